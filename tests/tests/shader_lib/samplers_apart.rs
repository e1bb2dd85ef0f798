//! Every sampler: dimensions, pixels and streams know nothing of each other, but for the pixels of blue noise, which are
//! meant to differ. The naive forms: pairs that are not shuffled, odd and even samples of one sequence as two streams.

use caustica_renderer::{Sampler, Sampling};
use caustica_tests::compute::{Snippet, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::{chi_square_deviate, correlation};

use super::random::column;
use super::samplers::{INCLUDES, cells_of, draw};

/// Deviate of the joint distribution of two columns from independence.
fn joint_deviate(values: &[f32], width: usize, [a, b]: [usize; 2]) -> f64 {
    let points: Vec<[f64; 2]> =
        column(values, width, a).into_iter().zip(column(values, width, b)).map(|(x, y)| [x, y]).collect();
    chi_square_deviate(&cells_of(&points, [16, 16]))
}

#[test]
fn dimensions_of_a_pixel_are_independent() {
    const SAMPLES: usize = 1024;
    const SEEDS: usize = 16;
    const SETS: usize = 6;
    let mut session = session();
    // Dimensions with bases of their own, padded ones, another pixel and the other stream; last the naive form: the first and
    // the second pair of padded dimensions scrambled, but not shuffled.
    let body = "
        uint seed = index / 1024u;
        uint64_t i = uint64_t(index % 1024u);
        Sequence s = sequence_begin(seed, uvec2(5u, 5u), i * 2ul);
        Sequence pixel = sequence_begin(seed, uvec2(6u, 5u), i * 2ul);
        Sequence stream = sequence_begin(seed, uvec2(5u, 5u), i * 2ul + 1ul);
        uint light = sample_dimension(0u, 0u, PURPOSE_LIGHT_POINT, 0u);
        uint padded = sample_dimension(1u, 0u, PURPOSE_LOBE, 0u);
        vec2 points[6] = vec2[6](sample_2d(s, sample_dimension(0u, 0u, PURPOSE_JITTER, 0u)), sample_2d(s, light), sample_2d(s, padded),
            sample_2d(s, sample_dimension(2u, 0u, PURPOSE_LOBE, 0u)), sample_2d(pixel, padded), sample_2d(stream, padded));
        for (uint k = 0u; k < 6u; ++k) {
            write(2u * k, points[k].x);
            write(2u * k + 1u, points[k].y);
        }
        write(12u, unit_float(bitfieldReverse(owen_permute_reversed(uint(i), hash_combine(seed, 17u)))));
        write(13u, unit_float(bitfieldReverse(owen_permute_reversed(uint(i), hash_combine(seed, 18u)))));";
    for sampler in Sampler::ALL {
        let values = draw(&mut session, sampler, 2 * SAMPLES as u64, body, 14, SAMPLES * SEEDS);
        // Shuffled nets lie together in wide cells less evenly than independent numbers, in narrow ones more so: the deviate of
        // one seed spreads by 2.4, whatever the number of samples. The mean of 16 spreads by 0.6.
        let deviate = |columns| {
            let seeds = values.chunks_exact(14 * SAMPLES);
            seeds.map(|points| joint_deviate(points, 14, columns)).sum::<f64>() / SEEDS as f64
        };
        for (a, b) in (0..SETS).flat_map(|a| (a + 1..SETS).map(move |b| (a, b))) {
            // Pixels of blue noise share their sequence, and differ by an offset alone.
            if sampler == Sampler::BlueNoise && (a, b) == (2, 4) {
                continue;
            }
            for (axis, other) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let deviate = deviate([2 * a + axis, 2 * b + other]);
                assert!(deviate < 3.0, "{sampler:?}: {a}.{axis} and {b}.{other}: {deviate} deviations");
            }
        }
        assert!(deviate([12, 13]) > 20.0, "pairs without shuffling: {}", deviate([12, 13]));
    }
}

#[test]
fn neighbouring_pixels_are_independent() {
    const SIDE: usize = 128;
    let mut session = session();
    let body = "
        uvec2 pixel = uvec2(index % 128u, index / 128u);
        for (uint k = 0u; k < 2u; ++k) {
            uint dimension = sample_dimension(k, 0u, PURPOSE_LIGHT_POINT, 0u);
            write(3u * k, sample_2d(sequence_begin(4u, pixel, 2ul), dimension).x);
            write(3u * k + 1u, sample_2d(sequence_begin(4u, pixel + uvec2(1u, 0u), 2ul), dimension).x);
            write(3u * k + 2u, sample_2d(sequence_begin(4u, pixel + uvec2(0u, 1u), 4ul), dimension).x);
        }";
    for sampler in Sampler::ALL {
        let values = draw(&mut session, sampler, 64, body, 6, SIDE * SIDE);
        let deviates = [[0, 1], [0, 2], [3, 4], [3, 5]].map(|columns| joint_deviate(&values, 6, columns));
        // Neighbours of the same sample are pushed apart by blue noise.
        let independent = deviates.iter().all(|deviate| deviate.abs() < 4.0);
        assert_eq!(independent, sampler != Sampler::BlueNoise, "{sampler:?}: {deviates:?}");
    }
}

