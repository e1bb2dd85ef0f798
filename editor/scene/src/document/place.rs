//! The document seen flat: every placed mesh, light and camera with its world transform.
//! In: the document. Out: what sync turns into the renderer's lists, for the whole scene or one target.
//! World space is in metres, double precision; no render origin is taken off here.

use glam::{DAffine3, DVec3};

use super::{Document, Slot, node_content, part_content};
use crate::assets::{Camera, Environment, Light, Mesh};
use crate::changes::Content;
use crate::ids::{MaterialId, MeshId, NodeId, Target};
use crate::node::NodeKind;

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
        let mesh = self.mesh_of(target)?;
        Some(Renderable {
            target,
            mesh,
            world_from_mesh: self.world_from(target)?,
            materials: self.materials_of(target, self.mesh(mesh)?),
            visible: self.shown_now(target),
        })
    }

    /// One placed light.
    pub fn light(&self, target: Target) -> Option<Placed<Light>> {
        self.placed(target, self.light_of(target)?)
    }

    /// One placed camera.
    pub fn camera(&self, target: Target) -> Option<Placed<Camera>> {
        self.placed(target, self.camera_of(target)?)
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

    /// The first camera of this name; parts of instances count.
    pub fn find_camera(&self, name: &str) -> Option<Placed<Camera>> {
        self.cameras().find(|camera| self.name(camera.target) == Some(name))
    }

    /// The camera to render with: the chosen one, else the first.
    pub fn main_camera(&self) -> Option<Placed<Camera>> {
        self.default_camera().and_then(|target| self.camera(target)).or_else(|| self.cameras().next())
    }

    /// Smallest and largest corner of all visible meshes, world space; `None` when there are none. Meshes
    /// whose place is not finite are left out.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.renderables()
            .filter(|placed| placed.visible)
            .filter_map(|placed| self.placed_bounds(&placed))
            .reduce(join)
    }

    /// Smallest and largest corner of what hangs at and below a target, world space, hidden or not.
    pub fn bounds_of(&self, target: Target) -> Option<(DVec3, DVec3)> {
        let mut bounds = None;
        let mut stack = vec![target];
        while let Some(target) = stack.pop() {
            let own = self.renderable(target).and_then(|placed| self.placed_bounds(&placed));
            bounds = match (bounds, own) {
                (Some(a), Some(b)) => Some(join(a, b)),
                (a, b) => a.or(b),
            };
            stack.extend(self.children_of(target));
        }
        bounds
    }

    fn placed_bounds(&self, placed: &Renderable) -> Option<(DVec3, DVec3)> {
        let (low, high) = self.mesh(placed.mesh)?.bounds?;
        let corner = |i: u32| {
            let pick = |bit: u32, a: f64, b: f64| if i & bit == 0 { a } else { b };
            placed.world_from_mesh.transform_point3(DVec3::new(
                pick(1, low.x, high.x),
                pick(2, low.y, high.y),
                pick(4, low.z, high.z),
            ))
        };
        let bounds = (0..8).map(corner).map(|p| (p, p)).reduce(join)?;
        (bounds.0.is_finite() && bounds.1.is_finite()).then_some(bounds)
    }

    /// What surrounds the scene: what was set; else what the first placed prefab with a wish asks for; else,
    /// when nothing in the scene shines, the built-in sky; else black. Never [`Environment::Auto`].
    pub fn effective_environment(&self) -> Environment {
        if self.environment != Environment::Auto {
            return self.environment.clone();
        }
        let wished = self
            .slots
            .values()
            .filter_map(|slot| slot.node.prefab())
            .filter_map(|id| self.prefab(id))
            .find_map(|prefab| prefab.environment.clone());
        match wished {
            Some(environment) => environment,
            None if self.has_light() => Environment::Constant(glam::Vec3::ZERO),
            None => Environment::DefaultSky,
        }
    }

    /// Whether something placed shines: a light, or a visible mesh with an untextured emissive material.
    pub fn has_light(&self) -> bool {
        let shines = |id: &MaterialId| {
            self.material(*id).is_some_and(|material| {
                material.emissive_texture.is_none() && material.emitted_radiance().max_element() > 0.0
            })
        };
        self.lights().next().is_some()
            || self.renderables().any(|placed| placed.visible && placed.materials.iter().any(shines))
    }

    fn placed<T>(&self, target: Target, value: T) -> Option<Placed<T>> {
        Some(Placed {
            target,
            value,
            world_from_node: self.world_from(target)?,
            visible: self.shown_now(target),
        })
    }

    /// The cached visibility where it is up to date.
    fn shown_now(&self, target: Target) -> bool {
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

    /// One material a primitive: the override where there is one and it is in the document, else the mesh's.
    fn materials_of(&self, target: Target, mesh: &Mesh) -> Vec<MaterialId> {
        let own = |index: usize| match target.part {
            Some(_) => self.part_override(target).and_then(|o| o.materials.get(&(index as u32)).copied()),
            None => match &self.node(target.node)?.kind {
                NodeKind::Mesh { materials, .. } => materials.get(index).copied(),
                _ => None,
            },
        };
        let primitives = mesh.primitives.iter().enumerate();
        primitives
            .map(|(index, primitive)| {
                own(index).filter(|id| self.material(*id).is_some()).unwrap_or(primitive.material)
            })
            .collect()
    }

    fn targets_with<'a>(
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
    }
}

fn join(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}
