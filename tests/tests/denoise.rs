//! Denoising: less noise at little bias, also of what mirrors show while the camera moves; nothing of the past where
//! something else is seen now; and nothing at all of it when it is off.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use caustica_renderer::delta::{Camera, InstanceId, Light, Material, SceneDelta};
use caustica_renderer::{Pipeline, ReflectionRate, ShadowRate, ViewSettings};
use caustica_tests::picture::rel_mse;
use caustica_tests::scene::{Scene, camera_at, checker, lambert, mirror, plain_use, quad, zoo};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

const EXTENT: [u32; 2] = [96, 64];

/// One sample a frame, without jitter: edges and textures are the same in all frames, and noise is all that differs.
fn settings(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, jitter: false, ..ViewSettings::default() }
}

fn still(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { temporal: false, ..settings(pipeline) }
}

fn mean_of(image: &[[f32; 3]]) -> f64 {
    image.iter().flatten().map(|x| f64::from(*x)).sum::<f64>() / (image.len() * 3) as f64
}

/// Denoised frames of one sample each are at least `gains` times nearer to the mean of many than one sample is, the first
/// frame and the one after some, and no brighter or darker than by `bias_max`.
fn one_sample_gains(pipeline: Pipeline, samples: u64, gains: [f64; 2], bias_max: f64) {
    let (scene, camera) = zoo();
    let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera);
    let noisy = studio.mean(1).mean;
    let reference = studio.mean(samples).mean;
    let before = rel_mse(&noisy, &reference);
    studio.set(|settings| settings.denoise_stills = true);
    for (frames, gain) in [1, 7].into_iter().zip(gains) {
        studio.frames(frames);
        let filtered = studio.read_frame();
        let after = rel_mse(&filtered, &reference);
        let bias = mean_of(&filtered) / mean_of(&reference) - 1.0;
        let what =
            format!("{}: relMSE {before:.4} -> {after:.4}, mean {:+.2} %", pipeline.name(), bias * 100.0);
        println!("{what}");
        assert!(after * gain <= before, "{what}");
        assert!(bias.abs() < bias_max, "{what}");
    }
}

#[test]
fn denoised_frames_of_hybrid_are_nearer_to_the_mean() {
    one_sample_gains(Pipeline::Hybrid, 48, [1.7, 4.0], 0.01);
}

#[test]
fn denoised_frames_of_paths_are_nearer_to_the_mean() {
    // Most of the light comes by few samples, of which the first frame has one a pixel.
    one_sample_gains(Pipeline::Path, 64, [4.0, 4.0], 0.04);
}

/// A floor under a large lamp with a board over it, seen by a mirror that fills the image: its soft shadow is
/// everything there is.
fn shadow_in_mirror() -> (Scene, InstanceId) {
    let mut scene = Scene::new();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(40.0, 40.0), lambert(0.7), lying);
    let board = Material { double_sided: true, ..lambert(0.5) };
    let above = Affine3A::from_translation(Vec3::new(0.0, 0.9, 0.0)) * lying;
    let board = scene.put(quad(1.2, 1.2), board, above);
    let facing = Affine3A::from_translation(Vec3::new(0.0, 1.5, -2.0));
    scene.put(quad(30.0, 3.0), Material { double_sided: true, ..mirror() }, facing);
    scene.light(Light::Point {
        position: Vec3::new(0.0, 3.0, 0.5),
        intensity: Vec3::splat(20.0),
        radius_m: 0.5,
        range_m: f32::INFINITY,
    });
    (scene, board)
}

fn passing_by(x: f32) -> Camera {
    camera_at(Vec3::new(x, 1.6, 2.5), Vec3::new(x, 0.6, -2.0), 0.6)
}

/// Radiance after `frames` frames in which the camera moves to `x` = 0.
fn while_moving(studio: &mut Studio, frames: u16) -> Vec<[f32; 3]> {
    for i in (0..frames).rev() {
        studio.view_mut().set_camera(passing_by(0.02 * f32::from(i)));
        studio.frames(1);
    }
    studio.read_frame()
}

