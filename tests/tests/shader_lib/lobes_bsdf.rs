//! The scattering function of whole materials with lobes: directions drawn as the density says, no energy made, nothing that
//! is not finite, and lobes of strength 0 that change no bit.

use std::f64::consts::PI;

use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::chi_square_deviate_against;

use super::scatter::SURFACE;

/// A white metal or a plain dielectric, in the plane z = 0, seen under cosine `mu` from (1, 1).
const FUNCTIONS: &str = "
    Surface plain_surface(float mu, float roughness, float metallic) {
        Surface s = white_surface(mu, roughness, MODE_PBR, true, 0u);
        s.view = vec3(vec2(sqrt(0.5 * (1.0 - mu * mu))), mu);
        s.metallic = metallic;
        s.transmission = 0.0;
        return s;
    }
    // What each case has: see CASES.
    Surface case_surface(uint kind, float mu, float roughness) {
        Surface s = plain_surface(mu, roughness, kind == 4u || kind == 5u ? 0.0 : 1.0);
        Lobes lobes = LOBES_NONE;
        lobes.tangent = vec3(1.0, 0.0, 0.0);
        lobes.clearcoat_normal = vec3(0.0, 0.0, 1.0);
        lobes.sheen_albedo = inputs.at[0];
        if (kind == 0u || kind == 6u) {
            lobes.flags |= LOBE_ANISOTROPY;
            lobes.anisotropy = 0.7;
        }
        if (kind == 1u || kind == 6u) {
            lobes.flags |= LOBE_CLEARCOAT;
            lobes.clearcoat = 1.0;
            lobes.clearcoat_roughness = 0.4;
            lobes.clearcoat_normal = normalize(vec3(0.1, -0.05, 1.0));
        }
        if (kind == 2u || kind == 6u) {
            lobes.flags |= LOBE_IRIDESCENCE;
            lobes.iridescence = 1.0;
            lobes.film_ior = 1.6;
            lobes.film_nm = 350.0;
        }
        if (kind == 3u || kind == 6u) {
            lobes.flags |= LOBE_SHEEN;
            lobes.sheen_color = vec3(1.0, 0.5, 0.2);
            lobes.sheen_roughness = 0.4;
        }
        if (kind == 4u || kind == 5u) {
            lobes.flags |= LOBE_DIFFUSE_TRANSMISSION;
            lobes.diffuse_transmission = 0.6;
            lobes.diffuse_transmission_color = vec3(1.0);
            s.specular = kind == 4u ? 0.0 : 1.0;
            s.transmission = kind == 4u ? 0.0 : 0.5;
        }
        s.lobes = lobes;
        return s;
    }
    const Sides SHEET = Sides(1.0, true, false);";

/// Names of the kinds above.
const CASES: [&str; 7] = [
    "anisotropy",
    "clear coat with a normal of its own",
    "film",
    "sheen",
    "diffuse transmission without specular",
    "diffuse beside rough transmission",
    "everything that a metal can have",
];
const SAMPLES: usize = 1 << 14;
const COSINES: [f32; 2] = [0.25, 0.9];
/// Rows by z from -1 to 1, columns by turn.
const CELLS: [usize; 2] = [16, 16];

fn run_cases(body: &str, values: usize, count: usize) -> Vec<f32> {
    let mut session = session();
    let body = format!(
        "float mu = (index / 16384u) % 2u == 0u ? 0.25 : 0.9; uint kind = index / 32768u;
        Surface s = case_surface(kind, mu, 0.5);
        mat3 frame = surface_frame(s);
        vec3 v = s.view * frame;
        Bsdf bsdf = bsdf_begin(s, SHEET, frame, v);
        uint k = index % 16384u;
        {body}"
    );
    let snippet = Snippet {
        includes: &["lib/bsdf.glsl", "lib/random.glsl"],
        functions: &format!("{SURFACE}{FUNCTIONS}"),
        body: &body,
        values,
        count,
        inputs: &[bytes(caustica_renderer::sheen_albedo_table())],
        ..Snippet::default()
    };
    run(&mut session, &snippet)
}

/// Invocations of one case and cosine.
const STRIDE: usize = SAMPLES;

