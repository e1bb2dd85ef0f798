// The layers over the base of a glTF material: clear coat over sheen. Frame: local, z is the shading normal; v.z > 0.
// In: Lobes at a point. Out: what the layers reflect (brdf x cosine), what they leave for the base, densities per solid angle.
#ifndef LIB_LAYERS
#define LIB_LAYERS

#include "lib/clearcoat.glsl"
#include "lib/lobes.glsl"
#include "lib/sheen.glsl"

struct Layers {
    uint flags;         // LOBE_CLEARCOAT, LOBE_SHEEN
    Clearcoat coat;     // local frame
    float coat_weight;  // as seen from v
    Sheen sheen;
};

Layers layers_begin(Lobes lobes, mat3 render_from_local, vec3 v) {
    Layers layers;
    layers.flags = NEEDS_LOBES ? lobes.flags & (LOBE_CLEARCOAT | LOBE_SHEEN) : 0u;
    layers.coat = Clearcoat(lobes.clearcoat, lobes.clearcoat_roughness * lobes.clearcoat_roughness, lobes.clearcoat_normal * render_from_local);
    layers.coat_weight = has_lobe(lobes, LOBE_CLEARCOAT) ? clearcoat_weight(layers.coat, v) : 0.0;
    layers.sheen = Sheen(lobes.sheen_color, max(lobes.sheen_roughness, SHEEN_ROUGHNESS_MIN), lobes.sheen_albedo);
    return layers;
}

bool has_layer(Layers layers, uint lobe) {
    return NEEDS_LOBES && (layers.flags & lobe) != 0u;
}

// Share of the light between directions of these cosines that the layers leave for the base.
float layers_base_share(Layers layers, float v_z, float l_z) {
    float share = 1.0 - layers.coat_weight;
    return has_layer(layers, LOBE_SHEEN) ? share * sheen_base_share(layers.sheen, v_z, l_z) : share;
}

// What coat and sheen reflect; l.z > 0. A coat that is a mirror is left out.
vec3 layers_evaluate(Layers layers, vec3 v, vec3 l) {
    vec3 value = vec3(0.0);
    if (has_layer(layers, LOBE_CLEARCOAT)) {
        value += layers.coat_weight * clearcoat_evaluate(layers.coat, v, l);
    }
    if (has_layer(layers, LOBE_SHEEN)) {
        value += (1.0 - layers.coat_weight) * sheen_evaluate(layers.sheen, v, l);
    }
    return value;
}

// About how much the sheen reflects: for the choice of a lobe.
float layers_sheen_share(Layers layers, float v_z) {
    return has_layer(layers, LOBE_SHEEN)
        ? (1.0 - layers.coat_weight) * max_component(layers.sheen.color) * min(sheen_albedo(layers.sheen, v_z), 1.0) : 0.0;
}

#endif
