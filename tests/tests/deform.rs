//! Meshes that deform: the picture is that of the same mesh deformed beforehand, instances follow poses of their own,
//! motion vectors know where the vertices were, and a pose costs its joints alone.
#![expect(clippy::expect_used, reason = "a test says what is wrong by panicking")]

use std::sync::Arc;

use caustica_renderer::delta::{
    Camera, Deformation, InstanceId, Mesh, MeshId, MorphTarget, Pose, SceneDelta,
};
use caustica_renderer::{Accumulated, Pipeline, Show, ToneMap, ViewSettings};
use caustica_tests::numbers::is_near;
use caustica_tests::scene::{Scene, camera_at, camera_parallel, lambert, mesh_of, point_light, quad};
use caustica_tests::studio::Studio;
use glam::{Affine3A, Quat, Vec2, Vec3, Vec3A};

const EXTENT: [u32; 2] = [96, 64];
const RINGS: u32 = 24;

fn settings(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, temporal: false, ..ViewSettings::default() }
}

/// A bar of height 2 that stands on the origin. The second joint takes over from the first around its middle.
fn bar() -> Mesh {
    let (mut positions, mut normals, mut tex_coords, mut indices) = (vec![], vec![], vec![], vec![]);
    for side in 0..4 {
        let turn = Quat::from_rotation_y(side as f32 * std::f32::consts::FRAC_PI_2);
        for ring in 0..=RINGS {
            for x in [-0.2, 0.2] {
                let y = 2.0 * ring as f32 / RINGS as f32;
                positions.push(turn * Vec3::new(x, y, 0.2));
                normals.push(turn * Vec3::Z);
                tex_coords.push(Vec2::new(x, y));
            }
        }
        let first = side * 2 * (RINGS + 1);
        for ring in 0..RINGS {
            let corner = |i: u32| first + 2 * ring + i;
            indices.extend([0, 1, 3, 0, 3, 2].map(corner));
        }
    }
    let share = |p: &Vec3| (p.y - 0.5).clamp(0.0, 1.0);
    let weights = positions.iter().map(|p| [1.0 - share(p), share(p), 0.0, 0.0]).collect();
    let joints = vec![[0, 1, 0, 0]; positions.len()];
    let mut mesh = mesh_of("bar", positions, normals, tex_coords, indices);
    mesh.deformation = Some(Deformation { joints, weights, joint_count: 2, targets: Vec::new() });
    mesh
}

/// Bends the upper half of the bar by an angle and stretches it unevenly; it grows longer by `taller`.
fn bent(angle_rad: f32, taller: f32) -> Pose {
    let middle = Vec3::new(0.0, 1.0, 0.0);
    let turn = Affine3A::from_scale_rotation_translation(
        Vec3::new(1.5, taller, 0.75),
        Quat::from_rotation_z(angle_rad),
        Vec3::ZERO,
    );
    let upper = Affine3A::from_translation(middle) * turn * Affine3A::from_translation(-middle);
    Pose { joints: vec![Affine3A::IDENTITY, upper], weights: Vec::new() }
}

/// The mesh as its pose makes it, rigid: a linear blend of joints, normals by cofactors.
fn deformed(mesh: &Mesh, pose: &Pose) -> Mesh {
    let mut rigid = mesh.clone();
    let deformation = rigid.deformation.take().expect("a mesh that deforms");
    for (target, weight) in deformation.targets.iter().zip(&pose.weights) {
        let add = |sum: &mut Vec3, offset: &Vec3| *sum += *weight * *offset;
        rigid.positions.iter_mut().zip(&target.positions).for_each(|(sum, offset)| add(sum, offset));
        rigid.normals.iter_mut().zip(&target.normals).for_each(|(sum, offset)| add(sum, offset));
    }
    for (vertex, (joints, weights)) in deformation.joints.iter().zip(&deformation.weights).enumerate() {
        let joint = |i: usize| pose.joints[usize::from(joints[i])];
        let blend = |of: fn(&Affine3A) -> Vec3A| (0..4).map(|i| of(&joint(i)) * weights[i]).sum::<Vec3A>();
        let (x, y, z) =
            (blend(|m| m.matrix3.x_axis), blend(|m| m.matrix3.y_axis), blend(|m| m.matrix3.z_axis));
        let map =
            Affine3A { matrix3: glam::Mat3A::from_cols(x, y, z), translation: blend(|m| m.translation) };
        let normal = Vec3A::from(rigid.normals[vertex]);
        let turned = y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z;
        rigid.positions[vertex] = map.transform_point3(rigid.positions[vertex]);
        rigid.normals[vertex] = turned.into();
        let tangent = map.transform_vector3(rigid.tangents[vertex].truncate()).normalize();
        rigid.tangents[vertex] = tangent.extend(rigid.tangents[vertex].w);
    }
    rigid.normals.iter_mut().for_each(|normal| *normal = normal.normalize());
    rigid
}

