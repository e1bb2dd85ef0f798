//! Materials on the device, and what `needs` asks of them.

use std::collections::BTreeMap;
use std::sync::Arc;

use caustica_gpu::{Device, Recorder};
use glam::Vec3;

use super::lobes::{flags_of, pack_lobes};
use super::sheen::albedo_table;
use super::table::{Download, Table};
use super::textures::Textures;
use crate::delta::{self, AlphaMode, MaterialId, ShadingMode};
use crate::error::{RendererError, Result};
use crate::gpu_types::{
    self, LOBE_SHEEN, MATERIAL_ALPHA_BLEND, MATERIAL_ALPHA_MASK, MATERIAL_DOUBLE_SIDED, MATERIAL_HAS_VOLUME,
    MODE_PBR, MODE_REFLECTIVE, MODE_REFRACTIVE, MODE_UNLIT, NO_TEXTURE,
};

/// All materials, by id.
pub(crate) struct Materials {
    table: Table<gpu_types::Material>,
    by_id: BTreeMap<MaterialId, (u32, delta::Material)>,
    free: Vec<u32>,
    lobes: Table<gpu_types::MaterialLobes>,
    free_lobes: Vec<u32>,
    /// Filled when the first material with sheen comes.
    sheen_albedo: Table<f32>,
}

impl Materials {
    pub(crate) fn new(device: &Arc<Device>) -> Self {
        Self {
            table: Table::new(device, "materials"),
            by_id: BTreeMap::new(),
            free: Vec::new(),
            lobes: Table::new(device, "material lobes"),
            free_lobes: Vec::new(),
            sheen_albedo: Table::new(device, "sheen albedo"),
        }
    }

    /// Index in the shader's table.
    pub(crate) fn index(&self, id: MaterialId) -> Result<u32> {
        let unknown = || RendererError::Unknown { what: "material", id: id.0.to_string() };
        self.by_id.get(&id).map(|(index, _)| *index).ok_or_else(unknown)
    }

    pub(crate) fn get(&self, id: MaterialId) -> Option<&delta::Material> {
        self.by_id.get(&id).map(|(_, material)| material)
    }

    /// Sets a material; says what follows for the instances that have it.
    pub(crate) fn set(
        &mut self,
        id: MaterialId,
        material: &delta::Material,
        textures: &Textures,
    ) -> MaterialChange {
        let old = self.by_id.get(&id);
        let change = old.map_or(MaterialChange::Values, |(_, old)| change_between(old, material));
        let index = match old {
            Some((index, _)) => *index,
            None => self.free.pop().unwrap_or(self.table.len() as u32),
        };
        let known = old.and_then(|_| self.table.get(index as usize)).map_or(0, |record| record.lobes);
        let lobes = self.set_lobes(known, material, textures);
        self.table.set(index as usize, gpu_types::Material { lobes, ..pack(material, textures) });
        self.by_id.insert(id, (index, material.clone()));
        change
    }

    /// Sets, makes or gives up the record of the lobes: `known` and the result are 1 + its index, or 0.
    fn set_lobes(&mut self, known: u32, material: &delta::Material, textures: &Textures) -> u32 {
        let Some(lobes) = material.lobes.as_deref().filter(|lobes| !lobes.is_plain()) else {
            self.free_lobes.extend(known.checked_sub(1));
            return 0;
        };
        let index = match known.checked_sub(1) {
            Some(index) => index,
            None => self.free_lobes.pop().unwrap_or(self.lobes.len() as u32),
        };
        if flags_of(lobes) & LOBE_SHEEN != 0 && self.sheen_albedo.len() == 0 {
            self.sheen_albedo.replace(albedo_table().to_vec());
        }
        self.lobes.set(index as usize, pack_lobes(lobes, textures));
        index + 1
    }

    pub(crate) fn remove(&mut self, id: MaterialId) {
        if let Some((index, _)) = self.by_id.remove(&id) {
            self.free.push(index);
            let lobes = self.table.get(index as usize).map_or(0, |record| record.lobes);
            self.free_lobes.extend(lobes.checked_sub(1));
        }
        // A scene loaded afresh lies as in a new renderer.
        if self.by_id.is_empty() {
            self.table.clear();
            self.free.clear();
            self.lobes.clear();
            self.free_lobes.clear();
        }
    }

    /// Every material with its index.
    pub(crate) fn ids(&self) -> impl Iterator<Item = (MaterialId, u32)> {
        self.by_id.iter().map(|(id, (index, _))| (*id, *index))
    }

    /// The material at an index.
    pub(crate) fn id_of(&self, index: u32) -> Option<MaterialId> {
        self.ids().find(|(_, other)| *other == index).map(|(id, _)| id)
    }

    pub(crate) fn address(&self) -> u64 {
        self.table.address()
    }

    pub(crate) fn lobes_address(&self) -> u64 {
        self.lobes.address()
    }

    pub(crate) fn sheen_albedo_address(&self) -> u64 {
        self.sheen_albedo.address()
    }

    /// Records the copy of the tables of materials and of lobes back to the host.
    pub(crate) fn download(&self, recorder: &mut Recorder) -> Result<(Download, Download)> {
        Ok((self.table.download(recorder)?, self.lobes.download(recorder)?))
    }

    pub(crate) fn is_dirty(&self) -> bool {
        self.table.is_dirty() || self.lobes.is_dirty() || self.sheen_albedo.is_dirty()
    }

    pub(crate) fn flush(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.table.flush(recorder)?;
        self.lobes.flush(recorder)?;
        self.sheen_albedo.flush(recorder)
    }
}

