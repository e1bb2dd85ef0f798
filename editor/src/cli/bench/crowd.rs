//! Documents of many nodes in a session without a window, made by edits as a user's would be. Enters: how many nodes.
//! Leaves: a session, frame by frame, with what each frame cost.

use anyhow::Context;
use caustica_renderer::{Pipeline, ViewSettings};
use caustica_scene::{
    Document, Edit, Local, MaterialId, MeshId, Node, NodeId, NodeKind, Subtree, Target, Trs,
};
use glam::DVec3;

use super::Bench;
use super::shapes::{LONE_MESH, props};
use crate::session::{HostTimes, Lap, Session, SessionOptions, ViewCamera};

/// Size of the view: the scene is measured, not the image.
const EXTENT: [u32; 2] = [64, 48];
/// Nodes below one group.
const GROUP: usize = 1000;
/// Distance of neighbours in the grid, metres.
const SPACING_M: f64 = 2.0;

/// A large prime: steps of it lead all over a document.
pub(super) const FAR: usize = 104_729;

/// A session with a grid of small meshes.
pub(super) struct Crowd {
    pub(super) session: Session,
    nodes: Vec<NodeId>,
    /// Nodes in a row of the grid.
    side: usize,
    /// Moves so far: no two end in the same place.
    moves: u32,
    /// Seconds that the edits took which made the document.
    pub(super) document_s: f64,
    /// Seconds until its first picture was finished.
    pub(super) first_frame_s: f64,
}

/// What a frame cost the host, milliseconds.
pub(super) struct FrameCost {
    pub(super) host: HostTimes,
    pub(super) submit_ms: f64,
}

/// Settings of a view in which every frame is one sample and nothing is denoised.
pub(super) fn plain(pipeline: Pipeline) -> ViewSettings {
    ViewSettings { pipeline, temporal: false, ..ViewSettings::default() }
}

impl Crowd {
    /// Makes the document by edits and renders it for the first time.
    pub(super) fn new(bench: &Bench, count: usize, pipeline: Pipeline) -> anyhow::Result<Self> {
        let options = SessionOptions {
            shaders: bench.shaders.clone(),
            settings: plain(pipeline),
            extent: EXTENT,
            ..SessionOptions::default()
        };
        let session = Session::new(&bench.device, options)?;
        let side = (count as f64).sqrt().ceil() as usize;
        let mut crowd =
            Self { session, nodes: Vec::new(), side, moves: 0, document_s: 0.0, first_frame_s: 0.0 };
        let mut lap = Lap::start();
        crowd.session.edit_with(|document| document.import_edit(props()))?;
        while crowd.nodes.len() < count {
            crowd.add_group((count - crowd.nodes.len()).min(GROUP))?;
        }
        crowd.document_s = lap.ms() / 1e3;
        crowd.look_at_probe();
        // As in the editor, where what is moved is selected: the last node, whose slot is the highest.
        let last = crowd.nodes.last().map(|node| Target::node(*node));
        crowd.session.set_selection(&last.into_iter().collect());
        crowd.frame()?;
        crowd.first_frame_s = lap.ms() / 1e3;
        Ok(crowd)
    }

    fn add_group(&mut self, count: usize) -> anyhow::Result<()> {
        let document = self.session.document();
        let meshes: Vec<MeshId> = document.meshes().map(|(id, _)| id).take(LONE_MESH).collect();
        let materials = self.materials();
        let (first, side) = (self.nodes.len(), self.side);
        let added = self.session.edit_with(|document| {
            let top = NodeId(document.allocate_id());
            let mut subtree = Subtree::single(top, Node::new("group", NodeKind::Group));
            for i in first..first + count {
                let material = materials.get(i / 7 % materials.len().max(1)).copied().unwrap_or_default();
                let mesh = meshes.get(i % meshes.len().max(1)).copied().unwrap_or_default();
                subtree.nodes.push(prop(document, top, (mesh, material), home(i, side)));
            }
            let ids: Vec<NodeId> = subtree.nodes.iter().skip(1).map(|(id, _)| *id).collect();
            (ids, Edit::AddNode { parent: None, index: usize::MAX, subtree })
        })?;
        self.nodes.extend(added);
        Ok(())
    }

    /// Adds the one node of a mesh that no other node uses.
    pub(super) fn add_lone(&mut self) -> anyhow::Result<NodeId> {
        let mesh =
            self.session.document().meshes().nth(LONE_MESH).map(|(id, _)| id).context("no lone mesh")?;
        let material = self.materials().first().copied().unwrap_or_default();
        let kind = NodeKind::Mesh { mesh, materials: vec![material], weights: Vec::new() };
        let node = Node::new("lone", kind).with_local(Trs::from_translation(DVec3::Y * 2.0));
        Ok(self.session.edit_with(|document| document.add_edit(node, None))?)
    }

    /// Materials of the props.
    pub(super) fn materials(&self) -> Vec<MaterialId> {
        self.session.document().materials().map(|(id, _)| id).collect()
    }

    /// Number of meshes placed.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// A node, counted round and round.
    pub(super) fn node(&self, index: usize) -> NodeId {
        self.nodes.get(index % self.nodes.len().max(1)).copied().unwrap_or_default()
    }

