//! When acceleration structures are built, refitted, rebuilt, compacted and swapped, counted row by row of the table
//! "Invalidation" in ARCHITECTURE.md; and that the picture is that of a fresh scene after each.
//!
//! | event | tests here, in `invalidation.rs` (i), `accel_edges.rs` (e), `deform.rs` (d), `churn/rows.rs` (r, through a session) |
//! |---|---|
//! | move, rotate, scale a node | `a_moved_instance_is_right_in_the_next_frame` (i), `a_tree_whose_instances_have_moved_far_is_built_anew`, `what_moves_or_hides_costs_its_records_and_a_refit` (r) |
//! | hide or show; seen by the camera, casts shadows | `hiding_is_a_mask_and_a_refit`, `masks_tell_the_camera_from_shadows_and_mirrors`, `hiding_and_degenerating_come_back_unharmed` (i) |
//! | assign a material | `a_material_that_is_given_builds_a_tree_only_where_rays_pass` (r) |
//! | add or remove | `adding_builds_what_is_new_only_and_removing_nothing` (i), `who_takes_anothers_slot_has_the_tree_built_anew`, `an_instance_builds_what_it_does_not_share_and_its_end_builds_nothing` (r) |
//! | move a primitive in its mesh | `a_moved_primitive_is_right_in_the_next_frame_and_refitted_from_then_on`, `where_a_refit_does_not_pay_a_moved_primitive_is_built_in_place` |
//! | pose: joints, morph weights | `a_pose_uploads_its_joints_and_refits_one_tree` (d), `a_primitive_a_weight_and_a_joint_cost_the_trees_that_they_bend` (r) |
//! | time step of an animation | `a_time_step_costs_what_the_clip_moves_and_bends` (r), `history_is_reprojected_by_moves_and_dropped_with_everything` (r) |
//! | change a material | `material_and_light_edits_build_nothing` (i), `a_material_that_lets_light_through_takes_another_blas_and_no_other_is_touched`, `a_material_that_begins_to_shine_touches_no_tree` (r) |
//! | light, environment | `lights_and_environment_touch_no_structure`, `materials_lights_and_surroundings_cost_their_records` (r) |
//! | render origin | `views_cost_no_structure` (r), `history_survives_moves_and_ends_with_its_targets` (i) |
//! | a first build that the background has finished | `first_builds_past_the_budget_come_later_while_frames_go_on` |
//! | BLAS compacted, rebuilt for quality, or built to be traced fast, in the background | `an_edited_mesh_that_rests_is_built_to_be_traced_fast_and_compacted`, `what_refits_have_loosened_is_rebuilt_in_the_background_and_swapped_without_a_reset`, `what_was_begun_for_another_mesh_is_dropped` |
//! | camera | `moving_one_camera_resets_that_view_alone` (i), `views_cost_no_structure` (r) |
//! | size of the view, adaptive resolution | `every_other_event_resets_and_says_why` (i), `another_resolution_keeps_the_reason_of_what_moved` (i), `history_survives_moves_and_ends_with_its_targets` (i) |
//! | pipeline, sampler, depth, rays, seed, jitter, any other setting | `every_other_event_resets_and_says_why` (i), `history_survives_moves_and_ends_with_its_targets` (i) |
//! | any of these of what no ray can meet (hidden, without size), and of meshes, materials and textures that nothing else uses (`tables/met.rs`) | `what_nobody_sees_moves_without_a_reset` (e), `assets_of_what_nobody_sees_change_without_a_reset` (e) |
//! | needs (auto or all) | `what_only_changes_the_display_keeps_the_samples` (i), `history_survives_moves_and_ends_with_its_targets` (i) |
//! | exposure, tone map, what is shown, selection | `what_only_changes_the_display_keeps_the_samples` (i), `what_is_no_event_keeps_the_samples` (r), `history_survives_moves_and_ends_with_its_targets` (i) |
//!
//! A reloaded shader has no row: shaders are read when a pipeline is made.

use std::sync::Arc;

use caustica_renderer::delta::{
    Camera, Instance, InstanceId, Light, Material, Mesh, MeshId, SceneDelta, ShadingMode, Visibility,
};
use caustica_renderer::{AccelPolicy, AccelStatistics, Accumulated, Pipeline, TlasWork, ViewSettings};
use caustica_tests::picture::largest_difference;
use caustica_tests::scene::{Scene, camera_at, cube, lambert, mirror, point_light, quad, sphere};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Vec3};

