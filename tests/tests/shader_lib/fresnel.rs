//! Row 10: Fresnel, Snell and total internal reflection against double precision. The naive forms: a normal that is not
//! turned to the side of the ray, and Schlick's approximation inside of glass.

use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::Random;
use glam::DVec3;

/// Reflectance and cosine behind the interface; `None`: total reflection.
fn exact(cos_i: f64, eta: f64) -> Option<(f64, f64)> {
    let sin2_t = eta * eta * (1.0 - cos_i * cos_i);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let perpendicular = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    Some((0.5 * (parallel * parallel + perpendicular * perpendicular), cos_t))
}

#[test]
fn fresnel_and_snell_are_exact() {
    const COUNT: usize = 50_000;
    let mut random = Random::new(2);
    let mut input = Vec::new();
    for i in 0..COUNT {
        let eta = (random.between(0.3, 3.0)) as f32;
        let cosine = if i % 4 == 0 { random.magnitude(-6.0, 0.0) } else { random.unit() };
        let normal = random.direction();
        let flat = random.direction().cross(normal).normalize();
        let travel = flat * (1.0 - cosine * cosine).sqrt() - normal * cosine;
        input.push(eta);
        input.extend(normal.as_vec3().to_array());
        input.extend(travel.as_vec3().to_array());
    }
    let body = "
        FloatTable t = FloatTable(inputs.at[0]);
        uint at = 7u * index;
        float eta = t.at[at];
        vec3 normal = vec3(t.at[at + 1u], t.at[at + 2u], t.at[at + 3u]);
        vec3 travel = vec3(t.at[at + 4u], t.at[at + 5u], t.at[at + 6u]);
        float cos_i = -dot(travel, normal);
        float cos_t;
        write(0u, fresnel_dielectric(cos_i, eta, cos_t));
        write(1u, cos_t);
        write(2u, cos_t > 0.0 ? refract_travel(travel, normal, eta, cos_i, cos_t) : vec3(0.0));
        write(5u, reflect_travel(travel, normal, normal));
        write(8u, fresnel_schlick(vec3(f0_from_ior(eta)), vec3(1.0), cos_i).x);
        // Naive: the outside normal kept for a ray that comes from inside.
        write(9u, refract(travel, -normal, eta));
        write(12u, cos_i);";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/fresnel.glsl", "lib/refraction.glsl"],
            body,
            values: 13,
            count: COUNT,
            inputs: &[bytes(&input)],
            ..Snippet::default()
        },
    );
    let vector = |v: &[f32]| DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]));
    let (mut total, mut naive_misses, mut naive_leaks) = (0, 0, 0);
    for (row, case) in values.chunks_exact(13).zip(input.chunks_exact(7)) {
        let (eta, normal, travel) = (f64::from(case[0]), vector(&case[1..]), vector(&case[4..]));
        let cos_i = f64::from(row[12]);
        assert!(row[..8].iter().all(|x| x.is_finite()), "{row:?}");
        let mirrored = travel - 2.0 * travel.dot(normal) * normal;
        assert!(vector(&row[5..]).distance(mirrored.normalize()) < 1e-6);
        let Some((reflectance, cos_t)) = exact(cos_i, eta) else {
            total += 1;
            assert_eq!((row[0], row[1]), (1.0, 0.0), "total reflection at cos {cos_i}, eta {eta}");
            naive_leaks += usize::from(row[8] < 0.999);
            continue;
        };
        // Near the critical angle the root stretches the rounding of its argument.
        let bound = 4e-7 * (1.0 + eta * eta) / cos_t.max(1e-4).powi(2) + 2e-6;
        assert!(
            (f64::from(row[0]) - reflectance).abs() < bound,
            "cos {cos_i}, eta {eta}: {} {reflectance}",
            row[0]
        );
        if row[1] > 0.0 {
            let direction = vector(&row[2..]);
            let sideways = |v: DVec3| v - v.dot(normal) * normal;
            let snell = sideways(direction).distance(eta * sideways(travel));
            assert!(snell < 2e-6 + 4e-7 / cos_t.max(1e-3), "Snell is off by {snell} at cos_t {cos_t}");
            assert!(direction.dot(normal) < 0.0, "the ray stays on its side");
            naive_misses += usize::from(vector(&row[9..]).distance(direction) > 0.1);
        }
    }
    assert!(total > COUNT / 20, "{total} total reflections");
    assert!(naive_leaks > total / 2, "Schlick is expected to leak light: {naive_leaks} of {total}");
    assert!(naive_misses > COUNT / 4, "the unturned normal is expected to miss: {naive_misses}");
}

#[test]
fn a_thin_sheet_adds_up_its_inner_reflections() {
    const COUNT: usize = 1000;
    let mut session = session();
    let body = "write(0u, fresnel_thin_sheet((float(index) + 0.5) / 1000.0, 1.5));";
    let values = run(
        &mut session,
        &Snippet { includes: &["lib/fresnel.glsl"], body, values: 1, count: COUNT, ..Snippet::default() },
    );
    for (i, value) in values.iter().enumerate() {
        let (r, _) = exact((i as f64 + 0.5) / COUNT as f64, 1.0 / 1.5).unwrap_or((1.0, 0.0));
        // r + t r t + t r r r t + ... with t = 1 - r.
        let mut series = r;
        let mut term = (1.0 - r) * (1.0 - r) * r;
        for _ in 0..20_000 {
            series += term;
            term *= r * r;
        }
        assert!((f64::from(*value) - series).abs() < 1e-5, "{i}: {value} {series}");
    }
}