#[test]
fn directions_are_drawn_as_the_density_says_and_no_energy_is_made() {
    let count = CASES.len() * COSINES.len() * STRIDE;
    let drawn = run_cases(
        "uvec4 drawn = hash_pcg4d(uvec4(index, 7u, 11u, 13u)); // independent, as the statistic wants them
            Scatter scatter = bsdf_sample(bsdf, s, frame, vec3(unit_float(drawn.x), unit_float(drawn.y), unit_float(drawn.z)));
            BsdfValue value = bsdf_evaluate_render(bsdf, s, frame, scatter.direction);
            write(0u, scatter.direction); write(3u, scatter.weight); write(6u, scatter.pdf); write(7u, scatter.valid ? 1.0 : 0.0);
            write(8u, value.pdf); write(9u, value.value);",
        12,
        count,
    );
    // Midpoints of 32 x 32 in each cell of equal solid angle.
    let densities = run_cases(
        "if (k >= 256u) { return; }
        float sum = 0.0, light = 0.0;
        for (uint i = 0u; i < 1024u; ++i) {
            float z = -1.0 + 2.0 * (float(k / 16u) + (float(i / 32u) + 0.5) / 32.0) / 16.0;
            float turn = TAU * (float(k % 16u) + (float(i % 32u) + 0.5) / 32.0) / 16.0;
            float across = sqrt(1.0 - z * z);
            BsdfValue value = bsdf_evaluate(bsdf, v, vec3(across * cos(turn), across * sin(turn), z));
            sum += value.pdf;
            light += max_component(value.value);
        }
        write(0u, sum * (4.0 * PI / 256.0 / 1024.0)); write(1u, light * (4.0 * PI / 256.0 / 1024.0));",
        2,
        count,
    );
    for (case, name) in CASES.iter().enumerate() {
        for (angle, mu) in COSINES.iter().enumerate() {
            let first = (case * COSINES.len() + angle) * STRIDE;
            let label = format!("{name}, cosine {mu}");
            let cells = CELLS[0] * CELLS[1];
            let share = |i: usize| f64::from(densities[2 * (first + i)]);
            let light: f64 = (0..cells).map(|i| f64::from(densities[2 * (first + i) + 1])).sum();
            let mut counts = vec![0_u64; cells];
            let mut weight = [0.0_f64; 3];
            for row in drawn[12 * first..12 * (first + SAMPLES)].chunks_exact(12) {
                assert!(row.iter().all(|x| x.is_finite()), "{label}: {row:?}");
                if row[7] == 0.0 {
                    continue;
                }
                let pdf = f64::from(row[6]);
                assert!(
                    (f64::from(row[8]) / pdf - 1.0).abs() < 2e-3,
                    "{label}: density {pdf} and {}",
                    row[8]
                );
                for channel in 0..3 {
                    let value = f64::from(row[9 + channel]);
                    let expected = f64::from(row[3 + channel]) * pdf;
                    assert!(
                        (value - expected).abs() < 2e-3 * (expected + 1e-3),
                        "{label}: {value} {expected}"
                    );
                    weight[channel] += f64::from(row[3 + channel]) / SAMPLES as f64;
                }
                let turn = f64::from(row[1]).atan2(f64::from(row[0])).rem_euclid(2.0 * PI) / (2.0 * PI);
                let z = (f64::from(row[2]) + 1.0) / 2.0;
                let cell = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                counts[cell(z, CELLS[0]) * CELLS[1] + cell(turn, CELLS[1])] += 1;
            }
            let total: u64 = counts.iter().sum();
            let covered: f64 = (0..cells).map(share).sum();
            assert!(
                (total as f64 / SAMPLES as f64 - covered).abs() < 0.02,
                "{label}: {total} drawn, {covered}"
            );
            let expected: Vec<f64> = (0..cells).map(|i| share(i) / covered * total as f64).collect();
            let deviate = chi_square_deviate_against(&counts, &expected);
            assert!(deviate < 4.0, "{label}: chi-square {deviate}");
            let most = weight.iter().copied().fold(0.0, f64::max);
            println!("{label}: chi-square {deviate:.2}, furnace {most:.4} drawn, {light:.4} integrated");
            assert!(most < 1.0 + 1e-2, "{label}: {most} of the light is reflected");
            if case == 4 {
                assert!((most - 1.0).abs() < 1e-2, "{label}: nothing absorbs, and {most} comes back");
            }
        }
    }
}

