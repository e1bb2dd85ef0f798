//! Carries out edits of values and hands back what undoes them.
//! Edits of the tree are in `apply_tree.rs`, those of prefabs in `apply_prefab.rs`, of shapes in `apply_shapes.rs`.

use std::sync::Arc;

use super::Document;
use crate::assets::{Camera, Environment, Light, Material, TextureUse};
use crate::changes::Content;
use crate::edit::{Edit, EditError, OverrideField};
use crate::ids::{MaterialId, MeshId, Target, TextureId};
use crate::node::{Node, NodeKind, RayVisibility};
use crate::package::MaterialEntry;
use crate::prefab::PartOverride;
use crate::transform::Local;

impl Document {
    /// Carries an edit out and returns the edit that undoes it.
    ///
    /// # Errors
    /// When the edit does not fit the document, which is then as it was.
    pub fn apply(&mut self, edit: Edit) -> Result<Edit, EditError> {
        let reason = edit.describe(self);
        let inverse = self.carry_out(edit)?;
        self.changes.add_reason(reason);
        Ok(inverse)
    }

    /// Carries out an edit that [`Self::apply`] or this has returned: undo and redo. It may set what nobody could choose
    /// any more, because a source was read again and has lost it: the document had it, and gets it back.
    ///
    /// # Errors
    /// When the document is not as it was after the edit that this one undoes.
    pub fn apply_back(&mut self, edit: Edit) -> Result<Edit, EditError> {
        self.restoring = true;
        let applied = self.apply(edit);
        self.restoring = false;
        applied
    }

    fn carry_out(&mut self, edit: Edit) -> Result<Edit, EditError> {
        match edit {
            Edit::SetTransform { target, local } => self.set_transform(target, local),
            Edit::Rename { target, name } => self.rename(target, name),
            Edit::SetVisible { target, visible } => self.set_visible(target, visible),
            Edit::SetRayVisibility { target, camera_visible, casts_shadows } => {
                self.set_ray_visibility(target, RayVisibility { camera_visible, casts_shadows })
            }
            Edit::SetMorphWeights { target, weights } => self.set_morph_weights(target, weights),
            Edit::SetClip { node, clip } => self.set_clip(node, clip),
            Edit::SetLocked { node, locked } => self.set_locked(node, locked),
            Edit::SetVariant { node, variant } => self.set_variant(node, variant),
            Edit::SetScene { node, scene } => self.set_scene(node, scene),
            Edit::SetPrefab { node, prefab } => self.set_prefab(node, prefab),
            Edit::ResetOverride { target, field } => self.reset_override(target, field),
            Edit::AssignMaterial { target, primitive, material } => {
                self.assign_material(target, primitive, material)
            }
            Edit::SetMaterial { material, value } => self.set_material(material, *value),
            Edit::AddMaterial { material, entry } => self.add_material(material, *entry),
            Edit::RemoveMaterial { material } => self.remove_material(material),
            Edit::SetLight { target, light } => self.set_light(target, light),
            Edit::SetCamera { target, camera } => self.set_camera(target, camera),
            Edit::SetEnvironment(environment) => self.set_environment(environment),
            Edit::SetDefaultCamera(camera) => {
                self.changes.structure = true;
                let old = std::mem::replace(&mut self.default_camera, camera);
                Ok(Edit::SetDefaultCamera(old))
            }
            Edit::AddNode { parent, index, subtree } => self.add_node(parent, index, subtree),
            Edit::RemoveNode { node } => self.remove_node(node),
            Edit::Reparent { node, parent, index, local } => self.reparent(node, parent, index, local),
            Edit::SetPrimitiveTransform { mesh, primitive, mesh_from_primitive } => {
                self.set_primitive_transform(mesh, primitive, mesh_from_primitive)
            }
            Edit::AddMesh { mesh, value } => self.add_mesh(mesh, *value),
            Edit::RemoveMesh { mesh } => self.remove_mesh(mesh),
            Edit::SetShapes { mesh, source } => self.set_shapes(mesh, *source),
            Edit::AddPrefab(package) => self.add_prefab(*package),
            Edit::RemovePrefab { prefab } => self.remove_prefab(prefab),
            Edit::ReplacePrefab(package) => self.replace_prefab(*package),
            Edit::Batch { label, edits } => self.carry_out_all(label, edits),
        }
    }

