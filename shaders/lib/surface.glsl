// A surface as the light passes see it. In: Scene, a hit, the direction of travel. Out: Surface: one consistent set of position, normals on
// the viewer's side, material and spawn offset. Knows no light.
#ifndef LIB_SURFACE
#define LIB_SURFACE

#include "shared/scene.glsl"
#include "lib/basis.glsl"
#include "lib/brdf.glsl"
#include "lib/clearcoat.glsl"
#include "lib/element.glsl"
#include "lib/lobes.glsl"
#include "lib/material.glsl"
#include "lib/random.glsl"

struct Surface {
    vec3 position;          // on the triangle or shape, render space
    float offset_m;         // see lib/ray_offset.glsl
    vec3 geometric_normal;  // unit, on the viewer's side
    vec3 shading_normal;    // unit, on the viewer's side; the mirror direction about it stays above the triangle
    vec3 view;              // unit, towards the viewer
    vec3 base_color;
    float occlusion;
    float metallic;
    float roughness;
    vec3 emissive;          // radiance towards the viewer
    float ior;
    float transmission;
    float specular;
    vec3 specular_color;
    vec3 attenuation_per_m;
    uint mode;
    uint flags;             // of the material
    bool front;             // the viewer is on the front side
    Lobes lobes;
};

// A shading normal that the viewer can see and about which the mirror direction does not enter the surface: bent as far as needed, no
// further (after Keller et al., "The Iray Light Transport Simulation and Rendering System", 2017, appendix A.3).
vec3 consistent_normal(vec3 normal, vec3 geometric_normal, vec3 view) {
    float facing = dot(normal, view);
    vec3 mirrored = 2.0 * facing * normal - view;
    float above = dot(mirrored, geometric_normal);
    if (facing > 0.0 && above >= 0.0) {
        return normal;
    }
    vec3 grazing = normalize_or(mirrored - min(above, 0.0) * geometric_normal, view);
    return normalize_or(view + grazing, geometric_normal);
}

// Tangent, bitangent and interpolated normal, on the front side.
mat3 front_frame(vec3 geometric_front, Attributes attributes) {
    vec3 normal = normalize_or(attributes.normal, geometric_front);
    vec3 tangent = attributes.tangent - dot(attributes.tangent, normal) * normal;
    tangent = normalize_or(tangent, basis_around(normal)[0]);
    return mat3(tangent, attributes.handedness * cross(normal, tangent), normal);
}

// Shading normal on the front side: interpolated, then mapped. Falls back to the triangle's own.
vec3 front_normal(vec3 geometric_front, Attributes attributes, vec3 tangent_normal) {
    if (tangent_normal.x == 0.0 && tangent_normal.y == 0.0) {
        return normalize_or(attributes.normal, geometric_front);
    }
    mat3 frame = front_frame(geometric_front, attributes);
    return normalize_or(frame * tangent_normal, frame[2]);
}

// What the material says, without position and normals.
void surface_set_material(inout Surface surface, Material material, vec3 base_color, vec2 metallic_roughness) {
    surface.base_color = base_color;
    surface.metallic = metallic_roughness.x;
    surface.roughness = metallic_roughness.y;
    surface.ior = material.ior;
    surface.transmission = NEEDS_REFRACTION ? material.transmission : 0.0;
    surface.specular = material.specular;
    surface.specular_color = material.specular_color;
    surface.attenuation_per_m = material.attenuation_per_m;
    surface.mode = material.mode;
    surface.flags = material.flags;
    surface.lobes = LOBES_NONE;
}

// Specular-glossiness: its diffuse colour takes what its reflectance leaves; the other numbers are those of a dielectric.
void surface_apply_glossiness(inout Surface surface, MaterialLobes record, TexturePoint textures_at) {
    if ((record.flags & LOBE_SPECULAR_GLOSSINESS) != 0u) {
        vec4 texel = lobe_texel(record.specular_color_texture, textures_at);
        surface.base_color *= 1.0 - clamp(max_component(surface.specular_color * texel.rgb), 0.0, 1.0);
        surface.roughness = 1.0 - record.glossiness * texel.a;
    }
}

