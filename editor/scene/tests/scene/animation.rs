//! The pose of a time: where things are and how they bend, that it is taken off without a trace, and that it goes
//! along with edits.

use std::path::Path;

use caustica_scene::import::{ImportOptions, load};
use caustica_scene::{
    Animation, Channel, ChannelPath, ClipChoice, DeformPose, Document, Driven, Edit, EditError,
    Interpolation, Local, Node, NodeId, NodeKind, OverrideField, Project, ProjectMeta, Target, Trs,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::common::{ARM, LAMP, PLATE, Scene, assets, scene, trs};
use crate::oracle::Oracle;

/// A document with one instance of a shared model.
pub fn placed(path: &Path) -> (Document, NodeId) {
    let mut document = Document::new();
    let imported = load(path, &ImportOptions::default()).unwrap();
    let prefab = document.add_imported(imported).unwrap();
    let (node, edit) = document.instantiate_edit(prefab, None, trs(3.0, 0.4, 1.5));
    document.apply(edit).unwrap();
    document.drain_changes();
    (document, node)
}

/// The parts of an instance that a skin bends.
pub fn skinned(document: &Document, node: NodeId) -> Vec<Target> {
    let prefab = document.prefab(document.node(node).unwrap().prefab().unwrap()).unwrap();
    let parts = 0..prefab.nodes().len() as u32;
    parts.filter(|&part| prefab.skin_of(part).is_some()).map(|part| Target::part(node, part)).collect()
}

/// Where a pose puts each vertex, world space, one by one.
pub fn bent(document: &Document, target: Target) -> Vec<DVec3> {
    let placed = document.renderable(target).unwrap();
    let mesh = document.mesh(placed.mesh).unwrap();
    let pose = document.deform_pose(target).unwrap();
    let position = |i: usize| {
        let mut p = mesh.data.positions[i].as_dvec3();
        for (target, &weight) in mesh.data.morph.iter().zip(&pose.weights) {
            p += target.positions.get(i).copied().unwrap_or_default().as_dvec3() * f64::from(weight);
        }
        let Some(skin) = mesh.data.skin.as_ref().filter(|_| !pose.joint_matrices.is_empty()) else {
            return p;
        };
        let holds = skin.joints[i].into_iter().zip(skin.weights[i]).filter(|(_, weight)| *weight > 0.0);
        let places: Vec<DVec3> = holds
            .map(|(j, weight)| pose.joint_matrices[j as usize].transform_point3(p) * f64::from(weight))
            .collect();
        if places.is_empty() { p } else { places.into_iter().sum() }
    };
    (0..mesh.data.positions.len()).map(|i| placed.world_from_mesh.transform_point3(position(i))).collect()
}

#[test]
fn joint_matrices_are_those_worked_out_from_the_file() {
    for name in
        ["gltf/SimpleSkin/glTF-Embedded/SimpleSkin.gltf", "gltf/RiggedSimple/glTF-Binary/RiggedSimple.glb"]
    {
        let Some(path) = assets(name) else { continue };
        let (mut document, node) = placed(&path);
        let oracle = Oracle::open(&path);
        let skin = oracle.document.skins().next().unwrap();
        let duration_s = document.animation_duration().unwrap();
        let target = skinned(&document, node)[0];
        let mut different = 0;
        for step in 0..=20 {
            let time_s = duration_s * f64::from(step) / 20.0;
            document.set_time(Some(time_s));
            let lazy = document.deform_pose(target).unwrap();
            let expected = oracle.joint_matrices(&skin, time_s);
            assert_eq!(lazy.joint_matrices.len(), expected.len(), "{name}");
            for (found, expected) in lazy.joint_matrices.iter().zip(&expected) {
                // The oracle has node transforms in single precision.
                assert!(found.abs_diff_eq(*expected, 2e-6), "{name} at {time_s}: {found} {expected}");
            }
            different += usize::from(document.drain_changes().poses.contains(&target));
            // The same bits before and after the update.
            assert_eq!(document.deform_pose(target), Some(lazy), "{name} at {time_s}");
        }
        assert!(different > 10, "{name}: {different} poses");
    }
}

#[test]
fn a_skinned_mesh_stands_in_the_space_of_its_instance() {
    let Some(path) = assets("gltf/RiggedSimple/glTF-Binary/RiggedSimple.glb") else { return };
    let (document, node) = placed(&path);
    let target = skinned(&document, node)[0];
    let placed = document.renderable(target).unwrap();
    assert!(placed.deform && placed.camera_visible && placed.casts_shadows);
    assert_eq!(Some(placed.world_from_mesh), document.world_from(node.into()));
    // The nodes above the mesh turn it, but only the joints count.
    assert_ne!(Some(placed.world_from_mesh), document.world_from(target));
}

#[test]
fn boxes_hold_every_bent_vertex() {
    for name in [
        "gltf/SimpleSkin/glTF-Embedded/SimpleSkin.gltf",
        "gltf/RiggedSimple/glTF-Binary/RiggedSimple.glb",
        "gltf/SimpleMorph/glTF/SimpleMorph.gltf",
        "gltf/AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb",
    ] {
        let Some(path) = assets(name) else { continue };
        let (mut document, _) = placed(&path);
        let (mesh, _) = document.meshes().next().unwrap();
        let mesh_from_primitive = DAffine3::from_scale_rotation_translation(
            DVec3::new(1.0, 2.0, 0.5),
            DQuat::from_rotation_x(0.3),
            DVec3::Y,
        );
        document.apply(Edit::SetPrimitiveTransform { mesh, primitive: 0, mesh_from_primitive }).unwrap();
        let duration_s = document.animation_duration().unwrap();
        let target = document.renderables().next().unwrap().target;
        if document.morph_weights(target).is_some() {
            let weights = vec![-1.5, 0.25];
            document.apply(Edit::SetMorphWeights { target, weights }).unwrap();
        }
        for step in 0..=16 {
            // At first the weights from above, then those of the clip.
            document.set_time((step > 0).then_some(duration_s * f64::from(step) / 16.0));
            let (low, high) = document.own_bounds(target).unwrap();
            let size = (high - low).length();
            let world_from_mesh = document.world_from_mesh(target).unwrap();
            let moved = world_from_mesh * mesh_from_primitive * world_from_mesh.inverse();
            let points: Vec<DVec3> =
                bent(&document, target).into_iter().map(|p| moved.transform_point3(p)).collect();
            let slack = DVec3::splat(1e-6 * size);
            for p in &points {
                assert!((*p - low + slack).min_element() >= 0.0, "{name}: {p} {low} {high}");
                assert!((high + slack - *p).min_element() >= 0.0, "{name}: {p} {low} {high}");
            }
            // Never useless either: deltas that point to all sides, and turned boxes, make it larger.
            let (first, last) =
                (points.iter().copied().reduce(DVec3::min), points.iter().copied().reduce(DVec3::max));
            assert!(size < 6.0 * (last.unwrap() - first.unwrap()).length(), "{name}: {size}");
        }
    }
}

/// The shared scene whose prefab got two clips: "turn" (2 s) turns the arm and lifts the lamp, "slide" (0.5 s)
/// slides the plate and lifts the lamp the other way.
pub fn animated(folder: &Path) -> Scene {
    let mut scene = scene(folder);
    let mut imported = crate::common::model(folder);
    let quarter = DQuat::from_rotation_z(1.0).to_array().map(|v| v as f32);
    let channel = |part, path, times_s: &[f32], values: &[f32]| Channel {
        part,
        path,
        interpolation: Interpolation::Linear,
        times_s: times_s.into(),
        values: values.into(),
    };
    let turned = [[0.0, 0.0, 0.0, 1.0], quarter].concat();
    let clips = [
        Animation::new(
            "turn",
            vec![
                channel(ARM, ChannelPath::Rotation, &[0.0, 2.0], &turned),
                channel(LAMP, ChannelPath::Translation, &[0.0, 1.0], &[0.0, 3.0, 0.0, 0.0, 4.0, 0.0]),
            ],
        ),
        Animation::new(
            "slide",
            vec![
                channel(PLATE, ChannelPath::Translation, &[0.0, 0.5], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
                channel(LAMP, ChannelPath::Translation, &[0.0, 0.5], &[0.0, 3.0, 0.0, 0.0, -9.0, 0.0]),
            ],
        ),
    ];
    imported.prefab.animations = clips.into_iter().map(Into::into).collect();
    let edit = scene.document.reload_edit(scene.prefab, imported).unwrap();
    scene.document.apply(edit).unwrap();
    scene.document.drain_changes();
    scene
}

/// Everything that is placed, with how it is bent.
fn picture(document: &Document) -> Vec<(Target, DAffine3, Option<DeformPose>)> {
    let mut document = document.clone();
    document.update_transforms();
    let meshes = document.renderables().map(|r| (r.target, r.world_from_mesh));
    let lights = document.lights().map(|l| (l.target, l.world_from_node));
    let placed: Vec<_> = meshes.chain(lights).collect();
    placed.into_iter().map(|(target, world)| (target, world, document.deform_pose(target))).collect()
}

fn local_of(document: &Document, target: Target) -> Trs {
    document.posed_local(target).unwrap().nearest_trs()
}

#[test]
fn a_time_moves_what_the_clip_says_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let (arm, plate, lamp) = (scene.part(ARM), scene.part(PLATE), scene.part(LAMP));
    let document = &mut scene.document;
    let rest = document.local(arm).unwrap();
    document.set_time(Some(1.0));
    let turned = local_of(document, arm);
    assert!((turned.rotation - DQuat::from_rotation_z(0.5)).length() < 1e-7);
    assert_eq!((turned.translation, turned.scale), (DVec3::ZERO, DVec3::ONE));
    assert_eq!(local_of(document, lamp).translation, DVec3::new(0.0, 4.0, 0.0));
    assert_eq!(document.local(arm), Some(rest), "the document's own value is as it was");
    let above = document.world_from(Target::part(scene.first, 0)).unwrap();
    let expected = above * turned.to_affine() * document.local(plate).unwrap().to_affine();
    assert_eq!(document.world_from(plate), Some(expected));
    document.update_transforms();
    assert_eq!(document.world_from(plate), Some(expected));
    assert_eq!((document.time(), document.animation_duration()), (Some(1.0), Some(2.0)));
}

#[test]
fn taking_the_time_off_restores_every_bit_and_leaves_no_trace() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let path = folder.path().join("scene.caustica");
    let saved = |document: &Document| {
        Project::save(&path, document, &ProjectMeta::default()).unwrap();
        std::fs::read_to_string(&path).unwrap()
    };
    let document = &mut scene.document;
    let (before, text, shown) = (document.clone(), saved(document), picture(document));
    for time_s in [0.1, 1.9, 0.0, 7.3, f64::NAN] {
        document.set_time(Some(time_s));
        assert!(*document == before, "what the user made is the same");
        assert_ne!(picture(document), shown);
        document.drain_changes();
    }
    assert_eq!(saved(document), text);
    assert_eq!(document.time(), Some(0.0), "a time that is not finite counts as 0");
    document.set_time(None);
    assert_eq!(picture(document), shown);
    assert!(!document.drain_changes().is_empty());
    document.set_time(None);
    assert!(document.drain_changes().is_empty());
}

