//! What the environment depends on when the user chose none: who shines, and which file wishes for what.
//! Kept up to date edit by edit, so that asking does not walk the scene.

use std::collections::BTreeSet;

use super::Document;
use crate::assets::{Environment, Material};
use crate::ids::{NodeId, Target};
use crate::node::NodeKind;

/// Who has a say in the surroundings.
#[derive(Clone, Debug, Default)]
pub(super) struct Surroundings {
    /// Instances whose file asks for an environment.
    wishes: BTreeSet<NodeId>,
    lights: BTreeSet<Target>,
    /// Placed meshes with a material that shines, hidden ones too.
    shining: BTreeSet<Target>,
    /// A material started or stopped to shine: `shining` has to be made anew, which walks the scene, before it is asked.
    stale: bool,
    /// The same since the last drain.
    shine_changed: bool,
    /// What the last drain told of; `None` while the environment is not [`Environment::Auto`].
    reported: Option<Environment>,
}

impl Surroundings {
    /// Forgets a node and the parts of its instance.
    pub fn remove(&mut self, node: NodeId) {
        self.wishes.remove(&node);
        for targets in [&mut self.lights, &mut self.shining] {
            let span = Target::node(node)..=Target::part(node, u32::MAX);
            let gone: Vec<Target> = targets.range(span).copied().collect();
            for target in gone {
                targets.remove(&target);
            }
        }
    }

    /// Some material may shine now that did not, or the other way round.
    pub fn note_material(&mut self, before: Option<&Material>, after: Option<&Material>) {
        let changed = before.is_some_and(shines) != after.is_some_and(shines);
        self.stale |= changed;
        self.shine_changed |= changed;
    }
}

/// Whether a surface emits light all over. A texture may be black nearly everywhere, so it does not count.
fn shines(material: &Material) -> bool {
    material.emissive_texture.is_none() && material.emitted_radiance().max_element() > 0.0
}

impl Document {
    /// What surrounds the scene: what was set; else what the first placed prefab with a wish asks for; else,
    /// when nothing in the scene shines, the built-in sky; else black. Never [`Environment::Auto`].
    pub fn effective_environment(&self) -> Environment {
        if self.environment != Environment::Auto {
            return self.environment.clone();
        }
        let wished = self.surroundings.wishes.first().and_then(|&node| self.wish_of(node));
        match wished {
            Some(environment) => environment.clone(),
            None if self.has_light() => Environment::Constant(glam::Vec3::ZERO),
            None => Environment::DefaultSky,
        }
    }

    /// Whether something placed shines: a light, or a visible mesh with an untextured emissive material.
    pub fn has_light(&self) -> bool {
        let Surroundings { lights, shining, stale, .. } = &self.surroundings;
        let visible = |target: &Target| self.shown_now(*target);
        !lights.is_empty()
            || match stale {
                false => shining.iter().any(visible),
                true => self.targets_with(|content| content.mesh).any(|t| self.shines(t) && visible(&t)),
            }
    }

    fn wish_of(&self, node: NodeId) -> Option<&Environment> {
        let NodeKind::Prefab { prefab, scene, .. } = &self.node(node)?.kind else { return None };
        self.prefab(*prefab)?.environment_in(scene.as_deref())
    }

    fn shines(&self, target: Target) -> bool {
        let Some(mesh) = self.mesh_of(target).and_then(|id| self.mesh(id)) else {
            return false;
        };
        let mut materials =
            (0..).zip(&mesh.primitives).map(|(index, p)| self.material_at(target, index, p.material));
        materials.any(|id| self.material(id).is_some_and(shines))
    }

    /// Takes a placed node with its parts into account.
    pub(super) fn note_surroundings(&mut self, node: NodeId) {
        self.surroundings.remove(node);
        if self.wish_of(node).is_some() {
            self.surroundings.wishes.insert(node);
        }
        let part_count = match self.node(node).map(|node| &node.kind) {
            Some(NodeKind::Prefab { prefab, .. }) => self.prefab(*prefab).map_or(0, |p| p.nodes().len()),
            _ => 0,
        };
        self.note_shine(Target::node(node));
        for part in 0..part_count as u32 {
            self.note_shine(Target::part(node, part));
        }
    }

    /// Takes a target into account whose materials are others now.
    pub(super) fn note_shine(&mut self, target: Target) {
        let content = self.content_of(target);
        if content.light {
            self.surroundings.lights.insert(target);
        }
        if content.mesh && self.shines(target) {
            self.surroundings.shining.insert(target);
        } else {
            self.surroundings.shining.remove(&target);
        }
    }

    /// The choice of the user replaces what the scene says, or gives way to it again.
    pub(super) fn forget_reported_environment(&mut self) {
        self.surroundings.reported = None;
    }

    /// Whether the effective environment is another than at the last drain. `may_differ` says that something
    /// came, went, was hidden or shown since.
    pub(super) fn environment_differs(&mut self, may_differ: bool) -> bool {
        let may_differ = std::mem::take(&mut self.surroundings.shine_changed) || may_differ;
        if self.environment != Environment::Auto || !may_differ {
            return false;
        }
        // A wish or a lamp decides alone, whatever shines besides.
        if self.surroundings.stale
            && self.surroundings.wishes.is_empty()
            && self.surroundings.lights.is_empty()
        {
            let all = self.targets_with(|content| content.mesh);
            self.surroundings.shining = all.filter(|&target| self.shines(target)).collect();
            self.surroundings.stale = false;
        }
        let now = Some(self.effective_environment());
        let differs = self.surroundings.reported != now;
        self.surroundings.reported = now;
        differs
    }
}
