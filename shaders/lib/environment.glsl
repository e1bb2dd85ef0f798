// Light from infinity: an equirectangular map or a constant. In: Scene and unit directions in render space. Out: radiance, samples, densities
// per solid angle. The map: +Y up, first row at the zenith, the middle column (u = 0.5) seen along -Z, +X to the right of it (u = 0.75).
#ifndef LIB_ENVIRONMENT
#define LIB_ENVIRONMENT

#include "shared/scene.glsl"
#include "shared/textures.glsl"
#include "shared/needs.glsl"
#include "lib/vector.glsl"

vec2 environment_uv(Scene scene, vec3 direction) {
    float across = length(direction.xz);
    float turn = across > 0.0 ? atan(direction.x, -direction.z) : 0.0;
    float u = 0.5 + (turn + scene.environment_rotation_rad) / TAU;
    return vec2(u - floor(u), atan(across, direction.y) / PI);
}

vec3 environment_radiance(Scene scene, vec3 direction) {
    if (!NEEDS_ENVIRONMENT) {
        return vec3(0.0);
    }
    if (!NEEDS_ENVIRONMENT_MAP || scene.environment_width == 0u) {
        return scene.environment_radiance;
    }
    return scene.environment_radiance * textureLod(environment_map, environment_uv(scene, direction), 0.0).rgb;
}

// Solid angle of one cell of the importance grid in a row: 2 pi / width times the difference of the cosines of its edges,
// written as a product so that rows at the poles keep their digits.
float environment_cell_sr(Scene scene, uint row) {
    float half_step = 0.5 * PI / float(scene.environment_height);
    return TAU / float(scene.environment_width) * 2.0 * sin(half_step * (2.0 * float(row) + 1.0)) * sin(half_step);
}

uint environment_cell(Scene scene, vec3 direction) {
    vec2 uv = environment_uv(scene, direction);
    uvec2 size = uvec2(scene.environment_width, scene.environment_height);
    uvec2 cell = min(uvec2(uv * vec2(size)), size - 1u);
    return cell.y * size.x + cell.x;
}

// Density of environment_sample in a direction, 1/sr. Only for maps.
float environment_pdf(Scene scene, vec3 direction) {
    uint cell = environment_cell(scene, direction);
    return AliasTable(scene.environment_alias).at[cell].pdf / environment_cell_sr(scene, cell / scene.environment_width);
}

// A cell by its alias table, then a direction within it, uniform per solid angle. cell_xi, point_xi in [0, 1)^2. Only for maps.
vec3 environment_sample(Scene scene, vec2 cell_xi, vec2 point_xi) {
    uint count = scene.environment_width * scene.environment_height;
    uint column = min(uint(cell_xi.x * float(count)), count - 1u);
    AliasEntry entry = AliasTable(scene.environment_alias).at[column];
    uint cell = cell_xi.y < entry.threshold ? column : entry.alias;
    uint row = cell / scene.environment_width;
    float upper = PI * float(row) / float(scene.environment_height);
    float lower = PI * float(row + 1u) / float(scene.environment_height);
    float y = mix(cos(upper), cos(lower), point_xi.y);
    float across = sqrt(max((1.0 - y) * (1.0 + y), 0.0));
    float u = (float(cell % scene.environment_width) + point_xi.x) / float(scene.environment_width);
    float turn = (u - 0.5) * TAU - scene.environment_rotation_rad;
    return vec3(across * sin(turn), y, -across * cos(turn));
}

#endif
