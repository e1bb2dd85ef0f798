//! What an edit costs: the next frame is right, nothing is built that did not change, samples are kept where the table
//! of the design says so, and every reset has its reason.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::sync::Arc;

use caustica_renderer::delta::{Camera, Geometry, Instance, InstanceId, Light, Material, SceneDelta};
use caustica_renderer::{NeedsMode, Pipeline, Show, TlasWork, ToneMap, ViewSettings};
use caustica_tests::picture::largest_difference;
use caustica_tests::scene::{
    Scene, camera_at, checker, cube, lambert, mirror, plain_use, point_light, quad, sphere,
};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

const EXTENT: [u32; 2] = [64, 48];

fn settings(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, ..ViewSettings::default() }
}

fn place(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(x, 0.5, 0.0))
}

/// A ball at `x` on a floor before a mirror, under a lamp with or without a size.
fn room(x: f32, radius_m: f32) -> (Scene, InstanceId, Camera) {
    let mut scene = Scene::new();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(6.0, 6.0), lambert(0.7), lying);
    scene.put(quad(4.0, 2.0), mirror(), Affine3A::from_translation(Vec3::new(0.0, 1.0, -1.5)));
    let ball = scene.put(sphere(0.5, 32), lambert(0.6), place(x));
    let intensity = Vec3::splat(8.0);
    scene.light(Light::Point {
        position: Vec3::new(1.0, 2.5, 1.5),
        intensity,
        radius_m,
        range_m: f32::INFINITY,
    });
    (scene, ball, camera_at(Vec3::new(0.0, 1.5, 4.0), Vec3::new(0.0, 0.6, 0.0), 0.7))
}

fn studio_of(pipeline: Pipeline, x: f32, radius_m: f32) -> (Studio, InstanceId) {
    let (scene, ball, camera) = room(x, radius_m);
    (Studio::of(EXTENT, settings(pipeline), &scene.delta, camera), ball)
}

fn moved(ball: InstanceId, x: f32) -> SceneDelta {
    SceneDelta {
        transforms: vec![(ball, place(x))],
        reason: String::from("moved Ball"),
        ..SceneDelta::default()
    }
}

#[test]
fn a_moved_instance_is_right_in_the_next_frame() {
    for pipeline in Pipeline::ALL {
        let expected = studio_of(pipeline, 0.7, 0.0).0.mean(1);
        let (mut studio, ball) = studio_of(pipeline, -0.6, 0.0);
        // Paths are noisy under any light, and are denoised while something moves.
        studio.set(|settings| settings.temporal = false);
        let before = studio.mean(3);
        studio.frame(&moved(ball, 0.7));
        let figures = studio.statistics();
        let after = studio.read();
        assert!(largest_difference(&before, &after) > 0.1, "{}", pipeline.name());
        assert!(largest_difference(&after, &expected) < 1e-6, "{}", pipeline.name());
        assert_eq!(figures.acceleration.tlas, TlasWork::Refit);
        assert_eq!((figures.acceleration.blas_built, figures.acceleration.blas_refit), (0, 0));
        assert_eq!((figures.samples, figures.reset_reason.as_str()), (1, "moved Ball"));
    }
}

#[test]
fn a_moved_instance_comes_to_rest_as_in_a_fresh_scene() {
    // A soft light: the first frame after the move is denoised, the following ones accumulate.
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced] {
        let expected = studio_of(pipeline, 0.7, 0.3).0.mean(4);
        let (mut studio, ball) = studio_of(pipeline, -0.6, 0.3);
        studio.frames(2);
        for x in [-0.2, 0.2, 0.7] {
            studio.frame(&moved(ball, x));
        }
        let after = studio.mean(4);
        assert_eq!(studio.statistics().samples, 4);
        assert!(largest_difference(&after, &expected) < 1e-6, "{}", pipeline.name());
    }
}