/// Meshes side by side on a floor under a lamp, each in its pose. What is given twice is one mesh with two instances.
fn row(meshes: &[(&Arc<Mesh>, Option<Pose>)]) -> (Scene, Vec<InstanceId>, Camera) {
    let mut scene = Scene::new();
    let lying = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.put(quad(9.0, 9.0), lambert(0.7), lying);
    scene.light(point_light(Vec3::new(1.0, 4.0, 3.0), 20.0));
    let material = scene.material(lambert(0.5));
    let mut ids: Vec<(*const Mesh, MeshId)> = Vec::new();
    let mut placed = Vec::new();
    for (i, (mesh, pose)) in meshes.iter().enumerate() {
        let known = ids.iter().find(|(known, _)| *known == Arc::as_ptr(mesh)).map(|(_, id)| *id);
        let id = known.unwrap_or_else(|| scene.mesh(mesh.as_ref().clone()));
        ids.push((Arc::as_ptr(mesh), id));
        let x = 1.8 * (i as f32 - 0.5 * (meshes.len() - 1) as f32);
        let instance = scene.place(id, material, Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)));
        scene.delta.instances.last_mut().expect("an instance").1.pose.clone_from(pose);
        placed.push(instance);
    }
    (scene, placed, camera_at(Vec3::new(0.0, 2.5, 6.0), Vec3::new(0.0, 1.0, 0.0), 0.6))
}

fn picture(pipeline: Pipeline, scene: &Scene, camera: Camera) -> Accumulated {
    Studio::of(EXTENT, settings(pipeline), &scene.delta, camera).mean(4)
}

/// Pixels that differ by more than 1e-5: rounding may move an edge across a sample, and there two things are seen.
fn differing(a: &Accumulated, b: &Accumulated) -> usize {
    let far = |(p, q): &(&[f32; 3], &[f32; 3])| (0..3).any(|c| !is_near(p[c].into(), q[c].into(), 1e-5));
    a.mean.iter().zip(&b.mean).filter(far).count()
}

fn pose_delta(id: InstanceId, pose: Pose) -> SceneDelta {
    SceneDelta { poses: vec![(id, pose)], reason: String::from("posed"), ..SceneDelta::default() }
}

#[test]
fn instances_of_one_mesh_look_as_if_each_was_modelled_in_its_pose() {
    let mesh = Arc::new(bar());
    let poses = [bent(0.9, 1.0), bent(-0.4, 1.3)];
    let modelled = poses.each_ref().map(|pose| Arc::new(deformed(&mesh, pose)));
    let rest = Arc::new(Mesh { deformation: None, ..mesh.as_ref().clone() });
    for pipeline in Pipeline::ALL {
        let [left, right] = poses.clone();
        let (scene, _, camera) = row(&[(&mesh, Some(left)), (&mesh, None), (&mesh, Some(right))]);
        let found = picture(pipeline, &scene, camera);
        let (scene, _, _) = row(&[(&modelled[0], None), (&rest, None), (&modelled[1], None)]);
        let expected = picture(pipeline, &scene, camera);
        let wrong = differing(&found, &expected);
        assert!(wrong <= 2, "{}: {wrong} pixels differ", pipeline.name());
        let (scene, _, _) = row(&[(&rest, None), (&rest, None), (&rest, None)]);
        assert!(differing(&found, &picture(pipeline, &scene, camera)) > 200, "the poses are seen");
    }
}

/// A quad with two targets: one lifts two corners, one pulls a corner out and turns the normals.
fn morphing() -> Mesh {
    let mut mesh = quad(2.0, 2.0);
    for vertex in &mut mesh.positions {
        vertex.y += 1.0;
    }
    let lift = vec![Vec3::ZERO, Vec3::ZERO, Vec3::new(0.0, 0.5, 0.25), Vec3::new(0.0, -0.5, 0.5)];
    let pull = vec![Vec3::ZERO, Vec3::new(1.0, 0.0, 0.5), Vec3::ZERO, Vec3::ZERO];
    let turn = vec![Vec3::ZERO, Vec3::new(0.5, 0.25, 0.0), Vec3::ZERO, Vec3::new(-0.5, 0.0, 0.0)];
    mesh.deformation = Some(Deformation {
        targets: vec![
            MorphTarget { positions: lift, ..MorphTarget::default() },
            MorphTarget { positions: pull, normals: turn, ..MorphTarget::default() },
        ],
        ..Deformation::default()
    });
    mesh
}

