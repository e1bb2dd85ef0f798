//! Direct light: closed forms for every kind of lamp, and the other pipelines.

use std::f64::consts::PI;

use std::sync::Arc;

use caustica_renderer::delta::{Environment, Light, Material, RadianceMap, Visibility};
use caustica_renderer::{Accumulated, Pipeline, ViewSettings};
use caustica_tests::scene::{Scene, camera_at, cube, glass, lambert, mirror, point_light, quad};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

use super::{mean_and_error, settings, within};

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
        let bound = within(error, 2e-3 * expected, 5e-3 * expected);
        assert!((mean - expected).abs() < bound, "{name}: {mean} +- {error}, not {expected}");
    };
    let at = Vec3::new(0.0, 0.0, height as f32);
    let mut scene = Scene::new();
    scene.light(point_light(at, 3.0));
    near(floor_under(&mut scene, 16), 3.0 / height.powi(2), "point");

    let mut scene = Scene::new();
    let radius_m = 0.7;
    scene.light(Light::Point { position: at, intensity: Vec3::splat(3.0), radius_m, range_m: f32::INFINITY });
    near(floor_under(&mut scene, 64), 3.0 / height.powi(2), "sphere");

    // The floor is seen from the lamp at an angle between those of its cone, where the ramp is at two thirds.
    let mut scene = Scene::new();
    let direction = Vec3::new((1.0 - 0.9_f32 * 0.9).sqrt(), 0.0, -0.9);
    let (cos_inner, cos_outer) = (0.95, 0.8);
    let (intensity, range_m) = (Vec3::splat(3.0), f32::INFINITY);
    scene.light(Light::Spot {
        position: at,
        direction,
        intensity,
        radius_m: 0.0,
        range_m,
        cos_inner,
        cos_outer,
    });
    near(floor_under(&mut scene, 16), 3.0 / height.powi(2) * 4.0 / 9.0, "spot");

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

    // Bright above the horizon and dark below: the floor, which stands upright here, sees as much of the one as of the other.
    let mut scene = Scene::new();
    let rgb = (0..16 * 8).map(|i| [if i < 16 * 4 { 1.9 } else { 0.1 }; 3]).collect();
    let map = Arc::new(RadianceMap { name: String::from("map"), width: 16, height: 8, rgb });
    scene.delta.environment = Some(Environment::Equirectangular { map, rotation_rad: 0.0, scale: 0.7 });
    near(floor_under(&mut scene, 256), 0.7 * PI, "map");
}

/// Radiance that a camera above sees in the middle of a scene.
fn seen_from_above(scene: &Scene, pipeline: Pipeline) -> [f32; 3] {
    let camera = camera_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 0.01);
    let mut studio = Studio::of([8, 8], ViewSettings { pipeline, ..settings() }, &scene.delta, camera);
    let image = studio.mean(16).mean;
    [0, 1, 2].map(|c| image.iter().map(|pixel| pixel[c]).sum::<f32>() / image.len() as f32)
}

