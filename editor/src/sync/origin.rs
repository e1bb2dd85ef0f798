//! The render origin: world space less one point, so that single precision is enough on the device. A pure function
//! of the camera's place and of the smallest extent in the scene: it has no memory, and is zero near zero.

use std::collections::BTreeMap;

use caustica_scene::{Document, MeshId, Target};
use glam::DVec3;

/// A cell of the grid of origins is this many times the smallest extent. Single precision carries 2^24 steps: at the
/// edge of a cell the smallest thing is still cut into 2^24 / 2^14 = 1024 steps.
const CELL_PER_EXTENT: f64 = 16_384.0;
/// With nothing in the scene.
const EMPTY_CELL_M: f64 = 1024.0;

/// Extents of everything placed, by powers of two, so that the smallest is known at once, and a mesh that changes its size
/// changes it for all its instances at once.
#[derive(Debug, Default)]
pub struct Extents {
    by_target: BTreeMap<Target, Extent>,
    meshes: BTreeMap<MeshId, OfMesh>,
    /// The smallest extent of every mesh, and the extents of what deforms.
    counts: BTreeMap<i32, usize>,
}

/// What is noted of a target: exponents of two.
#[derive(Clone, Copy, Debug)]
enum Extent {
    /// Of a rigid mesh, whose scale this is.
    Rigid(MeshId, i32),
    /// In its present pose.
    Posed(i32),
}

/// The rigid instances of a mesh.
#[derive(Debug, Default)]
struct OfMesh {
    /// Of the diagonal of its bounds; `None`: it is a point, or empty.
    size: Option<i32>,
    scales: BTreeMap<i32, usize>,
}

impl OfMesh {
    fn smallest(&self) -> Option<i32> {
        Some(self.size? + self.scales.keys().next()?)
    }
}

impl Extents {
    /// Notes where a target is placed; nothing of it is left when it places no mesh, or one without size.
    pub fn note(&mut self, document: &Document, target: Target) {
        self.remove(target);
        let Some((id, mesh)) = document.mesh_of(target).and_then(|id| Some((id, document.mesh(id)?))) else {
            return;
        };
        let length = |(low, high): (DVec3, DVec3)| (high - low).length();
        if document.deform_pose(target).is_some() {
            if let Some(extent) = document.own_bounds(target).map(length).and_then(exponent) {
                self.by_target.insert(target, Extent::Posed(extent));
                count(&mut self.counts, extent);
            }
            return;
        }
        let world = document.world_from_mesh(target).filter(|world| world.translation.is_finite());
        let longest = world.map(|world| {
            let m = world.matrix3;
            m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length())
        });
        let Some(scale) = longest.and_then(exponent) else { return };
        self.by_target.insert(target, Extent::Rigid(id, scale));
        self.change(id, |known| {
            known.size = mesh.bounds.map(length).and_then(exponent);
            count(&mut known.scales, scale);
        });
    }

    /// A mesh has another size.
    pub fn resize(&mut self, document: &Document, id: MeshId) {
        let bounds = document.mesh(id).and_then(|mesh| mesh.bounds);
        self.change(id, |known| known.size = bounds.and_then(|(low, high)| exponent((high - low).length())));
    }

    /// Forgets a target.
    pub fn remove(&mut self, target: Target) {
        match self.by_target.remove(&target) {
            Some(Extent::Posed(extent)) => discount(&mut self.counts, extent),
            Some(Extent::Rigid(id, scale)) => self.change(id, |known| discount(&mut known.scales, scale)),
            None => {}
        }
    }

    fn change(&mut self, id: MeshId, change: impl FnOnce(&mut OfMesh)) {
        let known = self.meshes.entry(id).or_default();
        let before = known.smallest();
        change(known);
        let after = known.smallest();
        if known.scales.is_empty() {
            self.meshes.remove(&id);
        }
        before.into_iter().for_each(|extent| discount(&mut self.counts, extent));
        after.into_iter().for_each(|extent| count(&mut self.counts, extent));
    }

    /// The origin for a camera at `eye`, world space, metres.
    pub fn render_origin(&self, eye: DVec3) -> DVec3 {
        let smallest = self.counts.keys().next().map(|exponent| 2f64.powi(*exponent));
        let cell = smallest.map_or(EMPTY_CELL_M, |extent| extent * CELL_PER_EXTENT);
        let snapped = (eye / cell).round() * cell;
        if snapped.is_finite() { snapped + DVec3::ZERO } else { DVec3::ZERO }
    }
}