const EXTENT: [u32; 2] = [64, 48];

/// Two cubes as two primitives of one mesh.
fn pair() -> Mesh {
    let mut mesh = cube(0.6);
    let second = cube(0.5);
    let first_vertex = mesh.positions.len() as u32;
    let first_index = mesh.indices.len() as u32;
    mesh.positions.extend(second.positions.iter().map(|p| *p + Vec3::X * 0.8));
    mesh.normals.extend(&second.normals);
    mesh.tangents.extend(&second.tangents);
    mesh.tex_coords0.extend(&second.tex_coords0);
    mesh.indices.extend(second.indices.iter().map(|i| i + first_vertex));
    let mut geometry = mesh.geometries[0];
    geometry.first_index = first_index;
    geometry.index_count = second.indices.len() as u32;
    mesh.geometries.push(geometry);
    mesh
}

struct Room {
    scene: Scene,
    mesh: MeshId,
    pair: InstanceId,
    camera: Camera,
}

/// A pair of cubes on a floor before a mirror under a lamp, and a ball.
fn room() -> Room {
    let mut scene = Scene::new();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(6.0, 6.0), lambert(0.7), lying);
    scene.put(quad(4.0, 2.0), mirror(), Affine3A::from_translation(Vec3::new(0.0, 1.0, -1.5)));
    scene.put(sphere(0.4, 32), lambert(0.6), Affine3A::from_translation(Vec3::new(-1.2, 0.4, 0.0)));
    let mesh = scene.mesh(pair());
    let material = scene.material(lambert(0.4));
    let pair = scene.place(mesh, material, Affine3A::from_translation(Vec3::new(0.0, 0.3, 0.0)));
    scene.light(point_light(Vec3::new(1.0, 2.5, 1.5), 8.0));
    let camera = camera_at(Vec3::new(0.0, 1.5, 4.0), Vec3::new(0.0, 0.6, 0.0), 0.7);
    Room { scene, mesh, pair, camera }
}

fn hybrid() -> ViewSettings {
    ViewSettings { pipeline: Pipeline::Hybrid, ..ViewSettings::default() }
}

fn studio_of(room: &Room, policy: AccelPolicy) -> Studio {
    Studio::with_policy(EXTENT, hybrid(), policy, &room.scene.delta, room.camera)
}

fn shift(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::new(x, 0.2, 0.1))
}

fn slid(mesh: MeshId, x: f32) -> SceneDelta {
    SceneDelta {
        primitive_transforms: vec![(mesh, 1, shift(x))],
        reason: String::from("moved primitive"),
        ..SceneDelta::default()
    }
}

/// The room in which the second primitive was moved before anything was built.
fn slid_room(x: f32) -> Accumulated {
    let mut room = room();
    for (id, mesh) in &mut room.scene.delta.meshes {
        if *id == room.mesh {
            let mut moved = Mesh::clone(mesh);
            moved.geometries[1].mesh_from_primitive = shift(x);
            *mesh = Arc::new(moved);
        }
    }
    studio_of(&room, AccelPolicy::default()).mean(1)
}

/// Builds, refits and TLAS work of the last frame.
fn work(studio: &Studio) -> (u64, u64, TlasWork) {
    let AccelStatistics { blas_built, blas_refit, tlas, .. } = studio.statistics().acceleration;
    (blas_built, blas_refit, tlas)
}

#[test]
fn a_moved_primitive_is_right_in_the_next_frame_and_refitted_from_then_on() {
    let room = room();
    let mut studio = studio_of(&room, AccelPolicy { compact: false, ..AccelPolicy::default() });
    let before = studio.mean(2);
    // The static structure cannot be updated: one of its own kind takes its place.
    studio.frame(&slid(room.mesh, 0.3));
    assert_eq!(work(&studio), (1, 0, TlasWork::Refit));
    assert!(largest_difference(&before, &studio.read()) > 0.05);
    for x in [0.4, 0.5] {
        studio.frame(&slid(room.mesh, x));
        assert_eq!(work(&studio), (0, 1, TlasWork::Refit));
        let figures = studio.statistics();
        assert_eq!((figures.samples, figures.reset_reason.as_str()), (1, "moved primitive"));
        assert!(figures.uploaded_bytes < 4096, "{} bytes for one primitive", figures.uploaded_bytes);
    }
    let after = studio.read();
    drop(studio);
    assert!(largest_difference(&after, &slid_room(0.5)) < 1e-6);
}

