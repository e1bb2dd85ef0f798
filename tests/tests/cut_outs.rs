//! Surfaces with holes and surfaces that are there in part: what light they let pass, against closed forms, and what opaque scenes
//! are spared.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::f32::consts::{FRAC_PI_2, PI};

use caustica_renderer::delta::{AlphaMode, Camera, Material, Texture, Visibility};
use caustica_renderer::{Pipeline, ViewSettings};
use caustica_tests::picture::mean_of;
use caustica_tests::scene::{Scene, camera_at, checker, lambert, plain_use, point_light, quad};
use caustica_tests::shapes::at;
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec2, Vec3, Vec4};

const EXTENT: [u32; 2] = [64, 64];
const LAMP_M: f32 = 2.0;
const INTENSITY: f32 = 8.0;
const ALBEDO: f32 = 0.6;
/// Of the hole, in units of the texture, which covers one metre.
const HOLE: f32 = 0.3;
const TEXELS: u32 = 64;

/// A screen of one metre with a round hole, 1 m above the floor and 1 m below a lamp, which the camera does not see.
fn under_a_screen(material: impl FnOnce(&mut Scene) -> Material) -> (Scene, Camera) {
    let lying = Affine3A::from_rotation_x(-FRAC_PI_2);
    let mut scene = Scene::new();
    scene.put(quad(4.0, 4.0), lambert(ALBEDO), lying);
    let material = material(&mut scene);
    scene.put(quad(1.0, 1.0), material, at(0.0, 1.0, 0.0) * lying);
    let screen = &mut scene.delta.instances.last_mut().expect("the screen").1;
    screen.visibility = Visibility { to_camera: false, ..Visibility::default() };
    scene.light(point_light(Vec3::Y * LAMP_M, INTENSITY));
    (scene, camera_at(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, 0.9))
}

fn holed(scene: &mut Scene) -> Material {
    let middle = Vec2::splat(0.5 * TEXELS as f32);
    let alpha = |i: u32| {
        let texel = Vec2::new((i % TEXELS) as f32 + 0.5, (i / TEXELS) as f32 + 0.5);
        if texel.distance(middle) < HOLE * TEXELS as f32 { 0 } else { 255 }
    };
    let rgba8 = (0..TEXELS * TEXELS).flat_map(|i| [255, 255, 255, alpha(i)]).collect();
    let texture = scene.texture(Texture {
        name: String::from("hole"),
        width: TEXELS,
        height: TEXELS,
        rgba8,
        ..checker(1, 0, 0)
    });
    Material {
        base_color_texture: Some(plain_use(texture)),
        alpha: AlphaMode::Mask { cutoff: 0.5 },
        double_sided: true,
        ..lambert(0.5)
    }
}

/// Where on the floor, metres, a pixel's centre looks.
fn floor_at(pixel: usize) -> Vec2 {
    let side = EXTENT[0] as usize;
    let ndc = Vec2::new((pixel % side) as f32 + 0.5, (pixel / side) as f32 + 0.5) * (2.0 / side as f32) - 1.0;
    ndc * 3.0 * 0.45_f32.tan()
}

/// Radiance of the floor where the lamp shines on it.
fn lit(point: Vec2) -> f32 {
    let square = point.length_squared() + LAMP_M * LAMP_M;
    ALBEDO / PI * INTENSITY * LAMP_M / square.powf(1.5)
}

fn still(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, jitter: false, path_depth: Some(1), ..ViewSettings::default() }
}

