//! The lobes beside metallic-roughness, each as a pure function against the formula of its glTF extension in double
//! precision. Bands where the device leaves the text: sheen below roughness 0.05 or cosine 0.001, films beyond 0..1.

use std::f64::consts::{PI, TAU};

use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::Random;
use glam::DVec3;

const COUNT: usize = 20_000;

/// A direction of the upper half as the device gets it.
fn upper(random: &mut Random, lowest: f64) -> [f32; 3] {
    let z = random.between(lowest, 1.0);
    let turn = random.between(0.0, TAU);
    let across = (1.0 - z * z).sqrt();
    [(across * turn.cos()) as f32, (across * turn.sin()) as f32, z as f32]
}

fn vector(v: &[f32]) -> DVec3 {
    DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
}

/// Runs a body that reads `SIZE` numbers of `t` from `at` on, and gives its values beside its inputs.
fn evaluate<const SIZE: usize, const VALUES: usize>(
    includes: &[&str],
    body: &str,
    inputs: &[[f32; SIZE]],
) -> Vec<[f32; VALUES]> {
    let mut session = session();
    let body = format!("FloatTable t = FloatTable(inputs.at[0]); uint at = {SIZE}u * index;\n{body}");
    let snippet = Snippet {
        includes,
        body: &body,
        values: VALUES,
        count: inputs.len(),
        inputs: &[bytes(inputs.as_flattened()), bytes(caustica_renderer::sheen_albedo_table())],
        ..Snippet::default()
    };
    run(&mut session, &snippet).as_chunks().0.to_vec()
}

fn assert_near(found: f32, expected: f64, relative: f64, label: &dyn std::fmt::Debug) {
    let found = f64::from(found);
    assert!((found - expected).abs() <= relative * expected.abs() + 1e-30, "{label:?}: {found} {expected}");
}

/// D and V of KHR_materials_anisotropy, and the density of visible normals (Heitz 2018), by their textbook forms.
#[test]
fn anisotropic_ggx_is_that_of_the_extension() {
    let mut random = Random::new(31);
    let inputs: Vec<[f32; 11]> = (0..COUNT)
        .map(|_| {
            let (v, l, h) = (upper(&mut random, 1e-3), upper(&mut random, 1e-3), upper(&mut random, 1e-3));
            let [roughness, strength] = [random.between(0.05, 1.0) as f32, random.unit() as f32];
            [v[0], v[1], v[2], l[0], l[1], l[2], h[0], h[1], h[2], roughness, strength]
        })
        .collect();
    let body = "
        vec3 v = vec3(t.at[at], t.at[at + 1u], t.at[at + 2u]), l = vec3(t.at[at + 3u], t.at[at + 4u], t.at[at + 5u]);
        vec3 h = vec3(t.at[at + 6u], t.at[at + 7u], t.at[at + 8u]);
        vec2 alpha = anisotropic_alpha(t.at[at + 9u] * t.at[at + 9u], t.at[at + 10u]);
        write(0u, anisotropic_distribution(h, alpha)); write(1u, anisotropic_visibility_cosine(v, l, alpha));
        write(2u, anisotropic_visibility_cosine(l, v, alpha)); write(3u, anisotropic_pdf_reflected(v, h, alpha));";
    let found = evaluate::<11, 4>(&["lib/anisotropic_ggx.glsl"], body, &inputs);
    for (input, [d, v_cosine, turned, pdf]) in inputs.iter().zip(found) {
        let (v, l, h) = (vector(input), vector(&input[3..]), vector(&input[6..]));
        let (roughness, strength) = (f64::from(input[9]), f64::from(input[10]));
        let (at, ab) = {
            let alpha = roughness * roughness;
            (alpha + (1.0 - alpha) * strength * strength, alpha)
        };
        let f = DVec3::new(ab * h.x, at * h.y, at * ab * h.z);
        let w2 = at * ab / f.dot(f);
        let distribution = at * ab * w2 * w2 / PI;
        let length = |w: DVec3| DVec3::new(at * w.x, ab * w.y, w.z).length();
        let visibility = 0.5 / (l.z * length(v) + v.z * length(l));
        assert_near(d, distribution, 1e-4, input);
        assert_near(v_cosine, visibility * l.z, 1e-4, input);
        assert_near(turned, visibility * v.z, 1e-4, input);
        let g1 = 2.0 * v.z / (v.z + length(v));
        assert_near(pdf, g1 * distribution / (4.0 * v.z), 1e-4, input);
    }
}

