//! Row 13: random numbers of the default sampler. The naive forms: a seed that adds pixel and frame, a frame index held in
//! a float.

use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::{chi_square_deviate, correlation};

const INCLUDES: &[&str] = &["lib/random.glsl"];

/// One value of every invocation.
pub fn column(values: &[f32], width: usize, at: usize) -> Vec<f64> {
    values.chunks_exact(width).map(|row| f64::from(row[at])).collect()
}

/// Two values of every invocation, as a point.
pub fn pairs(values: &[f32], width: usize, at: usize) -> Vec<[f64; 2]> {
    values.chunks_exact(width).map(|row| [f64::from(row[at]), f64::from(row[at + 1])]).collect()
}

/// Whether every box of every shape with area 1 / n holds one of these n points: a (0, m, 2)-net in base 2.
pub fn is_net(points: &[[f64; 2]]) -> bool {
    let bits = points.len().trailing_zeros();
    (0..=bits).all(|i| {
        let (wide, high) = (1_usize << i, 1_usize << (bits - i));
        let mut seen = vec![false; points.len()];
        points.iter().all(|[x, y]| {
            let cell = (x * wide as f64) as usize * high + (y * high as f64) as usize;
            !std::mem::replace(&mut seen[cell], true)
        })
    })
}

#[test]
fn every_run_of_samples_is_a_net() {
    const SAMPLES: usize = 4096;
    let mut session = session();
    // Two streams, a second pixel, a second dimension, four points a sample, and indices past 32 bits.
    let body = "
        uint64_t i = uint64_t(index);
        Sequence a = sequence_begin(7u, uvec2(3u, 5u), i * 2ul);
        Sequence b = sequence_begin(7u, uvec2(3u, 5u), i * 2ul + 1ul);
        Sequence c = sequence_begin(7u, uvec2(4u, 5u), i * 2ul);
        Sequence d = sequence_split(sequence_begin(7u, uvec2(3u, 5u), uint64_t(index / 4u) * 2ul), 4u, index % 4u);
        Sequence e = sequence_begin(7u, uvec2(3u, 5u), (i + (1ul << 40)) * 2ul);
        vec2 points[6] = vec2[6](sample_2d(a, 9u), sample_2d(b, 9u), sample_2d(c, 9u), sample_2d(a, 10u), sample_2d(d, 9u),
            sample_2d(e, 9u));
        for (uint k = 0u; k < 6u; ++k) {
            write(2u * k, points[k].x);
            write(2u * k + 1u, points[k].y);
        }";
    let values = run(
        &mut session,
        &Snippet { includes: INCLUDES, body, values: 12, count: SAMPLES, ..Snippet::default() },
    );
    for set in 0..6 {
        let points = pairs(&values, 12, set * 2);
        assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)), "set {set}");
        for size in [16, 64, 256, 1024, 4096] {
            assert!(points.chunks_exact(size).all(is_net), "set {set}, {size} points");
        }
    }
    // Streams, pixels and dimensions know nothing of each other: five standard deviations.
    let bound = 5.0 / (SAMPLES as f64).sqrt();
    for other in [2, 4, 6, 10] {
        for axis in 0..2 {
            let r = correlation(&column(&values, 12, axis), &column(&values, 12, other + axis));
            assert!(r.abs() < bound, "column {axis} and {}: {r}", other + axis);
        }
    }
}

#[test]
fn pixels_and_frames_are_independent() {
    const SIDE: usize = 128;
    let mut session = session();
    // Naive: one generator step on pixel number + frame, as in many path tracers' first version.
    let functions = "
        float naive(uint pixel, uint frame) { return unit_float((pixel + frame) * 1664525u + 1013904223u); }";
    let body = "
        uvec2 pixel = uvec2(index % 128u, index / 128u);
        for (uint frame = 0u; frame < 2u; ++frame) {
            vec2 x = sample_2d(sequence_begin(0u, pixel, uint64_t(frame) * 2ul), 0u);
            write(2u * frame, x.x);
            write(2u * frame + 1u, x.y);
            write(4u + frame, naive(index, frame));
        }";
    let count = SIDE * SIDE;
    let values = run(
        &mut session,
        &Snippet { includes: INCLUDES, functions, body, values: 6, count, ..Snippet::default() },
    );
    let mut cells = vec![0_u64; 256];
    for [x, y] in pairs(&values, 6, 0) {
        cells[(y * 16.0) as usize * 16 + (x * 16.0) as usize] += 1;
    }
    let deviate = chi_square_deviate(&cells);
    assert!(
        deviate.abs() < 4.0,
        "chi-square of {count} pixels over 256 cells: {deviate} standard deviations"
    );

    let bound = 5.0 / (count as f64).sqrt();
    let (now, next) = (column(&values, 6, 0), column(&values, 6, 2));
    // A pixel now, and its neighbours one frame later.
    for shift in [1, SIDE] {
        let r = correlation(&now[shift..], &next[..count - shift]);
        assert!(r.abs() < bound, "shift {shift}: {r}");
        let r = correlation(&now[shift..], &now[..count - shift]);
        assert!(r.abs() < bound, "neighbours at {shift}: {r}");
    }
    let (now, next) = (column(&values, 6, 4), column(&values, 6, 5));
    assert!(
        correlation(&now[1..], &next[..count - 1]) > 0.999,
        "the naive seed is expected to repeat itself"
    );
}

#[test]
fn late_samples_still_differ() {
    let mut session = session();
    // Naive: the frame index as a float, past 2^24 frames.
    let body = "
        const uint64_t late = 1ul << 26;
        vec2 ours = sample_2d(sequence_begin(0u, uvec2(1u, 1u), late + uint64_t(index) * 2ul), 0u);
        float frame = float(uint(late) + index);
        float naive = fract(sin(frame * 12.9898) * 43758.5453);
        write(0u, ours.x);
        write(1u, naive);";
    let values =
        run(&mut session, &Snippet { includes: INCLUDES, body, values: 2, count: 64, ..Snippet::default() });
    let distinct = |at: usize| {
        let mut bits: Vec<u32> = values.chunks_exact(2).map(|row| row[at].to_bits()).collect();
        bits.sort_unstable();
        bits.dedup();
        bits.len()
    };
    assert_eq!(distinct(0), 64);
    assert!(distinct(1) <= 24, "the naive index is expected to repeat: {}", distinct(1));
}
