// The three signals of pass denoise at one pixel, and which neighbours show the same surface. In: the G-buffer, the images of the signals.
#ifndef PASS_DENOISE_SIGNALS
#define PASS_DENOISE_SIGNALS

#extension GL_EXT_samplerless_texture_functions : require

#include "shared/frame.glsl"
#include "lib/light_signals.glsl"
#include "lib/material.glsl"
#include "lib/octahedral.glsl"
#include "lib/vector.glsl"

layout(set = 1, binding = 0) uniform utexture2D gbuffer_id;
layout(set = 1, binding = 1) uniform utexture2D gbuffer_normal;
layout(set = 1, binding = 2) uniform texture2D gbuffer_depth;
layout(set = 1, binding = 3) uniform texture2D image_of_surface;    // z: reverse depth of what the surface mirrors or shows behind it
layout(set = 1, binding = 4) uniform texture2D in_diffuse;
layout(set = 1, binding = 5) uniform texture2D in_specular;
layout(set = 1, binding = 6) uniform texture2D in_reflected;
layout(set = 1, binding = 7, rgba32f) uniform writeonly image2D out_diffuse;
layout(set = 1, binding = 8, rgba32f) uniform writeonly image2D out_specular;
layout(set = 1, binding = 9, rgba32f) uniform writeonly image2D out_reflected;
layout(set = 1, binding = 10, rgba32f) uniform writeonly image2D out_guide;     // luminances of the three, blurred: what pixels are compared by

// B3 spline: weights of a 5x5 kernel by the distance from its middle.
const float SPLINE[3] = float[3](3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0);
// Exponent of the cosine between normals.
const float NORMAL_POWER = 64.0;
// Reverse depth may leave the plane of the pixel by this share of what the plane itself changes, and of the depth.
const float DEPTH_OF_SLOPE = 0.5;
const float DEPTH_OF_DEPTH = 0.01;
// Likewise of what is mirrored.
const float IMAGE_OF_DEPTH = 0.1;
// Least weight of taps whose image is elsewhere: in mirrors, and where surfaces bend or spread the image, so that its depth tells little.
const float IMAGE_LEAST_MIRROR = 0.01;
const float IMAGE_LEAST = 0.4;

struct Signals {
    vec4 diffuse;       // a: as the pass says
    vec4 specular;
    vec4 reflected;
};

// What a pixel is compared by.
struct Place {
    uvec2 id;           // instance, material
    vec3 normal;
    float depth;        // reverse: affine over the image where the surface is a plane
    vec2 slope;         // its change a pixel
    float image_depth;
    float image_least;
};

Signals signals_at(Frame frame, ivec2 p) {
    Signals signals;
    signals.diffuse = texelFetch(in_diffuse, p, 0);
    signals.specular = has_specular(frame) ? texelFetch(in_specular, p, 0) : vec4(0.0);
    signals.reflected = HAS_REFLECTED ? texelFetch(in_reflected, p, 0) : vec4(0.0);
    return signals;
}

void store(Frame frame, ivec2 p, Signals signals) {
    imageStore(out_diffuse, p, signals.diffuse);
    if (has_specular(frame)) {
        imageStore(out_specular, p, signals.specular);
    }
    if (HAS_REFLECTED) {
        imageStore(out_reflected, p, signals.reflected);
    }
}

vec3 luminances(Signals signals) {
    return vec3(luminance(signals.diffuse.rgb), luminance(signals.specular.rgb), luminance(signals.reflected.rgb));
}

bool inside(Frame frame, ivec2 p) {
    return all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, ivec2(frame.extent_px)));
}

// Change of reverse depth towards one neighbour, or the other when that one is nearer: the smaller of both crosses no edge.
float slope_along(Frame frame, ivec2 p, ivec2 along, float depth) {
    float ahead = inside(frame, p + along) ? texelFetch(gbuffer_depth, p + along, 0).x - depth : FLOAT_MAX;
    float behind = inside(frame, p - along) ? depth - texelFetch(gbuffer_depth, p - along, 0).x : FLOAT_MAX;
    float least = abs(ahead) < abs(behind) ? ahead : behind;
    return abs(least) < FLOAT_MAX ? least : 0.0;
}

Place place_at(Frame frame, ivec2 p) {
    Place place;
    place.id = texelFetch(gbuffer_id, p, 0).xw;
    place.normal = octahedral_decode(texelFetch(gbuffer_normal, p, 0).x);
    place.depth = texelFetch(gbuffer_depth, p, 0).x;
    place.slope = vec2(slope_along(frame, p, ivec2(1, 0), place.depth), slope_along(frame, p, ivec2(0, 1), place.depth));
    place.image_depth = HAS_REFLECTED ? texelFetch(image_of_surface, p, 0).z : 0.0;
    bool mirror = material_is_mirror(MaterialTable(SceneTable(frame.scene).scene.materials).at[place.id.y]);
    place.image_least = mirror ? IMAGE_LEAST_MIRROR : IMAGE_LEAST;
    return place;
}

// Weight of a neighbour by what it shows (x) and by what it mirrors (y): 0 on another surface.
vec2 edge_weights(Place place, ivec2 p, ivec2 offset) {
    if (texelFetch(gbuffer_id, p, 0).xw != place.id) {
        return vec2(0.0);
    }
    float cosine = max(dot(octahedral_decode(texelFetch(gbuffer_normal, p, 0).x), place.normal), 0.0);
    float change = dot(place.slope, vec2(offset));
    float off = abs(texelFetch(gbuffer_depth, p, 0).x - place.depth - change);
    float weight = pow(cosine, NORMAL_POWER) * exp(-off / (DEPTH_OF_SLOPE * abs(change) + DEPTH_OF_DEPTH * place.depth + 1e-30));
    float image_off = HAS_REFLECTED ? abs(texelFetch(image_of_surface, p, 0).z - place.image_depth) : 0.0;
    return vec2(weight, weight * max(exp(-image_off / (IMAGE_OF_DEPTH * place.image_depth + 1e-30)), place.image_least));
}

#endif
