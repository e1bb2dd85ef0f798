//! The record of a material's lobes on the device.

use super::materials::pack_texture;
use super::textures::Textures;
use crate::delta::{Lobes, TextureUse};
use crate::gpu_types::{
    LOBE_ANISOTROPY, LOBE_CLEARCOAT, LOBE_DIFFUSE_TRANSMISSION, LOBE_DISPERSION, LOBE_IRIDESCENCE,
    LOBE_SHEEN, LOBE_SPECULAR_GLOSSINESS, MaterialLobes,
};

/// Which lobes there are: those of strength 0 are none, whatever their textures.
pub(super) fn flags_of(lobes: &Lobes) -> u32 {
    [
        (lobes.anisotropy > 0.0, LOBE_ANISOTROPY),
        (lobes.clearcoat > 0.0, LOBE_CLEARCOAT),
        (lobes.dispersion > 0.0, LOBE_DISPERSION),
        (lobes.iridescence > 0.0, LOBE_IRIDESCENCE),
        (lobes.sheen_color.max_element() > 0.0, LOBE_SHEEN),
        (lobes.diffuse_transmission > 0.0, LOBE_DIFFUSE_TRANSMISSION),
        (lobes.glossiness.is_some(), LOBE_SPECULAR_GLOSSINESS),
    ]
    .into_iter()
    .filter(|(there, _)| *there)
    .fold(0, |flags, (_, flag)| flags | flag)
}

/// The record.
pub(super) fn pack_lobes(lobes: &Lobes, textures: &Textures) -> MaterialLobes {
    let texture = |used: &Option<TextureUse>| pack_texture(used.as_ref(), textures);
    let (sin, cos) = lobes.anisotropy_rotation_rad.sin_cos();
    MaterialLobes {
        sheen_color: lobes.sheen_color.to_array(),
        sheen_roughness: lobes.sheen_roughness,
        diffuse_transmission_color: lobes.diffuse_transmission_color.to_array(),
        diffuse_transmission: lobes.diffuse_transmission,
        anisotropy_direction: [cos, sin],
        anisotropy: lobes.anisotropy,
        clearcoat: lobes.clearcoat,
        clearcoat_roughness: lobes.clearcoat_roughness,
        clearcoat_normal_scale: lobes.clearcoat_normal_scale,
        iridescence: lobes.iridescence,
        iridescence_ior: lobes.iridescence_ior,
        iridescence_thickness_min_nm: lobes.iridescence_thickness_min_nm,
        iridescence_thickness_max_nm: lobes.iridescence_thickness_max_nm,
        dispersion: lobes.dispersion,
        glossiness: lobes.glossiness.unwrap_or(0.0),
        flags: flags_of(lobes),
        specular_texture: texture(&lobes.specular_texture),
        specular_color_texture: texture(&lobes.specular_color_texture),
        transmission_texture: texture(&lobes.transmission_texture),
        anisotropy_texture: texture(&lobes.anisotropy_texture),
        clearcoat_texture: texture(&lobes.clearcoat_texture),
        clearcoat_roughness_texture: texture(&lobes.clearcoat_roughness_texture),
        clearcoat_normal_texture: texture(&lobes.clearcoat_normal_texture),
        iridescence_texture: texture(&lobes.iridescence_texture),
        iridescence_thickness_texture: texture(&lobes.iridescence_thickness_texture),
        sheen_color_texture: texture(&lobes.sheen_color_texture),
        sheen_roughness_texture: texture(&lobes.sheen_roughness_texture),
        diffuse_transmission_texture: texture(&lobes.diffuse_transmission_texture),
        diffuse_transmission_color_texture: texture(&lobes.diffuse_transmission_color_texture),
    }
}