#[test]
fn a_frame_in_motion_shows_the_moved_object() {
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced] {
        let mut still = studio_of(pipeline, 0.7, 0.05).0;
        still.set(|settings| settings.tone_map = ToneMap::Linear);
        still.frames(64);
        let expected = still.display();
        drop(still);
        let (mut studio, ball) = studio_of(pipeline, -0.6, 0.05);
        studio.set(|settings| settings.tone_map = ToneMap::Linear);
        studio.frames(8);
        let before = studio.display();
        studio.frame(&moved(ball, 0.7));
        let moving = studio.display();
        let distance = |a: &[[f32; 4]], b: &[[f32; 4]]| {
            a.iter().zip(b).map(|(p, q)| (p[0] - q[0]).abs()).sum::<f32>() / a.len() as f32
        };
        let (to_old, to_new) = (distance(&moving, &before), distance(&moving, &expected));
        // One sample a pixel, filtered: what is left is the shadow's edge, blurred.
        assert!(
            to_new < 0.35 * to_old && to_new < 0.01,
            "{}: {to_new} from the new, {to_old} from the old",
            pipeline.name()
        );
    }
}

#[test]
fn what_only_changes_the_display_keeps_the_samples() {
    // The mean must be that of seven samples of the same set.
    let expected = studio_of(Pipeline::Hybrid, 0.0, 0.0).0.mean(7);
    let (mut studio, _) = studio_of(Pipeline::Hybrid, 0.0, 0.0);
    studio.frames(3);
    let resets = studio.statistics().resets;
    let before = studio.read();
    studio.set(|settings| settings.exposure_ev = 1.0);
    studio.frames(1);
    studio.set(|settings| settings.tone_map = ToneMap::Aces);
    studio.frames(1);
    studio.set(|settings| settings.show = Show::Normal);
    studio.frames(1);
    studio.set(|settings| settings.needs = NeedsMode::All);
    studio.frames(1);
    let figures = studio.statistics();
    assert_eq!(
        (figures.samples, figures.resets),
        (7, resets),
        "the last reset was: {}",
        figures.reset_reason
    );
    let after = studio.read();
    assert!(largest_difference(&after, &expected) < 1e-6);
    assert!(largest_difference(&after, &before) > 0.0);
}

#[test]
fn exposure_scales_the_display() {
    let (mut studio, _) = studio_of(Pipeline::Hybrid, 0.0, 0.0);
    studio.set(|settings| settings.tone_map = ToneMap::Linear);
    studio.set(|settings| settings.exposure_ev = -3.0);
    studio.frames(1);
    let dark = studio.display();
    studio.set(|settings| settings.exposure_ev = -2.0);
    let mean = {
        studio.frames(1);
        studio.display()
    };
    // One sample more moves edges; elsewhere a stop is a factor of two.
    let doubled =
        dark.iter().zip(&mean).filter(|(d, m)| (m[0] - 2.0 * d[0]).abs() < 0.02 * m[0] + 1e-3).count();
    assert!(doubled * 10 > dark.len() * 9, "{doubled} of {}", dark.len());
}

