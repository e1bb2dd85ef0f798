//! What a document holds, as the steps want to know it.

use std::collections::BTreeSet;

use caustica_scene::{Document, Edit, Node, PrefabId, Target};

/// Nodes and parts.
pub fn targets_of(document: &Document) -> Vec<Target> {
    let mut targets = Vec::new();
    for (id, node) in document.nodes() {
        targets.push(Target::node(id));
        let prefab = node.prefab().and_then(|id| document.prefab(id));
        let parts = prefab.map_or(0, |prefab| prefab.nodes().len() as u32);
        targets.extend((0..parts).map(|part| Target::part(id, part)));
    }
    targets
}

/// A prefab goes, and with it all that uses it: not at all when that is much.
pub fn removal(document: &Document, prefab: PrefabId) -> Option<Edit> {
    let brought = document.prefab(prefab)?;
    let uses = |target: Target| {
        let node = document.node(target.node).and_then(Node::prefab) == Some(prefab);
        let mesh = document.mesh_of(target).is_some_and(|mesh| brought.meshes.contains(&mesh));
        let placed = document.renderable(target);
        let own = placed.is_some_and(|p| p.materials.iter().any(|id| brought.materials.contains(id)));
        let kept = document.part_override(target);
        let kept = kept.is_some_and(|o| o.materials.values().any(|id| brought.materials.contains(id)));
        node || mesh || own || kept
    };
    let mut gone = BTreeSet::new();
    let mut edits = Vec::new();
    for target in targets_of(document).into_iter().filter(|target| uses(*target)) {
        if !gone.contains(&target.node) {
            gone.extend(document.subtree_ids(target.node));
            edits.push(Edit::RemoveNode { node: target.node });
        }
    }
    // What hangs below another one that goes has gone with it.
    let top = |edit: &Edit| match edit {
        Edit::RemoveNode { node } => {
            let above = document.node(*node).and_then(|node| node.parent);
            above.is_none_or(|above| !gone.contains(&above))
        }
        _ => true,
    };
    edits.retain(top);
    edits.push(Edit::RemovePrefab { prefab });
    (gone.len() < 20).then(|| Edit::batch("removed a prefab with what uses it", edits))
}