#[test]
fn the_same_time_again_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let document = &mut scene.document;
    document.set_time(Some(0.5));
    let changes = document.drain_changes();
    let keys: Vec<Target> = changes.transforms.keys().copied().collect();
    let expected = [scene.first, scene.second].map(|n| [Target::part(n, PLATE), Target::part(n, LAMP)]);
    assert_eq!(keys, expected.concat());
    assert_eq!(changes.reason(), "animation");
    document.set_time(Some(0.5));
    let again = document.drain_changes();
    assert!(again.is_empty() && again.reasons.is_empty());
    // The lamp has arrived; the arm goes on.
    document.set_time(Some(1.0));
    document.drain_changes();
    document.set_time(Some(1.5));
    let keys: Vec<Target> = document.drain_changes().transforms.into_keys().collect();
    assert_eq!(keys, [Target::part(scene.first, PLATE), Target::part(scene.second, PLATE)]);
}

#[test]
fn edits_and_their_undo_go_on_below_the_pose() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let (arm, plate) = (scene.part(ARM), scene.part(PLATE));
    let document = &mut scene.document;
    let before = document.clone();
    document.set_time(Some(1.0));
    let posed = picture(document);
    let moved = trs(4.0, 0.7, 3.0);
    let undo_arm = document.apply(Edit::SetTransform { target: arm, local: moved }).unwrap();
    // The clip says how the arm is turned; where it is and how large, the override says.
    let now = local_of(document, arm);
    assert!((now.rotation - DQuat::from_rotation_z(0.5)).length() < 1e-7);
    assert_eq!((now.translation, now.scale), (moved.nearest_trs().translation, moved.nearest_trs().scale));
    assert_eq!(document.local(arm), Some(moved));
    let undo_plate = document.apply(Edit::SetVisible { target: plate, visible: false }).unwrap();
    document.set_time(Some(1.7));
    document.set_time(Some(1.0));
    document.apply(undo_plate).unwrap();
    let redo_arm = document.apply(undo_arm).unwrap();
    assert!(*document == before);
    assert_eq!(picture(document), posed);
    document.apply(redo_arm).unwrap();
    document.set_time(None);
    assert_eq!(document.posed_local(arm), Some(moved));
}