#[test]
fn every_other_event_resets_and_says_why() {
    let (mut studio, ball) = studio_of(Pipeline::Hybrid, 0.0, 0.0);
    studio.frames(3);
    let mut resets = studio.statistics().resets;
    let mut expect_reset = |studio: &mut Studio, reason: &str| {
        let figures = studio.statistics();
        assert_eq!((figures.samples, figures.reset_reason.as_str()), (1, reason));
        assert_eq!(figures.resets, resets + 1, "{reason}");
        resets = figures.resets;
        studio.frames(2);
        assert_eq!(studio.statistics().samples, 3);
    };
    let camera = camera_at(Vec3::new(0.1, 1.5, 4.0), Vec3::new(0.0, 0.6, 0.0), 0.7);
    studio.view_mut().set_camera(camera);
    studio.frames(1);
    expect_reset(&mut studio, "camera");
    studio.frame(&moved(ball, 0.3));
    expect_reset(&mut studio, "moved Ball");
    studio.set(|settings| settings.max_depth = 2);
    studio.frames(1);
    expect_reset(&mut studio, "render settings");
    studio.set(|settings| settings.pipeline = Pipeline::Raytraced);
    studio.frames(1);
    expect_reset(&mut studio, "pipeline");
    studio.view_mut().resize([32, 40]);
    studio.frames(1);
    expect_reset(&mut studio, "size of the view");
    assert_eq!(studio.read().extent, [32, 40]);
    // The same camera and the same size again are no events.
    studio.view_mut().set_camera(camera);
    studio.view_mut().resize([32, 40]);
    studio.frames(1);
    assert_eq!(studio.statistics().samples, 4);
}

#[test]
fn another_resolution_keeps_the_reason_of_what_moved() {
    let (mut studio, ball) = studio_of(Pipeline::Hybrid, 0.0, 0.0);
    studio.frames(2);
    let told = |studio: &mut Studio| {
        let figures = studio.statistics();
        (figures.samples, figures.reset_reason, studio.view_mut().extent())
    };
    let small = EXTENT.map(|side| side / 2);
    studio.view_mut().set_divisor(2);
    studio.frame(&moved(ball, 0.3));
    assert_eq!(told(&mut studio), (1, String::from("moved Ball"), small));
    // Still again: the picture is begun anew at full resolution, because of the same move.
    studio.frames(2);
    studio.view_mut().set_divisor(1);
    studio.frames(1);
    assert_eq!(told(&mut studio), (1, String::from("moved Ball"), EXTENT));
    studio.frames(2);
    studio.view_mut().resize(small);
    studio.view_mut().set_camera(camera_at(Vec3::new(0.1, 1.5, 4.0), Vec3::ZERO, 0.7));
    studio.frames(1);
    assert_eq!(told(&mut studio), (1, String::from("camera"), small));
    studio.view_mut().resize(EXTENT);
    studio.frames(1);
    assert_eq!(told(&mut studio), (1, String::from("size of the view"), EXTENT));
}

/// What happens to a view with a ball.
type Event = fn(&mut Studio, InstanceId);

#[test]
fn history_survives_moves_and_ends_with_its_targets() {
    let (mut studio, ball) = studio_of(Pipeline::Hybrid, -0.6, 0.3);
    studio.set(|settings| settings.show = Show::History);
    let mut x = -0.6;
    // Mean length of the history in a frame in which the ball has moved a little.
    let mut moving = |studio: &mut Studio| {
        x += 0.001;
        studio.frame(&moved(ball, x));
        let display = studio.display();
        display.iter().map(|pixel| pixel[0]).sum::<f32>() / display.len() as f32
    };
    let events: [(&str, bool, Event); 8] = [
        ("exposure", true, |studio, _| studio.set(|settings| settings.exposure_ev = 0.01)),
        ("selection", true, |studio, ball| {
            studio.renderer.select(studio.view, [ball].into_iter()).expect("a view");
        }),
        ("a move", true, |studio, ball| studio.frame(&moved(ball, -0.5))),
        ("size", true, |studio, _| studio.view_mut().resize([32, 24])),
        ("resolution", true, |studio, _| studio.view_mut().set_divisor(2)),
        ("needs", false, |studio, _| studio.set(|settings| settings.needs = NeedsMode::All)),
        ("settings", false, |studio, _| studio.set(|settings| settings.max_depth = 2)),
        ("render origin", false, |studio, _| {
            studio.frame(&SceneDelta { render_origin_changed: true, ..SceneDelta::default() });
        }),
    ];
    for (what, kept, event) in events {
        let before = (0..10).map(|_| moving(&mut studio)).last().expect("a length");
        event(&mut studio, ball);
        studio.frames(1);
        let after = moving(&mut studio);
        if kept {
            assert!(after > 0.9 * before, "{what}: {before}, then {after}");
        } else {
            assert!(after < 0.5 * before, "{what}: {before}, then {after}");
        }
    }
}

