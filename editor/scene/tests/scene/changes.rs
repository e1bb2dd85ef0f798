//! What the change set says after each kind of edit, and that it says nothing else.

use std::collections::{BTreeMap, BTreeSet};

use caustica_scene::{
    Camera, ChangeSet, ClipChoice, Content, Document, Edit, Environment, Light, LightKind, Material,
    MaterialId, Node, NodeKind, OverrideField, RayVisibility, Target,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::animation::{animated, morphed};
use crate::common::{ARM, LAMP, Numbers, PLATE, Scene, scene, trs};

const MESH: Content = Content { mesh: true, light: false, camera: false };
const LIGHT: Content = Content { mesh: false, light: true, camera: false };
/// The plate is a mesh and a camera too.
const MESH_AND_CAMERA: Content = Content { mesh: true, light: false, camera: true };

/// Drains the changes and compares all of them but the reasons.
#[track_caller]
fn assert_told(document: &mut Document, expected: ChangeSet) {
    let mut changes = document.drain_changes();
    assert!(!changes.reasons.is_empty() || changes.is_empty());
    changes.reasons.clear();
    assert_eq!(changes, expected);
}

fn map<const N: usize>(targets: [(Target, Content); N]) -> BTreeMap<Target, Content> {
    targets.into()
}

#[test]
fn each_edit_is_told_in_its_own_place_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let (plate, lamp, sun) = (scene.part(PLATE), scene.part(LAMP), Target::node(scene.light));
    let (group, eye) = (Target::node(scene.group), Target::node(scene.camera));
    let document = &mut scene.document;
    let (mesh, _) = document.meshes().next().unwrap();
    let (material, value) = document.materials().next().map(|(id, m)| (id, m.clone())).unwrap();
    let all = [(plate, MESH_AND_CAMERA), (lamp, LIGHT), (sun, LIGHT)];
    document.drain_changes();
    let none = ChangeSet::default;
    let spot =
        Light { color: Vec3::X, intensity: 7.0, kind: LightKind::Point { radius_m: 0.1, range_m: None } };
    let rows = [
        (
            Edit::SetTransform { target: group, local: trs(1.0, 2.0, 3.0) },
            ChangeSet { transforms: map(all), ..none() },
        ),
        (
            Edit::SetVisible { target: group, visible: false },
            ChangeSet { visibility: map(all), structure: true, ..none() },
        ),
        (
            Edit::SetRayVisibility { target: plate, camera_visible: false, casts_shadows: true },
            ChangeSet { visibility: map([(plate, MESH)]), ..none() },
        ),
        // The group has no mesh that a ray could meet.
        (Edit::SetRayVisibility { target: group, camera_visible: false, casts_shadows: false }, none()),
        (
            Edit::AssignMaterial { target: plate, primitive: 1, material },
            ChangeSet { instances: map([(plate, MESH_AND_CAMERA)]), ..none() },
        ),
        (
            Edit::SetMaterial { material, value: Box::new(Material { roughness: 0.1, ..value }) },
            ChangeSet { materials: [material].into(), ..none() },
        ),
        (Edit::SetLight { target: lamp, light: spot }, ChangeSet { lights: [lamp].into(), ..none() }),
        (
            Edit::SetCamera { target: eye, camera: Camera { near_m: 0.5, ..Camera::default() } },
            ChangeSet { cameras: [eye].into(), ..none() },
        ),
        (
            Edit::SetPrimitiveTransform {
                mesh,
                primitive: 1,
                mesh_from_primitive: DAffine3::from_scale(DVec3::splat(2.0)),
            },
            ChangeSet { primitive_transforms: [(mesh, 1)].into(), ..none() },
        ),
        (Edit::Rename { target: group, name: "x".into() }, ChangeSet { structure: true, ..none() }),
        (Edit::SetClip { node: scene.first, clip: ClipChoice::None }, none()),
        (Edit::SetEnvironment(Environment::Constant(Vec3::ONE)), ChangeSet { environment: true, ..none() }),
    ];
    for (edit, expected) in rows {
        println!("{edit:?}");
        let undo = document.apply(edit).unwrap();
        assert_told(document, expected.clone());
        // Resetting an override also makes lists stale.
        let structure = expected.structure || matches!(undo, Edit::ResetOverride { .. });
        document.apply(undo).unwrap();
        assert_told(document, ChangeSet { structure, ..expected });
    }
}

#[test]
fn what_changes_and_changes_back_is_not_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let target = Target::node(scene.group);
    let document = &mut scene.document;
    let local = document.local(target).unwrap();
    for edit in [
        Edit::SetVisible { target, visible: false },
        Edit::SetVisible { target, visible: true },
        Edit::SetTransform { target, local: trs(1.0, 2.0, 3.0) },
        Edit::SetTransform { target, local },
    ] {
        document.apply(edit).unwrap();
    }
    document.set_time(Some(1.0));
    document.set_time(None);
    assert_told(document, ChangeSet { structure: true, ..ChangeSet::default() });
}

