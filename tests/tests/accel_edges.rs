//! Acceleration structures where little is left: the last instance, an instance that nobody sees, a mesh that is edited before
//! it was ever built, everything exchanged in one frame.

use caustica_renderer::delta::{Camera, Instance, InstanceId, SceneDelta, Visibility};
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
