//! The path tracer's scattering function: what is drawn has the density that is said, what is evaluated is what is drawn,
//! and no corner gives a number that is not finite.

use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::session;

use super::scatter::SURFACE;

/// Cases: eight angles, eight roughnesses, inside or outside, sheet or volume, all light transmitted or half of it.
const CASES: &str = "
    Bsdf bsdf_of(uint index, out Surface s, out mat3 local) {
        float mu = 0.03 + 0.97 * float(index % 8u) / 7.0;
        float roughness = float((index / 8u) % 8u) / 7.0;
        bool front = (index / 64u) % 2u == 0u;
        bool sheet = (index / 128u) % 2u == 1u;
        s = white_surface(mu, roughness, MODE_PBR, front, sheet ? 0u : MATERIAL_HAS_VOLUME);
        s.transmission = (index / 256u) % 2u == 0u ? 1.0 : 0.5;
        Sides sides = sheet ? Sides(1.0, true, false) : Sides(front ? 1.0 / 1.5 : 1.5, false, false);
        local = basis_around(s.shading_normal);
        return bsdf_begin(s, sides, local, s.view * local);
    }";

/// `values` numbers of each of `count` invocations of `body`.
fn run_cases(functions: &str, body: &str, values: usize, count: usize) -> Vec<f32> {
    let includes = &["lib/bsdf.glsl", "lib/random.glsl"];
    run(&mut session(), &Snippet { includes, functions, body, values, count, ..Snippet::default() })
}

#[test]
fn what_is_drawn_is_what_is_evaluated() {
    let body = "
        Surface s;
        mat3 local;
        Bsdf bsdf = bsdf_of(index, s, local);
        vec3 v = s.view * local;
        float worst_pdf = 0.0, worst_value = 0.0, bad = 0.0, energy = 0.0;
        const uint N = 4096u;
        for (uint k = 0u; k < N; ++k) {
            Sequence q = sequence_begin(1u, uvec2(index, 0u), uint64_t(k) * 2ul);
            Scatter a = bsdf_sample(bsdf, s, local, vec3(sample_1d(q, 1u), sample_2d(q, 0u)));
            if (!a.valid) {
                continue;
            }
            bad += is_finite(a.weight) && is_finite(a.direction) && is_finite(a.pdf) ? 0.0 : 1.0;
            energy += a.weight.x / float(N);
            if (a.pdf > 0.0) {
                BsdfValue b = bsdf_evaluate(bsdf, v, a.direction * local);
                bad += is_finite(b.value) && is_finite(b.pdf) ? 0.0 : 1.0;
                worst_pdf = max(worst_pdf, abs(b.pdf / a.pdf - 1.0));
                worst_value = max(worst_value, abs(b.value.x / b.pdf - a.weight.x) / max(a.weight.x, 0.01));
            }
        }
        write(0u, worst_pdf); write(1u, worst_value); write(2u, bad); write(3u, energy); write(4u, s.roughness);";
    let values = run_cases(&format!("{SURFACE}{CASES}"), body, 5, 512);
    for (i, row) in values.chunks_exact(5).enumerate() {
        let label = format!("case {i}, roughness {}: {row:?}", row[4]);
        assert_eq!(row[2], 0.0, "not finite: {label}");
        // The half vector found again from two directions has lost the digits that alpha = 0.02 looks at.
        assert!(row[0] < 0.05 && row[1] < 0.05, "{label}");
        // A diffuse base below a smooth coat: glTF lets it have 1 - F of each half vector, which is more than the coat leaves at grazing angles.
        let inside = i / 64 % 2 == 1 && i / 128 % 2 == 0;
        let clear = i < 256 || inside;
        assert!(!clear || row[3] < 1.03, "makes light: {label}");
    }
}