// Lobes, and the textures that lie with them. Position, normals and view are set.
void surface_add_lobes(inout Surface surface, Scene scene, MaterialLobes record, vec3 geometric_front, Attributes attributes,
    TexturePoint textures_at) {
    surface.specular *= lobe_texel(record.specular_texture, textures_at).a;
    surface.specular_color *= lobe_texel(record.specular_color_texture, textures_at).rgb;
    surface.transmission *= lobe_texel(record.transmission_texture, textures_at).r;
    float side = surface.front ? 1.0 : -1.0;
    surface.lobes = lobes_at(record, textures_at, front_frame(geometric_front, attributes), side, scene.sheen_albedo);
    if (has_lobe(surface.lobes, LOBE_CLEARCOAT)) {
        surface.lobes.clearcoat_normal = consistent_normal(surface.lobes.clearcoat_normal, surface.geometric_normal, surface.view);
    }
}

// What a coat lets out of the surface's own emission towards the viewer.
float surface_emission_share(Surface surface) {
    if (!has_lobe(surface.lobes, LOBE_CLEARCOAT)) {
        return 1.0;
    }
    return 1.0 - clearcoat_weight(Clearcoat(surface.lobes.clearcoat, 0.0, surface.lobes.clearcoat_normal), surface.view);
}

uint material_index(Scene scene, uint instance_slot, uint geometry) {
    Instance instance = InstanceTable(scene.instances).at[instance_slot];
    return UintTable(scene.material_slots).at[instance.material_base + geometry];
}

// Emission leaves the front side, and the back side of double-sided materials. Unlit surfaces show their base colour on both.
vec3 surface_emission(Material material, TexturePoint point, vec3 base_color, bool front) {
    if (material.mode == MODE_UNLIT) {
        return base_color;
    }
    return front || material_emits_behind(material) ? material_emissive(material, point) : vec3(0.0);
}

// Fills a Surface from interpolated attributes: shared by raster, camera rays and secondary rays.
Surface surface_shade(Scene scene, Material material, SurfacePoint point, bool front, Attributes attributes, TexturePoint textures_at, vec3 view) {
    Surface surface;
    surface.position = point.position;
    surface.offset_m = point.offset_m;
    surface.view = view;
    surface.front = front;
    float side = front ? 1.0 : -1.0;
    surface.geometric_normal = side * point.normal;
    vec3 normal = side * front_normal(point.normal, attributes, material_tangent_normal(material, textures_at));
    surface.shading_normal = consistent_normal(normal, surface.geometric_normal, view);
    vec3 base_color = material_base_color(material, textures_at, attributes.color).rgb;
    surface_set_material(surface, material, max(base_color, vec3(0.0)), material_metallic_roughness(material, textures_at));
    surface.occlusion = material_occlusion(material, textures_at);
    surface.emissive = surface_emission(material, textures_at, surface.base_color, front);
    if (material_has_lobes(material)) {
        MaterialLobes record = material_lobes(scene, material);
        surface_apply_glossiness(surface, record, textures_at);
        surface_add_lobes(surface, scene, record, point.normal, attributes, textures_at);
        surface.emissive *= surface_emission_share(surface);
    }
    return surface;
}

#ifndef SURFACE_GRADIENTS
// Where textures are read, with the footprint of a ray cone. cosine: between ray and geometric normal.
TexturePoint cone_texture_point(Element element, Attributes attributes, float cosine, float cone_width_m) {
    TexturePoint point;
    point.uv = attributes.uv;
    vec2 uv_area = element_uv_density(element) * (cone_width_m * cone_width_m / abs(cosine));
    point.uv_area = float[2](uv_area.x, uv_area.y); // infinite or NaN where degenerate or edge-on; sample_texture sorts it out
    return point;
}

