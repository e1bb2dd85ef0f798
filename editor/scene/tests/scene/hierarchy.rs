//! Large and deep trees: what one edit costs, by the size of the subtree that it moves.
//! `cargo test --release -p caustica-scene --test scene hierarchy -- --nocapture` prints the tables.

use std::time::{Duration, Instant};

use caustica_scene::{Document, Edit, Node, NodeId, NodeKind, Project, ProjectMeta, Subtree, Target, Trs};
use glam::DVec3;

const NODES: usize = 100_000;
const DEEP: usize = 10_000;

/// A tree in which every node has up to `fan` children, breadth first, with one more root without children.
fn tree(count: usize, fan: usize) -> (Document, Vec<NodeId>) {
    let mut document = Document::new();
    let ids: Vec<NodeId> = (0..count).map(|_| NodeId(document.allocate_id())).collect();
    let node = |place: usize| {
        let parent = place.checked_sub(1).map(|before| ids[before / fan]);
        Node {
            parent,
            ..Node::new(format!("n{place}"), NodeKind::Group).with_local(Trs::from_translation(DVec3::X))
        }
    };
    let subtree = Subtree { nodes: (0..count).map(|place| (ids[place], node(place))).collect() };
    document.apply(Edit::AddNode { parent: None, index: 0, subtree }).unwrap();
    let (other, edit) = document.add_edit(Node::new("other", NodeKind::Group), None);
    document.apply(edit).unwrap();
    document.drain_changes();
    (document, ids.into_iter().chain([other]).collect())
}

fn timed<T>(work: impl FnOnce() -> T) -> (Duration, T) {
    let start = Instant::now();
    let value = work();
    (start.elapsed(), value)
}

fn median_of(repeat: usize, mut work: impl FnMut(usize) -> Duration) -> Duration {
    let mut times: Vec<Duration> = (0..repeat).map(&mut work).collect();
    times.sort();
    times[repeat / 2]
}

/// Moves a node and brings all transforms up to date; how many that were, and the time of it.
fn move_node(document: &mut Document, node: NodeId, step: usize) -> (Duration, usize) {
    let local = Trs::from_translation(DVec3::Y * (step + 1) as f64).into();
    timed(|| {
        document.apply(Edit::SetTransform { target: node.into(), local }).unwrap();
        document.update_transforms()
    })
}

#[test]
fn moving_a_node_costs_its_subtree() {
    let (mut document, ids) = tree(NODES, 10);
    println!("| nodes moved of {NODES} | median of 21 | a node |\n|---|---|---|");
    for place in [99_999, 5_000, 500, 50, 5, 0] {
        let size = document.subtree_ids(ids[place]).len();
        let time = median_of(21, |step| {
            let (time, computed) = move_node(&mut document, ids[place], step);
            assert_eq!(computed, size, "only the subtree");
            document.drain_changes();
            time
        });
        println!("| {size} | {time:.1?} | {:.0?} |", time / size as u32);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.caustica.json");
    let (saved, _) = timed(|| Project::save(&path, &document, &ProjectMeta::default()).unwrap());
    let (read, project) = timed(|| Project::load(&path).unwrap());
    assert!(project.document == document);
    println!("all saved in {saved:.1?}, read in {read:.1?}");
}

#[test]
fn a_hundred_thousand_nodes_side_by_side_are_handled_at_once() {
    let (mut document, ids) = tree(NODES, NODES);
    let (before, top) = (document.clone(), ids[0]);
    println!("| {NODES} siblings | time |\n|---|---|");
    let remove = ids[1..NODES].iter().rev().map(|&node| Edit::RemoveNode { node }).collect();
    let (removed, undo) = timed(|| document.apply(Edit::batch("removed all", remove)).unwrap());
    assert_eq!(document.node_count(), 2);
    let (restored, _) = timed(|| document.apply(undo).unwrap());
    assert!(document == before);
    let (copied, _) = timed(|| {
        let (_, edit) = document.duplicate_edit(top).unwrap();
        document.apply(edit).unwrap()
    });
    let hide =
        ids[1..NODES].iter().map(|&node| Edit::SetVisible { target: node.into(), visible: false }).collect();
    let (hidden, _) = timed(|| document.apply(Edit::batch("hid all", hide)).unwrap());
    let (updated, _) = timed(|| document.drain_changes());
    for (name, time) in [
        ("remove them one by one", removed),
        ("undo that", restored),
        ("copy their parent", copied),
        ("hide them one by one", hidden),
        ("bring the rest up to date", updated),
    ] {
        println!("| {name} | {time:.1?} |");
    }
}

#[test]
fn ten_thousand_levels_are_no_limit() {
    let (mut document, ids) = tree(DEEP, 1);
    let (top, bottom, other) = (ids[0], ids[DEEP - 1], ids[DEEP]);
    let world = document.world_from(bottom.into()).unwrap();
    assert_eq!(world.translation, DVec3::X * DEEP as f64);
    println!("| a chain of {DEEP} levels | time |\n|---|---|");
    for (name, node, size) in [
        ("move its end", bottom, 1),
        ("move its middle", ids[DEEP / 2], DEEP / 2),
        ("move its top", top, DEEP),
    ] {
        let time = median_of(21, |step| {
            let (time, computed) = move_node(&mut document, node, step);
            assert_eq!(computed, size);
            time
        });
        println!("| {name} | {time:.1?} |");
    }
    let before = document.clone();
    let (copied, (copy, edit)) = timed(|| document.duplicate_edit(top).unwrap());
    let (added, undo) = timed(|| document.apply(edit).unwrap());
    assert_eq!(document.node_count(), before.node_count() + DEEP);
    let edit = document.reparent_edit(copy, Some(other), 0).unwrap();
    let (hung, back) = timed(|| {
        let back = document.apply(edit).unwrap();
        document.update_transforms();
        back
    });
    document.apply(back).unwrap();
    let cycle = Edit::Reparent { node: top, parent: Some(bottom), index: 0, local: Trs::IDENTITY.into() };
    assert!(document.apply(cycle).is_err());
    let (removed, ()) = timed(|| drop(document.apply(undo).unwrap()));
    assert!(document == before);
    let (listed, bounds) = timed(|| document.bounds_of(Target::node(top)));
    assert_eq!(bounds, None);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep.caustica.json");
    let (saved, _) = timed(|| Project::save(&path, &document, &ProjectMeta::default()).unwrap());
    let (read, project) = timed(|| Project::load(&path).unwrap());
    assert!(project.document == document);
    for (name, time) in [
        ("copy all: make the edit", copied),
        ("copy all: apply it", added),
        ("hang the copy elsewhere", hung),
        ("remove the copy", removed),
        ("walk all", listed),
        ("save", saved),
        ("read", read),
    ] {
        println!("| {name} | {time:.1?} |");
    }
}
