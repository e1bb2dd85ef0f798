//! A checkered plane to the horizon: texture levels of camera rays and raster agree with each other, and those of ray cones behind a
//! mirror with both.

use std::f32::consts::{FRAC_PI_2, PI};

use caustica_renderer::delta::{Camera, Material, TextureUse};
use caustica_renderer::{Accumulated, Pipeline, ViewSettings};
use caustica_tests::picture::differing;
use caustica_tests::scene::{Scene, camera_at, checker, mirror, plain_use, quad, unlit};
use caustica_tests::shapes::at;
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec2, Vec3};

const EXTENT: [u32; 2] = [128, 96];
const EYE_M: f32 = 1.5;
/// Of the plane, metres; the texture has 8 cells and covers 4.
const SIDE_M: f32 = 800.0;
/// Radiance of the dark and the light cells: 40 and 230 of sRGB.
const LOW: f32 = 0.020_997;
const HIGH: f32 = 0.791_298;
/// Rows from the horizon down in which many cells share a pixel.
const FAR: usize = 4;

fn plane() -> Scene {
    let mut scene = Scene::new();
    let texture = scene.texture(checker(8, 40, 230));
    let repeated = TextureUse { scale: Vec2::splat(SIDE_M / 4.0), ..plain_use(texture) };
    let checks = Material { base_color_texture: Some(repeated), ..unlit(Vec3::ONE) };
    scene.put(quad(SIDE_M, SIDE_M), checks, Affine3A::from_rotation_x(-FRAC_PI_2));
    scene
}

/// Looks along `forward`, a little down, from 1.5 m above the plane at `z`.
fn walker(z: f32, forward: f32) -> Camera {
    let eye = Vec3::new(0.0, EYE_M, z);
    camera_at(eye, eye + Vec3::new(0.0, -0.15, forward), 0.9)
}

fn still(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, jitter: false, ..ViewSettings::default() }
}

/// Mean and deviation of each row of pixels, from the horizon down to the feet.
fn rows(image: &Accumulated) -> Vec<(f32, f32)> {
    let width = EXTENT[0] as usize;
    let row = |y: usize| {
        let pixels = &image.mean[y * width..(y + 1) * width];
        let mean = pixels.iter().map(|p| p[0]).sum::<f32>() / width as f32;
        let square = pixels.iter().map(|p| (p[0] - mean).powi(2)).sum::<f32>() / width as f32;
        (mean, square.sqrt())
    };
    (first_row()..EXTENT[1] as usize).map(row).collect()
}

/// The first row whose centre looks below the horizon at less than 300 m.
fn first_row() -> usize {
    let down = |y: usize| {
        let ndc = (y as f32 + 0.5) * 2.0 / EXTENT[1] as f32 - 1.0;
        (ndc * 0.45_f32.tan()).atan() + 0.15_f32.atan()
    };
    (0..EXTENT[1] as usize).find(|y| down(*y) > EYE_M / 300.0).unwrap_or(0)
}

#[test]
fn raster_and_ray_primaries_agree_up_to_the_horizon() {
    let scene = plane();
    let mut studio = Studio::of(EXTENT, still(Pipeline::Raster), &scene.delta, walker(0.0, -1.0));
    let raster = studio.mean(1);
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced] {
        studio.set(|settings| settings.pipeline = pipeline);
        let count = differing(&raster, &studio.mean(1), 2e-3);
        assert!(count <= 12, "{}: {count} pixels differ", pipeline.name());
    }
    studio.set(|settings| settings.jitter = true);
    assert!(
        differing(&raster, &studio.mean(1), 2e-3) > 1000,
        "another place in the pixel shows other texels"
    );
    // Where a cell is far below a pixel, all that is left is the mean of both colours.
    for (row, (mean, deviation)) in rows(&raster)[..FAR].iter().enumerate() {
        assert!((mean - 0.5 * (LOW + HIGH)).abs() < 0.01, "row {row}: {mean}");
        assert!(*deviation < 0.02 * (HIGH - LOW), "row {row}: {deviation}");
    }
}

#[test]
fn ray_cones_behind_a_mirror_see_what_the_camera_would_see_there() {
    let mut scene = plane();
    let facing = at(0.0, 0.0, 1.0) * Affine3A::from_rotation_y(PI);
    scene.put(quad(400.0, 400.0), mirror(), facing);
    for pipeline in [Pipeline::Hybrid, Pipeline::Path] {
        let settings = still(pipeline);
        let direct = Studio::of(EXTENT, settings.clone(), &plane().delta, walker(2.0, -1.0)).mean(1);
        let mirrored = Studio::of(EXTENT, settings, &scene.delta, walker(0.0, 1.0)).mean(1);
        for (row, (seen, expected)) in rows(&mirrored).iter().zip(rows(&direct)).enumerate() {
            let told = format!("{} {row}: {seen:?} {expected:?}", pipeline.name());
            assert!((seen.0 - expected.0).abs() < 0.01 * (HIGH - LOW), "{told}");
            // The camera's own rays: in `path` cones too, in `hybrid` gradients, which blur more along the footprint's long axis.
            let sharper = if pipeline == Pipeline::Path { 0.01 } else { 0.4 };
            let (least, most) = (expected.1 - 0.01, expected.1 + sharper * (HIGH - LOW));
            assert!(least < seen.1 && seen.1 < most, "{told}");
            assert!(row >= FAR || seen.1 < 0.02 * (HIGH - LOW), "{told}");
        }
    }
}