/// `D_Charlie` and its visibility, as in KHR_materials_sheen.
fn sheen(v: DVec3, l: DVec3, roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    let share = (1.0 - alpha).powi(2);
    let mix = |a: f64, b: f64| a * (1.0 - share) + b * share;
    let fit = |x: f64| {
        let (a, b, c) = (mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801));
        a / (1.0 + b * x.powf(c)) + mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967)
    };
    let lambda = |x: f64| if x < 0.5 { fit(x).exp() } else { (2.0 * fit(0.5) - fit(1.0 - x)).exp() };
    let h = (v + l).normalize();
    let d = (2.0 + 1.0 / alpha) * (h.x * h.x + h.y * h.y).powf(0.5 / alpha) / TAU;
    d / ((1.0 + lambda(v.z) + lambda(l.z)) * 4.0 * v.z * l.z)
}

#[test]
fn sheen_is_that_of_the_extension_and_reciprocal() {
    let mut random = Random::new(32);
    let inputs: Vec<[f32; 7]> = (0..COUNT)
        .map(|_| {
            let (v, l) = (upper(&mut random, 2e-3), upper(&mut random, 2e-3));
            [v[0], v[1], v[2], l[0], l[1], l[2], random.between(0.06, 1.0) as f32]
        })
        .collect();
    let body = "
        vec3 v = vec3(t.at[at], t.at[at + 1u], t.at[at + 2u]), l = vec3(t.at[at + 3u], t.at[at + 4u], t.at[at + 5u]);
        Sheen s = Sheen(vec3(1.0), t.at[at + 6u], inputs.at[1]);
        write(0u, sheen_lobe(s.roughness * s.roughness, v, l));
        write(1u, sheen_evaluate(s, v, l).x / l.z); write(2u, sheen_evaluate(s, l, v).x / v.z);
        write(3u, sheen_albedo(s, v.z, l.z));";
    let found = evaluate::<7, 4>(&["lib/sheen.glsl"], body, &inputs);
    let mut in_text = 0;
    for (input, [lobe, one_way, other_way, albedo]) in inputs.iter().zip(found) {
        let (v, l, roughness) = (vector(input), vector(&input[3..]), f64::from(input[6]));
        let expected = sheen(v, l, roughness);
        if expected < 1e-20 {
            continue; // the power has left the range of single precision
        }
        assert_near(lobe, expected * l.z, 1e-4, input);
        assert_near(one_way, f64::from(other_way), 1e-5, input);
        if albedo <= 1.0 {
            assert_near(one_way, expected, 1e-4, input);
            in_text += 1;
        }
    }
    assert!(in_text > COUNT / 2, "only {in_text} cases reflect less than arrives");
}

/// The table against the integral at points between its entries.
#[test]
fn the_table_of_sheen_is_near_the_integral() {
    let mut random = Random::new(33);
    let inputs: Vec<[f32; 2]> =
        (0..200).map(|_| [random.between(0.01, 1.0) as f32, random.between(0.05, 1.0) as f32]).collect();
    let body = "write(0u, sheen_albedo(Sheen(vec3(1.0), t.at[at + 1u], inputs.at[1]), t.at[at]));";
    let found = evaluate::<2, 1>(&["lib/sheen.glsl"], body, &inputs);
    let mut worst = 0.0_f64;
    for ([cosine, roughness], [table]) in inputs.iter().zip(found) {
        let (mu, roughness) = (f64::from(*cosine), f64::from(*roughness));
        let v = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        let mut sum = 0.0;
        const POLAR: u32 = 160;
        const TURNS: u32 = 160;
        for i in 0..POLAR {
            let u = (f64::from(i) + 0.5) / f64::from(POLAR);
            for k in 0..TURNS {
                let turn = PI * (f64::from(k) + 0.5) / f64::from(TURNS);
                let (z, across) = (u * u, (1.0 - u.powi(4)).sqrt());
                let l = DVec3::new(across * turn.cos(), across * turn.sin(), z);
                sum += sheen(v, l, roughness) * z * 2.0 * u;
            }
        }
        let expected = sum * TAU / f64::from(POLAR * TURNS);
        worst = worst.max((f64::from(table) - expected).abs() / expected.max(1.0));
    }
    println!("largest error of the sheen table: {worst:.2e}");
    assert!(worst < 0.03, "{worst}");
}

