// The scene on the device: what set 0 and the tables hold. Host twins: renderer/src/gpu_types.rs,
// field by field under the same names. All structs are laid out `scalar`; sizes are asserted on both sides.
// Space: render space (world space less the render origin), metres. Matrices are three rows of a 3x4 affine map.
#ifndef SHARED_SCENE
#define SHARED_SCENE

#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

const uint NO_TEXTURE = 0xffffffffu;

// Material.mode, in the order of renderer::delta::ShadingMode.
const uint MODE_PBR = 0u;
const uint MODE_REFLECTIVE = 1u;
const uint MODE_REFRACTIVE = 2u;
const uint MODE_UNLIT = 3u;

// Material.flags
const uint MATERIAL_DOUBLE_SIDED = 1u;
const uint MATERIAL_HAS_VOLUME = 2u;
const uint MATERIAL_ALPHA_MASK = 4u;
const uint MATERIAL_ALPHA_BLEND = 8u;

// MaterialLobes.flags: what the material has
const uint LOBE_ANISOTROPY = 1u;
const uint LOBE_CLEARCOAT = 2u;
const uint LOBE_DISPERSION = 4u;
const uint LOBE_IRIDESCENCE = 8u;
const uint LOBE_SHEEN = 16u;
const uint LOBE_DIFFUSE_TRANSMISSION = 32u;
const uint LOBE_SPECULAR_GLOSSINESS = 64u;

const uint GGX_ALBEDO_SIDE = 32u;   // cosines and roughnesses of the table Frame.ggx_albedo (lib/ggx_albedo.glsl)
const uint SHEEN_ALBEDO_SIDE = 32u; // cosines and roughnesses of the table Scene.sheen_albedo (lib/sheen.glsl)

// Instance.flags
const uint INSTANCE_MIRRORED = 1u;  // determinant below 0: the winding seen in render space is turned over

// Geometry.flags
const uint GEOMETRY_MOVED = 1u;     // mesh_from_primitive is not the identity, now or in the last frame
const uint GEOMETRY_MOVING = 2u;    // the previous vertices or matrix differ from the present ones
const uint GEOMETRY_SHAPES = 4u;    // spheres and boxes: `positions` is the address of Shape[triangle_count], there are no attributes and no indices

// Shape.kind
const uint SHAPE_SPHERE = 0u;
const uint SHAPE_BOX = 1u;

// Vertices that raster draws for a shape: the box around it.
const uint SHAPE_VERTICES = 36u;

// Light.kind
const uint LIGHT_POINT = 0u;
const uint LIGHT_SPOT = 1u;
const uint LIGHT_DIRECTIONAL = 2u;

struct Instance {
    vec4 render_from_mesh[3];
    vec4 previous_render_from_mesh[3];
    vec4 normal_from_mesh[3];   // rows of the cofactor matrix (xyz), scaled so that its largest entry is 1; w unused
    uint64_t geometries;        // address of Geometry[geometry_count]
    uint material_base;         // first of geometry_count entries of Scene.material_slots
    uint geometry_count;
    uint flags;
    uint pad0;
};

// The builder of acceleration structures reads mesh_from_primitive in place, 16-byte aligned: offset and size are multiples of 16.
struct Geometry {
    uint64_t positions;         // address of vec3[] (12 bytes each), mesh space before mesh_from_primitive
    uint64_t previous_positions; // the same of the last frame; equal to `positions` unless the mesh deforms
    uint64_t attributes;        // address of VertexAttributes[], same order
    uint64_t indices;           // address of uint[], already moved to the first index of this geometry
    uint triangle_count;        // or number of shapes
    uint flags;
    uint pad0;
    uint pad1;
    vec4 mesh_from_primitive[3];
    vec4 previous_mesh_from_primitive[3];
};

// A sphere or a box, primitive space. A size of 0: rays never meet it.
struct Shape {
    vec3 centre;
    uint kind;
    vec3 half_extent;           // of a sphere: the radius, three times
};

struct VertexAttributes {
    vec3 normal;
    vec4 tangent;               // w: handedness
    vec2 tex_coord0;
    vec2 tex_coord1;
    uint color_rg;              // packHalf2x16 of linear red, green
    uint color_ba;              // packHalf2x16 of linear blue, alpha
};

struct TextureUse {
    uint texture;               // index into textures[], or NO_TEXTURE
    uint tex_coord;             // 0 or 1
    vec2 offset;                // KHR_texture_transform: uv' = linear * uv + offset
    vec4 linear;                // 2x2 matrix by rows: (m00, m01, m10, m11)
};