/// The power of two below a length.
fn exponent(length: f64) -> Option<i32> {
    (length.is_finite() && length > 0.0).then(|| length.log2().floor() as i32)
}

fn count(counts: &mut BTreeMap<i32, usize>, key: i32) {
    *counts.entry(key).or_insert(0) += 1;
}

fn discount(counts: &mut BTreeMap<i32, usize>, key: i32) {
    if let Some(left) = counts.get_mut(&key) {
        *left -= 1;
        if *left == 0 {
            counts.remove(&key);
        }
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;
    use caustica_scene::{Edit, Local, Node, NodeId, NodeKind, Trs};

    use super::super::tests::rig::{BOX, Rig};

    /// A scene with instances of one mesh at these scales, and what is noted of it.
    fn scaled(scales: &[f64]) -> (Rig, Extents) {
        let mut rig = Rig::unsynced();
        let body = Target::part(rig.node, BOX);
        let mesh = rig.document.mesh_of(body).unwrap();
        rig.document.apply(Edit::RemoveNode { node: rig.node }).unwrap();
        let mut extents = Extents::default();
        for scale in scales {
            let local: Local = Trs { scale: DVec3::splat(*scale), ..Trs::default() }.into();
            let kind = NodeKind::Mesh { mesh, materials: Vec::new(), weights: Vec::new() };
            let (node, edit) = rig.document.add_edit(Node::new("box", kind).with_local(local), None);
            rig.document.apply(edit).unwrap();
            extents.note(&rig.document, Target::node(node));
        }
        (rig, extents)
    }

    #[test]
    fn zero_near_zero_and_near_the_camera_far_out() {
        let (_, extents) = scaled(&[1.0]);
        assert_eq!(extents.render_origin(DVec3::new(8000.0, -3.0, 2.0)), DVec3::ZERO);
        let eye = DVec3::new(1e6, 0.0, -5e5);
        assert!((extents.render_origin(eye) - eye).abs().max_element() <= 16_384.0);
    }

    #[test]
    fn the_way_there_does_not_matter() {
        let (rig, mut extents) = scaled(&[1e-3, 5.0, 0.0]);
        let eye = DVec3::splat(1e7 + 1.0);
        let small = extents.render_origin(eye);
        let smallest = rig.document.nodes().next().unwrap().0;
        extents.remove(Target::node(smallest));
        let large = extents.render_origin(eye);
        assert_ne!(small, large);
        assert_eq!(large, scaled(&[5.0]).1.render_origin(eye));
        extents.remove(Target::node(NodeId(7_000)));
        extents.note(&rig.document, Target::node(smallest));
        assert_eq!(extents.render_origin(eye), small);
    }

    #[test]
    fn a_mesh_that_changes_its_size_does_so_in_all_its_instances() {
        let (mut rig, mut extents) = scaled(&[1.0, 3.0]);
        let eye = DVec3::splat(1e7 + 1.0);
        let before = extents.render_origin(eye);
        let node = rig.document.nodes().next().unwrap().0;
        let mesh = rig.document.mesh_of(Target::node(node)).unwrap();
        let primitives = rig.document.mesh(mesh).unwrap().primitives.len() as u32;
        let mut resize = |size: f64| {
            for primitive in 0..primitives {
                let mesh_from_primitive = glam::DAffine3::from_scale(DVec3::splat(size));
                let edit = Edit::SetPrimitiveTransform { mesh, primitive, mesh_from_primitive };
                rig.document.apply(edit).unwrap();
            }
            extents.resize(&rig.document, mesh);
            extents.render_origin(eye)
        };
        let small = resize(1e-4);
        assert_ne!(small, before);
        assert_eq!(resize(0.0), Extents::default().render_origin(eye), "a point has no extent");
        assert_eq!(resize(1e-4), small);
        assert_eq!(resize(1.0), before);
    }

    #[test]
    fn nonsense_does_not_spread() {
        let (_, extents) = scaled(&[f64::MAX, 1e-320]);
        assert_eq!(extents.render_origin(DVec3::NAN), DVec3::ZERO);
        assert!(extents.render_origin(DVec3::splat(1e300)).is_finite());
    }
}