// Where textures are read as they were painted.
TexturePoint base_level_point(Attributes attributes) {
    TexturePoint point;
    point.uv = attributes.uv;
    point.uv_area = float[2](0.0, 0.0);
    return point;
}

// Surface of an element. travel: unit direction of the ray that met it; cone_width_m: of the ray cone there.
Surface surface_from_element(Scene scene, uint instance_slot, uint geometry, Element element, vec3 travel, float cone_width_m) {
    SurfacePoint point = element_point(element);
    Attributes attributes = element_attributes(scene, instance_slot, element);
    Material material = MaterialTable(scene.materials).at[material_index(scene, instance_slot, geometry)];
    float cosine = dot(point.normal, travel);
    TexturePoint textures_at = cone_texture_point(element, attributes, cosine, cone_width_m);
    return surface_shade(scene, material, point, cosine < 0.0, attributes, textures_at, -travel);
}

// Surface at a hit of a secondary ray.
Surface surface_from_hit(Scene scene, Hit hit, vec3 travel, float cone_width_m) {
    return surface_from_element(scene, hit.instance, hit.geometry, element_fetch(scene, hit), travel, cone_width_m);
}

bool material_has_alpha(Material material) {
    return (material.flags & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND)) != 0u;
}

// Coverage at a hit for any-hit shaders, 0..1. Read at the base level: a mask's edge stays as sharp as it was painted.
float hit_coverage(Scene scene, Hit hit, Material material) {
    if (!material_has_alpha(material)) {
        return 1.0;
    }
    Attributes attributes = element_attributes(scene, hit.instance, element_fetch(scene, hit));
    return material_coverage(material, material_base_color(material, base_level_point(attributes), attributes.color).a);
}
#endif

// A number in [0, 1) that belongs to one triangle, or one side of a shape, as one ray or pixel sees it.
float coverage_threshold(uint seed, uint instance, uint geometry, uint primitive) {
    return unit_float(hash_pcg4d(uvec4(seed, instance, geometry, primitive)).x);
}

// Light passes the surface: smooth glass, or glTF transmission.
bool surface_transmits(Surface surface) {
    return NEEDS_REFRACTION && (surface.mode == MODE_REFRACTIVE || (surface.mode == MODE_PBR && surface.transmission > 0.0));
}

Brdf surface_brdf(Surface surface) {
    Brdf brdf = brdf_from_material(surface.base_color, surface.metallic, surface.roughness, surface.ior, surface.specular,
        surface.specular_color);
    if (has_lobe(surface.lobes, LOBE_IRIDESCENCE)) {
        brdf.film.strength = surface.lobes.iridescence;
        brdf.film.ior = surface.lobes.film_ior;
        brdf.film.thickness_nm = surface.lobes.film_nm;
    }
    return brdf;
}

// Local frame: z is the shading normal, x the direction of the larger roughness where there is one.
mat3 surface_frame(Surface surface) {
    mat3 frame = basis_around(surface.shading_normal);
    if (has_lobe(surface.lobes, LOBE_ANISOTROPY)) {
        vec3 along = surface.lobes.tangent - dot(surface.lobes.tangent, surface.shading_normal) * surface.shading_normal;
        frame[0] = normalize_or(along, frame[0]);
        frame[1] = cross(surface.shading_normal, frame[0]);
    }
    return frame;
}

// What direct_diffuse is multiplied with.
vec3 surface_diffuse_albedo(Surface surface) {
    return surface.mode == MODE_PBR ? surface.base_color * ((1.0 - surface.metallic) * (1.0 - surface.transmission)) : vec3(0.0);
}

vec3 surface_spawn(Surface surface, vec3 direction) {
    return spawn_position(surface.position, surface.geometric_normal, surface.offset_m, direction);
}

#endif
