//! Every edit against its undo, and what the change set says about it.

use crate::common::{ARM, LAMP, PLATE, Scene, scene, trs};
use caustica_scene::{
    Camera, ClipChoice, Edit, EditError, Environment, Light, LightKind, Local, Material, MaterialEntry,
    MaterialId, MeshId, Node, NodeId, NodeKind, OverrideField, Subtree, Target, Trs,
};
use glam::{DAffine3, DVec3, Vec3};

/// One edit of every kind that fits the scene.
fn every_edit(scene: &mut Scene) -> Vec<Edit> {
    let Scene { prefab, group, first, second, light, camera, .. } = *scene;
    let plate = scene.part(PLATE);
    let document = &mut scene.document;
    let (mesh, _) = document.meshes().next().unwrap();
    let materials: Vec<MaterialId> = document.materials().map(|(id, _)| id).collect();
    let fresh = MaterialId(document.allocate_id());
    let spot = Light {
        color: Vec3::X,
        intensity: 7.0,
        kind: LightKind::Spot { radius_m: 0.1, range_m: Some(10.0), inner_rad: 0.1, outer_rad: 0.5 },
    };
    let wide = Camera { near_m: 0.5, ..Camera::default() };
    let material = Material { roughness: 0.25, ..document.material(materials[0]).unwrap().clone() };
    let entry = MaterialEntry::made_here(Material::default());
    let children = Subtree {
        nodes: (0..3)
            .map(|i| {
                let mut node = Node::new(format!("n{i}"), NodeKind::Group);
                node.parent = (i > 0).then_some(NodeId(9_000));
                (NodeId(9_000 + i), node)
            })
            .collect(),
    };
    let (_, duplicate) = document.duplicate_edit(group).unwrap();
    let unique = document.make_unique_edit(first).unwrap().edit;
    let merged = document.merge_edit(&document.clone(), "again").unwrap().edit;
    let mut edits = vec![
        Edit::Rename { target: first.into(), name: "other".into() },
        Edit::Rename { target: plate, name: "lid".into() },
        Edit::AssignMaterial { target: plate, primitive: 1, material: materials[0] },
        Edit::SetMaterial { material: materials[0], value: Box::new(material) },
        Edit::AddMaterial { material: fresh, entry: Box::new(entry) },
        Edit::SetLight { target: light.into(), light: spot },
        Edit::SetLight { target: Target::part(first, LAMP), light: spot },
        Edit::SetCamera { target: camera.into(), camera: wide },
        Edit::SetCamera { target: plate, camera: wide },
        Edit::SetEnvironment(Environment::Constant(Vec3::splat(0.5))),
        Edit::SetDefaultCamera(Some(plate)),
        Edit::AddNode { parent: Some(group), index: 0, subtree: children },
        Edit::RemoveNode { node: group },
        Edit::Reparent { node: group, parent: Some(second), index: 5, local: trs(1.0, 2.0, 3.0) },
        Edit::SetPrimitiveTransform {
            mesh,
            primitive: 1,
            mesh_from_primitive: DAffine3::from_translation(DVec3::X),
        },
        Edit::batch(
            "cleared",
            vec![
                Edit::RemoveNode { node: first },
                Edit::RemoveNode { node: second },
                Edit::RemovePrefab { prefab },
            ],
        ),
        duplicate,
        Edit::SetClip { node: first, clip: ClipChoice::All },
        unique,
        merged,
        Edit::SetLocked { node: group, locked: true },
        Edit::SetVariant { node: first, variant: Some("glowing".into()) },
    ];
    for target in [Target::node(first), plate, Target::part(first, ARM)] {
        edits.push(Edit::SetRayVisibility { target, camera_visible: false, casts_shadows: true });
        edits.push(Edit::SetTransform { target, local: trs(4.0, 0.7, 3.0) });
        edits.push(Edit::SetVisible { target, visible: false });
    }
    for field in [
        OverrideField::Name,
        OverrideField::Local,
        OverrideField::Visible,
        OverrideField::Material(1),
        OverrideField::Camera,
        OverrideField::RayVisibility,
        OverrideField::All,
    ] {
        let reset = Edit::ResetOverride { target: plate, field };
        edits.push(reset);
    }
    edits
}