#[test]
fn a_clip_drives_what_its_channels_name_while_a_time_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let (first, arm) = (scene.first, scene.part(ARM));
    assert_eq!(scene.document.driven(arm), Driven::default());
    scene.document.set_time(Some(0.0));
    assert_eq!(scene.document.driven(arm), Driven { rotation: true, ..Driven::default() });
    assert_eq!(scene.document.driven(first.into()), Driven::default());
}

#[test]
fn a_shorter_clip_repeats_and_each_instance_plays_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let (first, second) = (scene.first, scene.second);
    let document = &mut scene.document;
    let undo = document.apply(Edit::SetClip { node: second, clip: ClipChoice::Clip(1) }).unwrap();
    assert_eq!(undo, Edit::SetClip { node: second, clip: ClipChoice::First });
    document.set_time(Some(0.75));
    assert_eq!(local_of(document, Target::part(second, PLATE)).translation, DVec3::new(0.5, 0.0, 0.0));
    assert_eq!(local_of(document, Target::part(first, PLATE)).translation, DVec3::ZERO);
    assert_eq!(document.animation_duration(), Some(2.0));
    let names: Vec<&str> = document.clips_of(second).iter().map(|clip| clip.name.as_str()).collect();
    assert_eq!(names, ["turn", "slide"]);

    document.apply(Edit::SetClip { node: first, clip: ClipChoice::None }).unwrap();
    assert_eq!(document.animation_duration(), Some(0.5));
    let target = Target::part(first, LAMP);
    assert_eq!(document.posed_local(target), document.local(target));
    document.apply(Edit::SetClip { node: first, clip: ClipChoice::All }).unwrap();
    // Both clips move the lamp: the first one has it. Only the second moves the plate.
    assert_eq!(local_of(document, target).translation, DVec3::new(0.0, 3.75, 0.0));
    assert_eq!(local_of(document, Target::part(first, PLATE)).translation, DVec3::new(0.5, 0.0, 0.0));
    for clip in [ClipChoice::None, ClipChoice::Clip(7)] {
        for node in [first, second] {
            document.apply(Edit::SetClip { node, clip }).unwrap();
        }
        assert_eq!(document.animation_duration(), None);
    }
    let wanted = "instance";
    let group = Edit::SetClip { node: scene.group, clip: ClipChoice::All };
    let target = scene.group.into();
    assert_eq!(document.apply(group), Err(EditError::WrongKind { target, wanted }));
}

