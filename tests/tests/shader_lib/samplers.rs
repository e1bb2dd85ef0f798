//! Every sampler: its exact structure, uniform points, discrepancy, the jitter that the host draws. The naive forms:
//! Halton without scrambling, Hammersley in order, independent numbers.

use caustica_renderer::{Sampler, Sampling};
use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::{Session, session};
use caustica_tests::numbers::{chi_square_deviate, is_near, star_discrepancy};

use super::random::{column, is_net, pairs};

pub const INCLUDES: &[&str] = &["lib/random.glsl"];

/// Runs a snippet with a sampler, for `samples` samples of both streams.
pub fn draw(
    session: &mut Session,
    sampler: Sampler,
    samples: u64,
    body: &str,
    values: usize,
    count: usize,
) -> Vec<f32> {
    let specialization = Sampling::of(sampler, Some(samples)).specialization();
    run(session, &Snippet { includes: INCLUDES, body, values, count, specialization, ..Snippet::default() })
}

/// Cells of a `side` x `side` grid that hold these points.
pub fn cells_of(points: &[[f64; 2]], [columns, rows]: [usize; 2]) -> Vec<u64> {
    let mut cells = vec![0; columns * rows];
    for [x, y] in points {
        cells[(y * rows as f64) as usize * columns + (x * columns as f64) as usize] += 1;
    }
    cells
}

fn one_each(points: &[[f64; 2]], grid: [usize; 2]) -> bool {
    cells_of(points, grid).iter().all(|n| *n == 1)
}

/// Samples of one pixel in dimensions with bases of their own and in padded ones, and four points a sample.
const ALONG_A_PIXEL: &str = "
    Sequence s = sequence_begin(5u, uvec2(9u, 4u), uint64_t(index) * 2ul);
    Sequence late = sequence_begin(5u, uvec2(9u, 4u), (uint64_t(index) + (1ul << 40)) * 2ul + 1ul);
    Sequence part = sequence_split(sequence_begin(5u, uvec2(9u, 4u), uint64_t(index / 4u) * 2ul), 4u, index % 4u);
    uint jitter = sample_dimension(0u, 0u, PURPOSE_JITTER, 0u);
    uint padded = sample_dimension(3u, 1u, PURPOSE_LOBE, 0u);
    vec2 points[4] = vec2[4](sample_2d(s, jitter), sample_2d(s, padded), sample_2d(late, padded), sample_2d(part, padded));
    for (uint k = 0u; k < 4u; ++k) {
        write(2u * k, points[k].x);
        write(2u * k + 1u, points[k].y);
    }";

#[test]
fn sets_have_the_structure_that_their_name_promises() {
    let mut session = session();
    let halton = draw(&mut session, Sampler::Halton, 2592, ALONG_A_PIXEL, 8, 1296);
    let hammersley = draw(&mut session, Sampler::Hammersley, 600, ALONG_A_PIXEL, 8, 300);
    let blue = draw(&mut session, Sampler::BlueNoise, 512, ALONG_A_PIXEL, 8, 256);
    for set in 0..4 {
        // Halton in bases 2 and 3: any run of 2^i 3^j points has one in each box of that many columns and rows.
        let points = pairs(&halton, 8, set * 2);
        for power in 1..=4 {
            let grid = [2_usize.pow(power), 3_usize.pow(power)];
            let whole = points.chunks_exact(grid[0] * grid[1]).all(|run| one_each(run, grid));
            assert!(whole, "Halton {set}, {grid:?}");
        }
        let points = pairs(&blue, 8, set * 2);
        assert!([16, 64, 256].iter().all(|n| points.chunks_exact(*n).all(is_net)), "blue noise {set}");
    }
    let own_bases = pairs(&halton, 8, 0);
    assert!(own_bases.chunks_exact(8 * 27).all(|run| one_each(run, [8, 27])), "other runs");
    // Hammersley: one in each strip, of which there are as many as samples, and nearly even along the other side.
    for set in 0..3 {
        let points = pairs(&hammersley, 8, set * 2);
        assert!(one_each(&points, [300, 1]), "Hammersley {set}");
        assert!(cells_of(&points, [1, 4]).iter().all(|n| n.abs_diff(75) <= 2), "Hammersley {set}");
    }
    let quarter = pairs(&draw(&mut session, Sampler::Hammersley, 150, ALONG_A_PIXEL, 8, 300), 8, 6);
    assert!(one_each(&quarter, [300, 1]), "four points a sample are one set");
}

