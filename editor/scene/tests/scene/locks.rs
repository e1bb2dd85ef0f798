//! Locks: what they keep, and what goes on in spite of them.

use crate::common::{PLATE, Scene, scene, trs};
use caustica_scene::{Edit, Material, Node, NodeId, NodeKind, Subtree, Target};

fn locked(node: impl Fn(&Scene) -> NodeId) -> (Scene, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let node = node(&scene);
    scene.document.apply(Edit::SetLocked { node, locked: true }).unwrap();
    (scene, folder)
}

#[test]
fn a_lock_holds_for_all_below() {
    let (scene, _folder) = locked(|scene| scene.group);
    let Scene { document, group, first, second, light, .. } = &scene;
    let below = [Target::node(*group), (*first).into(), Target::part(*first, PLATE), (*light).into()];
    assert!(below.iter().all(|target| document.locked_by(*target) == Some(*group)));
    assert_eq!(document.locked_by((*second).into()), None);
    let child = Subtree::single(NodeId(999), Node::new("child", NodeKind::Group));
    let kept = [
        Edit::SetTransform { target: Target::part(*first, PLATE), local: trs(1.0, 0.0, 1.0) },
        Edit::Rename { target: (*light).into(), name: "other".into() },
        Edit::RemoveNode { node: *first },
        Edit::Reparent { node: *light, parent: None, index: 0, local: trs(0.0, 0.0, 1.0) },
        Edit::Reparent { node: *second, parent: Some(*first), index: 0, local: trs(0.0, 0.0, 1.0) },
        Edit::AddNode { parent: Some(*group), index: 0, subtree: child.clone() },
    ];
    for edit in kept {
        assert_eq!(document.locked_against(&edit), Some(*group), "{edit:?}");
        let batch = Edit::batch("both", vec![Edit::SetDefaultCamera(None), edit]);
        assert_eq!(document.locked_against(&batch), Some(*group), "{batch:?}");
    }
    let material = document.materials().next().unwrap().0;
    let free = [
        Edit::SetLocked { node: *group, locked: false },
        Edit::SetVisible { target: (*group).into(), visible: false },
        Edit::SetMaterial { material, value: Box::new(Material::default()) },
        Edit::SetTransform { target: (*second).into(), local: trs(1.0, 0.0, 1.0) },
        Edit::AddNode { parent: None, index: 0, subtree: child },
    ];
    for edit in free {
        assert_eq!(document.locked_against(&edit), None, "{edit:?}");
    }
}

#[test]
fn what_holds_something_locked_is_moved_but_not_removed() {
    let (scene, _folder) = locked(|scene| scene.first);
    let (document, group) = (&scene.document, scene.group);
    let moves = Edit::SetTransform { target: group.into(), local: trs(1.0, 0.0, 1.0) };
    assert_eq!(document.locked_against(&moves), None);
    assert_eq!(document.locked_against(&Edit::RemoveNode { node: group }), Some(scene.first));
}
