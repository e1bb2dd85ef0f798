// What shadow rays of the frames before tell of this frame's: where all around met light, or all met shadow, so would the next one. In: the image of the
// last frame, its depth and normals, the G-buffer. Out: for each light whether a ray is needed; what this frame's rays met, to be stored.
// A pixel keeps what its rays met since its last turn. It has one in every 8 frames: then it traces whatever is known and forgets what it met before.
#ifndef PASS_KNOWN_SHADOWS
#define PASS_KNOWN_SHADOWS

#include "lib/hash.glsl"
#include "lib/octahedral.glsl"
#include "lib/reprojection.glsl"

layout(set = 1, binding = 6) uniform texture2D gbuffer_motion;
layout(set = 1, binding = 7) uniform texture2D previous_depth;
layout(set = 1, binding = 8) uniform utexture2D previous_normal;
layout(set = 1, binding = 9) uniform utexture2D previous_shadows;
layout(set = 1, binding = 10, r32ui) uniform writeonly uimage2D shadows;    // two bits a light: MET_*

// What the rays to a light met.
const uint MET_NOTHING_YET = 0u;
const uint MET_LIGHT = 1u;
const uint MET_SHADOW = 2u;
const uint MET_BOTH = 3u;   // a penumbra, or glass
const uint KNOWN_LIGHTS = 16u;
// Pixels around the one where the surface was. What they know of other surfaces only makes for more rays.
const int REACH = 1;

struct KnownShadows {
    uint around;    // what the last frame's pixels met around here; 0: nothing is known, or it is this pixel's turn
    uint own;       // what this pixel met since its last turn
    uint rays;      // traced to lights that are known of
};

// One of the 8 frames of each block, another in the next. Tiles of 8 x 8 pixels have it together: invocations that run side by side trace together.
bool has_turn(Frame frame, uvec2 pixel) {
    uint index = uint(frame.sample_index);
    uint place = (pixel.x >> 3u & 3u) | (pixel.y >> 3u & 1u) << 2u;
    return ((index ^ place ^ hash_combine(frame.seed, index >> 3u)) & 7u) == 0u;
}

// The pixel where the surface was in the last frame; outside of the image where it was not seen. Nothing but the camera has moved.
ivec2 previous_pixel(Frame frame, uvec2 pixel, Surface surface) {
    const ivec2 nowhere = ivec2(-1);
    // Rounded up and down in turns (R2 sequence), so that over the frames what is kept moves as far as the surface does.
    vec2 rounding = fract(float(uint(frame.sample_index) & 1023u) * vec2(0.7548776662, 0.5698402910));
    ivec2 p = ivec2(floor(vec2(pixel) + rounding - texelFetch(gbuffer_motion, ivec2(pixel), 0).xy));
    if (any(lessThan(p, ivec2(0))) || any(greaterThanEqual(p, ivec2(frame.extent_px)))) {
        return nowhere;
    }
    vec4 clip = frame.previous_clip_from_render * vec4(surface.position, 1.0);
    float depth = clip.z / clip.w;
    float tolerance = depth_tolerance(frame, ivec2(frame.extent_px), depth, abs(dot(surface.geometric_normal, surface.view)));
    bool same = clip.w > 0.0 && abs(texelFetch(previous_depth, p, 0).x - depth) <= tolerance
        && dot(octahedral_decode(texelFetch(previous_normal, p, 0).x), octahedral_decode(texelFetch(gbuffer_normal, ivec2(pixel), 0).x)) > SAME_NORMAL;
    return same ? p : nowhere;
}

KnownShadows known_shadows(Frame frame, uvec2 pixel, Surface surface) {
    KnownShadows known = KnownShadows(0u, 0u, 0u);
    if ((frame.flags & FRAME_SHADOWS_KNOWN) == 0u || has_turn(frame, pixel)) {
        return known;
    }
    ivec2 p = previous_pixel(frame, pixel, surface);
    if (p.x < 0) {
        return known;
    }
    known.own = texelFetch(previous_shadows, p, 0).x;
    for (int y = -REACH; y <= REACH; ++y) {
        for (int x = -REACH; x <= REACH; ++x) {
            known.around |= texelFetch(previous_shadows, clamp(p + ivec2(x, y), ivec2(0), ivec2(frame.extent_px) - 1), 0).x;
        }
    }
    return known;
}

uint known_shadow(KnownShadows known, uint light) {
    return light < KNOWN_LIGHTS ? known.around >> (2u * light) & 3u : MET_NOTHING_YET;
}

// `share`: of the light, as the ray to it tells.
void remember_shadow(inout KnownShadows known, uint light, vec3 share) {
    if (light < KNOWN_LIGHTS) {
        uint met = share == vec3(1.0) ? MET_LIGHT : share == vec3(0.0) ? MET_SHADOW : MET_BOTH;
        known.own |= met << (2u * light);
        ++known.rays;
    }
}

#endif
