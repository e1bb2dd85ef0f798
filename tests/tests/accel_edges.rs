//! Acceleration structures where little is left: the last instance, an instance that nobody sees, a mesh that is edited before
//! it was ever built, everything exchanged in one frame, builds past their budgets, trees around a point.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::sync::Arc;

use caustica_renderer::delta::{
    Camera, Deformation, Instance, InstanceId, MorphTarget, Pose, SceneDelta, Visibility,
};
use caustica_renderer::{AccelPolicy, Pipeline, TlasWork, ViewSettings};
use caustica_tests::scene::{Scene, camera_at, cube, lambert, sphere};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

const EXTENT: [u32; 2] = [48, 32];

fn raytraced() -> ViewSettings {
    ViewSettings { pipeline: Pipeline::Raytraced, ..ViewSettings::default() }
}

fn camera() -> Camera {
    camera_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 0.7)
}

fn shift(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::X * x)
}

/// `count` balls in a row under an even sky.
fn row(first_id: u64, count: u8, y: f32) -> (Scene, Vec<InstanceId>) {
    let mut scene = Scene::starting_at(first_id);
    scene.surround(0.2);
    let (mesh, material) = (scene.mesh(sphere(0.3, 24)), scene.material(lambert(0.5)));
    let place = |i: u8| Affine3A::from_translation(Vec3::new(f32::from(i) * 0.7 - 0.7, y, 0.0));
    let ids = (0..count).map(|i| scene.place(mesh, material, place(i))).collect();
    (scene, ids)
}

#[test]
fn where_the_last_instance_was_rays_meet_the_sky() {
    let (scene, ids) = row(0, 1, 0.0);
    let mut studio = Studio::of(EXTENT, raytraced(), &scene.delta, camera());
    studio.frames(2);
    studio.frame(&SceneDelta { removed_instances: ids, ..SceneDelta::default() });
    assert_eq!(studio.statistics().acceleration.tlas, TlasWork::Built);
    let empty = studio.mean(2);
    assert!(empty.mean.iter().flatten().all(|x| (x - 0.2).abs() < 1e-4), "something is still met");
    // As many others as there were: a tree of their own.
    let (other, _) = row(100, 1, 0.4);
    studio.frame(&other.delta);
    assert_eq!(studio.statistics().acceleration.tlas, TlasWork::Built);
}

#[test]
fn exchanging_all_instances_in_one_frame_builds_the_tree() {
    let (scene, ids) = row(0, 3, 0.0);
    let (other, _) = row(100, 3, 0.5);
    let mut studio = Studio::of(EXTENT, raytraced(), &scene.delta, camera());
    studio.frames(2);
    studio.frame(&SceneDelta { removed_instances: ids, ..other.delta.clone() });
    assert_eq!(studio.statistics().acceleration.tlas, TlasWork::Built);
    let after = studio.mean(4);
    drop(studio);
    let fresh = Studio::of(EXTENT, raytraced(), &other.delta, camera()).mean(4);
    assert_eq!(after.mean, fresh.mean);
}

#[test]
fn what_nobody_sees_moves_without_a_reset() {
    let (scene, ids) = row(0, 2, 0.0);
    let mut studio = Studio::of(EXTENT, raytraced(), &scene.delta, camera());
    let hidden = Visibility { shown: false, ..Visibility::default() };
    studio.frame(&SceneDelta { visibility: vec![(ids[0], hidden)], ..SceneDelta::default() });
    studio.mean(4);
    let before = studio.statistics();
    studio.frame(&SceneDelta { transforms: vec![(ids[0], shift(1.0))], ..SceneDelta::default() });
    let after = studio.statistics();
    assert_eq!((after.resets, after.samples), (before.resets, before.samples + 1));
    let copy = InstanceId { node: 77, part: 0 };
    let unseen = Instance { visibility: hidden, ..scene.delta.instances[0].1.clone() };
    studio.frame(&SceneDelta { instances: vec![(copy, unseen)], ..SceneDelta::default() });
    studio.frame(&SceneDelta { removed_instances: vec![copy], ..SceneDelta::default() });
    assert_eq!(studio.statistics().resets, before.resets, "a hidden copy came and went");
    let scaled = |scale: f32| Affine3A::from_scale(Vec3::splat(scale));
    for (map, resets) in [(scaled(0.0), 1), (scaled(f32::INFINITY), 1), (shift(0.2), 2)] {
        studio.frame(&SceneDelta { transforms: vec![(ids[1], map)], ..SceneDelta::default() });
        assert_eq!(studio.statistics().resets, before.resets + resets, "{map:?}");
    }
}