#[test]
fn a_new_target_is_told_whole_and_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = animated(folder.path());
    let document = &mut scene.document;
    document.set_time(Some(0.25));
    document.drain_changes();
    let (node, edit) = document.instantiate_edit(scene.prefab, None, trs(1.0, 0.0, 1.0));
    document.apply(edit).unwrap();
    let (plate, lamp) = (Target::part(node, PLATE), Target::part(node, LAMP));
    let material = document.materials().next().unwrap().0;
    for edit in [
        Edit::SetTransform { target: node.into(), local: trs(4.0, 0.0, 1.0) },
        Edit::SetVisible { target: plate, visible: false },
        Edit::SetRayVisibility { target: plate, camera_visible: true, casts_shadows: false },
        Edit::AssignMaterial { target: plate, primitive: 0, material },
        Edit::SetClip { node, clip: ClipChoice::All },
    ] {
        document.apply(edit).unwrap();
    }
    document.set_time(Some(0.5));
    let mut changes = document.drain_changes();
    let of_new = |targets: &BTreeMap<Target, Content>| targets.keys().filter(|t| t.node == node).count();
    assert_eq!(changes.added, map([(plate, MESH_AND_CAMERA), (lamp, LIGHT)]));
    for group in [&changes.transforms, &changes.instances, &changes.visibility, &changes.removed] {
        assert_eq!(of_new(group), 0);
    }
    assert!(changes.poses.is_empty() && changes.lights.is_empty() && changes.cameras.is_empty());
    changes = {
        document.apply(Edit::RemoveNode { node }).unwrap();
        document.drain_changes()
    };
    assert_eq!(changes.removed, map([(plate, MESH_AND_CAMERA), (lamp, LIGHT)]));
    assert!(changes.visibility.is_empty() && changes.poses.is_empty());
}

#[test]
fn what_comes_back_is_told_whole_and_not_in_parts() {
    let Some((mut document, part, _)) = morphed() else { return };
    let material = document.renderable(part).unwrap().materials[0];
    for edit in [
        Edit::SetMorphWeights { target: part, weights: vec![0.5, 0.0] },
        Edit::SetRayVisibility { target: part, camera_visible: false, casts_shadows: true },
        Edit::AssignMaterial { target: part, primitive: 0, material },
    ] {
        document.apply(edit).unwrap();
    }
    let undo = document.apply(Edit::RemoveNode { node: part.node }).unwrap();
    document.apply(undo).unwrap();
    assert_told(
        &mut document,
        ChangeSet { added: map([(part, MESH)]), structure: true, ..ChangeSet::default() },
    );
}

#[test]
fn a_new_mesh_swallows_the_moves_of_its_primitives() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let document = &mut scene.document;
    document.drain_changes();
    let (mesh, _) = document.meshes().next().unwrap();
    let edit = document.reload_edit(scene.prefab, crate::common::model(folder.path())).unwrap();
    document.apply(edit).unwrap();
    let mesh_from_primitive = DAffine3::from_translation(DVec3::X);
    document.apply(Edit::SetPrimitiveTransform { mesh, primitive: 0, mesh_from_primitive }).unwrap();
    let changes = document.drain_changes();
    assert!(changes.primitive_transforms.is_empty());
    assert_eq!(changes.meshes, [mesh].into());
    for primitive in [0, 1] {
        document.apply(Edit::SetPrimitiveTransform { mesh, primitive, mesh_from_primitive }).unwrap();
    }
    let primitive_transforms: BTreeSet<_> = [(mesh, 0), (mesh, 1)].into();
    assert_told(document, ChangeSet { primitive_transforms, ..ChangeSet::default() });
}

#[test]
fn poses_are_told_apart_from_transforms() {
    let Some((mut document, part, own)) = morphed() else { return };
    for target in [part, own] {
        document.apply(Edit::SetMorphWeights { target, weights: vec![0.5, 0.0] }).unwrap();
        assert_told(&mut document, ChangeSet { poses: [target].into(), ..ChangeSet::default() });
        document.apply(Edit::SetMorphWeights { target, weights: vec![0.5, 0.0] }).unwrap();
        assert_told(&mut document, ChangeSet::default());
    }
    document.set_time(Some(0.7));
    assert_told(&mut document, ChangeSet { poses: [part].into(), ..ChangeSet::default() });
    document.apply(Edit::SetClip { node: part.node, clip: ClipChoice::None }).unwrap();
    assert_told(&mut document, ChangeSet { poses: [part].into(), ..ChangeSet::default() });
    document.set_time(None);
    assert_told(&mut document, ChangeSet::default());
    document.apply(Edit::ResetOverride { target: part, field: OverrideField::Weights }).unwrap();
    assert_told(&mut document, ChangeSet { poses: [part].into(), structure: true, ..ChangeSet::default() });
}

