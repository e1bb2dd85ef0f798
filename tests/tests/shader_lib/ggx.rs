//! Row 9: GGX from roughness 0 to 1 and to grazing angles, against an integration in double precision.
//! The naive form: normals drawn from the distribution, denominators held above 0.001.

use std::f64::consts::TAU;

use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::is_near;
use glam::DVec3;

const SIDE: usize = 16;

/// Perceptual roughness and cosine of the view of a cell of the grid.
fn cell(index: usize) -> (f64, f64) {
    let (r, m) = (index % SIDE, index / SIDE);
    (r as f64 / 15.0, if m == 0 { 0.001 } else { 0.05 + 0.95 * m as f64 / 15.0 })
}

/// Share of light that GGX with perfect Fresnel reflects, by visible normals in double precision
/// (Heitz 2014, 2018; the spherical-cap form of Dupuy and Benyoub 2023).
fn reference_albedo(roughness: f64, cosine: f64) -> f64 {
    let alpha = roughness * roughness;
    if alpha < 1e-7 {
        return 1.0;
    }
    let v = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let root = |c: f64| (alpha * alpha * (1.0 - c * c) + c * c).sqrt();
    let stretched = DVec3::new(alpha * v.x, alpha * v.y, v.z).normalize();
    let n = 16_384;
    let mut sum = 0.0;
    for i in 0..n {
        // Hammersley points.
        let (x, y) =
            ((f64::from(i) + 0.5) / f64::from(n), f64::from((i as u32).reverse_bits()) / 4_294_967_296.0);
        let z = (1.0 - y) * (1.0 + stretched.z) - stretched.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let h = DVec3::new(radius * (TAU * x).cos(), radius * (TAU * x).sin(), z) + stretched;
        let h = DVec3::new(alpha * h.x, alpha * h.y, h.z).normalize();
        let l = 2.0 * v.dot(h) * h - v;
        if l.z > 0.0 {
            sum += l.z * (v.z + root(v.z)) / (l.z * root(v.z) + v.z * root(l.z));
        }
    }
    sum / f64::from(n)
}

#[test]
fn ggx_reflects_what_it_should_at_every_roughness_and_angle() {
    let mut session = session();
    let functions = "
        vec3 ndf_half(float alpha, vec2 xi) {
            float c = sqrt((1.0 - xi.y) / (1.0 + (alpha * alpha - 1.0) * xi.y));
            float s = sqrt(1.0 - c * c);
            return vec3(s * cos(TAU * xi.x), s * sin(TAU * xi.x), c);
        }
        // One sample of the textbook form: D, G, clamped denominators, pdf of the distribution.
        float naive_weight(float alpha, vec3 v, vec2 xi) {
            vec3 h = ndf_half(alpha, xi);
            vec3 l = reflect(-v, h);
            float n_l = max(l.z, 0.0), n_h = max(h.z, 0.0), v_h = max(dot(v, h), 0.0);
            float a2 = alpha * alpha;
            float d = a2 / (PI * pow(n_h * n_h * (a2 - 1.0) + 1.0, 2.0));
            float k = alpha / 2.0;
            float g = n_l / (n_l * (1.0 - k) + k) * v.z / (v.z * (1.0 - k) + k);
            return d * g / max(4.0 * n_l * v.z, 0.001) * n_l / max(d * n_h / max(4.0 * v_h, 0.001), 0.001);
        }";
    let body = "
        float roughness = float(index % 16u) / 15.0;
        uint m = index / 16u;
        float mu = m == 0u ? 0.001 : 0.05 + 0.95 * float(m) / 15.0;
        Brdf brdf = brdf_from_material(vec3(1.0), 1.0, roughness, 1.5, 1.0, vec3(1.0));
        vec3 v = vec3(sqrt(1.0 - mu * mu), 0.0, mu);
        float sampled = 0.0, largest = 0.0, bad = 0.0, unequal = 0.0, naive = 0.0, density = 0.0, integrated = 0.0;
        const uint N = 4096u;
        for (uint k = 0u; k < N; ++k) {
            vec2 xi = sample_2d(sequence_begin(1u, uvec2(index, 0u), uint64_t(k) * 2ul), 0u);
            vec3 l, weight;
            if (brdf_sample_specular(brdf, v, xi, l, weight)) {
                sampled += weight.x;
                largest = max(largest, weight.x);
                bad += is_finite(weight) && is_finite(l) ? 0.0 : 1.0;
                float pdf = brdf_pdf_specular(brdf, v, l);
                if (pdf > 0.0) {
                    unequal = max(unequal, abs(brdf_evaluate(brdf, v, l).specular.x / pdf / weight.x - 1.0));
                }
            }
            vec3 even = cosine_sample(xi);
            if (even.z > 0.0) {
                density += brdf_pdf_specular(brdf, v, even) * PI / even.z;
                float value = brdf_evaluate(brdf, v, even).specular.x;
                integrated += value * PI / even.z;
                bad += is_finite(value) ? 0.0 : 1.0;
            }
            naive += naive_weight(brdf.alpha, v, xi);
        }
        write(0u, sampled / float(N)); write(1u, largest); write(2u, bad); write(3u, unequal);
        write(4u, naive / float(N)); write(5u, density / float(N)); write(6u, integrated / float(N));";
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/random.glsl", "lib/brdf.glsl"],
            functions,
            body,
            values: 7,
            count: SIDE * SIDE,
            ..Snippet::default()
        },
    );
    let mut naive_broken = 0;
    for (i, row) in values.chunks_exact(7).enumerate() {
        let (roughness, cosine) = cell(i);
        let expected = reference_albedo(roughness, cosine);
        let label = format!("roughness {roughness:.3}, cosine {cosine:.3}");
        assert_eq!(row[2], 0.0, "{label}: not finite");
        assert!((f64::from(row[0]) - expected).abs() < 2e-3, "{label}: {} instead of {expected}", row[0]);
        assert!(row[1] <= 1.0 + 1e-5, "{label}: a weight of {}", row[1]);
        assert!(row[3] < 5e-3, "{label}: value / pdf and weight differ by {}", row[3]);
        if roughness == 0.0 {
            assert!((row[0] - 1.0).abs() < 1e-6, "{label}: a mirror reflects {}", row[0]);
        }
        // Wide lobes can be integrated without aiming at them.
        if roughness > 0.55 && cosine > 0.1 {
            assert!(row[5] < 1.02, "{label}: the density integrates to {}", row[5]);
            assert!((f64::from(row[6]) - expected).abs() < 0.03, "{label}: integrated {} {expected}", row[6]);
        }
        naive_broken += usize::from(!is_near(f64::from(row[4]), expected, 0.1));
    }
    assert!(naive_broken > SIDE, "the naive form is expected to lose energy or its digits: {naive_broken}");
}