#[test]
fn a_mesh_that_is_edited_while_its_first_build_waits_appears_all_the_same() {
    let (scene, _) = row(0, 1, 0.0);
    let policy = AccelPolicy { frame_triangles: Some(2000), compact: false, ..AccelPolicy::default() };
    let mut studio = Studio::with_policy(EXTENT, raytraced(), policy, &scene.delta, camera());
    studio.frames(2);
    let mut more = Scene::starting_at(100);
    let mesh = more.mesh(sphere(0.4, 100));
    let material = more.material(lambert(0.5));
    more.place(mesh, material, shift(0.8));
    studio.frame(&more.delta);
    assert_eq!(studio.statistics().acceleration.blas_pending, 1);
    for step in 0..6_u8 {
        let map = shift(f32::from(step) * 0.01);
        studio.frame(&SceneDelta { primitive_transforms: vec![(mesh, 0, map)], ..SceneDelta::default() });
    }
    assert_eq!(studio.statistics().acceleration.blas_pending, 0, "an edit a frame kept it away");
    let mut cubes = Scene::starting_at(200);
    cubes.put(cube(0.2), lambert(0.5), shift(-1.2));
    studio.frame(&cubes.delta);
    assert_eq!(studio.statistics().acceleration.blas_pending, 0);
}

/// More meshes wait than the scratch memory of a batch has room for: all of them are built, one batch after the other.
#[test]
fn what_a_background_batch_has_no_room_for_is_built_in_the_next() {
    let mut scene = Scene::new();
    scene.surround(0.2);
    for i in 0..6_u8 {
        let place = Vec3::new(f32::from(i % 3) * 0.7 - 0.7, f32::from(i / 3) * 0.7 - 0.35, 0.0);
        let grey = lambert(0.3 + 0.1 * f32::from(i));
        scene.put(sphere(0.3, 40 + 4 * u32::from(i)), grey, Affine3A::from_translation(place));
    }
    // Room for one of them: lavapipe asks for 64 bytes a build, others for more.
    let policy = AccelPolicy {
        frame_triangles: Some(10),
        background_scratch: 96,
        compact: false,
        ..AccelPolicy::default()
    };
    let mut studio = Studio::with_policy(EXTENT, raytraced(), policy, &scene.delta, camera());
    let mut swaps = Vec::new();
    for _ in 0..60 {
        studio.frames(1);
        swaps.push(studio.statistics().acceleration.blas_swapped);
        if !studio.renderer.is_busy() {
            break;
        }
    }
    assert_eq!((swaps.iter().sum::<u64>(), swaps.iter().max()), (6, Some(&1)), "{swaps:?}");
    let found = studio.mean(2);
    drop(studio);
    let expected = Studio::of(EXTENT, raytraced(), &scene.delta, camera()).mean(2);
    assert_eq!(found.mean, expected.mean);
}

/// A mesh that gets other content in every frame is seen in every frame, however large it is.
#[test]
fn a_large_mesh_that_is_replaced_does_not_vanish() {
    let mut scene = Scene::new();
    scene.surround(0.2);
    let (mesh, material) = (scene.mesh(sphere(0.5, 100)), scene.material(lambert(0.5)));
    scene.place(mesh, material, Affine3A::IDENTITY);
    for wait in [true, false] {
        let policy = AccelPolicy { frame_triangles: Some(2000), wait, ..AccelPolicy::default() };
        let mut studio = Studio::with_policy(EXTENT, raytraced(), policy, &scene.delta, camera());
        while studio.renderer.is_busy() {
            studio.frames(1);
        }
        for i in 0..5_u8 {
            let content = Arc::new(sphere(0.5 + 0.01 * f32::from(i), 100));
            studio.frame(&SceneDelta { meshes: vec![(mesh, content)], ..SceneDelta::default() });
            let centre = studio.read().mean[(EXTENT[1] / 2 * EXTENT[0] + EXTENT[0] / 2) as usize][0];
            // Half of an even light comes back.
            assert!((centre - 0.1).abs() < 0.01, "edit {i}, wait {wait}: {centre}");
        }
    }
}

/// What is hidden comes with a mesh of its own, is built late, changes and goes.
#[test]
fn assets_of_what_nobody_sees_change_without_a_reset() {
    let (scene, ids) = row(0, 1, 0.0);
    let policy = AccelPolicy { frame_triangles: Some(2000), ..AccelPolicy::default() };
    let mut studio = Studio::with_policy(EXTENT, raytraced(), policy, &scene.delta, camera());
    studio.frames(4);
    let mut hidden = Scene::starting_at(100);
    let (mesh, material) = (hidden.mesh(sphere(0.3, 100)), hidden.material(lambert(0.2)));
    let id = hidden.place(mesh, material, shift(0.5));
    hidden.delta.instances[0].1.visibility.shown = false;
    let nothing = SceneDelta::default;
    let moved = (mesh, 0, shift(0.1));
    let visibility = Visibility { shown: false, to_camera: false, to_shadows: true };
    let events = [
        ("it comes", hidden.delta.clone()),
        ("it is built", nothing()),
        ("its primitive moves", SceneDelta { primitive_transforms: vec![moved], ..nothing() }),
        ("its material changes", SceneDelta { materials: vec![(material, lambert(0.9))], ..nothing() }),
        ("its mesh is another", SceneDelta { meshes: vec![(mesh, Arc::new(cube(0.1)))], ..nothing() }),
        ("the camera shall not see it", SceneDelta { visibility: vec![(id, visibility)], ..nothing() }),
        (
            "it goes",
            SceneDelta {
                removed_instances: vec![id],
                removed_meshes: vec![mesh],
                removed_materials: vec![material],
                ..nothing()
            },
        ),
    ];
    let resets = studio.statistics().resets;
    for (what, delta) in events {
        studio.frame(&delta);
        studio.frames(6);
        assert_eq!(studio.statistics().resets, resets, "{what}: {}", studio.statistics().reset_reason);
    }
    let visible = Visibility { shown: false, ..Visibility::default() };
    studio.frame(&SceneDelta { visibility: vec![(ids[0], visible)], ..nothing() });
    assert_eq!(studio.statistics().resets, resets + 1, "what was seen is hidden");
}