#[test]
fn moving_one_camera_resets_that_view_alone() {
    let (mut studio, ball) = studio_of(Pipeline::Hybrid, 0.0, 0.0);
    let other =
        studio.renderer.create_view([32, 24], settings(Pipeline::Raster), false).expect("a second view");
    let both = |studio: &mut Studio, delta: &SceneDelta| {
        let mut recorder = studio.session.frames.begin().expect("a frame");
        studio.renderer.apply(&mut recorder, delta).expect("the delta applies");
        studio.renderer.render(&mut recorder, studio.view).expect("the first view");
        studio.renderer.render(&mut recorder, other).expect("the second view");
        studio.session.frames.submit(recorder, None).expect("a submission");
        let samples = |id| studio.renderer.view(id).expect("a view").samples();
        (samples(studio.view), samples(other))
    };
    let nothing = SceneDelta::default();
    both(&mut studio, &nothing);
    assert_eq!(both(&mut studio, &nothing), (2, 2));
    studio.view_mut().set_camera(camera_at(Vec3::new(1.0, 1.5, 4.0), Vec3::ZERO, 0.7));
    assert_eq!(both(&mut studio, &nothing), (1, 3));
    assert_eq!(both(&mut studio, &moved(ball, 0.4)), (1, 1));
}

#[test]
fn material_and_light_edits_build_nothing() {
    let (scene, _, camera) = room(0.0, 0.0);
    let (material, light) = (scene.delta.materials[2].0, scene.delta.lights[0].0);
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    studio.frames(2);
    let before = studio.read();
    studio.frame(&SceneDelta {
        materials: vec![(material, lambert(0.1))],
        lights: vec![(light, point_light(Vec3::new(-1.0, 2.5, 1.5), 8.0))],
        reason: String::from("changed Ball"),
        ..SceneDelta::default()
    });
    let figures = studio.statistics();
    assert_eq!((figures.acceleration.tlas, figures.acceleration.blas_built), (TlasWork::Kept, 0));
    assert_eq!(figures.reset_reason, "changed Ball");
    assert!(largest_difference(&before, &studio.read()) > 0.05);
}

#[test]
fn a_texture_is_replaced_under_materials_that_are_not_sent_again() {
    let (mut scene, _, camera) = room(0.0, 0.0);
    let (old, new) = (checker(4, 0, 60), checker(6, 200, 255));
    let texture = scene.texture(old);
    let painted = Material { base_color_texture: Some(plain_use(texture)), ..lambert(1.0) };
    scene.delta.materials[0].1 = painted;
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    // At rest, compacted too.
    let before = studio.mean(8);
    let replaced = SceneDelta { textures: vec![(texture, Arc::new(new.clone()))], ..SceneDelta::default() };
    studio.frame(&replaced);
    assert_eq!(studio.statistics().acceleration.tlas, TlasWork::Kept);
    let after = studio.read();
    drop(studio);
    for (_, known) in &mut scene.delta.textures {
        *known = Arc::new(new.clone());
    }
    let expected = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera).mean(1);
    assert!(largest_difference(&before, &after) > 0.2);
    assert!(largest_difference(&after, &expected) < 1e-6);
}