#[test]
fn light_falls_through_a_hole_where_geometry_says() {
    let (scene, camera) = under_a_screen(holed);
    let mut studio = Studio::of(EXTENT, still(Pipeline::Hybrid), &scene.delta, camera);
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced, Pipeline::Path] {
        studio.set(|settings| settings.pipeline = pipeline);
        let image = studio.mean(1);
        let (mut bright, mut dark) = (0, 0);
        for (pixel, found) in image.mean.iter().enumerate() {
            let point = floor_at(pixel);
            // The shadow is twice as large as the screen.
            let (to_hole, to_rim) = (point.length() - 2.0 * HOLE, point.abs().max_element() - 1.0);
            if to_hole.abs() < 2.0 / TEXELS as f32 || to_rim.abs() < 1e-3 {
                continue; // within a texel of the edge, which is filtered
            }
            let shines = to_hole < 0.0 || to_rim > 0.0;
            let expected = if shines { lit(point) } else { 0.0 };
            let off = (found[0] - expected).abs();
            // Half precision holds the direct light.
            assert!(off <= 1e-3 * lit(point), "{}: {point}: {found:?}, {expected}", pipeline.name());
            *if shines { &mut bright } else { &mut dark } += 1;
        }
        assert!(bright > 500 && dark > 500, "{bright} {dark}");
    }
}

#[test]
fn what_is_there_in_part_lets_its_share_of_the_light_pass() {
    const COVERAGE: f32 = 0.3;
    const SAMPLES: u64 = 64;
    let (scene, camera) = under_a_screen(|_| Material {
        base_color: Vec4::new(0.5, 0.5, 0.5, COVERAGE),
        alpha: AlphaMode::Blend,
        double_sided: true,
        ..lambert(0.5)
    });
    let mut studio = Studio::of(EXTENT, still(Pipeline::Hybrid), &scene.delta, camera);
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced, Pipeline::Path] {
        studio.set(|settings| settings.pipeline = pipeline);
        let image = studio.mean(SAMPLES);
        let shares: Vec<f64> = (0..image.mean.len())
            .filter(|pixel| floor_at(*pixel).abs().max_element() < 0.95)
            .map(|pixel| f64::from(image.mean[pixel][0] / lit(floor_at(pixel))))
            .collect();
        let count = shares.len() as f64;
        let mean = shares.iter().sum::<f64>() / count;
        let expected = f64::from(1.0 - COVERAGE);
        let deviation = (expected * (1.0 - expected) / (count * SAMPLES as f64)).sqrt();
        assert!((mean - expected).abs() < 4.0 * deviation, "{}: {mean} +- {deviation}", pipeline.name());
        let variance = shares.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / count;
        assert!(variance > 0.0 && variance < 2.0 / SAMPLES as f64, "{}: {variance}", pipeline.name());
    }
}

/// An emitter over the floor, which the camera does not see, lights it as far as it is there.
#[test]
fn what_is_there_in_part_shines_in_part() {
    const COVERAGE: f32 = 0.3;
    const PIPELINES: [Pipeline; 2] = [Pipeline::Hybrid, Pipeline::Path];
    let lit_by = |alpha: AlphaMode| {
        let (mut scene, camera) = under_a_screen(|_| Material {
            base_color: Vec4::new(0.0, 0.0, 0.0, COVERAGE),
            emissive: Vec3::splat(5.0),
            alpha,
            double_sided: true,
            ..lambert(0.0)
        });
        scene.delta.lights.clear();
        let mut studio = Studio::of(EXTENT, still(Pipeline::Hybrid), &scene.delta, camera);
        PIPELINES.map(|pipeline| {
            studio.set(|settings| settings.pipeline = pipeline);
            mean_of(&studio.mean(16))
        })
    };
    let [whole, part, hole] =
        [AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.5 }].map(lit_by);
    for (i, pipeline) in PIPELINES.into_iter().enumerate() {
        assert!(whole[i] > 0.1 && hole[i] == 0.0, "{}: {} {}", pipeline.name(), whole[i], hole[i]);
        let share = part[i] / whole[i];
        assert!((share - COVERAGE).abs() < 0.02 * COVERAGE, "{}: {share}", pipeline.name());
    }
}

#[test]
fn any_hit_shaders_come_with_the_first_hole() {
    let spared = |scene: &Scene, camera| {
        let mut studio = Studio::of([16, 16], still(Pipeline::Hybrid), &scene.delta, camera);
        studio.frames(1);
        studio.statistics().left_out.iter().any(|left| left.what == "any-hit shaders")
    };
    let (opaque, camera) = under_a_screen(|_| lambert(0.5));
    let (masked, _) = under_a_screen(holed);
    assert!(spared(&opaque, camera));
    assert!(!spared(&masked, camera));
}