#[test]
fn where_a_refit_does_not_pay_a_moved_primitive_is_built_in_place() {
    let room = room();
    let policy = AccelPolicy { refit: false, compact: false, ..AccelPolicy::default() };
    let mut studio = studio_of(&room, policy);
    studio.frames(1);
    let bytes = studio.statistics().acceleration.blas_bytes;
    for x in [0.3, 0.5] {
        studio.frame(&slid(room.mesh, x));
        assert_eq!(work(&studio), (1, 0, TlasWork::Refit));
    }
    let after = studio.read();
    let now = studio.statistics().acceleration.blas_bytes;
    assert!(now < bytes * 2, "{bytes} bytes became {now}");
    drop(studio);
    assert!(largest_difference(&after, &slid_room(0.5)) < 1e-6);
}

#[test]
fn what_refits_have_loosened_is_rebuilt_in_the_background_and_swapped_without_a_reset() {
    for wait in [true, false] {
        let room = room();
        let policy = AccelPolicy { compact: false, wait, ..AccelPolicy::default() };
        let mut studio = studio_of(&room, policy);
        studio.frames(1);
        studio.frame(&slid(room.mesh, 0.0));
        studio.frame(&slid(room.mesh, 2.5));
        let resets = studio.statistics().resets;
        let mut frames = 0;
        while studio.statistics().acceleration.total_blas_swapped == 0 {
            studio.frames(1);
            frames += 1;
            assert!(frames < 200, "the rebuild never came into use");
        }
        let figures = studio.statistics();
        assert_eq!(figures.acceleration.tlas, TlasWork::Refit);
        assert_eq!((figures.resets, figures.samples), (resets, frames + 1), "samples are kept");
        // What was built in the background can be refitted like the one before.
        studio.frame(&slid(room.mesh, 0.6));
        assert_eq!(work(&studio).0, 0);
        let after = studio.read();
        drop(studio);
        assert!(largest_difference(&after, &slid_room(0.6)) < 1e-6);
    }
}

#[test]
fn an_edit_while_the_background_builds_is_not_lost() {
    let room = room();
    let mut studio = studio_of(&room, AccelPolicy { compact: false, ..AccelPolicy::default() });
    studio.frames(1);
    // Loosened in one frame, prepared there, submitted in the next one, which moves it again.
    studio.frame(&slid(room.mesh, 0.0));
    studio.frame(&slid(room.mesh, 2.5));
    studio.frame(&slid(room.mesh, 0.5));
    let after = studio.read();
    studio.frames(3);
    let settled = studio.mean(1);
    assert!(studio.statistics().acceleration.total_blas_swapped >= 1);
    drop(studio);
    let expected = slid_room(0.5);
    assert!(largest_difference(&after, &expected) < 1e-6);
    let changed = settled.mean.iter().zip(&expected.mean).filter(|(a, b)| (a[0] - b[0]).abs() > 0.3).count();
    assert!(changed < 60, "{changed} pixels are those of another scene");
}

#[test]
fn what_was_begun_for_another_mesh_is_dropped() {
    let room = room();
    let policy = AccelPolicy { compact: false, wait: false, ..AccelPolicy::default() };
    let mut studio = studio_of(&room, policy);
    studio.frames(1);
    studio.frame(&slid(room.mesh, 0.0));
    // Loosened here, and so begun in the background; in the next frame the mesh has other triangles.
    studio.frame(&slid(room.mesh, 2.5));
    let mut other = pair();
    other.indices.truncate(other.indices.len() - 24);
    other.geometries[1].index_count -= 24;
    other.geometries[1].mesh_from_primitive = shift(0.5);
    let other = Arc::new(other);
    let replaced = SceneDelta {
        meshes: vec![(room.mesh, Arc::clone(&other))],
        reason: String::from("replaced"),
        ..SceneDelta::default()
    };
    studio.frame(&replaced);
    assert_eq!(work(&studio).0, 1);
    let mut frames = 0;
    while studio.renderer.is_busy() {
        studio.frames(1);
        frames += 1;
        assert!(frames < 200, "the background never ends");
    }
    let found = studio.read();
    assert_eq!(studio.statistics().acceleration.total_blas_swapped, 0, "it is of another mesh");
    drop(studio);
    let mut fresh = room;
    fresh
        .scene
        .delta
        .meshes
        .iter_mut()
        .filter(|(id, _)| *id == fresh.mesh)
        .for_each(|(_, m)| *m = Arc::clone(&other));
    let mut fresh = studio_of(&fresh, AccelPolicy::default());
    let expected = fresh.mean(frames + 1);
    assert!(largest_difference(&found, &expected) < 1e-5);
}