    /// All or nothing: when one edit fails, those before it are undone.
    fn carry_out_all(&mut self, label: String, edits: Vec<Edit>) -> Result<Edit, EditError> {
        let mut inverses = Vec::with_capacity(edits.len());
        for edit in edits {
            match self.carry_out(edit) {
                Ok(inverse) => inverses.push(inverse),
                Err(error) => {
                    let restoring = std::mem::replace(&mut self.restoring, true);
                    for inverse in inverses.into_iter().rev() {
                        self.carry_out(inverse)?;
                    }
                    self.restoring = restoring;
                    return Err(error);
                }
            }
        }
        inverses.reverse();
        Ok(Edit::Batch { label, edits: inverses })
    }

    fn set_transform(&mut self, target: Target, local: Local) -> Result<Edit, EditError> {
        if !local.is_finite() {
            return Err(EditError::NotFinite);
        }
        let inverse = match target.part {
            None => {
                let old = std::mem::replace(&mut self.node_mut(target)?.local, local);
                Edit::SetTransform { target, local: old }
            }
            Some(_) => {
                let old = self.change_override(target, |o| o.local = Some(local))?;
                match old.local {
                    Some(local) => Edit::SetTransform { target, local },
                    None => reset(target, OverrideField::Local),
                }
            }
        };
        self.mark_target_dirty(target);
        Ok(inverse)
    }

    fn rename(&mut self, target: Target, name: String) -> Result<Edit, EditError> {
        let inverse = match target.part {
            None => {
                let old = std::mem::replace(&mut self.node_mut(target)?.name, name);
                Edit::Rename { target, name: old }
            }
            Some(_) => match self.change_override(target, |o| o.name = Some(name))?.name {
                Some(name) => Edit::Rename { target, name },
                None => reset(target, OverrideField::Name),
            },
        };
        self.changes.structure = true;
        Ok(inverse)
    }

    fn set_visible(&mut self, target: Target, visible: bool) -> Result<Edit, EditError> {
        let inverse = match target.part {
            None => {
                let old = std::mem::replace(&mut self.node_mut(target)?.visible, visible);
                Edit::SetVisible { target, visible: old }
            }
            Some(_) => {
                let old = self.change_override(target, |o| o.visible = Some(visible))?;
                match old.visible {
                    Some(visible) => Edit::SetVisible { target, visible },
                    None => reset(target, OverrideField::Visible),
                }
            }
        };
        self.changes.structure = true;
        self.mark_target_dirty(target);
        Ok(inverse)
    }

    fn set_ray_visibility(&mut self, target: Target, rays: RayVisibility) -> Result<Edit, EditError> {
        let before = self.ray_visibility(target);
        let set = |old: RayVisibility| {
            let RayVisibility { camera_visible, casts_shadows } = old;
            Edit::SetRayVisibility { target, camera_visible, casts_shadows }
        };
        let inverse = match target.part {
            None => set(std::mem::replace(&mut self.node_mut(target)?.ray_visibility, rays)),
            Some(_) => {
                match self.change_override(target, |o| o.ray_visibility = Some(rays))?.ray_visibility {
                    Some(old) => set(old),
                    None => reset(target, OverrideField::RayVisibility),
                }
            }
        };
        self.report_rays(target, before);
        Ok(inverse)
    }

    /// Marks a placed mesh that other rays meet than before.
    fn report_rays(&mut self, target: Target, before: Option<RayVisibility>) {
        if self.ray_visibility(target) != before {
            let content = Content { mesh: self.content_of(target).mesh, ..Content::default() };
            self.changes.target_shown(target, content);
        }
    }

