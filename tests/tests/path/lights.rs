//! Direct light: closed forms for every kind of lamp, and the other pipelines.

use std::f64::consts::PI;

use caustica_renderer::delta::{Light, Material};
use caustica_renderer::{Accumulated, Pipeline, ViewSettings};
use caustica_tests::scene::{Scene, camera_at, cube, lambert, point_light, quad};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

use super::{mean_and_error, settings};

/// The middle of a white floor as the camera above sees it, with this many samples.
fn floor_under(scene: &mut Scene, samples: u64) -> (f64, f64) {
    scene.put(quad(4.0, 4.0), lambert(1.0), Affine3A::IDENTITY);
    let camera = camera_at(Vec3::new(0.0, -0.05, 0.5), Vec3::ZERO, 0.01);
    let mut studio = Studio::of([16, 16], settings(), &scene.delta, camera);
    studio.set(|settings| settings.path_depth = Some(0));
    mean_and_error(&studio.mean(samples), 0)
}

#[test]
fn each_kind_of_lamp_gives_its_irradiance() {
    // E / pi is what a white floor shows.
    let height = 2.0_f64;
    let near = |(mean, error): (f64, f64), irradiance: f64, name: &str| {
        let expected = irradiance / PI;
        assert!(
            (mean - expected).abs() < 4.0 * error + 2e-3 * expected,
            "{name}: {mean} +- {error}, not {expected}"
        );
    };
    let at = Vec3::new(0.0, 0.0, height as f32);
    let mut scene = Scene::new();
    scene.light(point_light(at, 3.0));
    near(floor_under(&mut scene, 16), 3.0 / height.powi(2), "point");

    let mut scene = Scene::new();
    let radius_m = 0.7;
    scene.light(Light::Point { position: at, intensity: Vec3::splat(3.0), radius_m, range_m: f32::INFINITY });
    near(floor_under(&mut scene, 64), 3.0 / height.powi(2), "sphere");

    let mut scene = Scene::new();
    let (direction, irradiance) = (Vec3::NEG_Z, Vec3::splat(1.5));
    scene.light(Light::Directional { direction, irradiance, angular_radius_rad: 0.05 });
    near(floor_under(&mut scene, 64), 1.5, "sun");

    let mut scene = Scene::new();
    let lamp = Material { emissive: Vec3::splat(4.0), ..lambert(0.0) };
    let down = Affine3A::from_translation(at) * Affine3A::from_rotation_x(std::f32::consts::PI);
    scene.put(quad(2.0, 2.0), lamp, down);
    // Form factor of a square seen from below its middle (four corners of a rectangle a x b at distance c).
    let x = 1.0 / height;
    let root = (1.0 + x * x).sqrt();
    let corner = (x / root * (x / root).atan() * 2.0) / (2.0 * PI);
    near(floor_under(&mut scene, 64), 4.0 * PI * 4.0 * corner, "panel");

    let mut scene = Scene::new();
    scene.surround(0.7);
    near(floor_under(&mut scene, 64), 0.7 * PI, "surroundings");
}

/// More lights than rays are compared with: drawn only, and the mean is the same.
#[test]
fn many_lamps_are_the_sum_of_the_few() {
    let positions = |i: u32| Vec3::new((i % 5) as f32 * 0.4 - 0.8, (i / 5) as f32 * 0.4 - 0.8, 1.5);
    let floor = |range: std::ops::Range<u32>| {
        let mut scene = Scene::new();
        for i in range {
            scene.light(Light::Point {
                position: positions(i),
                intensity: Vec3::splat(1.0 + i as f32),
                radius_m: 0.1,
                range_m: f32::INFINITY,
            });
        }
        floor_under(&mut scene, 256)
    };
    let (all, all_error) = floor(0..25);
    let parts: Vec<_> = [0..9, 9..18, 18..25].into_iter().map(floor).collect();
    let sum: f64 = parts.iter().map(|(mean, _)| mean).sum();
    let error = parts.iter().map(|(_, e)| e * e).sum::<f64>().sqrt() + all_error;
    assert!((all - sum).abs() < 4.0 * error, "{all} +- {all_error}, not {sum}");
}

fn difference(a: &Accumulated, b: &Accumulated) -> f64 {
    let of = |p: &[f32; 3], q: &[f32; 3]| (0..3).map(|c| f64::from((p[c] - q[c]).abs())).fold(0.0, f64::max);
    let differing = a.mean.iter().zip(&b.mean).filter(|(p, q)| of(p, q) > 1e-3).count();
    differing as f64 / a.mean.len() as f64
}

#[test]
fn all_ray_pipelines_agree_on_direct_light_with_hard_shadows() {
    let mut scene = Scene::new();
    scene.put(quad(6.0, 6.0), lambert(0.6), Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2));
    scene.put(cube(0.8), lambert(0.4), Affine3A::from_translation(Vec3::new(0.2, 0.4, 0.0)));
    scene.light(point_light(Vec3::new(-1.0, 2.0, 1.5), 6.0));
    let direction = Vec3::new(0.3, -1.0, -0.4).normalize();
    scene.light(Light::Directional { direction, irradiance: Vec3::splat(0.8), angular_radius_rad: 0.0 });
    let camera = camera_at(Vec3::new(1.0, 1.6, 3.0), Vec3::new(0.0, 0.3, 0.0), 0.7);
    // Two lamps are drawn in turns in `path`: 512 samples bring that down to a few thousandths.
    let of = |pipeline: Pipeline, samples: u64| {
        let settings = ViewSettings { pipeline, jitter: false, path_depth: Some(0), ..settings() };
        Studio::of([64, 48], settings, &scene.delta, camera).mean(samples)
    };
    let [hybrid, raytraced] = [Pipeline::Hybrid, Pipeline::Raytraced].map(|pipeline| of(pipeline, 2));
    let path = of(Pipeline::Path, 512);
    assert!(difference(&hybrid, &raytraced) < 0.01, "{}", difference(&hybrid, &raytraced));
    let (mean, expected) = (mean_and_error(&path, 0), mean_and_error(&hybrid, 0).0);
    assert!((mean.0 / expected - 1.0).abs() < 2e-3, "{mean:?}, not {expected}");
    let squares: f64 = path
        .mean
        .iter()
        .zip(&hybrid.mean)
        .zip(&path.half_difference)
        .filter(|((_, q), d)| q[0] > 0.0 && d[0] != 0.0)
        .map(|((p, q), _)| (f64::from(p[0]) - f64::from(q[0])).powi(2))
        .sum::<f64>()
        / path.mean.len() as f64;
    assert!(squares.sqrt() < 0.01, "a pixel is {} off", squares.sqrt());
}