/// A lobe that is there with strength 0 gives the bits of a material without it.
#[test]
fn lobes_of_no_strength_change_no_bit() {
    let mut session = session();
    let body = "
        float mu = 0.02 + 0.96 * float(index % 16u) / 15.0;
        float roughness = float((index / 16u) % 8u) / 7.0;
        Surface plain = plain_surface(mu, roughness, float(index / 128u % 2u));
        plain.transmission = 0.3;
        Surface with = plain;
        with.lobes = Lobes(63u, 0.0, vec3(1.0, 0.0, 0.0), 0.0, 0.3, vec3(0.0, 0.0, 1.0), 0.0, 1.3, 400.0, vec3(0.0), 0.5, inputs.at[0],
            0.0, vec3(1.0));
        mat3 frame = basis_around(plain.shading_normal);
        Bsdf one = bsdf_begin(plain, SHEET, frame, plain.view * frame), other = bsdf_begin(with, SHEET, frame, plain.view * frame);
        float different = 0.0;
        for (uint k = 0u; k < 64u; ++k) {
            Sequence q = sequence_begin(3u, uvec2(index, 0u), uint64_t(k) * 2ul);
            vec3 xi = vec3(sample_1d(q, 1u), sample_2d(q, 0u));
            Scatter a = bsdf_sample(one, plain, frame, xi), b = bsdf_sample(other, with, frame, xi);
            BsdfValue c = bsdf_evaluate_render(one, plain, frame, a.direction), d = bsdf_evaluate_render(other, with, frame, a.direction);
            different += a.direction == b.direction && a.weight == b.weight && a.pdf == b.pdf && c.value == d.value && c.pdf == d.pdf
                ? 0.0 : 1.0;
        }
        write(0u, different);";
    let snippet = Snippet {
        includes: &["lib/bsdf.glsl", "lib/random.glsl"],
        functions: &format!("{SURFACE}{FUNCTIONS}"),
        body,
        values: 1,
        count: 256,
        inputs: &[bytes(caustica_renderer::sheen_albedo_table())],
        ..Snippet::default()
    };
    let different: f32 = run(&mut session, &snippet).iter().sum();
    assert_eq!(different, 0.0, "samples differ");
}

/// All corners of the parameters: grazing, smooth, thick, dense, saturated.
#[test]
fn nothing_is_ever_not_finite() {
    let mut session = session();
    let body = "
        uint bits = index;
        float low_high[2] = float[2](0.0, 1.0);
        float grazing[4] = float[4](1e-7, 1e-3, 0.5, 1.0);
        Surface s = plain_surface(grazing[bits & 3u], low_high[(bits >> 2u) & 1u], low_high[(bits >> 3u) & 1u]);
        s.view = normalize(vec3(1.0, 0.0, s.view.z));
        s.transmission = 0.5 * low_high[(bits >> 4u) & 1u];
        s.front = ((bits >> 5u) & 1u) == 0u;
        s.lobes = Lobes(63u, low_high[(bits >> 6u) & 1u], vec3(0.0, 0.0, 1.0), low_high[(bits >> 7u) & 1u], low_high[(bits >> 8u) & 1u],
            normalize(vec3(low_high[(bits >> 9u) & 1u], 0.0, 1.0)), 1.0, 1.0 + low_high[(bits >> 10u) & 1u],
            1e5 * low_high[(bits >> 11u) & 1u], vec3(1.0, 0.5, 0.0), low_high[(bits >> 12u) & 1u], inputs.at[0], 0.5, vec3(1.0));
        Sides sides = ((bits >> 13u) & 1u) == 0u ? SHEET : Sides(s.front ? 1.0 / 1.5 : 1.5, false, false);
        mat3 frame = surface_frame(s);
        Bsdf bsdf = bsdf_begin(s, sides, frame, s.view * frame);
        float bad = 0.0;
        for (uint k = 0u; k < 16u; ++k) {
            Sequence q = sequence_begin(5u, uvec2(index, 0u), uint64_t(k) * 2ul);
            Scatter scatter = bsdf_sample(bsdf, s, frame, vec3(sample_1d(q, 1u), sample_2d(q, 0u)));
            BsdfValue value = bsdf_evaluate_render(bsdf, s, frame, scatter.direction);
            bool right = is_finite(scatter.weight) && is_finite(scatter.direction) && is_finite(scatter.pdf) && is_finite(value.value)
                && is_finite(value.pdf) && min(min(value.value.x, value.value.y), value.value.z) >= 0.0 && value.pdf >= 0.0;
            if (!right) {
                bad += 1.0;
                write(1u, scatter.direction); write(4u, scatter.weight); write(7u, value.value); write(10u, scatter.pdf);
                write(11u, value.pdf);
            }
        }
        write(0u, bad);";
    let snippet = Snippet {
        includes: &["lib/bsdf.glsl", "lib/random.glsl"],
        functions: &format!("{SURFACE}{FUNCTIONS}"),
        body,
        values: 12,
        count: 1 << 14,
        inputs: &[bytes(caustica_renderer::sheen_albedo_table())],
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let rows: Vec<&[f32]> = values.chunks_exact(12).collect();
    let bad: Vec<usize> = (0..rows.len()).filter(|i| rows[*i][0] != 0.0).collect();
    assert!(bad.is_empty(), "{} corners, the first: {:b}: {:?}", bad.len(), bad[0], rows[bad[0]]);
}