    fn assign_material(
        &mut self,
        target: Target,
        primitive: u32,
        material: MaterialId,
    ) -> Result<Edit, EditError> {
        let mesh = self.mesh_of(target);
        let own: Vec<MaterialId> = mesh
            .and_then(|id| self.mesh(id))
            .iter()
            .flat_map(|mesh| &mesh.primitives)
            .map(|p| p.material)
            .collect();
        if !self.restoring {
            self.require_material(material)?;
            mesh.ok_or(EditError::WrongKind { target, wanted: "mesh" })?;
            if primitive as usize >= own.len() {
                return Err(EditError::NoPrimitive { primitive });
            }
        }
        let inverse = match target.part {
            None => match &mut self.node_mut(target)?.kind {
                NodeKind::Mesh { materials, .. } => {
                    // The mesh may have got primitives after the node was made.
                    let fewest = primitive as usize + 1;
                    materials.extend(own.iter().take(fewest).skip(materials.len()));
                    let slot =
                        materials.get_mut(primitive as usize).ok_or(EditError::NoPrimitive { primitive })?;
                    let old = std::mem::replace(slot, material);
                    Edit::AssignMaterial { target, primitive, material: old }
                }
                _ => return Err(EditError::NoPrimitive { primitive }),
            },
            Some(_) => {
                let old = self.change_override(target, |o| {
                    o.materials.insert(primitive, material);
                })?;
                match old.materials.get(&primitive) {
                    Some(&material) => Edit::AssignMaterial { target, primitive, material },
                    None => reset(target, OverrideField::Material(primitive)),
                }
            }
        };
        self.report_changed(target);
        Ok(inverse)
    }

    fn set_light(&mut self, target: Target, light: Light) -> Result<Edit, EditError> {
        let wanted = "light";
        let old = self.light_of(target);
        if old.is_none() && !(self.restoring && target.part.is_some()) {
            return Err(EditError::WrongKind { target, wanted });
        }
        if !light.is_finite() {
            return Err(EditError::NotFinite);
        }
        let inverse = match target.part {
            None => {
                self.node_mut(target)?.kind = NodeKind::Light(light);
                Edit::SetLight { target, light: old.unwrap_or(light) }
            }
            Some(_) => match self.change_override(target, |o| o.light = Some(light))?.light {
                Some(light) => Edit::SetLight { target, light },
                None => reset(target, OverrideField::Light),
            },
        };
        self.changes.lights.insert(target);
        Ok(inverse)
    }

    fn set_camera(&mut self, target: Target, camera: Camera) -> Result<Edit, EditError> {
        let wanted = "camera";
        let old = self.camera_of(target);
        if old.is_none() && !(self.restoring && target.part.is_some()) {
            return Err(EditError::WrongKind { target, wanted });
        }
        if !camera.is_finite() {
            return Err(EditError::NotFinite);
        }
        let inverse = match target.part {
            None => {
                self.node_mut(target)?.kind = NodeKind::Camera(camera);
                Edit::SetCamera { target, camera: old.unwrap_or(camera) }
            }
            Some(_) => {
                let old = self.change_override(target, |o| o.camera = Some(camera))?;
                match old.camera {
                    Some(camera) => Edit::SetCamera { target, camera },
                    None => reset(target, OverrideField::Camera),
                }
            }
        };
        self.changes.cameras.insert(target);
        Ok(inverse)
    }