#[test]
fn an_emitter_that_gets_a_size_shines_and_one_that_loses_it_does_not() {
    let (mut scene, _, camera) = room(0.0, 0.0);
    scene.delta.lights.clear();
    let panel = Material { emissive: Vec3::splat(20.0), ..lambert(0.0) };
    let up = Affine3A::from_translation(Vec3::new(0.0, 2.5, 0.5))
        * Affine3A::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let lamp = scene.put(quad(0.8, 0.8), panel, up);
    let image = |scene: &Scene| Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera).mean(8);
    let lit = image(&scene);
    let place = |scene: &mut Scene, map| {
        for (id, instance) in &mut scene.delta.instances {
            if *id == lamp {
                instance.render_from_mesh = map;
            }
        }
    };
    let none = Affine3A::from_scale(Vec3::ZERO);
    place(&mut scene, none);
    let dark = image(&scene);
    assert!(largest_difference(&lit, &dark) > 0.1);
    // What the scene needs is decided anew by a move alone.
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    studio.frames(2);
    let left_out = |studio: &Studio| {
        studio.statistics().left_out.iter().any(|left| left.what == "emissive triangles as lights")
    };
    assert!(left_out(&studio));
    for (map, expected) in [(up, &lit), (none, &dark), (up, &lit)] {
        studio.frame(&SceneDelta { transforms: vec![(lamp, map)], ..SceneDelta::default() });
        assert_eq!(left_out(&studio), map == none);
        assert!(largest_difference(&studio.mean(8), expected) < 1e-5);
    }
}