#[test]
fn a_soft_shadow_in_a_mirror_converges_while_the_camera_moves() {
    let (scene, _) = shadow_in_mirror();
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, passing_by(0.0));
    let noisy = studio.mean(1).mean;
    let reference = studio.mean(96).mean;
    let before = rel_mse(&noisy, &reference);
    let (full, half) = (ReflectionRate::Full, ReflectionRate::Half);
    for (spatial, rate) in [(false, full), (true, full), (true, half)] {
        studio.set(|settings| (settings.spatial, settings.reflection_rate) = (spatial, rate));
        studio.view_mut().set_camera(passing_by(1.0));
        studio.frames(1);
        let moved = while_moving(&mut studio, 16);
        assert_eq!(studio.view().samples(), 0, "every frame moved");
        let after = rel_mse(&moved, &reference);
        let what = format!("spatial {spatial}, {rate:?}: relMSE {before:.5} -> {after:.5}");
        println!("{what}");
        assert!(after * 3.0 <= before, "{what}");
    }
}

/// The first frame of another size is better than one without a past.
#[test]
fn a_view_of_another_size_goes_on_with_its_light() {
    let (scene, _) = shadow_in_mirror();
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, passing_by(0.0));
    for extent in [[64, 43], [128, 85]] {
        studio.set(|settings| settings.denoise_stills = false);
        studio.view_mut().resize(extent);
        let reference = studio.mean(48).mean;
        studio.set(|settings| settings.denoise_stills = true);
        let mut error_after = |frames| {
            studio.frames(frames);
            rel_mse(&studio.read_frame(), &reference)
        };
        let (first, later) = (error_after(1), error_after(12));
        studio.view_mut().resize(EXTENT);
        studio.set(|settings| settings.seed += 1);
        studio.frames(12);
        studio.view_mut().resize(extent);
        studio.frames(1);
        let resized = rel_mse(&studio.read_frame(), &reference);
        let what =
            format!("{extent:?}: relMSE {first:.4}, later {later:.4}, after another size {resized:.4}");
        println!("{what}");
        assert!(resized < 0.75 * first, "{what}");
    }
}

/// A board that was in front of the camera leaves nothing behind in the frame after it went, on the wall or in its image.
#[test]
fn what_was_hidden_has_no_past() {
    let mut scene = Scene::new();
    scene.put(quad(8.0, 8.0), lambert(0.6), Affine3A::from_translation(Vec3::new(0.0, 0.0, -3.0)));
    let shining = Material { double_sided: true, ..lambert(0.02) };
    let board = scene.put(quad(1.0, 4.0), shining, Affine3A::IDENTITY);
    scene.light(Light::Point {
        position: Vec3::new(0.0, 2.0, 4.0),
        intensity: Vec3::splat(100.0),
        radius_m: 0.2,
        range_m: f32::INFINITY,
    });
    let camera = camera_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 0.7);
    let away = SceneDelta {
        transforms: vec![(board, Affine3A::from_translation(Vec3::new(60.0, 0.0, 0.0)))],
        reason: String::from("moved"),
        ..SceneDelta::default()
    };
    for pipeline in [Pipeline::Hybrid, Pipeline::Path] {
        let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera);
        for i in 0..8 {
            let near = Affine3A::from_translation(Vec3::new(0.0, 0.001 * i as f32, 0.0));
            studio.frame(&SceneDelta { transforms: vec![(board, near)], ..away.clone() });
        }
        studio.frame(&away);
        assert_eq!(studio.view().samples(), 0);
        let after = studio.read_frame();
        let expected = studio.mean(64).mean;
        let centre = (EXTENT[1] / 2 * EXTENT[0] + EXTENT[0] / 2) as usize;
        let (seen, wanted) = (f64::from(after[centre][1]), f64::from(expected[centre][1]));
        assert!((seen / wanted - 1.0).abs() < 0.1, "{}: {seen} instead of {wanted}", pipeline.name());
    }
}

/// A mirror that fills the image, and in it a checkered wall and a bright lamp.
fn wall_in_mirror(silver: Material) -> Scene {
    let mut scene = Scene::new();
    scene.put(quad(6.0, 4.0), silver, Affine3A::IDENTITY);
    let texture = scene.texture(checker(3, 90, 230));
    let wall = Material { base_color_texture: Some(plain_use(texture)), ..lambert(1.0) };
    let behind = Affine3A::from_translation(Vec3::Z * 6.0);
    scene.put(quad(14.0, 10.0), wall, behind * Affine3A::from_rotation_y(std::f32::consts::PI));
    scene.light(Light::Point {
        position: Vec3::new(0.5, 0.3, 4.0),
        intensity: Vec3::splat(40.0),
        radius_m: 0.2,
        range_m: f32::INFINITY,
    });
    scene
}