#[test]
fn every_edit_is_undone_and_redone_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let edits = every_edit(&mut scene);
    assert!(edits.len() > 25);
    // Once on the plain scene, once with overrides on the parts, so that both old states are restored.
    for overridden in [false, true] {
        let mut document = scene.document.clone();
        if overridden {
            for edit in &edits {
                let on_part = matches!(edit, Edit::Rename { target, .. }
                    | Edit::SetTransform { target, .. } | Edit::SetVisible { target, .. }
                    | Edit::SetCamera { target, .. } | Edit::AssignMaterial { target, .. }
                    | Edit::SetRayVisibility { target, .. }
                    if target.part.is_some());
                if on_part {
                    document.apply(edit.clone()).unwrap();
                }
            }
        }
        for edit in &edits {
            let before = document.clone();
            document.drain_changes();
            assert!(!edit.describe(&document).is_empty(), "{edit:?}");
            let undo = document.apply(edit.clone()).unwrap();
            let after = document.clone();
            let may_repeat = overridden || matches!(edit, Edit::ResetOverride { .. });
            assert!(before != after || may_repeat, "{edit:?} changes something");
            let redo = document.apply(undo).unwrap();
            assert!(document == before, "undo of {edit:?}");
            let undo = document.apply(redo).unwrap();
            assert!(document == after, "redo of {edit:?}");
            document.apply(undo).unwrap();
            assert!(document == before, "second undo of {edit:?}");
            assert_derived_state_is_fresh(&mut document);
        }
    }
}

/// Caches agree with a document that never had any.
fn assert_derived_state_is_fresh(document: &mut caustica_scene::Document) {
    document.update_transforms();
    let placed: Vec<_> = document.renderables().collect();
    let mut again = document.clone();
    for &root in document.roots() {
        let target = Target::node(root);
        let local = document.local(target).unwrap();
        again.apply(Edit::SetTransform { target, local }).unwrap();
    }
    let computed: Vec<_> = again.renderables().collect();
    assert_eq!(placed, computed);
}

#[test]
fn a_removed_node_comes_back_under_its_id() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let group = scene.group;
    let undo = scene.document.apply(Edit::RemoveNode { node: group }).unwrap();
    assert!(scene.document.node(group).is_none());
    let fresh = scene.document.allocate_id();
    assert!(fresh > group.0, "ids are not given out twice");
    scene.document.apply(undo).unwrap();
    assert_eq!(scene.document.node(group).unwrap().name, "Group");
    assert_eq!(scene.document.roots()[0], group);
}

#[test]
fn edits_that_do_not_fit_are_refused_and_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let (group, first, prefab) = (scene.group, scene.first, scene.prefab);
    let nan = Local::Trs(Trs::from_translation(DVec3::NAN));
    let before = scene.document.clone();
    let refused = [
        Edit::SetTransform { target: NodeId(999).into(), local: Local::default() },
        Edit::SetTransform { target: Target::part(first, 99), local: Local::default() },
        Edit::SetTransform { target: first.into(), local: nan },
        Edit::SetLight {
            target: first.into(),
            light: Light {
                color: Vec3::ONE,
                intensity: 1.0,
                kind: LightKind::Directional { angular_radius_rad: 0.0 },
            },
        },
        Edit::Reparent { node: group, parent: Some(first), index: 0, local: Local::default() },
        Edit::RemovePrefab { prefab },
        Edit::SetPrimitiveTransform {
            mesh: MeshId(999),
            primitive: 0,
            mesh_from_primitive: DAffine3::IDENTITY,
        },
        Edit::AddNode {
            parent: None,
            index: 0,
            subtree: Subtree::single(first, Node::new("x", NodeKind::Group)),
        },
        Edit::batch("half", vec![Edit::RemoveNode { node: first }, Edit::RemoveNode { node: first }]),
    ];
    for edit in refused {
        assert!(scene.document.apply(edit.clone()).is_err(), "{edit:?}");
        assert!(scene.document == before, "{edit:?}");
    }
    let cycle = scene.document.reparent_edit(group, Some(first), 0).unwrap();
    assert_eq!(scene.document.apply(cycle), Err(EditError::Cycle));
}

#[test]
fn reparenting_keeps_the_place_in_the_world() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let target = Target::part(scene.first, PLATE);
    let before = scene.document.world_from(target).unwrap();
    let edit = scene.document.reparent_edit(scene.first, Some(scene.second), 0).unwrap();
    scene.document.apply(edit).unwrap();
    let after = scene.document.world_from(target).unwrap();
    assert!(before.abs_diff_eq(after, 1e-12), "{before} {after}");
    assert_eq!(scene.document.node(scene.first).unwrap().parent, Some(scene.second));
}

#[test]
fn drags_merge_and_other_edits_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let moved = |target: Target, x| Edit::SetTransform { target, local: trs(x, 0.0, 1.0) };
    let (a, b) = (Target::node(scene.first), Target::node(scene.second));
    assert!(moved(a, 1.0).same_gesture(&moved(a, 2.0)));
    assert!(!moved(a, 1.0).same_gesture(&moved(b, 1.0)));
    assert!(!moved(a, 1.0).same_gesture(&moved(scene.part(ARM), 1.0)));
    let pair = |x| Edit::batch("moved 2 nodes", vec![moved(a, x), moved(b, x)]);
    assert!(pair(1.0).same_gesture(&pair(2.0)));
    assert!(!pair(1.0).same_gesture(&moved(a, 1.0)));
    // The undo of the first step alone restores the state before the drag, also for an override.
    let mut document = scene.document.clone();
    let first_undo = document.apply(moved(scene.part(ARM), 1.0)).unwrap();
    document.apply(moved(scene.part(ARM), 2.0)).unwrap();
    document.apply(first_undo).unwrap();
    assert!(document == scene.document);
}

