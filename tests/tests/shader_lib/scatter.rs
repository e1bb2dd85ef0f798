//! Rows 9 and 10 together: what a glass or a transmitting surface sends on is what arrives, never more.

use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::session;

/// `white_surface`: in the plane z = 0, seen under cosine `mu`.
pub(super) const SURFACE: &str = "
    Surface white_surface(float mu, float roughness, uint mode, bool front, uint flags) {
        Surface s;
        s.position = vec3(0.0);
        s.offset_m = 0.0;
        s.geometric_normal = vec3(0.0, 0.0, 1.0);
        s.shading_normal = vec3(0.0, 0.0, 1.0);
        s.view = vec3(sqrt(1.0 - mu * mu), 0.0, mu);
        s.base_color = vec3(1.0);
        s.metallic = 0.0;
        s.roughness = roughness;
        s.ior = 1.5;
        s.transmission = 1.0;
        s.specular = 1.0;
        s.specular_color = vec3(1.0);
        s.attenuation_per_m = vec3(0.0);
        s.occlusion = 1.0;
        s.emissive = vec3(0.0);
        s.mode = mode;
        s.lobes = LOBES_NONE;
        s.front = front;
        s.flags = flags;
        return s;
    }";

#[test]
fn glass_sends_on_what_arrives() {
    let mut session = session();
    // Eight angles x eight roughnesses x inside or outside x smooth glass or glTF transmission x volume or sheet.
    let body = "
        float mu = 0.02 + 0.98 * float(index % 8u) / 7.0;
        float roughness = float((index / 8u) % 8u) / 7.0;
        bool front = (index / 64u) % 2u == 0u;
        uint mode = (index / 128u) % 2u == 0u ? MODE_PBR : MODE_REFRACTIVE;
        bool sheet = (index / 256u) % 2u == 1u;
        Surface s = white_surface(mu, roughness, mode, front, sheet ? 0u : MATERIAL_HAS_VOLUME);
        Sides sides = sheet ? Sides(1.0, true, false) : Sides(front ? 1.0 / 1.5 : 1.5, false, false);
        float reflected = 0.0, transmitted = 0.0, chosen = 0.0, bad = 0.0;
        const uint N = 2048u;
        for (uint k = 0u; k < N; ++k) {
            Sequence q = sequence_begin(1u, uvec2(index, 0u), uint64_t(k) * 2ul);
            vec3 xi = vec3(sample_1d(q, 1u), sample_2d(q, 0u));
            Scatter a = scatter_surface(s, sides, true, false, xi);
            Scatter b = scatter_surface(s, sides, false, true, xi);
            Scatter c = scatter_surface(s, sides, true, true, xi);
            if (a.valid) {
                reflected += a.weight.x;
                bad += a.direction.z > 0.0 && is_finite(a.weight) && is_finite(a.direction) ? 0.0 : 1.0;
            }
            if (b.valid) {
                transmitted += b.weight.x;
                bad += b.direction.z < 0.0 && is_finite(b.weight) && is_finite(b.direction) ? 0.0 : 1.0;
            }
            if (c.valid) {
                chosen += c.weight.x;
                bad += is_finite(c.weight) ? 0.0 : 1.0;
            }
        }
        write(0u, reflected / float(N)); write(1u, transmitted / float(N)); write(2u, chosen / float(N)); write(3u, bad);
        write(4u, mu);";
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/scatter.glsl", "lib/random.glsl"],
            functions: SURFACE,
            body,
            values: 5,
            count: 512,
            ..Snippet::default()
        },
    );
    for (i, row) in values.chunks_exact(5).enumerate() {
        let smooth = (i / 8) % 8 == 0 || (i / 128) % 2 == 1;
        let sum = row[0] + row[1];
        let label = format!("case {i}, cosine {}", row[4]);
        assert_eq!(row[3], 0.0, "{label}: wrong side or not finite");
        assert!(sum < 1.0 + 1e-3, "{label}: {sum}");
        assert!(
            (row[2] - sum).abs() < 0.02,
            "{label}: both lobes by chance give {} instead of {sum}",
            row[2]
        );
        if smooth {
            assert!((sum - 1.0).abs() < 1e-3, "{label}: {sum}");
        }
        let inside = (i / 64) % 2 == 1 && (i / 256) % 2 == 0;
        let beyond_critical = (1.0 - row[4] * row[4]) * 1.5 * 1.5 > 1.0;
        if smooth && inside && beyond_critical {
            assert!((row[0] - 1.0).abs() < 1e-6 && row[1] == 0.0, "{label}: total reflection");
        }
    }
}

#[test]
fn two_interfaces_of_a_prism_bend_as_snell_says() {
    let mut session = session();
    // A ray along +x enters a prism of 40 degrees at its left face and leaves at its right one.
    let body = "
        float tilt = 0.02 + 0.3 * float(index) / 63.0;
        vec3 left = vec3(-cos(tilt), sin(tilt), 0.0);
        vec3 right = vec3(cos(0.7 - tilt), sin(0.7 - tilt), 0.0);
        vec3 travel = vec3(1.0, 0.0, 0.0);
        for (uint k = 0u; k < 2u; ++k) {
            Surface s = white_surface(1.0, 0.0, MODE_REFRACTIVE, k == 0u, MATERIAL_HAS_VOLUME);
            s.view = -travel;
            s.geometric_normal = k == 0u ? left : -right; // turned to the side of the ray
            s.shading_normal = s.geometric_normal;
            travel = scatter_surface(s, Sides(k == 0u ? 1.0 / 1.5 : 1.5, false, false), false, true, vec3(0.5)).direction;
        }
        write(0u, travel);
        write(3u, tilt);";
    let values = run(
        &mut session,
        &Snippet {
            includes: &["lib/scatter.glsl", "lib/random.glsl"],
            functions: SURFACE,
            body,
            values: 4,
            count: 64,
            ..Snippet::default()
        },
    );
    for row in values.chunks_exact(4) {
        let tilt = f64::from(row[3]);
        // Deviation of a prism: entry angle, inner angles that add up to the prism's, exit angle.
        let inner = (tilt.sin() / 1.5).asin();
        let exit = (1.5 * (0.7 - inner).sin()).asin();
        let deviation = tilt + exit - 0.7;
        let angle = f64::from(-row[1]).atan2(f64::from(row[0]));
        assert!((angle - deviation).abs() < 2e-6, "tilt {tilt}: {angle} {deviation}");
    }
}