/// Share of the pixels that are more than a fifth off.
fn share_off(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let off = |(x, r): &(&[f32; 3], &[f32; 3])| (x[1] - r[1]).abs() > 0.2 * r[1];
    image.iter().zip(reference).filter(off).count() as f64 / image.len() as f64
}

/// Whether it is a mirror by its mode or by glTF's values; with jitter.
#[test]
fn what_a_mirror_shows_stays_sharp() {
    let metal = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    let scenes =
        [("mirror", mirror()), ("metal", metal)].map(|(name, silver)| (name, wall_in_mirror(silver)));
    let camera = camera_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 0.7);
    for pipeline in [Pipeline::Hybrid, Pipeline::Path] {
        // Cut, so that no path looks for the lamp by way of the wall and the mirror.
        let jittered = ViewSettings { jitter: true, path_depth: Some(1), ..settings(pipeline) };
        let mut studio = Studio::new(EXTENT, jittered);
        for (name, scene) in &scenes {
            studio.restage(&scene.delta, camera);
            studio.set(|settings| settings.denoise_stills = false);
            let reference = studio.mean(64).mean;
            let lamp = reference.iter().filter(|pixel| pixel[1] > 10.0).count();
            assert!(lamp > 20, "{lamp} pixels show the lamp");
            studio.set(|settings| settings.denoise_stills = true);
            let off = share_off(&studio.mean(12).mean, &reference);
            println!("{name}, {}: {off:.4} of the pixels are off", pipeline.name());
            assert!(off < 0.005, "{name}, {}: {off}", pipeline.name());
        }
    }
}

#[test]
fn nothing_is_denoised_when_it_is_off() {
    let (scene, _) = shadow_in_mirror();
    let run = |settings| {
        let mut studio = Studio::of(EXTENT, settings, &scene.delta, passing_by(0.0));
        let mean = studio.mean(3).mean;
        (mean, studio.statistics())
    };
    let ((off, figures), (on, figures_on)) = (run(still(Pipeline::Hybrid)), run(settings(Pipeline::Hybrid)));
    assert_eq!(off, on, "a view that stands still is the mean of its samples");
    for what in ["temporal denoising", "spatial denoising"] {
        assert!(figures.left_out.iter().any(|left| left.what == what), "{what} is listed as left out");
        assert!(figures_on.left_out.iter().all(|left| left.what != what), "{what} is used");
    }
    let bytes = |memory: &[(String, u64)]| memory.iter().map(|(_, bytes)| *bytes).sum::<u64>();
    assert!(bytes(&figures.memory) < bytes(&figures_on.memory), "targets of the denoiser are not made");
}

/// A floor under a large lamp with a board over it, from above: light, penumbra, shadow.
fn shadow_on_floor() -> (Scene, InstanceId) {
    let mut scene = Scene::new();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(20.0, 20.0), lambert(0.7), lying);
    let board = Material { double_sided: true, ..lambert(0.5) };
    let board = scene.put(quad(1.2, 1.2), board, lifted(0.0) * lying);
    scene.light(Light::Point {
        position: Vec3::new(0.0, 3.0, 0.0),
        intensity: Vec3::splat(20.0),
        radius_m: 0.3,
        range_m: f32::INFINITY,
    });
    (scene, board)
}

fn lifted(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(x, 1.0, 0.0))
}

fn above(x: f32) -> Camera {
    camera_at(Vec3::new(x, 5.0, 3.0), Vec3::new(x, 0.0, 0.0), 0.9)
}

/// Means of 4 x 4 pixels, green.
fn blocks(image: &[[f32; 3]]) -> Vec<f64> {
    let [width, height] = EXTENT.map(|side| side as usize);
    let block = |x: usize, y: usize| {
        let rows = (4 * y..4 * y + 4).map(|row| &image[row * width + 4 * x..][..4]);
        rows.flatten().map(|pixel| f64::from(pixel[1])).sum::<f64>() / 16.0
    };
    (0..height / 4).flat_map(|y| (0..width / 4).map(move |x| (x, y))).map(|(x, y)| block(x, y)).collect()
}