#[test]
fn a_morphed_quad_looks_as_if_it_was_modelled_so() {
    let mesh = Arc::new(morphing());
    for pipeline in Pipeline::ALL {
        // Sums that single precision holds exactly, and normals that stay: equal to the bit.
        for (weights, exact) in [(vec![0.5, 0.0], true), (vec![-1.0, 0.75], false)] {
            let pose = Pose { joints: Vec::new(), weights };
            let (scene, _, camera) = row(&[(&Arc::new(deformed(&mesh, &pose)), None)]);
            let expected = picture(pipeline, &scene, camera);
            let (scene, _, _) = row(&[(&mesh, Some(pose))]);
            let found = picture(pipeline, &scene, camera);
            if exact {
                assert_eq!(found, expected, "{}", pipeline.name());
            }
            assert!(differing(&found, &expected) <= 2, "{}", pipeline.name());
        }
    }
}

#[test]
fn a_new_pose_is_seen_in_the_next_frame_and_the_old_one_comes_back() {
    let mesh = Arc::new(bar());
    for pipeline in Pipeline::ALL {
        let (scene, ids, camera) = row(&[(&mesh, None), (&mesh, Some(bent(0.3, 1.0)))]);
        let mut studio = Studio::of(EXTENT, settings(pipeline), &scene.delta, camera);
        let before = studio.mean(4);
        studio.frame(&pose_delta(ids[0], bent(-1.0, 1.0)));
        assert_eq!(studio.statistics().samples, 1, "a pose resets the samples");
        let after = studio.mean(4);
        let still = Pose { joints: vec![Affine3A::IDENTITY; 2], weights: Vec::new() };
        studio.frame(&pose_delta(ids[0], still));
        let back = studio.mean(4);
        drop(studio);
        let (scene, _, _) = row(&[(&mesh, Some(bent(-1.0, 1.0))), (&mesh, Some(bent(0.3, 1.0)))]);
        let expected = picture(pipeline, &scene, camera);
        assert!(differing(&before, &after) > 100);
        assert_eq!(differing(&after, &expected), 0, "{}", pipeline.name());
        assert_eq!(differing(&back, &before), 0, "{}", pipeline.name());
    }
}

#[test]
fn a_pose_uploads_its_joints_and_refits_one_tree() {
    let mesh = Arc::new(bar());
    let (scene, ids, camera) = row(&[(&mesh, None)]);
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    studio.frames(3);
    let idle = studio.statistics().uploaded_bytes;
    for step in 0..6 {
        studio.frame(&pose_delta(ids[0], bent(0.1 * step as f32, 1.0)));
        let figures = studio.statistics();
        assert_eq!((figures.acceleration.blas_built, figures.acceleration.blas_refit), (0, 1), "step {step}");
        let bytes = figures.uploaded_bytes - idle;
        // The joints, a job, an instance number or two, and in the first of these frames a geometry record.
        assert!(bytes < 512, "step {step}: {bytes} bytes, of a mesh of {}", mesh.positions.len() * 64);
    }
    studio.frames(1);
    studio.frame(&pose_delta(ids[0], bent(0.5, 1.0)));
    let figures = studio.statistics();
    assert_eq!((figures.acceleration.blas_refit, figures.uploaded_bytes), (0, idle), "the pose that it has");
}

/// Motion in pixels at a pixel, from the picture of the motion vectors.
fn motion_at(picture: &[[f32; 4]], pixel: [u32; 2]) -> Vec2 {
    let encoded = |linear: f32| {
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
    };
    let [red, green, ..] = picture[(pixel[1] * EXTENT[0] + pixel[0]) as usize];
    Vec2::new(encoded(red) - 0.5, encoded(green) - 0.5) * 16.0
}

/// The pixels' distance from the middle of the picture, metres (x right, y up); the camera of [`flat`] shows 3 of them.
fn metres(pixel: [u32; 2]) -> Vec2 {
    let centre = Vec2::new(EXTENT[0] as f32, EXTENT[1] as f32) * 0.5;
    let offset = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) - centre;
    Vec2::new(offset.x, -offset.y) * (3.0 / EXTENT[1] as f32)
}

