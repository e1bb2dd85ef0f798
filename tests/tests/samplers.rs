//! Every sampler through the renderer: the same picture, a reset with its reason. `error_table`, which is not run with the
//! others, prints what docs/samplers.md holds.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use caustica_renderer::delta::{Camera, Light, Material, SceneDelta};
use caustica_renderer::{Pipeline, Sampler, ViewSettings};
use caustica_tests::picture::rel_mse;
use caustica_tests::scene::{Scene, camera_at, lambert, quad, sphere};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

const EXTENT: [u32; 2] = [48, 32];
/// Of the reference alone.
const REFERENCE_SEED: u32 = 1000;

/// A ball on a floor under a square emitter and a spherical light: wide penumbrae, and every pixel is noisy.
fn area_lit() -> (SceneDelta, Camera) {
    let mut scene = Scene::new();
    let down = Affine3A::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let up = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(8.0, 8.0), lambert(0.6), up);
    scene.put(sphere(0.6, 32), lambert(0.8), Affine3A::from_translation(Vec3::new(0.0, 0.6, 0.0)));
    let emitter = Material { emissive: Vec3::splat(6.0), ..lambert(0.0) };
    scene.put(quad(1.5, 1.5), emitter, Affine3A::from_translation(Vec3::new(-0.8, 2.4, 0.3)) * down);
    scene.light(Light::Point {
        position: Vec3::new(1.6, 2.0, 1.0),
        intensity: Vec3::splat(3.0),
        radius_m: 0.4,
        range_m: f32::INFINITY,
    });
    (scene.delta, camera_at(Vec3::new(0.0, 1.6, 4.0), Vec3::new(0.0, 0.5, 0.0), 0.7))
}

fn studio() -> Studio {
    let settings = ViewSettings { pipeline: Pipeline::Hybrid, temporal: false, ..ViewSettings::default() };
    let (scene, camera) = area_lit();
    Studio::of(EXTENT, settings, &scene, camera)
}

fn mean(studio: &mut Studio, sampler: Sampler, seed: u32, samples: u64) -> Vec<[f32; 3]> {
    studio.set(|settings| (settings.sampler, settings.seed) = (sampler, seed));
    studio.view_mut().set_sample_target(Some(samples));
    studio.mean(samples).mean
}

#[test]
fn every_sampler_leads_to_the_same_picture() {
    let mut studio = studio();
    let brightness = |image: &[[f32; 3]]| image.iter().flatten().map(|x| f64::from(*x)).sum::<f64>();
    let reference = mean(&mut studio, Sampler::Sobol, REFERENCE_SEED, 128);
    for sampler in Sampler::ALL {
        let image = mean(&mut studio, sampler, 0, 32);
        let error = rel_mse(&image, &reference).sqrt();
        assert!(error < 0.06, "{sampler:?}: {error}");
        let ratio = brightness(&image) / brightness(&reference);
        // All pixels share their jitter, so independent numbers move the edges of the whole picture.
        let bound = if sampler == Sampler::Independent { 0.02 } else { 5e-3 };
        assert!((ratio - 1.0).abs() < bound, "{sampler:?}: {ratio} times as bright");
    }
}

#[test]
fn a_change_of_sampler_starts_again_and_says_so() {
    let mut studio = studio();
    studio.mean(3);
    studio.set(|settings| settings.sampler = Sampler::Halton);
    studio.frames(1);
    assert_eq!((studio.view().samples(), studio.statistics().reset_reason.as_str()), (1, "sampler"));
    // Only Hammersley sets are made for a number of samples.
    studio.frames(1);
    studio.view_mut().set_sample_target(Some(64));
    studio.frames(1);
    assert_eq!(studio.view().samples(), 3);
    studio.set(|settings| settings.sampler = Sampler::Hammersley);
    studio.frames(1);
    studio.view_mut().set_sample_target(Some(32));
    studio.frames(1);
    let figures = studio.statistics();
    assert_eq!((figures.samples, figures.reset_reason.as_str()), (1, "number of samples"));
    let text = serde_json::to_string(studio.view().settings()).expect("JSON");
    assert!(text.contains(r#""sampler":"hammersley""#), "{text}");
}

#[test]
#[ignore = "makes the table of docs/samplers.md, which takes minutes"]
fn error_table() {
    const SEEDS: u32 = 2;
    const SAMPLES: [u64; 3] = [16, 64, 256];
    let mut studio = studio();
    let reference = mean(&mut studio, Sampler::Sobol, REFERENCE_SEED, 4096);
    println!("| sampler | {} |", SAMPLES.map(|n| format!("{n} samples")).join(" | "));
    println!("|---|{}", "---|".repeat(SAMPLES.len()));
    for sampler in Sampler::ALL {
        let row = SAMPLES.map(|samples| {
            let of_seed = |seed| rel_mse(&mean(&mut studio, sampler, seed, samples), &reference);
            let error: f64 = (0..SEEDS).map(of_seed).sum::<f64>() / f64::from(SEEDS);
            format!("{:.2} %", error.sqrt() * 100.0)
        });
        println!("| {} | {} |", sampler.name(), row.join(" | "));
    }
}