#[test]
fn an_edited_mesh_that_rests_is_built_to_be_traced_fast_and_compacted() {
    let room = room();
    let mut studio = studio_of(&room, AccelPolicy::default());
    // Sizes are asked for in one frame, copied in the next, in use in the third.
    studio.frames(6);
    let first = studio.statistics().acceleration;
    assert_eq!((first.total_blas_compacted, first.blas_background), (4, 0));
    studio.frame(&slid(room.mesh, 0.5));
    let resets = studio.statistics().resets;
    studio.frames(110);
    let edited = studio.statistics().acceleration;
    assert_eq!(edited.total_blas_swapped, 4, "still dynamic");
    studio.frames(20);
    let figures = studio.statistics();
    assert_eq!(figures.acceleration.total_blas_swapped, 6, "built once more, then compacted");
    assert_eq!(figures.acceleration.total_blas_compacted, 5);
    assert_eq!((figures.resets, figures.samples), (resets, 131));
    let long = studio.read();
    drop(studio);
    let mut fresh = studio_with_slid(0.5);
    let expected = fresh.mean(131);
    assert!(largest_difference(&long, &expected) < 1e-5);
}

fn studio_with_slid(x: f32) -> Studio {
    let mut room = room();
    for (id, mesh) in &mut room.scene.delta.meshes {
        if *id == room.mesh {
            let mut moved = Mesh::clone(mesh);
            moved.geometries[1].mesh_from_primitive = shift(x);
            *mesh = Arc::new(moved);
        }
    }
    studio_of(&room, AccelPolicy::default())
}

#[test]
fn first_builds_past_the_budget_come_later_while_frames_go_on() {
    for wait in [true, false] {
        let room = room();
        let policy =
            AccelPolicy { frame_triangles: Some(3000), wait, compact: false, ..AccelPolicy::default() };
        let mut studio = studio_of(&room, policy);
        studio.frames(2);
        let before = studio.read();
        let mut more = Scene::starting_at(1000);
        more.put(sphere(0.3, 100), lambert(0.5), Affine3A::from_translation(Vec3::new(0.9, 0.3, 0.8)));
        studio.frame(&more.delta);
        assert_eq!(studio.statistics().acceleration.blas_pending, 1);
        assert_eq!(work(&studio).0, 0);
        let resets = studio.statistics().resets;
        let mut frames = 0;
        while studio.renderer.is_busy() {
            studio.frames(1);
            frames += 1;
            assert!(frames < 500, "it never came");
        }
        let figures = studio.statistics();
        assert_eq!((figures.acceleration.blas_pending, figures.acceleration.tlas), (0, TlasWork::Built));
        assert_eq!(figures.reset_reason, "built what was pending");
        assert_eq!((figures.samples, figures.resets), (1, resets + 1));
        let late = studio.read();
        drop(studio);
        assert!(largest_difference(&before, &late) > 0.05);
        let mut whole = room.scene.delta.clone();
        whole.meshes.extend(more.delta.meshes);
        whole.materials.extend(more.delta.materials);
        whole.instances.extend(more.delta.instances);
        let at_once = Studio::of(EXTENT, hybrid(), &whole, room.camera).mean(1);
        assert!(largest_difference(&late, &at_once) < 1e-6);
    }
}