/// A quad that fills the picture's middle, with a target that stretches it along x and one that lifts it. Seen from the
/// front without perspective: 1 metre is a third of the picture's height.
fn flat(pipeline: Pipeline) -> (Studio, InstanceId, MeshId) {
    let mut scene = Scene::new();
    let mut mesh = quad(2.0, 2.0);
    let stretch = mesh.positions.iter().map(|p| Vec3::new(p.x, 0.0, 0.0)).collect();
    let lift = vec![Vec3::Y; 4];
    let target = |positions| MorphTarget { positions, ..MorphTarget::default() };
    mesh.deformation =
        Some(Deformation { targets: vec![target(stretch), target(lift)], ..Deformation::default() });
    let instance = scene.put(mesh, lambert(0.5), Affine3A::IDENTITY);
    let id = scene.delta.meshes[0].0;
    scene.light(point_light(Vec3::new(0.0, 0.0, 3.0), 5.0));
    let settings = ViewSettings {
        pipeline,
        show: Show::Motion,
        jitter: false,
        tone_map: ToneMap::Linear,
        ..ViewSettings::default()
    };
    (Studio::of(EXTENT, settings, &scene.delta, camera_parallel(3.0, 1.5)), instance, id)
}

fn stretched(stretch: f32, lift: f32) -> Pose {
    Pose { joints: Vec::new(), weights: vec![stretch, lift] }
}

/// Compares the motion of pixels on the quad with where their points were; `was`: place now to place before, metres.
fn assert_motion(studio: &mut Studio, what: &str, was: impl Fn(Vec2) -> Vec2) {
    let picture = studio.display();
    for pixel in [[48, 32], [40, 28], [60, 33], [36, 40], [57, 24]] {
        let now = metres(pixel);
        let moved_m = now - was(now);
        let expected = Vec2::new(moved_m.x, -moved_m.y) * (EXTENT[1] as f32 / 3.0);
        let found = motion_at(&picture, pixel);
        // The picture holds half floats: steps of 0.01 pixels.
        assert!(
            (found - expected).length() < 0.02,
            "{what}, {pixel:?}: moved by {found}, expected {expected}"
        );
    }
}

#[test]
fn motion_vectors_know_where_the_vertices_were() {
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced] {
        let (mut studio, id, _) = flat(pipeline);
        studio.frames(2);
        assert_motion(&mut studio, "at rest", |now| now);
        studio.frame(&pose_delta(id, stretched(0.25, 0.125)));
        assert_motion(&mut studio, "first pose", |now| Vec2::new(now.x / 1.25, now.y - 0.125));
        studio.frame(&pose_delta(id, stretched(0.5, 0.0)));
        assert_motion(&mut studio, "second pose", |now| Vec2::new(now.x * 1.25 / 1.5, now.y + 0.125));
        studio.frame(&pose_delta(id, stretched(0.5, 0.0)));
        assert_motion(&mut studio, "same pose", |now| now);
        studio.frames(1);
        assert_motion(&mut studio, "at rest again", |now| now);
        let moved = SceneDelta {
            transforms: vec![(id, Affine3A::from_translation(Vec3::new(0.0625, 0.0, 0.0)))],
            ..pose_delta(id, stretched(0.75, 0.0))
        };
        studio.frame(&moved);
        let was = |now: Vec2| Vec2::new((now.x - 0.0625) * 1.5 / 1.75, now.y);
        assert_motion(&mut studio, "pose and place", was);
        studio.frames(1);
        assert_motion(&mut studio, "at rest at last", |now| now);
    }
}

#[test]
fn a_primitive_of_a_deforming_mesh_can_be_moved() {
    for pipeline in [Pipeline::Hybrid, Pipeline::Raytraced] {
        let (mut studio, id, mesh) = flat(pipeline);
        studio.frames(2);
        studio.frame(&pose_delta(id, stretched(0.25, 0.0)));
        let there = Affine3A::from_translation(Vec3::new(0.0, 0.1875, 0.0));
        let delta = SceneDelta {
            primitive_transforms: vec![(mesh, 0, there)],
            reason: String::from("moved primitive"),
            ..SceneDelta::default()
        };
        studio.frame(&delta);
        assert_motion(&mut studio, "primitive", |now| now - Vec2::new(0.0, 0.1875));
        studio.frames(1);
        assert_motion(&mut studio, "at rest", |now| now);
        studio.frame(&pose_delta(id, stretched(0.5, 0.0)));
        assert_motion(&mut studio, "pose of a moved primitive", |now| Vec2::new(now.x * 1.25 / 1.5, now.y));
        // The upper edge stands 0.1875 m higher: there the quad is seen now, below no longer.
        studio.set(|settings| settings.show = Show::Instance);
        studio.frames(1);
        let seen = studio.display();
        let shown = |y: u32| seen[(y * EXTENT[0] + 48) as usize][..3] != [0.0; 3];
        let rows: Vec<u32> = (0..EXTENT[1]).filter(|y| shown(*y)).collect();
        let bounds =
            rows.first().zip(rows.last()).map(|(top, bottom)| (metres([0, *top]).y, metres([0, *bottom]).y));
        let (top, bottom) = bounds.expect("the quad is seen");
        let step = 3.0 / EXTENT[1] as f32;
        assert!((top - 1.1875).abs() < step && (bottom + 0.8125).abs() < step, "{top} to {bottom}");
    }
}

