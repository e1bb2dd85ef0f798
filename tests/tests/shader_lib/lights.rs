//! Lights with a size: solid angle and direction against double precision, windows, alias tables.
//! The naive form: 1 - cos taken from a rounded cosine, which vanishes for far and small lights.

use caustica_renderer::gpu_types::AliasEntry;
use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::{Random, chi_square_deviate_against, is_near};

const INCLUDES: &[&str] = &["lib/random.glsl", "lib/light_sampling.glsl"];

/// A point light of intensity 1 at the origin, with radius `radius`.
const POINT_LIGHT: &str = "
    Light point_light(float radius) {
        Light light;
        light.position = vec3(0.0);
        light.kind = LIGHT_POINT;
        light.range_m = 0.0;
        light.intensity = vec3(1.0);
        light.direction = vec3(0.0, -1.0, 0.0);
        light.radius_m = radius;
        return light;
    }";

#[test]
fn sphere_lights_are_exact_from_far_and_near() {
    const COUNT: usize = 1024;
    let mut session = session();
    // Radius over distance from 1e-6 to 0.999, sizes from 1e-4 to 1e4.
    let body = "
        float ratio = pow(10.0, -6.0 + 6.0 * float(index % 32u) / 31.0) * 0.999;
        float scale = pow(10.0, -4.0 + 8.0 * float(index / 32u) / 31.0);
        Light light = point_light(ratio * scale);
        vec3 position = scale * normalize(vec3(0.3, -0.5, 0.81));
        vec3 sum = vec3(0.0);
        float off_surface = 0.0, missed = 0.0, unequal = 0.0, bad = 0.0, pdf = 0.0;
        const uint N = 1024u;
        for (uint k = 0u; k < N; ++k) {
            vec2 xi = sample_2d(sequence_begin(1u, uvec2(index, 0u), uint64_t(k) * 2ul), 0u);
            LightSample s = light_sample(light, position, xi);
            bad += is_finite(s.direction) && is_finite(s.irradiance) && is_finite(s.distance_m) ? 0.0 : 1.0;
            sum += s.direction * s.irradiance.x;
            off_surface = max(off_surface, abs(length(position + s.direction * s.distance_m) - light.radius_m) / scale);
            LightMet met;
            if (light_intersect(light, position, s.direction, FLOAT_MAX, met)) {
                unequal = max(unequal, abs(met.radiance.x / met.pdf / s.irradiance.x - 1.0));
                unequal = max(unequal, abs(met.distance_m / s.distance_m - 1.0));
            } else {
                missed += 1.0;
            }
            pdf = s.pdf;
        }
        float cosine = sqrt(1.0 - ratio * ratio);
        float naive_pdf = 1.0 / (TAU * (1.0 - cosine));
        write(0u, light.radius_m); write(1u, position); write(4u, length(sum) / float(N) * scale * scale);
        write(5u, bad); write(6u, missed / float(N)); write(7u, unequal); write(8u, off_surface); write(9u, pdf);
        write(10u, naive_pdf);";
    let values = run(
        &mut session,
        &Snippet {
            includes: INCLUDES,
            functions: POINT_LIGHT,
            body,
            values: 11,
            count: COUNT,
            ..Snippet::default()
        },
    );
    let mut naive_broken = 0;
    for row in values.chunks_exact(11) {
        let at = |i: usize| f64::from(row[i]);
        let distance = (at(1) * at(1) + at(2) * at(2) + at(3) * at(3)).sqrt();
        let sine2 = (at(0) / distance).powi(2);
        let solid_angle = std::f64::consts::TAU * sine2 / (1.0 + (1.0 - sine2).sqrt());
        let label = format!("radius / distance {:e}, distance {distance:e}", at(0) / distance);
        assert_eq!(row[5], 0.0, "{label}");
        // A uniform sphere lights a point as if all its light came from the centre.
        assert!((at(4) - 1.0).abs() < 2e-3, "{label}: vector irradiance {}", at(4));
        assert!((at(9) * solid_angle - 1.0).abs() < 1e-4, "{label}: pdf {}", at(9));
        // A unit vector in single precision is only so sharp: 1e-7 rad.
        let blurred = 0.005 + 1e-7 * distance / at(0);
        assert!(at(6) < blurred, "{label}: {} of the samples miss their light", at(6));
        assert!(at(7) < 1e-3, "{label}: {} between sampling and meeting", at(7));
        assert!(at(8) < 1e-5, "{label}: {} off the surface", at(8));
        naive_broken += usize::from(!is_near(at(10) * solid_angle, 1.0, 0.01));
    }
    assert!(naive_broken > COUNT / 3, "the naive density is expected to break: {naive_broken}");
}