/// Largest difference of means of 4 x 4 pixels, and that of the means of all, by the brightest mean.
fn off(image: &[[f32; 3]], expected: &[[f32; 3]]) -> [f64; 2] {
    let (image_blocks, expected_blocks) = (blocks(image), blocks(expected));
    let brightest = expected_blocks.iter().copied().fold(0.0, f64::max);
    let differences = image_blocks.iter().zip(&expected_blocks).map(|(x, r)| (x - r).abs());
    let largest = differences.fold(0.0, f64::max);
    [largest / brightest, (mean_of(image) - mean_of(expected)).abs() / brightest]
}

/// Where the rarer of light and shadow has chance p, no ray is traced when none of the n >= 9 that are remembered met it,
/// so that p (1 - p)^n of the light is missing or too much: at most 0.039.
const KNOWN_SHADOWS_OFF_MAX: f64 = 0.04;

/// The pictures of both rates after `frames`, and the rays of the last frame. Each is of a new view, so that both have the
/// same random numbers.
fn both_rates(studio: &mut Studio, frames: impl Fn(&mut Studio)) -> [(Vec<[f32; 3]>, u64); 2] {
    [ShadowRate::Full, ShadowRate::Penumbra].map(|rate| {
        let settings = ViewSettings { shadow_rate: rate, ..studio.view().settings().clone() };
        studio.renderer.remove_view(studio.view);
        studio.view = studio.renderer.create_view(EXTENT, settings, false).expect("a view");
        studio.view_mut().set_camera(above(0.0));
        frames(studio);
        studio.read();
        let rays = studio.statistics().shadow_rays;
        (studio.read_frame(), rays)
    })
}

#[test]
fn shadow_rays_in_penumbrae_alone_give_the_same_picture() {
    let (scene, _) = shadow_on_floor();
    let settings = ViewSettings { spatial: false, denoise_stills: true, ..settings(Pipeline::Hybrid) };
    let mut studio = Studio::of(EXTENT, settings, &scene.delta, above(0.0));
    let still = |studio: &mut Studio| studio.frames(24);
    let drive = |studio: &mut Studio| {
        for i in (0..24_u8).rev() {
            studio.view_mut().set_camera(above(0.013 * f32::from(i)));
            studio.frames(1);
        }
    };
    studio.set(|settings| settings.shadow_rate = ShadowRate::Penumbra);
    studio.frames(1);
    studio.read();
    let all_rays = studio.statistics().shadow_rays;
    for (what, frames) in [("still", &still as &dyn Fn(&mut Studio)), ("the camera moves", &drive)] {
        let [(full, _), (known, rays)] = both_rates(&mut studio, frames);
        let [worst, mean] = off(&known, &full);
        println!("{what}: {rays} of {all_rays} rays, 4 x 4 means within {worst:.4}, all within {mean:.5}");
        // Both are estimates from about 96 pixels.
        assert!(rays * 2 < all_rays && rays * 16 > all_rays, "{what}: {rays} of {all_rays} rays");
        assert!(worst < KNOWN_SHADOWS_OFF_MAX && mean < 0.002, "{what}: {worst} {mean}");
    }
}

/// All rays are traced in a frame in which the scene changes, so that a shadow is where it belongs in that frame and stays
/// there in the next ones, while the camera moves on.
#[test]
fn a_shadow_that_moves_is_there_at_once() {
    let (scene, board) = shadow_on_floor();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let put = |x: f32| SceneDelta {
        transforms: vec![(board, lifted(x) * lying)],
        reason: String::from("moved"),
        ..SceneDelta::default()
    };
    let settings = ViewSettings { spatial: false, ..settings(Pipeline::Hybrid) };
    let mut studio = Studio::of(EXTENT, settings, &scene.delta, above(0.0));
    for after in 0..4_u16 {
        let pictures = both_rates(&mut studio, |studio| {
            studio.frame(&put(0.0));
            let drive = |studio: &mut Studio, frames: u16| {
                for i in 0..frames {
                    studio.view_mut().set_camera(above(0.01 * f32::from(i + 1)));
                    studio.frames(1);
                }
            };
            drive(studio, 12);
            studio.frame(&put(1.0));
            drive(studio, after);
            assert_eq!(studio.view().samples(), 0, "every frame moved");
        });
        let [(full, _), (known, _)] = pictures;
        let [worst, mean] = off(&known, &full);
        println!("{after} frames after: 4 x 4 means within {worst:.4}, all within {mean:.5}");
        assert!(worst < KNOWN_SHADOWS_OFF_MAX && mean < 0.002, "{after} frames after: {worst} {mean}");
    }
}