/// Glass that bends nothing, two metres thick: what light loses on its way is all there is to see of it.
#[test]
fn light_inside_of_glass_is_absorbed_as_far_as_it_goes() {
    let color = Vec3::new(0.2, 0.5, 0.9);
    let green = Material { attenuation_color: color, attenuation_distance_m: 1.0, ..glass(1.0) };
    let block = |at: Vec3, radius_m: f32| {
        let mut scene = Scene::new();
        scene.put(cube(2.0), green.clone(), Affine3A::from_translation(at));
        let intensity = Vec3::splat(3.0);
        scene.light(Light::Point { position: at, intensity, radius_m, range_m: f32::INFINITY });
        scene
    };
    let check = |scene: &Scene, pipeline: Pipeline, radiance: f64, way_m: f32, what: &str| {
        let found = seen_from_above(scene, pipeline);
        for (found, color) in found.into_iter().zip(color.to_array()) {
            let expected = radiance as f32 * color.powf(way_m);
            let off = (found / expected - 1.0).abs();
            assert!(off < 0.01, "{what}, {}: {found}, not {expected}", pipeline.name());
        }
    };
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced, Pipeline::Path] {
        // The lamp itself, in a mirror: the camera's own rays do not meet lamps.
        let mut scene = block(Vec3::X * 4.0, 0.3);
        scene.put(quad(2.0, 2.0), mirror(), Affine3A::from_rotation_y(std::f32::consts::FRAC_PI_4));
        check(&scene, pipeline, 3.0 / (PI * 0.09), 1.0 - 0.3, "a lamp within");

        // A floor beside the lamp: 0.8 m from the lamp to it, 1.8 m from there to the camera.
        let mut scene = block(Vec3::ZERO, 0.0);
        scene.put(quad(1.6, 1.6), lambert(0.5), Affine3A::from_translation(Vec3::Z * -0.8));
        check(&scene, pipeline, 0.5 / PI * 3.0 / 0.64, 0.8 + 1.8, "a floor within");

        // Glass without an end takes it all.
        let mut scene = Scene::new();
        scene.put(quad(2.0, 2.0), green.clone(), Affine3A::IDENTITY);
        scene.surround(1.0);
        assert_eq!(seen_from_above(&scene, pipeline), [0.0; 3], "{}", pipeline.name());
    }
    // A floor below the glass, which the camera does not see; paths cannot meet a lamp without size.
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced] {
        let mut scene = block(Vec3::ZERO, 0.0);
        let (_, glass) = scene.delta.instances.last_mut().expect("the glass");
        glass.visibility = Visibility { to_camera: false, ..Visibility::default() };
        scene.put(quad(6.0, 6.0), lambert(0.5), Affine3A::from_translation(Vec3::Z * -2.0));
        check(&scene, pipeline, 0.5 / PI * 3.0 / 4.0, 1.0, "a floor below");
    }
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
    assert!((all - sum).abs() < within(error, 0.0, 2e-3 * sum), "{all} +- {all_error}, not {sum}");
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
    scene.light(Light::Spot {
        position: Vec3::new(1.0, 2.0, 0.5),
        direction: Vec3::new(-0.4, -1.0, 0.0).normalize(),
        intensity: Vec3::splat(8.0),
        radius_m: 0.0,
        range_m: 6.0,
        cos_inner: 0.95,
        cos_outer: 0.85,
    });
    let camera = camera_at(Vec3::new(1.0, 1.6, 3.0), Vec3::new(0.0, 0.3, 0.0), 0.7);
    // Three lamps are drawn in turns in `path`: 512 samples bring that down to a few thousandths.
    let of = |pipeline: Pipeline, samples: u64| {
        let settings = ViewSettings { pipeline, jitter: false, path_depth: Some(0), ..settings() };
        Studio::of([64, 48], settings, &scene.delta, camera).mean(samples)
    };
    let [hybrid, raytraced] = [Pipeline::Hybrid, Pipeline::Raytraced].map(|pipeline| of(pipeline, 2));
    let path = of(Pipeline::Path, 512);
    assert!(difference(&hybrid, &raytraced) < 0.01, "{}", difference(&hybrid, &raytraced));
    let (mean, expected) = (mean_and_error(&path, 0), mean_and_error(&hybrid, 0).0);
    assert!((mean.0 / expected - 1.0).abs() < 2e-3, "{mean:?}, not {expected}");
    let pairs = path.mean.iter().zip(&hybrid.mean);
    let dark = pairs.clone().filter(|(_, q)| q[0] == 0.0);
    assert!(dark.clone().count() > 20, "{} pixels lie in the shadow of all lamps", dark.count());
    assert!(dark.clone().all(|(p, _)| p[0] == 0.0), "no lamp reaches them in `path` either");
    let squares =
        pairs.map(|(p, q)| (f64::from(p[0]) - f64::from(q[0])).powi(2)).sum::<f64>() / path.mean.len() as f64;
    assert!(squares.sqrt() < 0.01, "a pixel is {} off", squares.sqrt());
}