/// What the base under the coat reflects of evenly arriving light, base colour 1: the integral of
/// (1 - F(v.h)) cos / pi (glTF 2.0, appendix B.3.4). The model takes no notice of what the coat reflects elsewhere, so
/// near grazing angles coat and base together exceed 1: it is the model that is tested here, not conservation.
fn reference_base(cosine: f64) -> f64 {
    let v = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let n = 16_384;
    let mut sum = 0.0;
    for i in 0..n {
        let (x, y) =
            ((f64::from(i) + 0.5) / f64::from(n), f64::from((i as u32).reverse_bits()) / 4_294_967_296.0);
        let l = DVec3::new(y.sqrt() * (TAU * x).cos(), y.sqrt() * (TAU * x).sin(), (1.0 - y).sqrt());
        let v_dot_h = v.dot((v + l).normalize());
        sum += 1.0 - (0.04 + 0.96 * (1.0 - v_dot_h).powi(5));
    }
    sum / f64::from(n)
}

#[test]
fn the_base_gets_what_the_coat_lets_through() {
    let mut session = session();
    let body = "
        float mu = max(float(index) / 15.0, 0.01);
        Brdf brdf = brdf_from_material(vec3(1.0), 0.0, 0.3, 1.5, 1.0, vec3(1.0));
        vec3 v = vec3(sqrt(1.0 - mu * mu), 0.0, mu);
        float sum = 0.0;
        const uint N = 4096u;
        for (uint k = 0u; k < N; ++k) {
            vec3 even = cosine_sample(sample_2d(sequence_begin(2u, uvec2(index, 0u), uint64_t(k) * 2ul), 0u));
            sum += even.z > 0.0 ? brdf_evaluate(brdf, v, even).diffuse * PI / even.z : 0.0;
        }
        write(0u, sum / float(N));
        write(1u, mu);";
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/random.glsl", "lib/brdf.glsl"],
            body,
            values: 2,
            count: SIDE,
            ..Snippet::default()
        },
    );
    for row in values.chunks_exact(2) {
        let expected = reference_base(f64::from(row[1]));
        assert!((f64::from(row[0]) - expected).abs() < 1e-3, "cosine {}: {} {expected}", row[1], row[0]);
    }
}
