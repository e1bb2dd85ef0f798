//! The document seen flat: every placed mesh, light and camera with its world transform.
//! In: the document. Out: what sync turns into the renderer's lists, for the whole scene or one target.
//! World space is in metres, double precision; no render origin is taken off here.

use glam::{DAffine3, DVec3};

use super::{Document, Slot, node_content, part_content};
use crate::assets::{Bounds, Camera, Light, Mesh, join, moved};
use crate::changes::Content;
use crate::ids::{MaterialId, MeshId, NodeId, Target};
use crate::node::NodeKind;
use crate::prefab::scenes::told_apart;

/// A mesh that is placed.
#[derive(Clone, Debug, PartialEq)]
pub struct Renderable {
    /// Who places it.
    pub target: Target,
    /// The mesh.
    pub mesh: MeshId,
    /// Mesh space to world space.
    pub world_from_mesh: DAffine3,
    /// One material for each primitive of the mesh.
    pub materials: Vec<MaterialId>,
    /// False: hidden, by itself or from above.
    pub visible: bool,
    /// A skin or morph targets bend it: see [`Document::deform_pose`].
    pub deform: bool,
    /// False: the camera does not see it.
    pub camera_visible: bool,
    /// False: it stops no light.
    pub casts_shadows: bool,
}

/// A light or camera that is placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<T> {
    /// Who is it.
    pub target: Target,
    /// Its values.
    pub value: T,
    /// Its space (looking or shining along -Z) to world space; may have scale.
    pub world_from_node: DAffine3,
    /// False: hidden, by itself or from above.
    pub visible: bool,
}

impl Document {
    /// One placed mesh.
    pub fn renderable(&self, target: Target) -> Option<Renderable> {
        let id = self.mesh_of(target).filter(|_| !self.is_absent(target))?;
        let mesh = self.mesh(id)?;
        let rays = self.ray_visibility(target)?;
        Some(Renderable {
            target,
            mesh: id,
            world_from_mesh: self.world_from_mesh(target)?,
            materials: self.materials_of(target, mesh),
            visible: self.shown_now(target),
            deform: self.deforms(target, mesh),
            camera_visible: rays.camera_visible,
            casts_shadows: rays.casts_shadows,
        })
    }

    /// One placed light, as the time that is shown has it.
    pub fn light(&self, target: Target) -> Option<Placed<Light>> {
        self.placed(target, self.posed_light(target)?)
    }

    /// One placed camera, as the time that is shown has it.
    pub fn camera(&self, target: Target) -> Option<Placed<Camera>> {
        self.placed(target, self.posed_camera(target)?)
    }