#[test]
fn blue_noise_spreads_each_sample_over_the_pixels() {
    let mut session = session();
    let body = "
        uvec2 pixel = uvec2(16u, 32u) + uvec2(index % 16u, index / 16u);
        for (uint i = 0u; i < 3u; ++i) {
            vec2 x = sample_2d(sequence_begin(2u, pixel, uint64_t(i) * 3ul), 7u);
            write(2u * i, x.x);
            write(2u * i + 1u, x.y);
        }";
    let blue = draw(&mut session, Sampler::BlueNoise, 64, body, 6, 256);
    let white = draw(&mut session, Sampler::Sobol, 64, body, 6, 256);
    for sample in 0..3 {
        assert!(is_net(&pairs(&blue, 6, sample * 2)), "16 x 16 pixels of sample {sample}");
        assert!(!is_net(&pairs(&white, 6, sample * 2)), "pixels that know nothing of each other");
    }
}

/// The worst deviate of a point set: both axes in 64 cells, the square in 256.
fn worst_deviate(points: &[[f64; 2]]) -> f64 {
    let deviates = [[64, 1], [1, 64], [16, 16]].map(|grid| chi_square_deviate(&cells_of(points, grid)));
    deviates.into_iter().fold(f64::MIN, f64::max)
}

#[test]
fn points_are_uniform_over_pixels_and_over_samples() {
    const COUNT: usize = 16384;
    let mut session = session();
    // The set of one pixel, and one sample of each of as many pixels, in a dimension with bases of its own and in a padded one.
    let body = "
        Sequence along = sequence_begin(1u, uvec2(3u, 8u), uint64_t(index) * 2ul + 1ul);
        Sequence across = sequence_begin(1u, uvec2(index % 128u, index / 128u), 6ul);
        for (uint k = 0u; k < 2u; ++k) {
            uint dimension = sample_dimension(k, 0u, PURPOSE_LIGHT_POINT, 0u);
            vec2 x = sample_2d(along, dimension);
            vec2 y = sample_2d(across, dimension);
            write(4u * k, x.x); write(4u * k + 1u, x.y); write(4u * k + 2u, y.x); write(4u * k + 3u, y.y);
        }";
    for sampler in Sampler::ALL {
        let values = draw(&mut session, sampler, 2 * COUNT as u64, body, 8, COUNT);
        for set in 0..4 {
            let points = pairs(&values, 8, set * 2);
            assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)), "{sampler:?} {set}");
            let deviate = worst_deviate(&points);
            assert!(deviate < 4.0, "{sampler:?} {set}: {deviate} standard deviations");
            // A part of the set is uniform too: a picture can be looked at before it is complete.
            let deviate = worst_deviate(&points[..COUNT / 4]);
            assert!(deviate < 4.0, "{sampler:?} {set}, a quarter: {deviate} standard deviations");
        }
    }
    // Naive: a Hammersley set in order.
    let ordered: Vec<[f64; 2]> = (0..COUNT / 4)
        .map(|i| [i as f64 / COUNT as f64, f64::from((i as u32).reverse_bits()) * 2f64.powi(-32)])
        .collect();
    assert!(worst_deviate(&ordered) > 50.0, "{}", worst_deviate(&ordered));
}