    fn reset_override(&mut self, target: Target, field: OverrideField) -> Result<Edit, EditError> {
        let (rays, weights) = (self.ray_visibility(target), self.shown_weights(target));
        let old = self.change_override(target, |o| match field {
            OverrideField::Name => o.name = None,
            OverrideField::Local => o.local = None,
            OverrideField::Visible => o.visible = None,
            OverrideField::Material(primitive) => {
                o.materials.remove(&primitive);
            }
            OverrideField::Light => o.light = None,
            OverrideField::Camera => o.camera = None,
            OverrideField::Weights => o.weights = None,
            OverrideField::RayVisibility => o.ray_visibility = None,
            OverrideField::All => *o = PartOverride::default(),
        })?;
        let edits = restoring_edits(target, old, field);
        for edit in &edits {
            match edit {
                Edit::AssignMaterial { .. } => self.report_changed(target),
                Edit::SetLight { .. } => {
                    self.changes.lights.insert(target);
                }
                Edit::SetCamera { .. } => {
                    self.changes.cameras.insert(target);
                }
                _ => {}
            }
        }
        self.report_rays(target, rays);
        self.report_weights(target, weights);
        self.changes.structure = true;
        self.mark_target_dirty(target);
        Ok(Edit::batch(String::new(), edits))
    }

    fn set_material(&mut self, id: MaterialId, value: Material) -> Result<Edit, EditError> {
        if !value.is_finite() {
            return Err(EditError::NotFinite);
        }
        self.require_material(id)?;
        // One that its prefab has taken along may stay: the rest of the material can still be changed.
        let known: Vec<TextureId> =
            self.material(id).iter().flat_map(|m| m.textures()).map(|t| t.texture).collect();
        for TextureUse { texture, .. } in value.textures() {
            if !self.textures.contains_key(texture) && !known.contains(texture) && !self.restoring {
                return Err(EditError::NoAsset(format!("texture {}", texture.0)));
            }
        }
        let entry = self.materials.entry(id).or_default();
        self.surroundings.note_material(Some(&entry.value), Some(&value));
        let old = std::mem::replace(&mut entry.value, Arc::new(value));
        self.changes.materials.insert(id);
        Ok(Edit::SetMaterial { material: id, value: Box::new(Arc::unwrap_or_clone(old)) })
    }

    fn add_material(&mut self, id: MaterialId, entry: MaterialEntry) -> Result<Edit, EditError> {
        if self.materials.contains_key(&id) {
            return Err(EditError::Taken(format!("material {}", id.0)));
        }
        if !entry.value.is_finite() {
            return Err(EditError::NotFinite);
        }
        self.reserve_ids_up_to(id.0);
        self.surroundings.note_material(None, Some(&entry.value));
        self.materials.insert(id, entry);
        self.changes.removed_materials.remove(&id);
        self.changes.materials.insert(id);
        Ok(Edit::RemoveMaterial { material: id })
    }

    fn remove_material(&mut self, id: MaterialId) -> Result<Edit, EditError> {
        self.require_material(id)?;
        if let Some(by) = self.user_of_material(id) {
            let what = format!("material {}", id.0);
            return Err(EditError::InUse { what, by });
        }
        let entry = self.materials.remove(&id).unwrap_or_default();
        self.surroundings.note_material(Some(&entry.value), None);
        self.changes.materials.remove(&id);
        self.changes.removed_materials.insert(id);
        Ok(Edit::AddMaterial { material: id, entry: Box::new(entry) })
    }

    fn set_environment(&mut self, environment: Environment) -> Result<Edit, EditError> {
        let finite = match &environment {
            Environment::Constant(radiance) => radiance.is_finite(),
            Environment::File(file) => file.rotation_rad.is_finite() && file.scale.is_finite(),
            Environment::Auto | Environment::DefaultSky => true,
        };
        if !finite {
            return Err(EditError::NotFinite);
        }
        self.changes.environment = true;
        self.forget_reported_environment();
        let old = std::mem::replace(&mut self.environment, environment);
        Ok(Edit::SetEnvironment(old))
    }

    fn set_primitive_transform(
        &mut self,
        id: MeshId,
        primitive: u32,
        mesh_from_primitive: glam::DAffine3,
    ) -> Result<Edit, EditError> {
        if !mesh_from_primitive.is_finite() {
            return Err(EditError::NotFinite);
        }
        let mesh = self.meshes.get_mut(&id).ok_or_else(|| EditError::NoAsset(format!("mesh {}", id.0)))?;
        let slot = mesh.primitives.get_mut(primitive as usize).ok_or(EditError::NoPrimitive { primitive })?;
        let old = std::mem::replace(&mut slot.mesh_from_primitive, mesh_from_primitive);
        mesh.update_bounds();
        self.changes.primitive_transforms.insert((id, primitive));
        Ok(Edit::SetPrimitiveTransform { mesh: id, primitive, mesh_from_primitive: old })
    }

