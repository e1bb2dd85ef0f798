//! Filters: how attributes were rewritten before they were compressed, undone in place.
//! In: elements. Out: the same number of bytes. Format: `KHR_meshopt_compression`, appendix B.

type Filter = fn(&mut [u8]);

/// The filter of a name for elements of `stride` bytes.
pub(super) fn named(name: &str, stride: usize) -> Result<Filter, String> {
    let filter: (Filter, bool) = match (name, stride) {
        ("NONE", _) => (|_| {}, true),
        ("OCTAHEDRAL", 4) => (|elements| each(elements, octahedral8), true),
        ("OCTAHEDRAL", _) => (|elements| each(elements, octahedral16), stride == 8),
        ("QUATERNION", _) => (|elements| each(elements, quaternion), stride == 8),
        ("EXPONENTIAL", _) => (|elements| each(elements, exponential), stride.is_multiple_of(4)),
        ("COLOR", 4) => (|elements| each(elements, color8), true),
        ("COLOR", _) => (|elements| each(elements, color16), stride == 8),
        _ => return Err(format!("filter {name:?} does not exist")),
    };
    match filter {
        (filter, true) => Ok(filter),
        _ => Err(format!("filter {name} does not work on elements of {stride} bytes")),
    }
}

fn each<const N: usize>(elements: &mut [u8], change: fn([u8; N]) -> [u8; N]) {
    for element in elements.as_chunks_mut::<N>().0 {
        *element = change(*element);
    }
}

fn words([a, b, c, d, e, f, g, h]: [u8; 8]) -> [i16; 4] {
    [[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes)
}

fn bytes(words: [i16; 4]) -> [u8; 8] {
    let [[a, b], [c, d], [e, f], [g, h]] = words.map(i16::to_le_bytes);
    [a, b, c, d, e, f, g, h]
}

/// Halves away from zero, as the extension says.
fn rounded(value: f32) -> i32 {
    (value + 0.5_f32.copysign(value)) as i32
}

/// A direction from two coordinates on an octahedron; the third number is what 1 is.
fn direction([x, y, one]: [i32; 3], max: f32) -> [i32; 3] {
    let [mut x, mut y, one] = [x, y, one].map(|v| v as f32);
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    x += if x >= 0.0 { fold } else { -fold };
    y += if y >= 0.0 { fold } else { -fold };
    let scale = max / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| rounded(v * scale))
}

fn octahedral8([x, y, one, w]: [u8; 4]) -> [u8; 4] {
    let [x, y, z] = direction([x, y, one].map(|v| i32::from(v as i8)), 127.0);
    [x as u8, y as u8, z as u8, w]
}

fn octahedral16(element: [u8; 8]) -> [u8; 8] {
    let [x, y, one, w] = words(element);
    let [x, y, z] = direction([x, y, one].map(i32::from), 32767.0);
    bytes([x as i16, y as i16, z as i16, w])
}

/// The three smallest of four numbers; the lowest two bits of the last word say which one is left out.
fn quaternion(element: [u8; 8]) -> [u8; 8] {
    let [x, y, z, last] = words(element);
    let unit = f32::from(last | 3);
    let [x, y, z] = [x, y, z].map(|v| f32::from(v) / unit * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut out = [0; 4];
    for (place, value) in (0..).zip([w, x, y, z]) {
        out[(usize::from(last as u16 & 3) + place) & 3] = rounded(value * 32767.0) as i16;
    }
    bytes(out)
}

/// A signed exponent above 24 bits of a signed mantissa.
fn exponential(element: [u8; 4]) -> [u8; 4] {
    let value = i32::from_le_bytes(element);
    let (exponent, mantissa) = (value >> 24, value << 8 >> 8);
    ((f64::from(mantissa) * f64::from(exponent).exp2()) as f32).to_le_bytes()
}

/// Luma, two signed chromas and alpha, all with as many bits as alpha has.
fn color([y, co, cg, a]: [i32; 4], max: i32) -> [i32; 4] {
    // The highest bit of alpha says how many bits there are; it is no part of alpha.
    let unit = (1 << (i32::BITS - a.leading_zeros())) - 1;
    let alpha = a << 1 & unit | a & 1;
    let scale = max as f32 / unit as f32;
    [y + co - cg, y + cg, y - co - cg, alpha].map(|v| (v as f32 * scale + 0.5) as i32)
}

fn color8([y, co, cg, a]: [u8; 4]) -> [u8; 4] {
    let signed = |v| i32::from(v as i8);
    color([y.into(), signed(co), signed(cg), a.into()], 255).map(|v| v as u8)
}

fn color16(element: [u8; 8]) -> [u8; 8] {
    let [y, co, cg, a] = words(element);
    let plain = |v| i32::from(v as u16);
    bytes(color([plain(y), co.into(), cg.into(), plain(a)], 65535).map(|v| v as i16))
}