/// However many instances there are, and however far up the table the selected one stands.
#[test]
fn moving_a_selected_instance_uploads_as_little_as_any_other() {
    let mut scene = Scene::new();
    scene.surround(0.2);
    let (mesh, material) = (scene.mesh(cube(0.05)), scene.material(lambert(0.5)));
    let place = |i: u16, x: f32| {
        let (column, row) = (f32::from(i % 200), f32::from(i / 200));
        Affine3A::from_translation(Vec3::new(0.02 * column - 2.0 + x, 0.02 * row - 1.0, 0.0))
    };
    let ids: Vec<InstanceId> = (0..20_000).map(|i| scene.place(mesh, material, place(i, 0.0))).collect();
    let last = ids[ids.len() - 1];
    let mut studio = Studio::of([8, 8], raytraced(), &scene.delta, camera());
    let mut uploads = |selected: bool| {
        let chosen = selected.then_some(last);
        studio.renderer.select(studio.view, chosen.into_iter()).expect("a view");
        studio.frames(3);
        let idle = studio.statistics().uploaded_bytes;
        let x = if selected { 0.1 } else { 0.2 };
        studio.frame(&SceneDelta { transforms: vec![(last, place(19_999, x))], ..SceneDelta::default() });
        (idle, studio.statistics().uploaded_bytes)
    };
    let plain = uploads(false);
    assert_eq!(uploads(true), plain);
    assert!(plain.1 - plain.0 < 1024, "{plain:?}");
}

fn static_forms_stay() -> AccelPolicy {
    AccelPolicy { compact: false, ..AccelPolicy::default() }
}

/// A tree that was built around a point is made anew once there is something around it.
#[test]
fn a_primitive_that_grows_out_of_a_point_gets_another_tree() {
    let mut scene = Scene::new();
    scene.surround(0.2);
    let mut ball = sphere(0.5, 60);
    ball.geometries[0].mesh_from_primitive = Affine3A::from_scale(Vec3::ZERO);
    let (mesh, material) = (scene.mesh(ball), scene.material(lambert(0.5)));
    scene.place(mesh, material, Affine3A::IDENTITY);
    let mut studio = Studio::with_policy(EXTENT, raytraced(), static_forms_stay(), &scene.delta, camera());
    studio.frames(2);
    for size in [0.0, 1.0] {
        let map = Affine3A::from_scale(Vec3::splat(size));
        studio.frame(&SceneDelta { primitive_transforms: vec![(mesh, 0, map)], ..SceneDelta::default() });
    }
    studio.frames(8);
    assert_eq!(studio.statistics().acceleration.total_blas_swapped, 1);
}

/// One far pose is enough, though only each eighth refit is measured: what rests was measured last.
#[test]
fn a_mesh_torn_apart_by_its_last_pose_gets_another_tree() {
    let mut scene = Scene::new();
    scene.surround(0.2);
    let mut ball = sphere(0.5, 60);
    let apart = |(i, p): (usize, &Vec3)| *p * ((i * 7919) % 13) as f32;
    let positions = ball.positions.iter().enumerate().map(apart).collect();
    let target = MorphTarget { positions, ..MorphTarget::default() };
    ball.deformation = Some(Deformation { targets: vec![target], ..Deformation::default() });
    let (mesh, material) = (scene.mesh(ball), scene.material(lambert(0.5)));
    let id = scene.place(mesh, material, Affine3A::IDENTITY);
    for refits in [1_u8, 7] {
        let mut studio =
            Studio::with_policy(EXTENT, raytraced(), static_forms_stay(), &scene.delta, camera());
        studio.frames(4);
        for i in 0..refits {
            let pose = Pose { joints: Vec::new(), weights: vec![1.0 + 0.001 * f32::from(i)] };
            studio.frame(&SceneDelta { poses: vec![(id, pose)], ..SceneDelta::default() });
        }
        studio.frames(10);
        assert_eq!(studio.statistics().acceleration.total_blas_swapped, 1, "{refits} refits");
    }
}
