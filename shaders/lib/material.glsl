// A material at a point. In: Material, texture coordinates, vertex colour. Out: the numbers of the model, textures applied.
// Texture levels: with SURFACE_GRADIENTS defined before the include (camera rays, raster) from exact gradients, so that both agree and the
// sampler's anisotropy works; without it from a ray cone (Akenine-Moeller et al., "Texture Level of Detail Strategies for Real-Time Ray
// Tracing", Ray Tracing Gems, ch. 20), with the geometric mean of the cone's footprint on the triangle (width^2 / cosine as an area): blurred
// less than the footprint's long axis asks for. Cones grow with distance only; reflection at curved or rough surfaces does not widen them.
#ifndef LIB_MATERIAL
#define LIB_MATERIAL

#include "shared/scene.glsl"
#include "shared/textures.glsl"
#include "shared/needs.glsl"
#include "lib/ggx.glsl"
#include "lib/vector.glsl"

struct TexturePoint {
    vec2 uv[2];
#ifdef SURFACE_GRADIENTS
    vec4 uv_gradient[2];    // per pixel to the right (xy) and down (zw)
#else
    float uv_area[2];       // footprint of the cone, in units of texture area (before the texture's transform)
#endif
};

bool uses_texture(TextureUse use) {
    return NEEDS_TEXTURES && use.texture != NO_TEXTURE;
}

vec4 sample_texture(TextureUse use, TexturePoint point) {
    uint set = min(use.tex_coord, 1u);
    mat2 turn = transpose(mat2(use.linear.xy, use.linear.zw));
    vec2 uv = turn * point.uv[set] + use.offset;
#ifdef SURFACE_GRADIENTS
    vec4 gradient = point.uv_gradient[set];
    return textureGrad(textures[nonuniformEXT(use.texture)], uv, turn * gradient.xy, turn * gradient.zw);
#else
    vec2 size = vec2(textureSize(textures[nonuniformEXT(use.texture)], 0));
    float texels = point.uv_area[set] * abs(determinant(turn)) * size.x * size.y;
    float level = texels > 1.0 ? 0.5 * log2(min(texels, 1e18)) : 0.0; // the sampler clamps to its last level
    return textureLod(textures[nonuniformEXT(use.texture)], uv, level);
#endif
}

vec4 material_base_color(Material material, TexturePoint point, vec4 vertex_color) {
    vec4 color = material.base_color * vertex_color;
    return uses_texture(material.base_color_texture) ? color * sample_texture(material.base_color_texture, point) : color;
}

// Metallic (x) and roughness (y), 0..1.
vec2 material_metallic_roughness(Material material, TexturePoint point) {
    vec2 value = vec2(material.metallic, material.roughness);
    if (uses_texture(material.metallic_roughness_texture)) {
        value *= sample_texture(material.metallic_roughness_texture, point).bg;
    }
    return clamp(value, 0.0, 1.0);
}

float material_occlusion(Material material, TexturePoint point) {
    if (!uses_texture(material.occlusion_texture)) {
        return 1.0;
    }
    return 1.0 + material.occlusion_strength * (sample_texture(material.occlusion_texture, point).r - 1.0);
}

vec3 material_emissive(Material material, TexturePoint point) {
    if (!NEEDS_EMISSION) {
        return vec3(0.0);
    }
    return uses_texture(material.emissive_texture)
        ? material.emissive * sample_texture(material.emissive_texture, point).rgb : material.emissive;
}

// Normal in tangent space, not normalised; z alone where there is no map.
vec3 material_tangent_normal(Material material, TexturePoint point) {
    if (!NEEDS_NORMAL_MAPS || !uses_texture(material.normal_texture)) {
        return vec3(0.0, 0.0, 1.0);
    }
    vec3 n = 2.0 * sample_texture(material.normal_texture, point).xyz - 1.0;
    return vec3(n.xy * material.normal_scale, n.z);
}

// Alpha as coverage, 0..1: a mask gives 0 or 1.
float material_coverage(Material material, float alpha) {
    if ((material.flags & MATERIAL_ALPHA_MASK) != 0u) {
        return alpha < material.alpha_cutoff ? 0.0 : 1.0;
    }
    return (material.flags & MATERIAL_ALPHA_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
}

// Shows sharp images alone, everywhere: the mirror of its mode, or smooth metal without further lobes.
bool material_is_mirror(Material material) {
    bool metal = material.mode == MODE_PBR && material.metallic >= 1.0 && material.lobes == 0u;
    bool polished = ggx_is_delta(material.roughness * material.roughness) && !uses_texture(material.metallic_roughness_texture);
    return material.mode == MODE_REFLECTIVE || (metal && polished);
}

bool material_emits_behind(Material material) {
    return (material.flags & MATERIAL_DOUBLE_SIDED) != 0u;
}

// Light passes the surface: smooth glass, or glTF transmission.
bool material_transmits(Material material) {
    return NEEDS_REFRACTION && (material.mode == MODE_REFRACTIVE || (material.mode == MODE_PBR && material.transmission > 0.0));
}

// The camera sees both sides; of other surfaces it passes the back.
bool material_shows_both_sides(Material material) {
    return (material.flags & MATERIAL_DOUBLE_SIDED) != 0u || material_transmits(material);
}

#endif