#[test]
fn instances_that_come_go_or_are_reloaded_are_in_the_pose() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let document = &mut scene.document;
    document.set_time(Some(1.0));
    let turned = local_of(document, Target::part(scene.first, ARM));
    let (copy, edit) = document.duplicate_edit(scene.first).unwrap();
    document.apply(edit).unwrap();
    let changes = document.drain_changes();
    assert!(changes.added.contains_key(&Target::part(copy, PLATE)));
    assert_eq!(local_of(document, Target::part(copy, ARM)), turned);

    let undo = document.apply(Edit::RemoveNode { node: scene.first }).unwrap();
    document.set_time(Some(2.0));
    document.apply(undo).unwrap();
    let rotation = local_of(document, Target::part(scene.first, ARM)).rotation;
    assert!((rotation - DQuat::from_rotation_z(1.0)).length() < 1e-7);

    // A reading of the source without clips, and back.
    let plain = crate::common::model(folder.path());
    let edit = document.reload_edit(scene.prefab, plain).unwrap();
    let undo = document.apply(edit).unwrap();
    assert_eq!(document.animation_duration(), None);
    let target = Target::part(scene.first, ARM);
    assert_eq!(document.posed_local(target), document.local(target));
    document.apply(undo).unwrap();
    assert_eq!(local_of(document, target).rotation, rotation);
    assert_eq!(document.animation_duration(), Some(2.0));
}