    pub(super) fn require_material(&self, id: MaterialId) -> Result<(), EditError> {
        match self.materials.contains_key(&id) {
            true => Ok(()),
            false => Err(EditError::NoAsset(format!("material {}", id.0))),
        }
    }

    pub(super) fn node_mut(&mut self, target: Target) -> Result<&mut Node, EditError> {
        self.slots.get_mut(&target.node).map(|slot| &mut slot.node).ok_or(EditError::NoNode(target.node))
    }

    pub(super) fn report_changed(&mut self, target: Target) {
        if !self.contains(target) {
            return;
        }
        let content = Content { mesh: true, ..self.content_of(target) };
        self.changes.target_changed(target, content);
        self.note_shine(target);
    }

    /// Changes the override of a part, in the map by path and in the one by index, and returns the old one.
    pub(super) fn change_override(
        &mut self,
        target: Target,
        change: impl FnOnce(&mut PartOverride),
    ) -> Result<PartOverride, EditError> {
        let no_part = EditError::NoPart(target);
        let (Some(part), Some(slot)) = (target.part, self.slots.get_mut(&target.node)) else {
            return Err(no_part);
        };
        let NodeKind::Prefab { prefab, overrides, .. } = &mut slot.node.kind else {
            return Err(no_part);
        };
        let Some(path) = self.prefabs.get(prefab).and_then(|p| p.path_of(part)) else {
            return Err(no_part);
        };
        let old = slot.parts.overrides.remove(&part).unwrap_or_default();
        let mut new = old.clone();
        change(&mut new);
        if new.is_empty() {
            overrides.remove(&path);
        } else {
            overrides.insert(path, new.clone());
            slot.parts.overrides.insert(part, new);
        }
        Ok(old)
    }
}

pub(super) fn reset(target: Target, field: OverrideField) -> Edit {
    Edit::ResetOverride { target, field }
}

/// The edits that set what a reset of `field` takes from `old`.
fn restoring_edits(target: Target, old: PartOverride, field: OverrideField) -> Vec<Edit> {
    let all = field == OverrideField::All;
    let wants = |f: OverrideField| all || field == f;
    let mut edits = Vec::new();
    if let Some(name) = old.name.filter(|_| wants(OverrideField::Name)) {
        edits.push(Edit::Rename { target, name });
    }
    if let Some(local) = old.local.filter(|_| wants(OverrideField::Local)) {
        edits.push(Edit::SetTransform { target, local });
    }
    if let Some(visible) = old.visible.filter(|_| wants(OverrideField::Visible)) {
        edits.push(Edit::SetVisible { target, visible });
    }
    for (primitive, material) in old.materials {
        if wants(OverrideField::Material(primitive)) {
            edits.push(Edit::AssignMaterial { target, primitive, material });
        }
    }
    if let Some(light) = old.light.filter(|_| wants(OverrideField::Light)) {
        edits.push(Edit::SetLight { target, light });
    }
    if let Some(camera) = old.camera.filter(|_| wants(OverrideField::Camera)) {
        edits.push(Edit::SetCamera { target, camera });
    }
    if let Some(weights) = old.weights.filter(|_| wants(OverrideField::Weights)) {
        edits.push(Edit::SetMorphWeights { target, weights });
    }
    if let Some(rays) = old.ray_visibility.filter(|_| wants(OverrideField::RayVisibility)) {
        let RayVisibility { camera_visible, casts_shadows } = rays;
        edits.push(Edit::SetRayVisibility { target, camera_visible, casts_shadows });
    }
    edits
}