#[test]
fn ray_visibility_is_the_targets_own_and_is_undone() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let (plate, arm) = (scene.part(PLATE), scene.part(ARM));
    let document = &mut scene.document;
    let before = document.clone();
    let set = |target, camera_visible, casts_shadows| Edit::SetRayVisibility {
        target,
        camera_visible,
        casts_shadows,
    };
    let rays = |document: &Document| {
        let placed = document.renderable(plate).unwrap();
        (placed.visible, placed.camera_visible, placed.casts_shadows)
    };
    // What is above does not hand it down.
    for target in [arm, Target::node(scene.first), Target::node(scene.group)] {
        document.apply(set(target, false, false)).unwrap();
        assert_eq!(rays(document), (true, true, true));
    }
    let undo = document.apply(set(plate, false, true)).unwrap();
    assert_eq!(rays(document), (true, false, true));
    let second = document.apply(set(plate, true, false)).unwrap();
    assert_eq!(second, set(plate, false, true));
    assert_eq!(rays(document), (true, true, false));
    let field = OverrideField::RayVisibility;
    let unreset = document.apply(Edit::ResetOverride { target: plate, field }).unwrap();
    assert_eq!(document.ray_visibility(plate), Some(RayVisibility::default()));
    document.apply(unreset).unwrap();
    assert_eq!(rays(document), (true, true, false));
    document.apply(undo).unwrap();
    assert_eq!(document.part_override(plate), None);
    for target in [arm, Target::node(scene.first), Target::node(scene.group)] {
        document.apply(set(target, true, true)).unwrap();
    }
    document.apply(Edit::ResetOverride { target: arm, field }).unwrap();
    assert!(*document == before);
}

/// What [`Document::has_light`] promises, by looking at everything.
fn has_light(document: &Document) -> bool {
    let shines = |id: &MaterialId| {
        let material = document.material(*id).unwrap();
        material.emissive_texture.is_none() && material.emitted_radiance().max_element() > 0.0
    };
    document.lights().next().is_some()
        || document.renderables().any(|placed| placed.visible && placed.materials.iter().any(shines))
}

/// A random edit of something that the surroundings may depend on.
fn random_edit(scene: &mut Scene, numbers: &mut Numbers) -> Edit {
    let document = &mut scene.document;
    let targets: Vec<Target> = document.nodes().map(|(id, _)| Target::node(id)).collect();
    let any_node = targets[numbers.below(targets.len())];
    let placed: Vec<Target> = document.renderables().map(|placed| placed.target).collect();
    let materials: Vec<MaterialId> = document.materials().map(|(id, _)| id).collect();
    let material = materials[numbers.below(materials.len())];
    let value = document.material(material).unwrap().clone();
    match (numbers.below(7), placed.get(numbers.below(placed.len().max(1)))) {
        (0, _) => {
            let emissive = if numbers.below(2) == 0 { Vec3::ZERO } else { Vec3::ONE };
            Edit::SetMaterial { material, value: Box::new(Material { emissive, ..value }) }
        }
        (1, Some(&target)) => {
            let primitive = numbers.below(2) as u32;
            Edit::AssignMaterial { target, primitive, material }
        }
        (2, Some(&target)) => Edit::SetVisible { target, visible: numbers.below(2) == 0 },
        (3, _) => Edit::SetVisible { target: any_node, visible: numbers.below(3) > 0 },
        (4, _) => Edit::RemoveNode { node: any_node.node },
        (5, Some(&target)) if target.part.is_some() => {
            Edit::ResetOverride { target, field: OverrideField::All }
        }
        _ => document.duplicate_edit(any_node.node).unwrap().1,
    }
}

#[test]
fn surroundings_kept_up_to_date_are_those_of_the_whole_scene() {
    let folder = tempfile::tempdir().unwrap();
    let (mut dark, mut bright) = (0, 0);
    for seed in 0..40 {
        let mut scene = scene(folder.path());
        let mut numbers = Numbers(seed);
        // Without lamps and sun it is the materials that count.
        let sun = scene.light;
        let edit = Edit::RemoveNode { node: sun };
        scene.document.apply(edit).unwrap();
        let mut imported = crate::common::model(folder.path());
        let mut parts = imported.prefab.nodes().to_vec();
        parts.pop();
        imported.prefab.set_nodes(parts).unwrap();
        let edit = scene.document.reload_edit(scene.prefab, imported).unwrap();
        scene.document.apply(edit).unwrap();
        let group = Node::new("kept", NodeKind::Group);
        let (_, edit) = scene.document.add_edit(group, None);
        scene.document.apply(edit).unwrap();
        scene.document.drain_changes();
        let mut told = scene.document.effective_environment();
        for _ in 0..30 {
            if scene.document.node_count() < 2 {
                break;
            }
            let edit = random_edit(&mut scene, &mut numbers);
            let undo = scene.document.apply(edit.clone()).unwrap();
            assert_eq!(scene.document.has_light(), has_light(&scene.document), "before the drain: {edit:?}");
            if numbers.below(3) == 0 {
                scene.document.apply(undo).unwrap();
            }
            let changes = scene.document.drain_changes();
            let expected = has_light(&scene.document);
            assert_eq!(scene.document.has_light(), expected, "after the drain: {edit:?}");
            let now = scene.document.effective_environment();
            assert_eq!(changes.environment, now != told, "{edit:?}");
            told = now;
            *(if expected { &mut bright } else { &mut dark }) += 1;
        }
    }
    assert!(dark > 100 && bright > 100, "{dark} dark, {bright} bright");
}