#[test]
fn a_mesh_that_does_not_fit_its_instances_is_refused_until_they_follow() {
    let (scene, ball, camera) = room(0.0, 0.0);
    let (_, instance) = scene.delta.instances.iter().find(|(id, _)| *id == ball).expect("the ball").clone();
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    studio.frames(2);
    let mut halves = cube(1.0);
    let half = halves.geometries[0].index_count / 2;
    halves.geometries[0].index_count = half;
    halves.geometries.push(Geometry { first_index: half, ..halves.geometries[0] });
    let meshes = vec![(instance.mesh, Arc::new(halves))];
    let alone = SceneDelta { meshes: meshes.clone(), ..SceneDelta::default() };
    let mut recorder = studio.session.frames.begin().expect("a frame");
    let refused = studio.renderer.apply(&mut recorder, &alone).expect_err("two primitives, one material");
    studio.session.frames.submit(recorder, None).expect("a submission");
    assert!(refused.to_string().contains("an instance has 1 materials, its mesh"), "{refused}");
    let followed = Instance { materials: vec![instance.materials[0]; 2], ..instance };
    studio.frame(&SceneDelta { meshes, instances: vec![(ball, followed)], ..SceneDelta::default() });
    assert_eq!(studio.statistics().acceleration.blas_count, 3);
    assert!(studio.mean(2).mean.iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn adding_builds_what_is_new_only_and_removing_nothing() {
    let (scene, _, camera) = room(0.0, 0.0);
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    let before = studio.mean(1);
    let mut more = Scene::starting_at(1000);
    let added = more.put(cube(0.5), lambert(0.5), Affine3A::from_translation(Vec3::new(-1.0, 0.3, 0.8)));
    studio.frame(&more.delta);
    let figures = studio.statistics().acceleration;
    assert_eq!((figures.blas_built, figures.blas_count, figures.tlas), (1, 4, TlasWork::Built));
    let with = studio.read();
    assert!(largest_difference(&before, &with) > 0.05);
    // The fresh scene with everything in it looks the same.
    let (mut whole, _, camera) = room(0.0, 0.0);
    whole.delta.meshes.extend(more.delta.meshes.clone());
    whole.delta.materials.extend(more.delta.materials.clone());
    whole.delta.instances.extend(more.delta.instances.clone());
    let mesh = more.delta.meshes[0].0;
    let fresh = {
        let remove = SceneDelta {
            removed_instances: vec![added],
            removed_meshes: vec![mesh],
            ..SceneDelta::default()
        };
        studio.frame(&remove);
        let figures = studio.statistics().acceleration;
        assert_eq!((figures.blas_built, figures.blas_count, figures.tlas), (0, 3, TlasWork::Built));
        let back = studio.read();
        assert!(largest_difference(&before, &back) < 1e-6);
        drop(studio);
        Studio::of(EXTENT, settings(Pipeline::Hybrid), &whole.delta, camera).mean(1)
    };
    assert!(largest_difference(&with, &fresh) < 1e-6);
}

#[test]
fn hiding_and_degenerating_come_back_unharmed() {
    let (mut studio, ball) = studio_of(Pipeline::Hybrid, 0.2, 0.0);
    let before = studio.mean(1);
    let nothing =
        SceneDelta { transforms: vec![(ball, Affine3A::from_scale(Vec3::ZERO))], ..SceneDelta::default() };
    studio.frame(&nothing);
    // Active became inactive: an update would be illegal.
    assert_eq!(studio.statistics().acceleration.tlas, TlasWork::Built);
    let gone = studio.read();
    assert!(largest_difference(&before, &gone) > 0.05);
    studio.frame(&moved(ball, 0.2));
    assert_eq!(studio.statistics().acceleration.tlas, TlasWork::Built);
    let back = studio.read();
    assert!(largest_difference(&before, &back) < 1e-6);
}

#[test]
fn a_spoilt_emitter_is_counted_dropped_and_forgotten() {
    let (scene, _, camera) = room(0.2, 0.0);
    let material = scene.delta.materials[2].0;
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    let clean = studio.mean(2);
    assert_eq!(studio.statistics().non_finite, 0);
    let spoilt = Material { emissive: Vec3::new(1.0, f32::INFINITY, 1.0), ..lambert(0.6) };
    studio.frame(&SceneDelta { materials: vec![(material, spoilt)], ..SceneDelta::default() });
    let image = studio.mean(3);
    let counted = studio.statistics().non_finite;
    assert!(counted > 100, "{counted}");
    assert!(image.mean.iter().flatten().all(|x| x.is_finite()));
    // The floor in the corner is lit as before.
    let corner = image.mean.len() - 1;
    assert!((image.mean[corner][0] - clean.mean[corner][0]).abs() < 0.02);
    studio.frame(&SceneDelta { materials: vec![(material, lambert(0.6))], ..SceneDelta::default() });
    let again = studio.mean(1);
    assert_eq!(studio.statistics().non_finite, 0, "after one clean frame nothing is left");
    assert!(largest_difference(&again, &clean) < 1e-6);
}

#[test]
fn a_spoilt_light_leaves_no_trace_in_motion() {
    let lamp = InstanceId { node: 5000, part: 0 };
    // So near and so strong that the light of some pixels is infinite, that of others merely absurd.
    let absurd = Light::Point {
        position: Vec3::new(-1.0, 0.01, 0.8),
        intensity: Vec3::splat(1e38),
        radius_m: 0.0,
        range_m: f32::INFINITY,
    };
    let after_motion = |spoil: bool| {
        let (mut studio, ball) = studio_of(Pipeline::Hybrid, -0.6, 0.3);
        studio.frames(2);
        let mut counted = 0;
        for step in 0..7_u8 {
            let mut delta = moved(ball, -0.55 + 0.1 * f32::from(step));
            match step {
                0 if spoil => delta.lights.push((lamp, absurd)),
                1 if spoil => delta.removed_lights.push(lamp),
                _ => {}
            }
            studio.frame(&delta);
            let display = studio.display();
            assert!(display.iter().flatten().all(|x| x.is_finite()), "step {step}");
            counted += display.iter().filter(|pixel| pixel[0] > 0.99).count();
        }
        (studio.display(), counted)
    };
    let (clean, few) = after_motion(false);
    let (spoilt, many) = after_motion(true);
    assert!(many > few + 500, "the absurd light is expected to blind: {few}, {many} white pixels");
    let differing = clean.iter().zip(&spoilt).filter(|(p, q)| (p[0] - q[0]).abs() > 0.05).count();
    assert!(differing * 100 < clean.len(), "{differing} of {} pixels still show it", clean.len());
}