    /// The edit that puts a node beside its place in the grid.
    pub(super) fn put(&self, index: usize, offset: DVec3) -> Edit {
        let place = home(index % self.nodes.len().max(1), self.side) + offset;
        Edit::SetTransform { target: self.node(index).into(), local: translated(place) }
    }

    /// A node of round `round`: they lie all over the document.
    pub(super) fn far_node(&self, round: usize) -> NodeId {
        self.node(round * FAR)
    }

    /// The edit that gives a node another material.
    pub(super) fn give_material(&self, node: NodeId, round: usize) -> Edit {
        let materials = self.materials();
        let now = match self.session.document().node(node).map(|node| &node.kind) {
            Some(NodeKind::Mesh { materials, .. }) => materials.first().copied(),
            _ => None,
        };
        let others: Vec<MaterialId> = materials.into_iter().filter(|id| Some(*id) != now).collect();
        let material = others.get(round % others.len().max(1)).copied().unwrap_or_default();
        Edit::AssignMaterial { target: node.into(), primitive: 0, material }
    }

    /// Copies the node of a round, as the editor does.
    pub(super) fn copy(&mut self, round: usize) -> anyhow::Result<()> {
        let node = self.far_node(round);
        let made = self.session.edit_with(|document| match document.duplicate_edit(node) {
            Ok((id, edit)) => (Some(id), edit),
            Err(_) => (None, Edit::batch("copied nothing", Vec::new())),
        })?;
        made.map(|_| ()).context("the node to be copied is gone")
    }

    /// The edit that moves a node a little, to where it has not been before.
    pub(super) fn next_move(&mut self, index: usize) -> Edit {
        self.moves += 1;
        let height = 0.1 + f64::from(self.moves) * 1e-3;
        self.put(index, DVec3::new(0.1, if self.moves.is_multiple_of(2) { height } else { -height }, 0.0))
    }

    /// Renders one frame and waits for it, so that the next one does not wait.
    pub(super) fn frame(&mut self) -> anyhow::Result<FrameCost> {
        let cost = self.frame_without_waiting()?;
        self.session.finish()?;
        Ok(cost)
    }

    /// Renders one frame and goes on, as the window does.
    pub(super) fn frame_without_waiting(&mut self) -> anyhow::Result<FrameCost> {
        let recorder = self.session.begin_frame(EXTENT)?;
        let host = self.session.host_times();
        let mut lap = Lap::start();
        self.session.submit(recorder, None)?;
        Ok(FrameCost { host, submit_ms: lap.ms() })
    }

    /// Index of the node that the camera waits for.
    fn probe(&self) -> usize {
        self.nodes.len() / 2
    }

    /// Looks at a point above the probe, where nothing is until it jumps there.
    fn look_at_probe(&mut self) {
        let point = home(self.probe(), self.side) + JUMP;
        let eye = point + DVec3::new(0.0, 0.3, 3.0);
        self.session.set_camera(ViewCamera::looking_at(eye, point, 0.7, 0.01));
    }

    fn sees_probe(&mut self) -> anyhow::Result<bool> {
        let hit = self.session.pick(EXTENT.map(|side| side / 2))?;
        Ok(hit.is_some_and(|hit| hit.target == Target::node(self.node(self.probe()))))
    }

    /// Frames until the picture shows that a node jumped into it or out of it: the most of ten jumps.
    pub(super) fn latency_frames(&mut self) -> anyhow::Result<u32> {
        self.session.push(self.put(self.probe(), DVec3::ZERO))?;
        self.frame()?;
        anyhow::ensure!(!self.sees_probe()?, "the node is in sight before it has moved");
        let mut most = 0;
        for jump in 0..10 {
            let up = jump % 2 == 0;
            self.session.push(self.put(self.probe(), if up { JUMP } else { DVec3::ZERO }))?;
            self.session.end_gesture();
            let mut frames = 0;
            while frames == 0 || (frames < 8 && self.sees_probe()? != up) {
                self.frame()?;
                frames += 1;
            }
            anyhow::ensure!(self.sees_probe()? == up, "a jump was not shown for {frames} frames");
            most = most.max(frames);
        }
        Ok(most)
    }
}

/// From the place of the probe in the grid to the middle of the picture.
const JUMP: DVec3 = DVec3::new(0.0, 4.0, 0.0);

/// Place of a node in a grid of `side` nodes a row, its middle near the origin.
fn home(index: usize, side: usize) -> DVec3 {
    let side = side.max(1);
    let half = (side / 2) as f64;
    DVec3::new((index % side) as f64 - half, 0.0, (index / side) as f64 - half) * SPACING_M
}

fn translated(place: DVec3) -> Local {
    Trs::from_translation(place).into()
}

fn prop(
    document: &mut Document,
    parent: NodeId,
    (mesh, material): (MeshId, MaterialId),
    place: DVec3,
) -> (NodeId, Node) {
    let kind = NodeKind::Mesh { mesh, materials: vec![material], weights: Vec::new() };
    let mut node = Node::new("prop", kind).with_local(translated(place));
    node.parent = Some(parent);
    (NodeId(document.allocate_id()), node)
}
