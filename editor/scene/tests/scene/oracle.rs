//! Skins, morph targets and clips of the shared models by the gltf crate, and poses worked out from them anew.

use std::path::Path;

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::animation::util::ReadOutputs;

/// A file as the gltf crate reads it.
pub struct Oracle {
    pub document: gltf::Document,
    pub buffers: Vec<gltf::buffer::Data>,
    /// Nodes of the scene in depth-first order: the place is the index of the part.
    pub nodes: Vec<usize>,
}

impl Oracle {
    pub fn open(path: &Path) -> Self {
        let gltf::Gltf { document, blob } = gltf::Gltf::open(path).unwrap();
        let buffers = gltf::import_buffers(&document, path.parent(), blob).unwrap();
        let mut nodes = Vec::new();
        let scene = document.default_scene().or_else(|| document.scenes().next()).unwrap();
        for root in scene.nodes() {
            visit(&root, &mut nodes);
        }
        Self { document, buffers, nodes }
    }

    /// Index of the part that a node became.
    pub fn part(&self, node: usize) -> Option<u32> {
        self.nodes.iter().position(|&n| n == node).map(|part| part as u32)
    }

    /// Transform of a node against its parent at a time of the first clip, linear channels only.
    fn local(&self, node: &gltf::Node<'_>, time_s: f64) -> DAffine3 {
        let (translation, rotation, scale) = node.transform().decomposed();
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let mut trs =
            (wide(translation), DQuat::from_array(rotation.map(f64::from)).normalize(), wide(scale));
        let channels = self.document.animations().next().into_iter().flat_map(|clip| clip.channels());
        for channel in channels.filter(|c| c.target().node().index() == node.index()) {
            assert_eq!(channel.sampler().interpolation(), gltf::animation::Interpolation::Linear);
            let reader = channel.reader(|buffer| Some(&self.buffers[buffer.index()]));
            let times: Vec<f64> = reader.read_inputs().unwrap().map(f64::from).collect();
            let (key, share) = place(&times, time_s);
            match reader.read_outputs().unwrap() {
                ReadOutputs::Translations(values) => trs.0 = mixed(values.map(wide).collect(), key, share),
                ReadOutputs::Scales(values) => trs.2 = mixed(values.map(wide).collect(), key, share),
                ReadOutputs::Rotations(values) => {
                    let keys: Vec<DQuat> =
                        values.into_f32().map(|q| DQuat::from_array(q.map(f64::from)).normalize()).collect();
                    let (from, to) = (keys[key], keys[(key + 1).min(keys.len() - 1)]);
                    trs.1 = turned(from, to, share);
                }
                ReadOutputs::MorphTargetWeights(_) => {}
            }
        }
        DAffine3::from_scale_rotation_translation(trs.2, trs.1, trs.0)
    }

    /// Matrices of the joints of a skin at a time, against the top of the scene.
    pub fn joint_matrices(&self, skin: &gltf::Skin<'_>, time_s: f64) -> Vec<DAffine3> {
        let reader = skin.reader(|buffer| Some(&self.buffers[buffer.index()]));
        let inverse_bind: Vec<DAffine3> = match reader.read_inverse_bind_matrices() {
            Some(matrices) => matrices
                .map(|m| DAffine3::from_mat4(DMat4::from_cols_array_2d(&m.map(|c| c.map(f64::from)))))
                .collect(),
            None => vec![DAffine3::IDENTITY; skin.joints().count()],
        };
        let parent_of = |node: usize| {
            self.document.nodes().find(|n| n.children().any(|c| c.index() == node)).map(|n| n.index())
        };
        let matrix = |(joint, inverse): (gltf::Node<'_>, &DAffine3)| {
            let mut matrix = self.local(&joint, time_s);
            let mut at = joint.index();
            while let Some(parent) = parent_of(at) {
                matrix = self.local(&self.document.nodes().nth(parent).unwrap(), time_s) * matrix;
                at = parent;
            }
            matrix * *inverse
        };
        skin.joints().zip(&inverse_bind).map(matrix).collect()
    }
}

fn visit(node: &gltf::Node<'_>, nodes: &mut Vec<usize>) {
    nodes.push(node.index());
    for child in node.children() {
        visit(&child, nodes);
    }
}

/// The key before a time and the share of the way to the next.
fn place(times: &[f64], time_s: f64) -> (usize, f64) {
    let last = times.len() - 1;
    if time_s <= times[0] {
        return (0, 0.0);
    }
    if time_s >= times[last] {
        return (last, 0.0);
    }
    let key = (0..last).find(|&k| times[k] <= time_s && time_s < times[k + 1]).unwrap();
    (key, (time_s - times[key]) / (times[key + 1] - times[key]))
}

fn mixed(values: Vec<DVec3>, key: usize, share: f64) -> DVec3 {
    values[key].lerp(values[(key + 1).min(values.len() - 1)], share)
}

/// By axis and angle of the rotation that leads from one to the other.
fn turned(from: DQuat, to: DQuat, share: f64) -> DQuat {
    let mut way = to * from.inverse();
    if way.w < 0.0 {
        way = -way;
    }
    let (axis, angle) = way.to_axis_angle();
    DQuat::from_axis_angle(axis, angle * share) * from
}
