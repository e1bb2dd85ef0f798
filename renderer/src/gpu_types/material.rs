//! Host twins of the structs of a material in `shaders/shared/scene.glsl`.

use bytemuck::{Pod, Zeroable};

use super::Twin;

twins! {
    /// A texture as a material uses it.
    struct TextureUse, size 32 {
        /// Index into the bindless array, or [`NO_TEXTURE`](super::NO_TEXTURE).
        0 texture: u32,
        /// Texture coordinate set, 0 or 1.
        4 tex_coord: u32,
        /// `KHR_texture_transform`: `uv' = linear * uv + offset`.
        8 offset: [f32; 2],
        /// 2x2 matrix by rows: m00, m01, m10, m11.
        16 linear: [f32; 4],
    }

    /// A material: glTF metallic-roughness with its extensions and a shading mode.
    struct Material, size 260 {
        /// Linear RGB and alpha.
        0 base_color: [f32; 4],
        /// Emitted radiance.
        16 emissive: [f32; 3],
        /// 0..1.
        28 metallic: f32,
        /// `KHR_materials_specular` colour factor.
        32 specular_color: [f32; 3],
        /// `KHR_materials_specular` strength.
        44 specular: f32,
        /// Absorption coefficient of the volume, 1/m.
        48 attenuation_per_m: [f32; 3],
        /// Perceptual roughness; GGX alpha is its square.
        60 roughness: f32,
        /// Scale of the normal map's x and y.
        64 normal_scale: f32,
        /// Strength of the occlusion texture.
        68 occlusion_strength: f32,
        /// Index of refraction.
        72 ior: f32,
        /// `KHR_materials_transmission` factor.
        76 transmission: f32,
        /// `alphaCutoff` of the MASK mode.
        80 alpha_cutoff: f32,
        /// `MODE_*`.
        84 mode: u32,
        /// `MATERIAL_*` bits.
        88 flags: u32,
        /// Where volumes overlap, the higher one counts; equal: the one entered last.
        92 medium_priority: u32,
        /// 1 + index of its [`MaterialLobes`]; 0: it has none.
        96 lobes: u32,
        /// sRGB colour, alpha in a.
        100 base_color_texture: TextureUse,
        /// Roughness in g, metallic in b, linear.
        132 metallic_roughness_texture: TextureUse,
        /// Tangent-space normal, linear.
        164 normal_texture: TextureUse,
        /// Occlusion in r, linear.
        196 occlusion_texture: TextureUse,
        /// sRGB colour.
        228 emissive_texture: TextureUse,
    }

    /// What most materials go without.
    struct MaterialLobes, size 500 {
        /// Linear colour of the sheen.
        0 sheen_color: [f32; 3],
        /// Perceptual.
        12 sheen_roughness: f32,
        /// Linear tint of the diffuse light that passes.
        16 diffuse_transmission_color: [f32; 3],
        /// Share of the diffuse light that passes.
        28 diffuse_transmission: f32,
        /// Cosine and sine of the rotation from the tangent.
        32 anisotropy_direction: [f32; 2],
        /// Strength.
        40 anisotropy: f32,
        /// Strength.
        44 clearcoat: f32,
        /// Perceptual.
        48 clearcoat_roughness: f32,
        /// Scale of the coat's normal map.
        52 clearcoat_normal_scale: f32,
        /// Strength.
        56 iridescence: f32,
        /// Index of refraction of the film.
        60 iridescence_ior: f32,
        /// Nanometres, where the texture is 0.
        64 iridescence_thickness_min_nm: f32,
        /// Nanometres, where the texture is 1, and without one.
        68 iridescence_thickness_max_nm: f32,
        /// 20 / Abbe number.
        72 dispersion: f32,
        /// Of specular-glossiness: 1 - roughness.
        76 glossiness: f32,
        /// `LOBE_*` bits.
        80 flags: u32,
        /// Alpha: strength of the dielectric specular lobe.
        84 specular_texture: TextureUse,
        /// sRGB tint of the dielectric F0; of specular-glossiness the reflectance, and the glossiness in a.
        116 specular_color_texture: TextureUse,
        /// Share of transmitted light in r.
        148 transmission_texture: TextureUse,
        /// Direction in rg, strength in b.
        180 anisotropy_texture: TextureUse,
        /// Strength in r.
        212 clearcoat_texture: TextureUse,
        /// Roughness in g.
        244 clearcoat_roughness_texture: TextureUse,
        /// Tangent-space normal.
        276 clearcoat_normal_texture: TextureUse,
        /// Strength in r.
        308 iridescence_texture: TextureUse,
        /// Thickness in g.
        340 iridescence_thickness_texture: TextureUse,
        /// sRGB colour.
        372 sheen_color_texture: TextureUse,
        /// Roughness in a.
        404 sheen_roughness_texture: TextureUse,
        /// Share in a.
        436 diffuse_transmission_texture: TextureUse,
        /// sRGB tint.
        468 diffuse_transmission_color_texture: TextureUse,
    }
}

impl MaterialLobes {
    /// Every texture, in order.
    pub(crate) fn textures_mut(&mut self) -> [&mut TextureUse; 13] {
        [
            &mut self.specular_texture,
            &mut self.specular_color_texture,
            &mut self.transmission_texture,
            &mut self.anisotropy_texture,
            &mut self.clearcoat_texture,
            &mut self.clearcoat_roughness_texture,
            &mut self.clearcoat_normal_texture,
            &mut self.iridescence_texture,
            &mut self.iridescence_thickness_texture,
            &mut self.sheen_color_texture,
            &mut self.sheen_roughness_texture,
            &mut self.diffuse_transmission_texture,
            &mut self.diffuse_transmission_color_texture,
        ]
    }
}