/// Mean power of an image of `side` x `side` errors at frequencies below `limit` cycles an image, against the mean over all.
fn low_frequency_share(errors: &[f64], side: usize, limit: i32) -> f64 {
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let total: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
    let (mut power, mut count) = (0.0, 0.0);
    for u in -limit..=limit {
        for v in 0..=limit {
            if (u, v) == (0, 0) || u * u + v * v > limit * limit {
                continue;
            }
            let (mut re, mut im) = (0.0, 0.0);
            for (i, error) in errors.iter().enumerate() {
                let turn = f64::from(u) * (i % side) as f64 + f64::from(v) * (i / side) as f64;
                let (sin, cos) = (std::f64::consts::TAU * turn / side as f64).sin_cos();
                re += (error - mean) * cos;
                im += (error - mean) * sin;
            }
            power += (re * re + im * im) / errors.len() as f64;
            count += 1.0;
        }
    }
    power / count / (total / errors.len() as f64)
}

#[test]
fn blue_noise_has_little_error_at_low_frequencies() {
    const SIDE: usize = 64;
    let mut session = session();
    // One sample a pixel of a smooth integrand, of a disc, and of a half plane: a lobe, a light, the edge of a shadow.
    let body = "
        vec2 x = sample_2d(sequence_begin(6u, uvec2(index % 64u, index / 64u), 0ul), 3u);
        write(0u, exp(x.x) * (1.0 + x.y * x.y));
        write(1u, length(x - 0.5) < 0.4 ? 1.0 : 0.0);
        write(2u, x.x + 0.7 * x.y < 0.6 ? 1.0 : 0.0);";
    for sampler in Sampler::ALL {
        let values = draw(&mut session, sampler, 64, body, 3, SIDE * SIDE);
        let shares = [0, 1, 2].map(|at| low_frequency_share(&column(&values, 3, at), SIDE, 6));
        if sampler == Sampler::BlueNoise {
            assert!(shares[0] < 0.1 && shares[1] < 0.6 && shares[2] < 0.4, "{shares:?}");
        } else {
            assert!(shares.iter().all(|share| (0.6..1.5).contains(share)), "{sampler:?}: {shares:?}");
        }
    }
}

/// Errors of the means of both streams, and of the even and the odd samples of one, over pixels and seeds.
fn errors_of_streams(sampler: Sampler, samples: u32, count: usize) -> [Vec<f64>; 4] {
    let mut session = session();
    // A product of a function of two dimensions and of one of another: pairs of dimensions count too.
    let functions = "
        float integrand(Sequence s) {
            vec2 x = sample_2d(s, sample_dimension(0u, 0u, PURPOSE_LIGHT_POINT, 0u));
            float y = sample_1d(s, sample_dimension(1u, 0u, PURPOSE_LOBE, 0u));
            return exp(x.x) * (1.0 + x.y * x.y) * (0.5 + y);
        }";
    let body = format!(
        "
        uvec2 pixel = uvec2(index % 64u, index / 64u);
        uint seed = index;
        vec4 sums = vec4(0.0);
        for (uint i = 0u; i < {samples}u; ++i) {{
            sums.x += integrand(sequence_begin(seed, pixel, uint64_t(i) * 2ul));
            sums.y += integrand(sequence_begin(seed, pixel, uint64_t(i) * 2ul + 1ul));
            sums.z += integrand(sequence_begin(seed, pixel, uint64_t(2u * i) * 2ul));
            sums.w += integrand(sequence_begin(seed, pixel, uint64_t(2u * i + 1u) * 2ul));
        }}
        for (uint k = 0u; k < 4u; ++k) {{
            write(k, sums[k]);
        }}"
    );
    // The naive streams are halves of a set of twice the size.
    let specialization = Sampling::of(sampler, Some(u64::from(samples) * 4)).specialization();
    let snippet = Snippet {
        includes: INCLUDES,
        functions,
        body: &body,
        values: 4,
        count,
        specialization,
        ..Snippet::default()
    };
    let values = run(&mut session, &snippet);
    let mean = (std::f64::consts::E - 1.0) * (4.0 / 3.0);
    [0, 1, 2, 3].map(|at| {
        column(&values, 4, at).iter().map(|sum| sum / f64::from(samples) - mean).collect::<Vec<_>>()
    })
}

#[test]
fn the_two_streams_err_independently() {
    const COUNT: usize = 4096;
    let sigma = 1.0 / (COUNT as f64).sqrt();
    let deviation = |e: &[f64]| (e.iter().map(|x| x * x).sum::<f64>() / e.len() as f64).sqrt();
    for sampler in Sampler::ALL {
        let [a, b, even, odd] = errors_of_streams(sampler, 16, COUNT);
        for errors in [&a, &b] {
            let bias = errors.iter().sum::<f64>() / COUNT as f64;
            let allowed = (5.0 * deviation(errors) * sigma).max(1e-5);
            assert!(bias.abs() < allowed, "{sampler:?}: bias {bias} of {allowed}");
        }
        let r = correlation(&a, &b);
        assert!(r.abs() < 3.0 * sigma, "{sampler:?}: {r}");
        // So the half difference estimates the error of the mean.
        let (half, full): (Vec<f64>, Vec<f64>) =
            a.iter().zip(&b).map(|(a, b)| (0.5 * (a - b), 0.5 * (a + b))).unzip();
        let ratio = deviation(&half) / deviation(&full);
        assert!((ratio - 1.0).abs() < 0.1, "{sampler:?}: {ratio}");
        let r = correlation(&even, &odd);
        if sampler != Sampler::Independent {
            assert!(
                r.abs() > 6.0 * sigma,
                "{sampler:?}: odd and even samples of one set are correlated: {r}"
            );
        }
    }
}