/// A row of boxes, one metre apart.
fn row() -> (Scene, Vec<InstanceId>, Camera) {
    let mut scene = Scene::new();
    let (mesh, material) = (scene.mesh(cube(0.6)), scene.material(lambert(0.5)));
    let boxes = (0..12).map(|i| scene.place(mesh, material, in_row(i))).collect();
    scene.light(point_light(Vec3::new(0.0, 4.0, 6.0), 30.0));
    (scene, boxes, camera_at(Vec3::new(0.0, 2.0, 14.0), Vec3::ZERO, 0.7))
}

fn in_row(place: u8) -> Affine3A {
    Affine3A::from_translation(Vec3::X * (f32::from(place) - 5.5))
}

#[test]
fn a_tree_whose_instances_have_moved_far_is_built_anew() {
    let (scene, boxes, camera) = row();
    let mut studio = Studio::of(EXTENT, hybrid(), &scene.delta, camera);
    studio.frames(3);
    let moved = |by: u8| SceneDelta {
        transforms: (0..12).zip(&boxes).map(|(i, id)| (*id, in_row((i + by) % 12))).collect(),
        ..SceneDelta::default()
    };
    studio.frame(&SceneDelta { transforms: vec![(boxes[0], in_row(11))], ..SceneDelta::default() });
    assert_eq!(work(&studio), (0, 0, TlasWork::Refit), "one of twelve");
    studio.frame(&moved(6));
    assert_eq!(work(&studio), (0, 0, TlasWork::Built), "all of them, by half of the row");
    let after = studio.read();
    studio.frame(&moved(7));
    assert_eq!(work(&studio), (0, 0, TlasWork::Refit), "counted from the last build");
    drop(studio);
    let mut fresh = scene;
    fresh
        .delta
        .instances
        .iter_mut()
        .zip(0..)
        .for_each(|((_, box_), i)| box_.render_from_mesh = in_row((i + 6) % 12));
    let expected = Studio::of(EXTENT, hybrid(), &fresh.delta, camera).mean(1);
    assert!(largest_difference(&after, &expected) < 1e-6);
}

#[test]
fn who_takes_anothers_slot_has_the_tree_built_anew() {
    let (scene, boxes, camera) = row();
    let mut studio = Studio::of(EXTENT, hybrid(), &scene.delta, camera);
    studio.frames(3);
    // The same mesh, the same number of instances, the same active states: only nothing stands where it stood.
    let (_, first) = scene.delta.instances[0].clone();
    let render_from_mesh = Affine3A::from_translation(Vec3::new(2.0, 2.0, 1.0));
    let added = (InstanceId { node: 900, part: 0 }, Instance { render_from_mesh, ..first });
    studio.frame(&SceneDelta {
        removed_instances: vec![boxes[0]],
        instances: vec![added.clone()],
        ..SceneDelta::default()
    });
    assert_eq!(work(&studio), (0, 0, TlasWork::Built));
    let after = studio.read();
    drop(studio);
    let mut fresh = scene;
    fresh.delta.instances.remove(0);
    fresh.delta.instances.push(added);
    let expected = Studio::of(EXTENT, hybrid(), &fresh.delta, camera).mean(1);
    assert!(largest_difference(&after, &expected) < 1e-6);
}

#[test]
fn hiding_is_a_mask_and_a_refit() {
    let room = room();
    let mut studio = studio_of(&room, AccelPolicy { compact: false, ..AccelPolicy::default() });
    let before = studio.mean(1);
    let set = |visibility| SceneDelta {
        visibility: vec![(room.pair, visibility)],
        reason: String::from("hid Pair"),
        ..SceneDelta::default()
    };
    let all = Visibility::default();
    studio.frame(&set(Visibility { shown: false, ..all }));
    assert_eq!(work(&studio), (0, 0, TlasWork::Refit));
    let hidden = studio.read();
    assert!(largest_difference(&before, &hidden) > 0.05);
    studio.frame(&set(all));
    assert_eq!(work(&studio), (0, 0, TlasWork::Refit));
    assert!(largest_difference(&before, &studio.read()) < 1e-6);
}