#[test]
fn what_does_not_fit_is_refused_by_name_and_harms_nothing() {
    let mesh = Arc::new(bar());
    let (scene, ids, camera) = row(&[(&mesh, Some(bent(0.5, 1.0)))]);
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Hybrid), &scene.delta, camera);
    let before = studio.mean(2);
    let short = Pose { joints: vec![Affine3A::IDENTITY], weights: Vec::new() };
    let nan = Pose { joints: vec![Affine3A::from_scale(Vec3::NAN); 2], weights: Vec::new() };
    let mut strange = bar();
    if let Some(deformation) = &mut strange.deformation {
        deformation.joints[7][1] = 2;
    }
    let replaced = SceneDelta { meshes: vec![(MeshId(999), Arc::new(strange))], ..SceneDelta::default() };
    for (delta, words) in [
        (pose_delta(ids[0], short), "the pose has 1 joints, the mesh 2"),
        (pose_delta(ids[0], nan), "joint 0 of the pose is not finite"),
        (replaced, "joint 2 is named, there are 2"),
    ] {
        let mut recorder = studio.session.frames.begin().expect("a frame");
        let error = studio.renderer.apply(&mut recorder, &delta).expect_err("refused").to_string();
        studio.session.frames.submit(recorder, None).expect("a submission");
        assert!(error.contains("mesh 'bar'") && error.contains(words), "{error}");
    }
    // Another pose and back: the same once more would be no change.
    studio.frame(&pose_delta(ids[0], bent(0.2, 1.0)));
    let reason = String::from("again");
    studio.frame(&SceneDelta { reason, ..pose_delta(ids[0], bent(0.5, 1.0)) });
    assert_eq!(studio.mean(2).mean, before.mean);
}

#[test]
fn a_mesh_may_start_and_stop_to_deform() {
    let mesh = Arc::new(bar());
    let rigid = Arc::new(Mesh { deformation: None, ..bar() });
    let (posed, ids, camera) = row(&[(&mesh, Some(bent(0.7, 1.0)))]);
    let (still, _, _) = row(&[(&rigid, None)]);
    let mut studio = Studio::of(EXTENT, settings(Pipeline::Raytraced), &still.delta, camera);
    let at_rest = studio.mean(2);
    // The mesh alone is replaced: the instance deforms, and is at rest.
    let id = posed.delta.instances.last().expect("an instance").1.mesh;
    let replace = |mesh: &Arc<Mesh>| SceneDelta {
        meshes: vec![(id, Arc::clone(mesh))],
        reason: String::from("replaced"),
        ..SceneDelta::default()
    };
    studio.frame(&replace(&mesh));
    assert_eq!(studio.mean(2).mean, at_rest.mean);
    studio.frame(&pose_delta(ids[0], bent(0.7, 1.0)));
    let bent_bar = studio.mean(2);
    assert!(differing(&bent_bar, &at_rest) > 100);
    studio.frame(&replace(&rigid));
    assert_eq!(studio.mean(2).mean, at_rest.mean);
    // All at once: mesh and pose in one delta.
    studio.frame(&posed.delta);
    assert_eq!(studio.mean(2).mean, bent_bar.mean);
    // The mesh with another joint, and the pose that fits it alone.
    let mut jointed = bar();
    if let Some(deformation) = &mut jointed.deformation {
        deformation.joint_count = 3;
    }
    let mut pose = bent(0.7, 1.0);
    pose.joints.push(Affine3A::ZERO);
    let jointed = replace(&Arc::new(jointed));
    studio.frame(&SceneDelta { poses: vec![(ids[0], pose)], ..jointed });
    assert_eq!(studio.mean(2).mean, bent_bar.mean);
    studio.frame(&SceneDelta { removed_instances: ids, ..replace(&mesh) });
    studio.frames(2);
}

#[test]
fn pictures_of_motion_are_read_as_they_are_drawn() {
    // Grey is rest, full colour 8 pixels.
    let grey = 0.214_041_14;
    let picture = vec![[grey, 1.0, 0.0, 1.0]; (EXTENT[0] * EXTENT[1]) as usize];
    let found = motion_at(&picture, [3, 4]);
    assert!((found - Vec2::new(0.0, 8.0)).length() < 1e-4, "{found}");
}
