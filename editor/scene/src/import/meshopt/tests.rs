#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use meshopt::{EncodeExpMode, FilterComponent};

use super::decode;

/// Numbers without a pattern, the same each time.
fn noise(seed: u32) -> impl Iterator<Item = u32> {
    let mut state = seed.wrapping_mul(2_654_435_769).max(1);
    std::iter::repeat_with(move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state
    })
}

/// Bytes that call for every number of bits: constant, slow, fast and wild ones, by their place in the element.
fn elements<const N: usize>(count: usize) -> Vec<[u8; N]> {
    let mut noise = noise(count as u32 + 1);
    let mut next = || noise.next().unwrap_or_default();
    (0..count)
        .map(|i| {
            std::array::from_fn(|k| match (k / 4 + k + i / 300) % 6 {
                0 => 7,
                1 => i as u8,
                2 => (i / 7 * 3) as u8,
                3 => (next() % 3) as u8,
                4 => (next() % 29) as u8,
                _ => next() as u8,
            })
        })
        .collect()
}

fn attributes_come_back<const N: usize>() {
    for count in [1, 15, 16, 17, 255, 256, 257, 1000] {
        let elements = elements::<N>(count);
        for (version, level) in [(0, 0), (1, 0), (1, 1), (1, 2), (1, 3)] {
            let stream = meshopt::encode_vertex_buffer_level(&elements, level, Some(version)).unwrap();
            let read = decode("ATTRIBUTES", "NONE", count, N, &stream).unwrap();
            assert_eq!(
                read,
                elements.as_flattened(),
                "{count} of {N} bytes, version {version}, level {level}"
            );
        }
    }
}

#[test]
fn attributes_of_an_independent_encoder_come_back() {
    attributes_come_back::<4>();
    attributes_come_back::<8>();
    attributes_come_back::<12>();
    attributes_come_back::<20>();
    attributes_come_back::<64>();
    attributes_come_back::<256>();
}