struct Material {
    vec4 base_color;
    vec3 emissive;              // radiance
    float metallic;
    vec3 specular_color;
    float specular;
    vec3 attenuation_per_m;     // absorption coefficient, 1/m
    float roughness;            // perceptual; GGX alpha is its square
    float normal_scale;
    float occlusion_strength;
    float ior;
    float transmission;
    float alpha_cutoff;
    uint mode;
    uint flags;
    uint medium_priority;       // where volumes overlap, the higher one counts (Schmidt and Budge 2002); equal: the one entered last
    uint lobes;                 // 1 + index into Scene.material_lobes; 0: none
    TextureUse base_color_texture;
    TextureUse metallic_roughness_texture;
    TextureUse normal_texture;
    TextureUse occlusion_texture;
    TextureUse emissive_texture;
};

// What most materials go without: lobes and their textures.
struct MaterialLobes {
    vec3 sheen_color;
    float sheen_roughness;                              // perceptual
    vec3 diffuse_transmission_color;
    float diffuse_transmission;                         // share of the diffuse light
    vec2 anisotropy_direction;                          // cosine and sine of the rotation from the tangent
    float anisotropy;
    float clearcoat;
    float clearcoat_roughness;                          // perceptual
    float clearcoat_normal_scale;
    float iridescence;
    float iridescence_ior;
    float iridescence_thickness_min_nm;
    float iridescence_thickness_max_nm;
    float dispersion;                                   // 20 / Abbe number
    float glossiness;                                   // of specular-glossiness, whose reflectance is Material.specular_color
    uint flags;
    TextureUse specular_texture;                        // a
    TextureUse specular_color_texture;                  // rgb; of specular-glossiness its glossiness in a
    TextureUse transmission_texture;                    // r
    TextureUse anisotropy_texture;                      // rg: direction, b: strength
    TextureUse clearcoat_texture;                       // r
    TextureUse clearcoat_roughness_texture;             // g
    TextureUse clearcoat_normal_texture;
    TextureUse iridescence_texture;                     // r
    TextureUse iridescence_thickness_texture;           // g
    TextureUse sheen_color_texture;
    TextureUse sheen_roughness_texture;                 // a
    TextureUse diffuse_transmission_texture;            // a
    TextureUse diffuse_transmission_color_texture;
};

struct Light {
    vec3 position;              // point, spot
    float radius_m;             // 0: hard shadow
    vec3 direction;             // in which light travels: spot axis, directional
    float range_m;              // 0: no limit
    vec3 intensity;             // candela (point, spot) or lux (directional), linear RGB
    uint kind;
    float cos_inner;
    float cos_outer;
    float angular_radius_rad;   // directional
    float selection_pdf;        // probability of this light when one is drawn from the alias table
};

// One entry of an alias table (Walker 1977; Vose 1991): draw a column i, keep it when xi < threshold, else take `alias`.
struct AliasEntry {
    float threshold;
    uint alias;
    float pdf;                  // probability of drawing this entry, discrete, for the whole table
};

// A triangle whose material emits; found through the instance tables so that moving it uploads nothing.
struct EmissiveTriangle {
    uint instance;
    uint geometry;
    uint primitive;
    uint pad0;
};

struct Scene {
    uint64_t instances;             // Instance[]
    uint64_t material_slots;        // uint[]: index into materials, one per (instance, geometry)
    uint64_t materials;             // Material[]
    uint64_t lights;                // Light[light_count]
    uint64_t light_alias;           // AliasEntry[light_count], by power
    uint64_t emissive_triangles;    // EmissiveTriangle[emissive_count]
    uint64_t emissive_alias;        // AliasEntry[emissive_count], by area x luminance
    uint64_t environment_alias;     // AliasEntry[environment_width * environment_height], by radiance x solid angle
    uint64_t draw_instances;        // uint[]: instance slots, indexed by gl_InstanceIndex of the raster draws
    uint64_t material_lobes;        // MaterialLobes[]
    uint64_t sheen_albedo;          // float[SHEEN_ALBEDO_SIDE squared]
    uint light_count;
    uint emissive_count;
    uint environment_width;         // of the alias table's grid; 0: constant environment
    uint environment_height;
    vec3 environment_radiance;      // the constant, or the factor on the map
    float environment_rotation_rad; // turn of the map around +Y
    float emissive_power;           // sum of area x luminance over emissive_triangles
    uint pad0;
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer InstanceTable { Instance at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer GeometryTable { Geometry at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer PositionTable { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer ShapeTable { Shape at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AttributeTable { VertexAttributes at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer UintTable { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MaterialTable { Material at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LobesTable { MaterialLobes at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer SheenAlbedoTable { float at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightTable { Light at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer AliasTable { AliasEntry at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer EmissiveTable { EmissiveTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer SceneTable { Scene scene; };

// Bit of gbuffer_id.y: the back side of the triangle was seen, or the inside of a shape.
const uint GBUFFER_BACK = 0x80000000u;

#endif