#[test]
fn large_bases_are_not_striped() {
    let mut session = session();
    // The last pair with bases of its own (47, 53), against the same without scrambling, whose first points lie on stripes.
    let functions = "
        float inverse(uint base, uint i) {
            float value = 0.0;
            for (float digit = 1.0 / float(base); i > 0u; digit /= float(base), i /= base) {
                value += digit * float(i % base);
            }
            return value;
        }";
    let body = "
        vec2 ours = sample_2d(sequence_begin(3u, uvec2(1u, 2u), uint64_t(index) * 2ul), sample_dimension(0u, 0u, PURPOSE_LOBE, 1u));
        write(0u, ours.x); write(1u, ours.y);
        write(2u, inverse(47u, index)); write(3u, inverse(53u, index));";
    let specialization = Sampling::of(Sampler::Halton, None).specialization();
    let snippet = Snippet {
        includes: INCLUDES,
        functions,
        body,
        values: 4,
        count: 96,
        specialization,
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let deviate = |at: usize| chi_square_deviate(&cells_of(&pairs(&values, 4, at), [8, 8]));
    assert!(deviate(0) < 3.0, "{}", deviate(0));
    assert!(deviate(2) > 5.0, "{}", deviate(2));
}

#[test]
fn discrepancy_is_that_of_low_discrepancy_sets() {
    let mut session = session();
    let body = "
        vec2 x = sample_2d(sequence_begin(1u, uvec2(11u, 2u), uint64_t(index) * 2ul), sample_dimension(0u, 0u, PURPOSE_JITTER, 0u));
        vec2 y = sample_2d(sequence_begin(1u, uvec2(11u, 2u), uint64_t(index) * 2ul), sample_dimension(1u, 0u, PURPOSE_LOBE, 0u));
        write(0u, x.x); write(1u, x.y); write(2u, y.x); write(3u, y.y);";
    for count in [256_usize, 1024] {
        // Low discrepancy in two dimensions is c (log n)^2 / n; independent numbers have about 1 / sqrt(n).
        let bound = 0.25 * (count as f64).ln().powi(2) / count as f64;
        for sampler in Sampler::ALL {
            let values = draw(&mut session, sampler, 2 * count as u64, body, 4, count);
            for at in [0, 2] {
                let discrepancy = star_discrepancy(&pairs(&values, 4, at));
                let low = sampler != Sampler::Independent;
                assert_eq!(discrepancy < bound, low, "{sampler:?}, {count}: {discrepancy} against {bound}");
            }
        }
    }
}

#[test]
fn the_host_jitters_by_the_points_of_the_shaders() {
    const COUNT: usize = 512;
    let mut session = session();
    // The first samples of both streams, and samples past 32 bits, as frames of a moving view are numbered.
    let body = "
        uint64_t late = index < 256u ? 0ul : 1ul << 48;
        vec2 x = sample_2d(sequence_begin(77u, uvec2(0u), uint64_t(index) + late), sample_dimension(0u, 0u, PURPOSE_JITTER, 0u));
        write(0u, x.x); write(1u, x.y);";
    for sampler in Sampler::ALL {
        let sampling = Sampling::of(sampler, Some(150));
        let values = draw(&mut session, sampler, 150, body, 2, COUNT);
        for (i, [x, y]) in pairs(&values, 2, 0).into_iter().enumerate() {
            let late = if i < 256 { 0 } else { 1 << 48 };
            let host = sampling.jitter_px(77, i as u64 + late) + 0.5;
            let same = is_near(f64::from(host.x), x, 1e-6) && is_near(f64::from(host.y), y, 1e-6);
            assert!(same, "{sampler:?}, sample {i}: {host} here, {x} {y} there");
        }
    }
}

#[test]
fn late_samples_of_every_sampler_still_differ() {
    let mut session = session();
    let body = "
        Sequence s = sequence_begin(0u, uvec2(1u, 1u), (1ul << 27) + uint64_t(index) * 2ul);
        write(0u, sample_2d(s, sample_dimension(0u, 0u, PURPOSE_LIGHT_POINT, 0u)).x);
        write(1u, sample_2d(s, sample_dimension(1u, 0u, PURPOSE_LIGHT_POINT, 0u)).x);";
    for sampler in Sampler::ALL {
        let values = draw(&mut session, sampler, 64, body, 2, 64);
        for at in 0..2 {
            let mut sorted = column(&values, 2, at);
            sorted.sort_by(f64::total_cmp);
            sorted.dedup();
            assert_eq!(sorted.len(), 64, "{sampler:?} {at}");
        }
    }
}