/// All kinds of channels: floats that grow evenly are encoded by exclusive or or by words.
#[test]
fn floats_and_words_come_back() {
    let floats: Vec<[f32; 4]> = (0..700)
        .map(|i| [i as f32, (i as f32).sin(), 1.0 / (i as f32 + 1.0), f32::from_bits(i << 7)])
        .collect();
    let words: Vec<[i16; 4]> = (0..700).map(|i| [i * 41, -i * 3, i % 5 * 1000, 300 - i]).collect();
    let mut kinds = std::collections::BTreeSet::new();
    let streams = [3, 2].map(|level| {
        let of_floats = meshopt::encode_vertex_buffer_level(&floats, level, Some(1)).unwrap();
        let of_words = meshopt::encode_vertex_buffer_level(&words, level, Some(1)).unwrap();
        kinds.extend(of_floats[of_floats.len() - 4..].iter().map(|kind| kind & 3));
        kinds.extend(of_words[of_words.len() - 2..].iter().map(|kind| kind & 3));
        (of_floats, of_words)
    });
    for (of_floats, of_words) in streams {
        let read = decode("ATTRIBUTES", "NONE", 700, 16, &of_floats).unwrap();
        assert_eq!(read, floats.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
        let read = decode("ATTRIBUTES", "NONE", 700, 8, &of_words).unwrap();
        assert_eq!(read, words.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
    }
    assert!(kinds.contains(&1) && kinds.contains(&2), "{kinds:?}");
}

/// A grid, and triangles of vertices without any order.
fn triangles() -> Vec<u32> {
    let grid = (0..20).flat_map(|y| (0..20).map(move |x| y * 21 + x));
    let mut indices: Vec<u32> = grid.flat_map(|i| [i, i + 1, i + 21, i + 21, i + 1, i + 22]).collect();
    indices.extend(noise(3).take(300).map(|v| v % 441));
    indices.extend(noise(4).take(30).map(|v| v >> 3));
    indices.extend([0, 1, 2, 2, 1, 3, 4, 5, 6]);
    indices
}

/// The corners of each triangle, beginning with the smallest: the encoder may turn triangles.
fn turned(indices: &[u32]) -> Vec<[u32; 3]> {
    let turn =
        |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default();
    indices.as_chunks::<3>().0.iter().map(turn).collect()
}

fn read_indices(mode: &str, count: usize, stream: &[u8]) -> Vec<u32> {
    let bytes = decode(mode, "NONE", count, 4, stream).unwrap();
    bytes.as_chunks::<4>().0.iter().map(|&index| u32::from_le_bytes(index)).collect()
}

#[test]
fn indices_of_an_independent_encoder_come_back() {
    let indices = triangles();
    let stream = meshopt::encode_index_buffer(&indices, 1 << 31).unwrap();
    let read = read_indices("TRIANGLES", indices.len(), &stream);
    assert_eq!(turned(&read), turned(&indices));
    assert_eq!(read, meshopt::decode_index_buffer::<u32>(&stream, indices.len()).unwrap());

    let stream = meshopt::encode_index_sequence(&indices, 1 << 31).unwrap();
    assert_eq!(read_indices("INDICES", indices.len(), &stream), indices);

    let short = meshopt::encode_index_sequence(&[1, 2, 65_535], 65_536).unwrap();
    assert_eq!(decode("INDICES", "NONE", 3, 2, &short).unwrap(), [1, 0, 2, 0, 255, 255]);
    let wide = meshopt::encode_index_sequence(&[1, 2, 65_536], 65_537).unwrap();
    assert!(decode("INDICES", "NONE", 3, 2, &wide).unwrap_err().contains("65536 does not fit"));
}

/// Stores elements, reads them with a filter, and compares with the encoder's own numbers.
fn filtered<T: Copy, const N: usize>(filter: &str, elements: &[[T; N]]) -> Vec<u8> {
    let stream = meshopt::encode_vertex_buffer_level(elements, 2, Some(0)).unwrap();
    decode("ATTRIBUTES", filter, elements.len(), size_of::<[T; N]>(), &stream).unwrap()
}

fn vectors() -> Vec<[f32; 4]> {
    let mut noise = noise(9).map(|v| v as f32 / u32::MAX as f32 * 2.0 - 1.0);
    let mut next = || noise.next().unwrap_or_default();
    let random = |_| {
        let v = [next(), next(), next(), next()];
        let length = v.iter().map(|v| v * v).sum::<f32>().sqrt();
        v.map(|v| v / length)
    };
    let mut vectors: Vec<[f32; 4]> = (0..400).map(random).collect();
    vectors.extend([[1., 0., 0., 0.], [0., -1., 0., 0.], [0., 0., -1., 0.], [0., 0., 0., -1.], [0.5; 4]]);
    vectors
}

/// Whether whole numbers differ by rounding at most.
fn assert_near(read: &[i32], expected: &[i32], what: &str) {
    assert_eq!(read.len(), expected.len());
    for (read, expected) in read.iter().zip(expected) {
        assert!((read - expected).abs() <= 1, "{what}: {read} and {expected}");
    }
}

fn int8(bytes: &[u8]) -> Vec<i32> {
    bytes.iter().map(|&v| i32::from(v as i8)).collect()
}

fn int16(bytes: &[u8]) -> Vec<i32> {
    bytes.as_chunks::<2>().0.iter().map(|&v| i32::from(i16::from_le_bytes(v))).collect()
}

#[test]
fn directions_and_rotations_are_unfolded() {
    let directions: Vec<[f32; 4]> = vectors()
        .into_iter()
        .map(|[x, y, z, w]| {
            let length = (x * x + y * y + z * z).sqrt().max(1e-9);
            [x / length, y / length, z / length, w]
        })
        .collect();
    let mut bytes: Vec<[i8; 4]> = meshopt::encode_filter_oct(&directions, 8);
    let read = int8(&filtered("OCTAHEDRAL", &bytes));
    meshopt::decode_filter_oct(&mut bytes);
    assert_near(&read, &bytes.as_flattened().iter().map(|&v| v.into()).collect::<Vec<_>>(), "8 bits");

    let mut words: Vec<[i16; 4]> = meshopt::encode_filter_oct(&directions, 12);
    let read = int16(&filtered("OCTAHEDRAL", &words));
    meshopt::decode_filter_oct(&mut words);
    assert_near(&read, &words.as_flattened().iter().map(|&v| v.into()).collect::<Vec<_>>(), "16 bits");

    let mut words = meshopt::encode_filter_quat(&vectors(), 12);
    let read = int16(&filtered("QUATERNION", &words));
    meshopt::decode_filter_quat(&mut words);
    assert_near(&read, &words.as_flattened().iter().map(|&v| v.into()).collect::<Vec<_>>(), "rotations");
}

fn colors_come_back<C: FilterComponent + std::fmt::Debug>(bits: i32, read: fn(&[u8]) -> Vec<i32>, max: f32) {
    let colors: Vec<[f32; 4]> = vectors().into_iter().map(|v| v.map(f32::abs)).collect();
    let decoded = read(&filtered("COLOR", &meshopt::encode_filter_color::<C>(&colors, bits)));
    let step = max / ((1 << (bits - 1)) - 1) as f32;
    for (read, color) in decoded.iter().zip(colors.as_flattened()) {
        let read = if *read < 0 { *read as f32 + max + 1.0 } else { *read as f32 };
        assert!((read - color * max).abs() <= 2.5 * step, "{bits} bits: {read} and {}", color * max);
    }
}

#[test]
fn colors_and_exponents_are_undone() {
    colors_come_back::<u8>(8, int8, 255.0);
    colors_come_back::<u16>(12, int16, 65535.0);

    let floats: Vec<[f32; 3]> = vectors().iter().map(|&[x, y, z, w]| [x, y * 1e6, z * w * 1e-6]).collect();
    let mut bits = meshopt::encode_filter_exp(&floats, 15, EncodeExpMode::Separate);
    let read = filtered("EXPONENTIAL", &bits);
    meshopt::decode_filter_exp(&mut bits);
    assert_eq!(read, bits.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
}

#[test]
fn what_the_extension_does_not_know_is_refused() {
    let stream = meshopt::encode_vertex_buffer(&elements::<8>(40)).unwrap();
    for (mode, filter, count, stride, part) in [
        ("POINTS", "NONE", 40, 4, "does not exist"),
        ("ATTRIBUTES", "WAVELET", 40, 8, "does not exist"),
        ("ATTRIBUTES", "QUATERNION", 40, 4, "does not work"),
        ("ATTRIBUTES", "NONE", 40, 6, "byteStride is 6"),
        ("ATTRIBUTES", "NONE", 41, 8, "stream"),
        ("ATTRIBUTES", "NONE", 39, 8, "stream"),
        ("ATTRIBUTES", "NONE", usize::MAX, 8, "cut off"),
        ("TRIANGLES", "NONE", 39, 4, "begin with"),
        ("TRIANGLES", "OCTAHEDRAL", 39, 4, "no filter"),
        ("TRIANGLES", "NONE", 40, 4, "no triangles"),
        ("INDICES", "NONE", 40, 8, "byteStride is 8"),
    ] {
        let reason = decode(mode, filter, count, stride, &stream).unwrap_err();
        assert!(reason.contains(part), "{mode} {filter} {count} {stride}: {reason}");
    }
}

/// Cut anywhere and changed anywhere: an answer, never a panic.
#[test]
fn damaged_streams_end_in_words() {
    let indices = triangles();
    let streams = [
        (
            "ATTRIBUTES",
            200,
            12,
            meshopt::encode_vertex_buffer_level(&elements::<12>(200), 3, Some(0)).unwrap(),
        ),
        (
            "ATTRIBUTES",
            200,
            12,
            meshopt::encode_vertex_buffer_level(&elements::<12>(200), 3, Some(1)).unwrap(),
        ),
        ("TRIANGLES", indices.len(), 4, meshopt::encode_index_buffer(&indices, 1 << 31).unwrap()),
        ("INDICES", indices.len(), 4, meshopt::encode_index_sequence(&indices, 1 << 31).unwrap()),
    ];
    let mut refused = 0;
    for (mode, count, stride, stream) in streams {
        for length in 0..stream.len() {
            assert!(
                decode(mode, "NONE", count, stride, &stream[..length]).is_err(),
                "{mode} cut at {length}"
            );
        }
        let mut noise = noise(77);
        for _ in 0..3000 {
            let mut damaged = stream.clone();
            for _ in 0..=noise.next().unwrap() % 4 {
                let at = noise.next().unwrap() as usize % damaged.len();
                damaged[at] = noise.next().unwrap() as u8;
            }
            match decode(mode, "NONE", count, stride, &damaged) {
                Ok(bytes) => assert_eq!(bytes.len(), count * stride),
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > 1000, "{refused}");
}