/// What a new version of a material means for the instances that have it, from little to much.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum MaterialChange {
    /// The table alone.
    Values,
    /// Its emitters shine differently.
    Emission,
    /// It began or ended to shine: its instances are emitters, or no longer.
    Shine,
    /// Rays pass where they did not, or faces are culled differently: its instances belong elsewhere, whether they shine or not.
    Kind,
}

fn change_between(old: &delta::Material, new: &delta::Material) -> MaterialChange {
    let kind = |m: &delta::Material| (is_opaque(m), shows_both_sides(m), has_alpha(m));
    if kind(old) != kind(new) {
        MaterialChange::Kind
    } else if emits(old) != emits(new) {
        MaterialChange::Shine
    } else if old.emissive != new.emissive {
        MaterialChange::Emission
    } else {
        MaterialChange::Values
    }
}

/// Whether any-hit never needs to be called for a surface.
pub(crate) fn is_opaque(material: &delta::Material) -> bool {
    !transmits(material) && !has_alpha(material)
}

/// Whether the surface has holes or coverage by alpha.
pub(crate) fn has_alpha(material: &delta::Material) -> bool {
    material.alpha != AlphaMode::Opaque
}

/// Whether light passes through the surface.
pub(crate) fn transmits(material: &delta::Material) -> bool {
    match material.mode {
        ShadingMode::Refractive => true,
        ShadingMode::Pbr => material.transmission > 0.0,
        ShadingMode::Reflective | ShadingMode::Unlit => false,
    }
}

/// Whether back faces are seen by the camera.
pub(crate) fn shows_both_sides(material: &delta::Material) -> bool {
    material.double_sided || transmits(material)
}

/// Whether the surface emits light.
pub(crate) fn emits(material: &delta::Material) -> bool {
    material.emissive.max_element() > 0.0
}

fn pack(material: &delta::Material, textures: &Textures) -> gpu_types::Material {
    let mut flags = 0;
    let mut alpha_cutoff = 0.5;
    if material.double_sided {
        flags |= MATERIAL_DOUBLE_SIDED;
    }
    if material.has_volume {
        flags |= MATERIAL_HAS_VOLUME;
    }
    match material.alpha {
        AlphaMode::Opaque => {}
        AlphaMode::Mask { cutoff } => {
            flags |= MATERIAL_ALPHA_MASK;
            alpha_cutoff = cutoff;
        }
        AlphaMode::Blend => flags |= MATERIAL_ALPHA_BLEND,
    }
    let texture = |used: &Option<delta::TextureUse>| pack_texture(used.as_ref(), textures);
    gpu_types::Material {
        base_color: material.base_color.to_array(),
        emissive: material.emissive.to_array(),
        metallic: material.metallic,
        specular_color: material.specular_color.to_array(),
        specular: material.specular,
        attenuation_per_m: attenuation_per_m(material).to_array(),
        roughness: material.roughness,
        normal_scale: material.normal_scale,
        occlusion_strength: material.occlusion_strength,
        ior: material.ior,
        transmission: material.transmission,
        alpha_cutoff,
        mode: match material.mode {
            ShadingMode::Pbr => MODE_PBR,
            ShadingMode::Reflective => MODE_REFLECTIVE,
            ShadingMode::Refractive => MODE_REFRACTIVE,
            ShadingMode::Unlit => MODE_UNLIT,
        },
        flags,
        medium_priority: u32::from(material.volume_priority),
        lobes: 0,
        base_color_texture: texture(&material.base_color_texture),
        metallic_roughness_texture: texture(&material.metallic_roughness_texture),
        normal_texture: texture(&material.normal_texture),
        occlusion_texture: texture(&material.occlusion_texture),
        emissive_texture: texture(&material.emissive_texture),
    }
}

/// Absorption coefficient, 1/m: KHR_materials_volume gives the colour that is left after a distance, so that
/// sigma = -ln(colour) / distance. A channel of colour 0 absorbs all but e^-64 over the distance.
fn attenuation_per_m(material: &delta::Material) -> Vec3 {
    let distance = material.attenuation_distance_m;
    if !(distance.is_finite() && distance > 0.0) {
        return Vec3::ZERO;
    }
    let sigma = |channel: f32| -channel.clamp(1.6e-28, 1.0).ln() / distance;
    let c = material.attenuation_color;
    Vec3::new(sigma(c.x), sigma(c.y), sigma(c.z))
}

/// KHR_texture_transform as one 2x2 matrix and an offset: uv' = T * R * S * uv with a counter-clockwise rotation in
/// a space whose v points down, that is (u cos + v sin, -u sin + v cos).
pub(super) fn pack_texture(used: Option<&delta::TextureUse>, textures: &Textures) -> gpu_types::TextureUse {
    let Some(used) = used else {
        return gpu_types::TextureUse {
            texture: NO_TEXTURE,
            tex_coord: 0,
            offset: [0.0; 2],
            linear: [1.0, 0.0, 0.0, 1.0],
        };
    };
    let (sin, cos) = used.rotation_rad.sin_cos();
    gpu_types::TextureUse {
        texture: textures.slot(used.texture),
        tex_coord: used.tex_coord,
        offset: used.offset.to_array(),
        linear: [cos * used.scale.x, sin * used.scale.y, -sin * used.scale.x, cos * used.scale.y],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attenuation_leaves_the_colour_after_the_distance() {
        let material = delta::Material {
            attenuation_color: Vec3::new(0.25, 1.0, 0.0),
            attenuation_distance_m: 2.0,
            ..Default::default()
        };
        let left = (-attenuation_per_m(&material) * 2.0).exp();
        assert!((left - Vec3::new(0.25, 1.0, 0.0)).abs().max_element() < 1e-6);
        assert_eq!(attenuation_per_m(&delta::Material::default()), Vec3::ZERO);
    }
}
