//! Rays against spheres and boxes (robustness, rows 3 and 4) against double precision. The naive forms: b^2 - 4ac with
//! the near root alone, and slabs multiplied by inverse directions.

use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::session;
use glam::DVec3;

const INCLUDES: &[&str] = &["lib/random.glsl", "lib/intersect.glsl"];

/// Both roots of a sphere of radius 1 at the origin, in double precision.
fn roots(origin: DVec3, direction: DVec3) -> [f64; 2] {
    let (a, b) = (direction.length_squared(), -origin.dot(direction));
    let nearest = origin + direction * (b / a);
    let q = b + b.signum() * (a * (1.0 - nearest.length_squared())).sqrt();
    let c = (origin.length() - 1.0) * (origin.length() + 1.0);
    let (first, second) = (c / q, q / a);
    [first.min(second), first.max(second)]
}

#[test]
fn spheres_are_exact_from_far_and_from_inside() {
    const COUNT: usize = 8192;
    let mut session = session();
    // A quarter starts inside, the others up to a million radii away; all aim at the inner nine tenths.
    let body = "
        vec2 a = sample_2d(sequence_begin(5u, uvec2(index, 0u), 0ul), 0u);
        vec2 b = sample_2d(sequence_begin(5u, uvec2(index, 0u), 0ul), 1u);
        vec3 side = normalize(vec3(a - 0.5, b.x - 0.5) + 1e-4);
        float away = index % 4u == 0u ? 0.9 * b.y : 1.1 * pow(10.0, 5.95 * b.y);
        vec3 origin = side * away;
        vec3 aim = 0.9 * (vec3(b, a.x) - 0.5);
        vec3 direction = normalize(aim - origin);
        vec2 t;
        bool hit = intersect_sphere(origin, direction, vec3(0.0), 1.0, t);
        float p = 2.0 * dot(origin, direction), q = dot(origin, origin) - 1.0;
        float naive = 0.5 * (-p - sqrt(p * p - 4.0 * q));
        write(0u, origin); write(3u, direction); write(6u, hit ? 1.0 : 0.0); write(7u, t.x); write(8u, t.y);
        write(9u, naive);";
    let snippet = Snippet { includes: INCLUDES, body, values: 10, count: COUNT, ..Snippet::default() };
    let values = run(&mut session, &snippet);
    let mut naive_broken = 0;
    for row in values.chunks_exact(10) {
        let [origin, direction] =
            [0, 3].map(|i| DVec3::new(f64::from(row[i]), f64::from(row[i + 1]), f64::from(row[i + 2])));
        let expected = roots(origin, direction);
        assert_eq!(row[6], 1.0, "{origin} {direction}");
        for (found, expected) in [row[7], row[8]].into_iter().zip(expected) {
            let error = (f64::from(found) - expected).abs() / expected.abs().max(0.1);
            assert!(error <= 1e-6, "{origin} {direction}: {found}, expected {expected}");
        }
        let naive_error = (f64::from(row[9]) - expected[0]).abs() / expected[0].abs().max(0.1);
        naive_broken += usize::from(naive_error.is_nan() || naive_error > 1e-6);
    }
    assert!(naive_broken > COUNT / 10, "the naive form fails in {naive_broken} of {COUNT} cases only");
}

#[test]
fn boxes_are_hit_by_rays_along_their_faces() {
    // Origins and directions on a grid: on faces, edges and corners, parallel to one axis or two.
    const COUNT: usize = 125 * 27;
    let mut session = session();
    let body = "
        uvec3 place = uvec3(index, index / 5u, index / 25u) % 5u;
        uint turn = index / 125u;
        vec3 origin = vec3(place) - 2.0;
        vec3 direction = vec3(turn % 3u, turn / 3u % 3u, turn / 9u) - 1.0;
        vec2 t;
        bool hit = direction != vec3(0.0) && intersect_box(origin, direction, vec3(-1.0), vec3(1.0), t);
        vec3 inverse = 1.0 / direction, first = (vec3(-1.0) - origin) * inverse, second = (vec3(1.0) - origin) * inverse;
        vec3 near = min(first, second), far = max(first, second);
        bool naive = max(max(near.x, near.y), near.z) <= min(min(far.x, far.y), far.z);
        write(0u, origin); write(3u, direction); write(6u, hit ? 1.0 : 0.0); write(7u, naive ? 1.0 : 0.0);";
    let snippet = Snippet { includes: INCLUDES, body, values: 8, count: COUNT, ..Snippet::default() };
    let values = run(&mut session, &snippet);
    let mut naive_broken = 0;
    for row in values.chunks_exact(8) {
        let (origin, direction) = (&row[0..3], &row[3..6]);
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut outside = direction.iter().all(|d| *d == 0.0);
        for (o, d) in origin.iter().zip(direction).map(|(o, d)| (f64::from(*o), f64::from(*d))) {
            if d == 0.0 {
                outside |= o.abs() > 1.0;
            } else {
                let (first, second) = ((-1.0 - o) / d, (1.0 - o) / d);
                (low, high) = (low.max(first.min(second)), high.min(first.max(second)));
            }
        }
        let expected = !outside && low <= high;
        assert_eq!(row[6] == 1.0, expected, "{origin:?} {direction:?}");
        naive_broken += usize::from((row[7] == 1.0) != expected);
    }
    assert!(naive_broken > 20, "the naive form fails in {naive_broken} cases only");
}