#[test]
fn every_interpolation_of_the_sample_model_moves_its_cube_alone() {
    let Some(path) = assets("gltf/InterpolationTest/glTF-Binary/InterpolationTest.glb") else { return };
    let (mut document, node) = placed(&path);
    for (index, clip) in (0..).zip(document.clips_of(node).to_vec()) {
        document.apply(Edit::SetClip { node, clip: ClipChoice::Clip(index) }).unwrap();
        document.set_time(Some(0.0));
        document.drain_changes();
        document.set_time(Some(clip.duration_s / 3.0));
        let keys: Vec<Target> = document.drain_changes().transforms.into_keys().collect();
        let step = clip.channels[0].interpolation == Interpolation::Step;
        let moved = Target::part(node, clip.channels[0].part);
        assert!(keys == [moved] || (step && keys.is_empty()), "{}: {keys:?}", clip.name);
    }
    document.apply(Edit::SetClip { node, clip: ClipChoice::All }).unwrap();
    document.set_time(None);
    document.drain_changes();
    document.set_time(Some(1.0));
    assert!(document.drain_changes().transforms.len() >= 6);
}

/// A document with the morph cube: an instance of it, and a node that places its mesh.
pub fn morphed() -> Option<(Document, Target, Target)> {
    let path = assets("gltf/AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb")?;
    let (mut document, node) = placed(&path);
    let part = document.renderables().next().unwrap().target;
    assert_eq!(part.node, node);
    let mesh = document.mesh_of(part).unwrap();
    let materials = document.renderable(part).unwrap().materials;
    let kind = NodeKind::Mesh { mesh, materials, weights: Vec::new() };
    let (own, edit) = document.add_edit(Node::new("own", kind), None);
    document.apply(edit).unwrap();
    document.drain_changes();
    Some((document, part, own.into()))
}

#[test]
fn weights_come_from_the_clip_else_the_user_else_the_file() {
    let Some((mut document, part, own)) = morphed() else { return };
    let weights = |document: &Document, target| document.deform_pose(target).unwrap().weights;
    let set = |target, weights: &[f32]| Edit::SetMorphWeights { target, weights: weights.to_vec() };
    for target in [part, own] {
        let before = document.clone();
        assert_eq!(weights(&document, target), [0.0, 0.0]);
        let undo = document.apply(set(target, &[0.25, 0.5])).unwrap();
        assert_eq!(weights(&document, target), [0.25, 0.5]);
        let second = document.apply(set(target, &[1.0, 0.0])).unwrap();
        assert_eq!(second, set(target, &[0.25, 0.5]));
        document.apply(second).unwrap();
        let redo = document.apply(undo).unwrap();
        assert!(document == before, "undone");
        document.apply(redo).unwrap();
        assert_eq!(document.morph_weights(target), Some(vec![0.25, 0.5]));
    }
    document.set_time(Some(0.5));
    let played = weights(&document, part);
    assert_ne!(played, [0.25, 0.5]);
    assert_eq!(document.morph_weights(part), Some(vec![0.25, 0.5]), "the document's own");
    assert_eq!(weights(&document, own), [0.25, 0.5], "no clip moves a node of the document");
    document.drain_changes();
    document.apply(set(part, &[0.75, 0.75])).unwrap();
    assert!(document.drain_changes().poses.is_empty(), "the clip outdoes it");
    document.set_time(None);
    assert_eq!(weights(&document, part), [0.75, 0.75]);
    let field = OverrideField::Weights;
    let undo = document.apply(Edit::ResetOverride { target: part, field }).unwrap();
    assert_eq!(weights(&document, part), [0.0, 0.0]);
    document.apply(undo).unwrap();
    assert_eq!(weights(&document, part), [0.75, 0.75]);
    // The base of the mesh is its own file's: a node may say nothing again.
    document.apply(set(own, &[])).unwrap();
    assert_eq!(weights(&document, own), [0.0, 0.0]);
}