#[test]
fn inside_a_light_its_radiance_comes_from_everywhere() {
    let mut session = session();
    let body = "
        Light light = point_light(2.0);
        vec3 position = vec3(1.999 * float(index) / 63.0, 0.0, 0.0);
        float sum = 0.0;
        for (uint k = 0u; k < 1024u; ++k) {
            vec2 xi = sample_2d(sequence_begin(1u, uvec2(index, 0u), uint64_t(k) * 2ul), 0u);
            LightSample s = light_sample(light, position, xi);
            sum += s.irradiance.x * max(s.direction.y, 0.0);
        }
        write(0u, sum / 1024.0);";
    let values = run(
        &mut session,
        &Snippet {
            includes: INCLUDES,
            functions: POINT_LIGHT,
            body,
            values: 1,
            count: 64,
            ..Snippet::default()
        },
    );
    // Radiance 1 / (pi r^2) over a half space: irradiance 1 / r^2.
    assert!(values.iter().all(|e| (e - 0.25).abs() < 2e-3), "{values:?}");
}

#[test]
fn windows_follow_their_formulas() {
    const COUNT: usize = 4096;
    let mut random = Random::new(4);
    let mut input: Vec<f32> = Vec::new();
    for i in 0..COUNT {
        let range = if i % 8 == 0 { 0.0 } else { random.magnitude(-2.0, 2.0) };
        let outer = random.between(-0.5, 1.0);
        let inner = if i % 5 == 0 { outer } else { random.between(outer, 1.0) };
        let numbers = [random.magnitude(-2.0, 2.0), range, inner, outer, random.between(-1.0, 1.0)];
        input.extend(numbers.map(|x| x as f32));
    }
    let body = "
        FloatTable t = FloatTable(inputs.at[0]);
        uint at = 5u * index;
        Light light = point_light(0.0);
        light.cos_inner = t.at[at + 2u];
        light.cos_outer = t.at[at + 3u];
        write(0u, light_range_window(t.at[at], t.at[at + 1u]));
        write(1u, light_spot_window(light, t.at[at + 4u]));";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: INCLUDES,
            functions: POINT_LIGHT,
            body,
            values: 2,
            count: COUNT,
            inputs: &[bytes(&input)],
            ..Snippet::default()
        },
    );
    for (row, case) in values.chunks_exact(2).zip(input.chunks_exact(5)) {
        let [distance, range, inner, outer, cosine] = [0, 1, 2, 3, 4].map(|i| f64::from(case[i]));
        let window = if range > 0.0 { (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0) } else { 1.0 };
        assert!((f64::from(row[0]) - window).abs() < 2e-6, "range {case:?}: {} {window}", row[0]);
        let ramp = inner - outer;
        let t = if ramp > 0.0 {
            ((cosine - outer) / ramp).clamp(0.0, 1.0)
        } else {
            f64::from(u8::from(cosine >= outer))
        };
        let bound = 2e-6 + 4e-7 / ramp.max(1e-6);
        assert!((f64::from(row[1]) - t * t).abs() < bound, "spot {case:?}: {} {}", row[1], t * t);
    }
}

#[test]
fn alias_tables_draw_in_proportion() {
    const DRAWS: usize = 1 << 20;
    // Vose 1991, by hand for weights 1, 2, 3, 10: columns of a quarter each.
    let weights = [1.0, 2.0, 3.0, 10.0];
    let entry = |threshold: f64, alias: u32, weight: f64| AliasEntry {
        threshold: threshold as f32,
        alias,
        pdf: (weight / 16.0) as f32,
    };
    let table = [entry(0.25, 3, 1.0), entry(0.5, 3, 2.0), entry(0.75, 3, 3.0), entry(1.0, 3, 10.0)];
    let body = "
        vec2 xi = sample_2d(sequence_begin(1u, uvec2(index >> 10u, 0u), uint64_t(index & 1023u) * 2ul), 0u);
        write(0u, float(alias_draw(inputs.at[0], 4u, xi)));
        write(1u, float(alias_draw(inputs.at[0], 4u, vec2(0.99999994))));";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: INCLUDES,
            body,
            values: 2,
            count: DRAWS,
            inputs: &[bytes(&table)],
            ..Snippet::default()
        },
    );
    let mut counts = [0_u64; 4];
    values.chunks_exact(2).for_each(|row| counts[row[0] as usize] += 1);
    let expected = weights.map(|w| w / 16.0 * DRAWS as f64);
    let deviate = chi_square_deviate_against(&counts, &expected);
    // Low-discrepancy draws are more even than chance.
    assert!(deviate < 4.0, "{counts:?}: {deviate}");
    assert!(
        values.chunks_exact(2).all(|row| row[1] == 3.0),
        "the last number below 1 stays inside the table"
    );
}
