// What a material has beside metallic-roughness, at a point. In: MaterialLobes, texture coordinates, the tangent frame of the map's side.
// Out: Lobes: factors times textures, directions in render space. Knows no light; lib/layers.glsl and lib/bsdf.glsl shade with it.
#ifndef LIB_LOBES
#define LIB_LOBES

#include "shared/scene.glsl"
#include "lib/material.glsl"
#include "lib/vector.glsl"

struct Lobes {
    uint flags;                     // LOBE_*
    float anisotropy;
    vec3 tangent;                   // unit, direction of the larger roughness; not yet perpendicular to the shading normal
    float clearcoat;
    float clearcoat_roughness;
    vec3 clearcoat_normal;          // unit, on the viewer's side
    float iridescence;
    float film_ior;
    float film_nm;
    vec3 sheen_color;
    float sheen_roughness;
    uint64_t sheen_albedo;          // SheenAlbedoTable
    float diffuse_transmission;
    vec3 diffuse_transmission_color;
};

const Lobes LOBES_NONE = Lobes(0u, 0.0, vec3(0.0), 0.0, 0.0, vec3(0.0), 0.0, 1.0, 0.0, vec3(0.0), 0.0, 0ul, 0.0, vec3(0.0));

bool has_lobe(Lobes lobes, uint lobe) {
    return NEEDS_LOBES && (lobes.flags & lobe) != 0u;
}

MaterialLobes material_lobes(Scene scene, Material material) {
    return LobesTable(scene.material_lobes).at[material.lobes - 1u];
}

bool material_has_lobes(Material material) {
    return NEEDS_LOBES && material.lobes != 0u;
}

// 1, or the texel.
vec4 lobe_texel(TextureUse use, TexturePoint point) {
    return uses_texture(use) ? sample_texture(use, point) : vec4(1.0);
}

// Tangent-space direction (red, green: -1..1) and strength (blue); the tangent where the texture has no direction.
vec3 lobe_anisotropy(MaterialLobes record, TexturePoint point) {
    vec3 texel = vec3(1.0, 0.5, 1.0);
    if (uses_texture(record.anisotropy_texture)) {
        texel = sample_texture(record.anisotropy_texture, point).rgb;
    }
    vec2 direction = normalize_or(vec3(2.0 * texel.xy - 1.0, 0.0), vec3(1.0, 0.0, 0.0)).xy;
    vec2 turn = record.anisotropy_direction;
    return vec3(turn.x * direction.x - turn.y * direction.y, turn.y * direction.x + turn.x * direction.y, record.anisotropy * texel.z);
}

// Of the coat's map, not normalised; z alone where there is none.
vec3 lobe_coat_normal(MaterialLobes record, TexturePoint point) {
    if (!uses_texture(record.clearcoat_normal_texture)) {
        return vec3(0.0, 0.0, 1.0);
    }
    vec3 n = 2.0 * sample_texture(record.clearcoat_normal_texture, point).xyz - 1.0;
    return vec3(n.xy * record.clearcoat_normal_scale, n.z);
}

// tangent_frame: tangent, bitangent and interpolated normal on the front side, render space. side: -1 where the back is seen.
Lobes lobes_at(MaterialLobes record, TexturePoint point, mat3 tangent_frame, float side, uint64_t sheen_albedo) {
    Lobes lobes = LOBES_NONE;
    lobes.flags = record.flags;
    if (has_lobe(lobes, LOBE_ANISOTROPY)) {
        vec3 direction = lobe_anisotropy(record, point);
        lobes.tangent = tangent_frame * vec3(direction.xy, 0.0);
        lobes.anisotropy = clamp(direction.z, 0.0, 1.0);
    }
    if (has_lobe(lobes, LOBE_CLEARCOAT)) {
        lobes.clearcoat = record.clearcoat * lobe_texel(record.clearcoat_texture, point).r;
        lobes.clearcoat_roughness = record.clearcoat_roughness * lobe_texel(record.clearcoat_roughness_texture, point).g;
        lobes.clearcoat_normal = side * normalize_or(tangent_frame * lobe_coat_normal(record, point), tangent_frame[2]);
    }
    if (has_lobe(lobes, LOBE_IRIDESCENCE)) {
        lobes.iridescence = record.iridescence * lobe_texel(record.iridescence_texture, point).r;
        lobes.film_ior = record.iridescence_ior;
        lobes.film_nm = mix(record.iridescence_thickness_min_nm, record.iridescence_thickness_max_nm,
            lobe_texel(record.iridescence_thickness_texture, point).g);
    }
    if (has_lobe(lobes, LOBE_SHEEN)) {
        lobes.sheen_color = record.sheen_color * lobe_texel(record.sheen_color_texture, point).rgb;
        lobes.sheen_roughness = record.sheen_roughness * lobe_texel(record.sheen_roughness_texture, point).a;
        lobes.sheen_albedo = sheen_albedo;
    }
    if (has_lobe(lobes, LOBE_DIFFUSE_TRANSMISSION)) {
        lobes.diffuse_transmission = record.diffuse_transmission * lobe_texel(record.diffuse_transmission_texture, point).a;
        lobes.diffuse_transmission_color =
            record.diffuse_transmission_color * lobe_texel(record.diffuse_transmission_color_texture, point).rgb;
    }
    return lobes;
}

#endif