#[test]
fn clear_coats_are_those_of_the_extension() {
    let mut random = Random::new(34);
    let inputs: Vec<[f32; 11]> = (0..COUNT)
        .map(|_| {
            let (v, l, n) = (upper(&mut random, 0.01), upper(&mut random, 0.01), upper(&mut random, 0.8));
            let [roughness, factor] = [random.between(0.2, 1.0) as f32, random.unit() as f32];
            [v[0], v[1], v[2], l[0], l[1], l[2], n[0], n[1], n[2], roughness, factor]
        })
        .collect();
    let body = "
        vec3 v = vec3(t.at[at], t.at[at + 1u], t.at[at + 2u]), l = vec3(t.at[at + 3u], t.at[at + 4u], t.at[at + 5u]);
        vec3 n = vec3(t.at[at + 6u], t.at[at + 7u], t.at[at + 8u]);
        Clearcoat coat = Clearcoat(t.at[at + 10u], t.at[at + 9u] * t.at[at + 9u], n);
        write(0u, clearcoat_weight(coat, v)); write(1u, clearcoat_evaluate(coat, v, l));";
    let found = evaluate::<11, 2>(&["lib/clearcoat.glsl"], body, &inputs);
    let mut lit = 0;
    for (input, [weight, value]) in inputs.iter().zip(found) {
        let (v, l, n) = (vector(input), vector(&input[3..]), vector(&input[6..]));
        let (roughness, factor) = (f64::from(input[9]), f64::from(input[10]));
        let (v_n, l_n) = (v.dot(n), l.dot(n));
        assert_near(weight, factor * (0.04 + 0.96 * (1.0 - v_n.abs()).powi(5)), 1e-4, input);
        if v_n < 1e-3 || l_n < 1e-3 {
            continue;
        }
        // Appendix B.3.2 and B.3.3.
        let alpha2 = roughness.powi(4);
        let n_h = n.dot((v + l).normalize());
        let d = alpha2 / (PI * (n_h * n_h * (alpha2 - 1.0) + 1.0).powi(2));
        let smith = |c: f64| (alpha2 + (1.0 - alpha2) * c * c).sqrt();
        assert_near(value, l_n * d * 0.5 / (l_n * smith(v_n) + v_n * smith(l_n)), 1e-4, input);
        lit += 1;
    }
    assert!(lit > COUNT / 2);
}

/// The appendix of KHR_materials_iridescence, not cut above.
fn film(film_ior: f64, base_f0: [f64; 3], thickness_nm: f64, cos1: f64) -> [f64; 3] {
    let sin2 = (1.0 / film_ior).powi(2) * (1.0 - cos1 * cos1);
    let cos2 = (1.0 - sin2).sqrt();
    let schlick = |f0: f64, c: f64| f0 + (1.0 - f0) * (1.0 - c).powi(5);
    let to_f0 = |t: f64, i: f64| ((t - i) / (t + i)).powi(2);
    let r12 = schlick(to_f0(film_ior, 1.0), cos1);
    let t121 = 1.0 - r12;
    let path = 2.0 * film_ior * thickness_nm * cos2;
    let base_ior = base_f0.map(|f0| (1.0 + (f0 + 1e-4).sqrt()) / (1.0 - (f0 + 1e-4).sqrt()));
    let phase = |order: f64, channel: usize| {
        let phi23 = if base_ior[channel] < film_ior { PI } else { 0.0 };
        order * (PI + phi23)
    };
    let sensitivity = |order: f64| {
        let p = TAU * order * path * 1e-9;
        let lobe = |value: f64, position: f64, variance: f64, shift: f64| {
            value * (TAU * variance).sqrt() * (position * p + shift).cos() * (-p * p * variance).exp()
        };
        let x = lobe(5.4856e-13, 1.6810e6, 4.3278e9, phase(order, 0))
            + lobe(9.7470e-14, 2.2399e6, 4.5282e9, phase(order, 0));
        let y = lobe(4.4201e-13, 1.7953e6, 9.3046e9, phase(order, 1));
        let z = lobe(5.2481e-13, 2.2084e6, 6.6121e9, phase(order, 2));
        let [x, y, z] = [x, y, z].map(|v| v / 1.0685e-7);
        [
            3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
            -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
            0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
        ]
    };
    std::array::from_fn(|channel| {
        let r23 = schlick(to_f0(base_ior[channel], film_ior), cos2);
        let r123 = (r12 * r23).clamp(1e-5, 0.9999);
        let rs = t121 * t121 * r23 / (1.0 - r123);
        let mut sum = r12 + rs;
        let mut amplitude = rs - t121;
        for order in [1.0, 2.0] {
            amplitude *= r123.sqrt();
            sum += amplitude * 2.0 * sensitivity(order)[channel];
        }
        sum.max(0.0)
    })
}