#[test]
fn the_first_drain_adds_everything_and_the_next_is_empty() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let changes = scene.document.drain_changes();
    // Two instances with plate and lamp each, the sun and the eye.
    assert_eq!(changes.added.len(), 6);
    assert_eq!((changes.meshes.len(), changes.materials.len()), (1, 2));
    assert!(changes.environment && changes.transforms.is_empty());
    let again = scene.document.drain_changes();
    assert!(again.is_empty() && again.reasons.is_empty());
    scene.document.mark_all_added("again");
    assert_eq!(scene.document.drain_changes().added.len(), 6);
}

#[test]
fn changes_name_what_changed_and_no_more() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let (plate, lamp) = (scene.part(PLATE), scene.part(LAMP));
    let document = &mut scene.document;
    document.drain_changes();

    let target = Target::part(scene.first, ARM);
    let local = trs(4.0, 0.7, 3.0);
    document.apply(Edit::SetTransform { target, local }).unwrap();
    let changes = document.drain_changes();
    assert_eq!(changes.transforms.keys().collect::<Vec<_>>(), [&plate]);
    assert_eq!(changes.reason(), "moved Arm");

    let target = Target::node(scene.group);
    document.apply(Edit::SetVisible { target, visible: false }).unwrap();
    let changes = document.drain_changes();
    let sun = Target::node(scene.light);
    let keys: Vec<Target> = changes.visibility.keys().copied().collect();
    assert_eq!(keys, [plate, lamp, sun]);
    assert!(changes.transforms.is_empty() && changes.instances.is_empty() && !changes.environment);
    assert!(!document.renderable(plate).unwrap().visible);

    let undo = document.apply(Edit::RemoveNode { node: scene.group }).unwrap();
    let removed = document.drain_changes().removed;
    assert_eq!(removed.keys().copied().collect::<Vec<_>>(), [plate, lamp, sun]);
    let redo = document.apply(undo).unwrap();
    document.apply(redo).unwrap();
    // Came back and went again: nobody has to know.
    assert!(document.drain_changes().removed.is_empty());
}

#[test]
fn a_removed_and_restored_node_is_told_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let document = &mut scene.document;
    document.drain_changes();
    let undo = document.apply(Edit::RemoveNode { node: scene.second }).unwrap();
    document.apply(undo).unwrap();
    let changes = document.drain_changes();
    assert_eq!(changes.added.len(), 2);
    assert!(changes.removed.is_empty());
}

#[test]
fn a_reloaded_source_keeps_overrides_and_ids() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let target = scene.part(PLATE);
    let moved = trs(4.0, 0.7, 3.0);
    let edit = Edit::SetTransform { target, local: moved };
    scene.document.apply(edit).unwrap();
    let mesh = scene.document.mesh_of(target);
    // The source gets a node in front, so that every index of a part is another.
    let mut imported = crate::common::model(folder.path());
    let mut nodes = imported.prefab.nodes().to_vec();
    for node in &mut nodes {
        node.parent = node.parent.map(|p| p + 1);
    }
    nodes.insert(0, caustica_scene::PartNode::default());
    imported.prefab.set_nodes(nodes).unwrap();
    let before = scene.document.clone();
    let name = scene.document.prefab(scene.prefab).unwrap().name.clone();
    let mut other = imported.clone();
    other.prefab.source = folder.path().join("lamp.glb");
    let edit = scene.document.reload_edit(scene.prefab, other).unwrap();
    assert_eq!(edit.describe(&scene.document), format!("replaced the source of {name} by lamp.glb"));
    let edit = scene.document.reload_edit(scene.prefab, imported).unwrap();
    assert_eq!(edit.describe(&scene.document), format!("reloaded the source of {name}"));
    assert!(!name.is_empty());
    let undo = scene.document.apply(edit).unwrap();
    let target = scene.part(PLATE + 1);
    assert_eq!(scene.document.local(target), Some(moved));
    assert_eq!(scene.document.mesh_of(target), mesh);
    scene.document.apply(undo).unwrap();
    assert!(scene.document == before);
}

#[test]
fn the_environment_follows_the_lights() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let document = &mut scene.document;
    let black = Environment::Constant(Vec3::ZERO);
    assert_eq!(document.effective_environment(), black);
    for node in [scene.light, scene.first, scene.second] {
        document.apply(Edit::RemoveNode { node }).unwrap();
    }
    assert_eq!(document.effective_environment(), Environment::DefaultSky);
    let set = Environment::Constant(Vec3::ONE);
    document.apply(Edit::SetEnvironment(set.clone())).unwrap();
    assert_eq!(document.effective_environment(), set);
}