    /// Every placed mesh, in order of target.
    pub fn renderables(&self) -> impl Iterator<Item = Renderable> + '_ {
        self.targets_with(|content| content.mesh).filter_map(|target| self.renderable(target))
    }

    /// Every placed light, in order of target.
    pub fn lights(&self) -> impl Iterator<Item = Placed<Light>> + '_ {
        self.targets_with(|content| content.light).filter_map(|target| self.light(target))
    }

    /// Every placed camera, in order of target.
    pub fn cameras(&self) -> impl Iterator<Item = Placed<Camera>> + '_ {
        self.targets_with(|content| content.camera).filter_map(|target| self.camera(target))
    }

    /// Names of the cameras in the order of [`Self::cameras`], told apart as scenes and variants are: the n-th of one name is
    /// `NAME#n`, one without a name `camera n`.
    pub fn camera_names(&self) -> Vec<String> {
        let name = |camera: Placed<Camera>| self.name(camera.target).unwrap_or_default().to_owned();
        told_apart("camera", self.cameras().map(name).collect())
    }

    /// The camera of one of [`Self::camera_names`]; parts of instances count.
    pub fn find_camera(&self, name: &str) -> Option<Placed<Camera>> {
        let place = self.camera_names().iter().position(|known| known == name)?;
        self.cameras().nth(place)
    }

    /// The camera to render with: the chosen one, else the first.
    pub fn main_camera(&self) -> Option<Placed<Camera>> {
        self.default_camera().and_then(|target| self.camera(target)).or_else(|| self.cameras().next())
    }

    /// Smallest and largest corner of all visible meshes, world space; `None` when there are none. Meshes
    /// whose place is not finite are left out.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.targets_with(|content| content.mesh)
            .filter(|&target| self.shown_now(target))
            .filter_map(|target| self.own_bounds(target))
            .reduce(join)
    }

    /// Smallest and largest corner of what hangs at and below a target, world space, hidden or not. Walks all
    /// of it; for the target alone there is [`Self::own_bounds`].
    pub fn bounds_of(&self, target: Target) -> Option<(DVec3, DVec3)> {
        let mut bounds: Option<Bounds> = None;
        let mut stack = vec![target];
        while let Some(target) = stack.pop() {
            let own = self.own_bounds(target);
            bounds = bounds.into_iter().chain(own).reduce(join);
            stack.extend(self.children_of(target));
        }
        bounds
    }

    /// Smallest and largest corner of the mesh that a target places itself, world space, hidden or not; `None`
    /// without a mesh and where its place is not finite. A mesh that deforms is taken in its present pose: the
    /// box is never too small, but can be too large, because it holds the boxes of all joints.
    pub fn own_bounds(&self, target: Target) -> Option<(DVec3, DVec3)> {
        let mesh = self.mesh(self.mesh_of(target)?)?;
        let bounds = match self.deform_pose(target) {
            Some(pose) => mesh.posed_bounds(&pose)?,
            None => mesh.bounds?,
        };
        let placed = moved(&self.world_from_mesh(target)?, bounds);
        (placed.0.is_finite() && placed.1.is_finite()).then_some(placed)
    }

    fn placed<T>(&self, target: Target, value: T) -> Option<Placed<T>> {
        (!self.is_absent(target)).then_some(())?;
        Some(Placed {
            target,
            value,
            world_from_node: self.world_from(target)?,
            visible: self.shown_now(target),
        })
    }

    /// The cached visibility where it is up to date.
    pub(super) fn shown_now(&self, target: Target) -> bool {
        let cached = self.slots.get(&target.node).and_then(|slot| {
            let fresh = !slot.dirty && self.dirty_parts.is_empty();
            match target.part {
                _ if !fresh => None,
                None => Some(slot.shown),
                Some(part) => slot.parts.shown.get(part as usize).copied(),
            }
        });
        cached.unwrap_or_else(|| self.effectively_visible(target))
    }

    /// One material a primitive.
    pub(crate) fn materials_of(&self, target: Target, mesh: &Mesh) -> Vec<MaterialId> {
        (0..).zip(&mesh.primitives).map(|(index, p)| self.material_at(target, index, p.material)).collect()
    }

    /// Material of a placed primitive: the override where there is one and it is in the document, else that of the
    /// variant, else the mesh's own.
    pub(super) fn material_at(&self, target: Target, primitive: u32, of_mesh: MaterialId) -> MaterialId {
        let chosen = match target.part {
            Some(_) => {
                let own = self.part_override(target).and_then(|o| o.materials.get(&primitive));
                own.or_else(|| self.varied_material(target, primitive))
            }
            None => match self.node(target.node).map(|node| &node.kind) {
                Some(NodeKind::Mesh { materials, .. }) => materials.get(primitive as usize),
                _ => None,
            },
        };
        chosen.copied().filter(|id| self.material(*id).is_some()).unwrap_or(of_mesh)
    }

    pub(super) fn targets_with<'a>(
        &'a self,
        wanted: impl Fn(Content) -> bool + Copy + 'a,
    ) -> impl Iterator<Item = Target> + 'a {
        self.slots.iter().flat_map(move |(&id, slot)| {
            let own = wanted(node_content(&slot.node.kind)).then_some(Target::node(id));
            own.into_iter().chain(self.parts_with(id, slot, wanted))
        })
    }

    fn parts_with<'a>(
        &'a self,
        id: NodeId,
        slot: &Slot,
        wanted: impl Fn(Content) -> bool + 'a,
    ) -> impl Iterator<Item = Target> + 'a {
        slot.node
            .prefab()
            .and_then(|prefab| self.prefab(prefab))
            .into_iter()
            .flat_map(|prefab| prefab.nodes().iter().enumerate())
            .filter(move |(_, part)| wanted(part_content(part)))
            .map(move |(index, _)| Target::part(id, index as u32))
            .filter(|&target| !self.is_absent(target))
    }
}