#[test]
fn films_are_those_of_the_extension() {
    let mut random = Random::new(35);
    let inputs: Vec<[f32; 6]> = (0..COUNT)
        .map(|_| {
            let f0 = [random.between(0.0, 0.95), random.between(0.0, 0.95), random.between(0.0, 0.95)];
            let [ior, nm, cosine] = [random.between(1.05, 2.5), random.between(0.0, 1200.0), random.unit()];
            [f0[0] as f32, f0[1] as f32, f0[2] as f32, ior as f32, nm as f32, cosine as f32]
        })
        .collect();
    let body = "
        vec3 f0 = vec3(t.at[at], t.at[at + 1u], t.at[at + 2u]);
        write(0u, fresnel_thin_film(1.0, t.at[at + 3u], f0, t.at[at + 4u], t.at[at + 5u]));";
    let found = evaluate::<6, 3>(&["lib/thin_film.glsl"], body, &inputs);
    let mut cut = 0;
    for (input, found) in inputs.iter().zip(found) {
        let [r, g, b, ior, nm, cosine] = input.map(f64::from);
        let expected = film(ior, [r, g, b], nm, cosine);
        for (found, expected) in found.into_iter().zip(expected) {
            cut += usize::from(expected > 1.0);
            // The cosine of some 60 radians has six digits; the sum of the orders may be small beside its terms.
            let error = (f64::from(found) - expected.min(1.0)).abs();
            assert!(error <= 1e-4 * (expected + 0.1), "{input:?}: {found} {expected}");
        }
    }
    assert!(cut < 3 * COUNT / 10, "{cut} channels are beyond 1");
    println!("{cut} of {} channels are beyond 1 and cut", 3 * COUNT);
}

#[test]
fn dispersion_spreads_the_index_about_green() {
    let inputs: Vec<[f32; 2]> =
        (0..1000_u16).map(|i| [1.0 + f32::from(i % 40) * 0.05, f32::from(i / 40) * 0.1]).collect();
    let body = "
        for (uint channel = 0u; channel < 4u; ++channel) { write(channel, dispersion_ior(t.at[at], t.at[at + 1u], channel)); }
        vec3 mean = (dispersion_weight(0u) + dispersion_weight(1u) + dispersion_weight(2u)) / 3.0;
        write(4u, mean); write(7u, float(dispersion_channel(0.99999)));";
    let found = evaluate::<2, 8>(&["lib/dispersion.glsl"], body, &inputs);
    for (input, found) in inputs.iter().zip(found) {
        let [ior, dispersion] = input.map(f64::from);
        let half = (ior - 1.0) * 0.025 * dispersion;
        assert_near(found[0], (ior - half).max(1.0), 1e-6, input);
        assert_near(found[2], ior + half, 1e-6, input);
        assert_eq!((found[1], found[3]), (input[0], input[0]), "green, and paths of all colours");
        assert_eq!(found[4..], [1.0, 1.0, 1.0, 2.0]);
        // Abbe number: V = (n - 1) / (nF - nC) = 20 / dispersion.
        if dispersion > 0.05 && ior > 1.01 && dispersion < 2.0 {
            let v = (ior - 1.0) / (f64::from(found[2]) - f64::from(found[0]));
            assert!((v * dispersion / 20.0 - 1.0).abs() < 1e-2, "{input:?}: {v}");
        }
    }
}