/// Whatever is evaluated is drawn, too: inside of rough glass some microfacets let light through where the surface as a whole reflects totally.
#[test]
fn all_that_is_evaluated_is_drawn() {
    let body = "
        Surface s;
        mat3 local;
        Bsdf bsdf = bsdf_of(index, s, local);
        vec3 v = s.view * local;
        float drawn = 0.0, expected = 0.0;
        const uint N = 8192u;
        for (uint k = 0u; k < N; ++k) {
            Sequence q = sequence_begin(9u, uvec2(index, 2u), uint64_t(k) * 2ul);
            Scatter a = bsdf_sample(bsdf, s, local, vec3(sample_1d(q, 1u), sample_2d(q, 0u)));
            drawn += a.valid ? a.weight.x / float(N) : 0.0;
            vec2 at = (vec2(k % 64u, k / 64u) + 0.5) / vec2(64.0, 128.0);
            float angle = PI * at.y;
            vec3 l = vec3(sin(angle) * vec2(cos(TAU * at.x), sin(TAU * at.x)), cos(angle));
            expected += bsdf_evaluate(bsdf, v, l).value.x * sin(angle) * (PI * TAU / float(N));
        }
        write(0u, drawn); write(1u, expected); write(2u, s.roughness);";
    let values = run_cases(&format!("{SURFACE}{CASES}"), body, 3, 512);
    let rough = values.chunks_exact(3).enumerate().filter(|(_, row)| row[2] > 0.5);
    for (case, row) in rough {
        assert!(
            (row[0] - row[1]).abs() < 0.02 * row[1] + 0.01,
            "case {case}: drawn {}, not {}",
            row[0],
            row[1]
        );
    }
}

/// Chi-square of drawn directions against the integral of the density over cells of (cosine, azimuth), both hemispheres.
#[test]
fn densities_are_those_of_the_directions() {
    // 8 x 4 cells; each invocation draws for one cell count, or integrates the density over one cell.
    let functions = format!(
        "{SURFACE}{CASES}
        const uint CASE[6] = uint[6](21u, 36u, 63u, 85u, 28u + 128u, 39u + 320u);
        uint cell_of(vec3 l) {{
            uint row = min(uint((l.z + 1.0) * 4.0), 7u);
            float turn = atan(l.y, l.x) / TAU + 0.5;
            return row * 4u + min(uint(turn * 4.0), 3u);
        }}"
    );
    let body = "
        Surface s;
        mat3 local;
        Bsdf bsdf = bsdf_of(CASE[index / 32u], s, local);
        vec3 v = s.view * local;
        uint cell = index % 32u;
        float drawn = 0.0, expected = 0.0;
        const uint N = 16384u;
        for (uint k = 0u; k < N; ++k) {
            Sequence q = sequence_begin(5u, uvec2(index / 32u, 1u), uint64_t(k) * 2ul);
            Scatter a = bsdf_sample(bsdf, s, local, vec3(sample_1d(q, 1u), sample_2d(q, 0u)));
            drawn += a.valid && a.pdf > 0.0 && cell_of(a.direction * local) == cell ? 1.0 : 0.0;
        }
        for (uint k = 0u; k < N; ++k) {
            vec2 at = (vec2(k % 128u, k / 128u) + 0.5) / 128.0;
            float z = (float(cell / 4u) + at.x) / 4.0 - 1.0;
            float turn = ((float(cell % 4u) + at.y) / 4.0 - 0.5) * TAU;
            vec3 l = vec3(sqrt(1.0 - z * z) * vec2(cos(turn), sin(turn)), z);
            expected += bsdf_evaluate(bsdf, v, l).pdf * (TAU / 16.0);
        }
        write(0u, drawn); write(1u, expected);";
    let values = run_cases(&functions, body, 2, 6 * 32);
    for (case, cells) in values.chunks_exact(64).enumerate() {
        for (cell, pair) in cells.chunks_exact(2).enumerate() {
            let (drawn, expected) = (f64::from(pair[0]), f64::from(pair[1]));
            let bound = 5.0 * expected.sqrt() + 0.01 * expected + 3.0;
            assert!((drawn - expected).abs() < bound, "case {case}, cell {cell}: {drawn}, not {expected}");
        }
        let total: f64 = cells.chunks_exact(2).map(|pair| f64::from(pair[1])).sum();
        assert!(total > 8000.0, "case {case}: the density is of something: {total}");
    }
}
