//! Light from a map: its density integrates to 1, its samples fall where the density says.

use caustica_renderer::gpu_types::AliasEntry;
use caustica_tests::compute::{Snippet, bytes, run};
use caustica_tests::gpu::session;
use caustica_tests::numbers::{Random, chi_square_deviate_against};

const WIDTH: usize = 16;
const HEIGHT: usize = 8;
const CELLS: usize = WIDTH * HEIGHT;

/// An alias table in double precision (Vose 1991), of its own: the oracle of the host's.
fn alias_table(weights: &[f64]) -> Vec<AliasEntry> {
    let total: f64 = weights.iter().sum();
    let n = weights.len();
    let mut left: Vec<f64> = weights.iter().map(|w| w / total * n as f64).collect();
    let mut table: Vec<AliasEntry> = weights
        .iter()
        .enumerate()
        .map(|(i, w)| AliasEntry { threshold: 1.0, alias: i as u32, pdf: (w / total) as f32 })
        .collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|i| left[*i] < 1.0);
    while let (Some(low), Some(high)) = (small.pop(), large.pop()) {
        table[low].threshold = left[low] as f32;
        table[low].alias = high as u32;
        left[high] -= 1.0 - left[low];
        if left[high] < 1.0 { small.push(high) } else { large.push(high) }
    }
    table
}

/// Weights with a sun, dark cells and bright poles.
fn weights() -> Vec<f64> {
    let mut random = Random::new(8);
    (0..CELLS)
        .map(|i| match i {
            37 => 400.0,
            50..60 => 0.0,
            _ => random.between(0.1, 2.0),
        })
        .collect()
}

const SCENE: &str = "
    Scene environment_scene() {
        Scene scene;
        scene.environment_alias = inputs.at[0];
        scene.environment_width = 16u;
        scene.environment_height = 8u;
        scene.environment_radiance = vec3(1.0);
        scene.environment_rotation_rad = 0.7;
        return scene;
    }";

const INCLUDES: &[&str] = &["lib/random.glsl", "lib/environment.glsl"];

#[test]
fn the_density_of_a_map_integrates_to_one() {
    // Equal steps in height and turn: every point stands for the same solid angle.
    const ROWS: usize = 512;
    const COLUMNS: usize = 256;
    let table = alias_table(&weights());
    let body = "
        Scene scene = environment_scene();
        float y = 1.0 - 2.0 * (float(index / 256u) + 0.5) / 512.0;
        float turn = TAU * (float(index % 256u) + 0.37) / 256.0;
        float across = sqrt((1.0 - y) * (1.0 + y));
        write(0u, environment_pdf(scene, vec3(across * sin(turn), y, -across * cos(turn))));";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: INCLUDES,
            functions: SCENE,
            body,
            values: 1,
            count: ROWS * COLUMNS,
            inputs: &[bytes(&table)],
            ..Snippet::default()
        },
    );
    let mean = values.iter().map(|x| f64::from(*x)).sum::<f64>() / values.len() as f64;
    let integral = mean * 4.0 * std::f64::consts::PI;
    assert!((integral - 1.0).abs() < 5e-3, "{integral}");
}

#[test]
fn samples_of_a_map_fall_where_its_density_says() {
    const DRAWS: usize = 1 << 18;
    let weights = weights();
    let table = alias_table(&weights);
    let body = "
        Scene scene = environment_scene();
        Sequence sequence = sequence_begin(1u, uvec2(index, index >> 10u), 0ul);
        vec3 direction = environment_sample(scene, sample_2d(sequence, 0u), sample_2d(sequence, 1u));
        uint cell = environment_cell(scene, direction);
        write(0u, float(cell));
        write(1u, environment_pdf(scene, direction) * environment_cell_sr(scene, cell / 16u));
        write(2u, length(direction));
        vec2 uv = environment_uv(scene, direction);
        write(3u, fract(uv.x * 16.0));
        write(4u, direction.y);";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: INCLUDES,
            functions: SCENE,
            body,
            values: 5,
            count: DRAWS,
            inputs: &[bytes(&table)],
            ..Snippet::default()
        },
    );
    let total: f64 = weights.iter().sum();
    let mut counts = vec![0_u64; CELLS];
    for row in values.chunks_exact(5) {
        assert!((row[2] - 1.0).abs() < 1e-5, "length {}", row[2]);
        let cell = row[0] as usize;
        counts[cell] += 1;
        assert!((f64::from(row[1]) - weights[cell] / total).abs() < 1e-6, "density of cell {cell}");
    }
    let expected: Vec<f64> = weights.iter().map(|w| w / total * DRAWS as f64).collect();
    let deviate = chi_square_deviate_against(&counts, &expected);
    assert!(deviate < 4.0, "{deviate} standard deviations: {counts:?}");
    // Within the row at the pole the points are uniform per solid angle: half of them below the middle of the cosine.
    let upper: Vec<f32> =
        values.chunks_exact(5).filter(|row| row[0] < WIDTH as f32).map(|row| row[4]).collect();
    let middle = 0.5 * (1.0 + (std::f64::consts::PI / HEIGHT as f64).cos()) as f32;
    let below = upper.iter().filter(|y| **y < middle).count() as f64;
    let spread = 0.5 * (upper.len() as f64).sqrt();
    assert!((below - 0.5 * upper.len() as f64).abs() < 4.0 * spread, "{below} of {}", upper.len());
}

#[test]
fn the_middle_column_is_seen_along_minus_z() {
    let directions =
        [[0.0_f32, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
    let body = "
        Scene scene = environment_scene();
        scene.environment_rotation_rad = 0.0;
        vec2 uv = environment_uv(scene, Vec3Table(inputs.at[0]).at[index]);
        write(0u, uv.x); write(1u, uv.y);";
    let mut session = session();
    let values = run(
        &mut session,
        &Snippet {
            includes: INCLUDES,
            functions: SCENE,
            body,
            values: 2,
            count: 5,
            inputs: &[bytes(&directions)],
            ..Snippet::default()
        },
    );
    let expected = [[0.5, 0.5], [0.75, 0.5], [0.5, 0.0], [0.5, 1.0]];
    for (row, expected) in values.chunks_exact(2).zip(expected) {
        assert!(
            (row[0] - expected[0]).abs() < 1e-6 && (row[1] - expected[1]).abs() < 1e-6,
            "{row:?} {expected:?}"
        );
    }
    let from_seam = (values[8] - values[8].round()).abs();
    assert!(from_seam < 1e-6, "behind is the seam: {}", values[8]);
}