#[test]
fn weights_that_do_not_fit_are_refused() {
    let Some((mut document, part, own)) = morphed() else { return };
    let set = |target, weights: &[f32]| Edit::SetMorphWeights { target, weights: weights.to_vec() };
    let count = |found| EditError::WeightCount { wanted: 2, found };
    let before = document.clone();
    assert_eq!(document.apply(set(part, &[1.0])), Err(count(1)));
    assert_eq!(document.apply(set(part, &[])), Err(count(0)));
    assert_eq!(document.apply(set(own, &[1.0, 2.0, 3.0])), Err(count(3)));
    assert_eq!(document.apply(set(own, &[1.0, f32::NAN])), Err(EditError::NotFinite));
    let node = Target::node(part.node);
    assert!(matches!(document.apply(set(node, &[1.0, 0.0])), Err(EditError::WrongKind { .. })));
    let nan = NodeKind::Mesh {
        mesh: document.mesh_of(own).unwrap(),
        materials: Vec::new(),
        weights: vec![f32::INFINITY],
    };
    let (_, edit) = document.add_edit(Node::new("nan", nan), None);
    assert_eq!(document.apply(edit), Err(EditError::NotFinite));
    assert!(document == before);
    assert!(set(own, &[0.0, 0.0]).same_gesture(&set(own, &[1.0, 0.0])));
    assert!(!set(own, &[0.0, 0.0]).same_gesture(&set(part, &[1.0, 0.0])));
}

#[test]
fn a_moved_instance_keeps_every_bit_of_its_pose() {
    let Some(path) = assets("gltf/RiggedSimple/glTF-Binary/RiggedSimple.glb") else { return };
    let (mut document, node) = placed(&path);
    let target = skinned(&document, node)[0];
    document.set_time(Some(0.4));
    document.drain_changes();
    let before = document.deform_pose(target);
    let far = Trs { translation: DVec3::new(1e7, -3e5, 0.1), ..trs(0.0, 2.0, 0.3).nearest_trs() };
    document.apply(Edit::SetTransform { target: node.into(), local: Local::Trs(far) }).unwrap();
    assert_eq!(document.deform_pose(target), before);
    let changes = document.drain_changes();
    assert_eq!(changes.transforms.keys().copied().collect::<Vec<_>>(), [target]);
    assert!(changes.poses.is_empty());
    assert_eq!(document.deform_pose(target), before);
    // The oldest joint of the chain is moved by hand: the pose is another, the place is not.
    let prefab = document.prefab(document.node(node).unwrap().prefab().unwrap()).unwrap();
    let joint = Target::part(node, prefab.skins()[0].joints[0]);
    let parent = document.parent_of(joint).unwrap();
    for moved in [joint, parent] {
        document.apply(Edit::SetTransform { target: moved, local: trs(0.1, 0.2, 1.0) }).unwrap();
        let changes = document.drain_changes();
        assert_eq!(changes.poses.iter().copied().collect::<Vec<_>>(), [target], "{moved:?}");
        assert!(changes.transforms.is_empty(), "{moved:?}");
    }
    // Its own part may go where it likes.
    document.apply(Edit::SetTransform { target, local: trs(0.1, 0.2, 1.0) }).unwrap();
    assert!(document.drain_changes().is_empty());
    let data = &document.mesh(document.mesh_of(target).unwrap()).unwrap().data;
    assert_eq!(bent(&document, target).len(), data.positions.len());
    assert!(data.positions.iter().any(|p| *p != Vec3::ZERO));
}