#[test]
fn masks_tell_the_camera_from_shadows_and_mirrors() {
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced] {
        let room = room();
        let settings = ViewSettings { pipeline, ..ViewSettings::default() };
        let mut studio = Studio::of(EXTENT, settings, &room.scene.delta, room.camera);
        let all = Visibility::default();
        let mut image = |visibility| {
            studio.frame(&SceneDelta { visibility: vec![(room.pair, visibility)], ..SceneDelta::default() });
            studio.read()
        };
        let [whole, gone, unseen, shadowless] = [
            all,
            Visibility { shown: false, ..all },
            Visibility { to_camera: false, ..all },
            Visibility { to_shadows: false, ..all },
        ]
        .map(&mut image);
        let differing = |a: &Accumulated, b: &Accumulated| {
            a.mean.iter().zip(&b.mean).filter(|(p, q)| (p[0] - q[0]).abs() > 1e-4).count()
        };
        // Not seen by the camera: its shadow and its mirror image are still there.
        assert!(differing(&unseen, &whole) > 30, "{}", pipeline.name());
        assert!(differing(&unseen, &gone) > 30, "{}", pipeline.name());
        // Without shadow: only pixels get lighter, and those of the object itself stay.
        assert!(differing(&shadowless, &whole) > 20, "{}", pipeline.name());
        let darker = shadowless.mean.iter().zip(&whole.mean).filter(|(p, q)| p[0] < q[0] - 1e-4).count();
        assert_eq!(darker, 0, "{}", pipeline.name());
    }
}

#[test]
fn a_material_that_lets_light_through_takes_another_blas_and_no_other_is_touched() {
    for frame_triangles in [None, Some(1)] {
        let room = room();
        let material = room.scene.delta.materials[3].0;
        let policy = AccelPolicy { frame_triangles, wait: true, compact: false, ..AccelPolicy::default() };
        let mut studio = studio_of(&room, policy);
        studio.frames(12);
        let change = |to: Material| SceneDelta { materials: vec![(material, to)], ..SceneDelta::default() };
        studio.frame(&change(lambert(0.2)));
        assert_eq!(work(&studio), (0, 0, TlasWork::Kept), "a colour is no geometry");
        let glass = Material { mode: ShadingMode::Refractive, ior: 1.5, ..Material::default() };
        studio.frame(&change(glass.clone()));
        assert_eq!(work(&studio), (1, 0, TlasWork::Refit), "no instance has come, gone or moved");
        assert_eq!(studio.statistics().acceleration.blas_count, 4, "the old one is dropped");
        studio.frame(&change(Material { ior: 1.3, ..glass }));
        assert_eq!(work(&studio), (0, 0, TlasWork::Kept));
    }
}

#[test]
fn idle_frames_do_nothing_at_all() {
    let room = room();
    let mut studio = studio_of(&room, AccelPolicy::default());
    studio.frames(8);
    let settled = studio.statistics();
    studio.frames(4);
    let figures = studio.statistics();
    assert_eq!(work(&studio), (0, 0, TlasWork::Kept));
    let totals = |a: &AccelStatistics| {
        (a.total_blas_built, a.total_blas_refit, a.total_blas_swapped, a.total_tlas_built, a.total_tlas_refit)
    };
    assert_eq!(totals(&figures.acceleration), totals(&settled.acceleration));
    assert_eq!((figures.resets, figures.samples), (settled.resets, settled.samples + 4));
    assert!(figures.uploaded_bytes < 1024, "the frame's constants alone: {}", figures.uploaded_bytes);
}

#[test]
fn lights_and_environment_touch_no_structure() {
    let room = room();
    let light = room.scene.delta.lights[0].0;
    let mut studio = studio_of(&room, AccelPolicy { compact: false, ..AccelPolicy::default() });
    studio.frames(2);
    let resets = studio.statistics().resets;
    studio.frame(&SceneDelta {
        lights: vec![(
            light,
            Light::Point {
                position: Vec3::new(-1.0, 2.0, 1.0),
                intensity: Vec3::splat(4.0),
                radius_m: 0.0,
                range_m: f32::INFINITY,
            },
        )],
        environment: Some(caustica_renderer::delta::Environment::Constant(Vec3::splat(0.1))),
        ..SceneDelta::default()
    });
    assert_eq!(work(&studio), (0, 0, TlasWork::Kept));
    // With an environment there is noise: the first frame after the change is denoised, not accumulated.
    assert_eq!((studio.statistics().samples, studio.statistics().resets), (0, resets + 1));
}
