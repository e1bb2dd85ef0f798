// The volumes that a path is in. In: the materials of the surfaces it crosses. Out: the index of refraction and absorption on both sides.
// Volumes may overlap: the one of the highest priority counts (Schmidt and Budge, "Simple Nested Dielectrics in Ray Traced Images", JGT 7(2),
// 2002); at equal priority the one entered last. A surface that changes nothing is passed straight.
#ifndef LIB_MEDIA
#define LIB_MEDIA

#include "shared/needs.glsl"
#include "shared/scene.glsl"
#include "lib/dispersion.glsl"

const uint MEDIA_MAX = 4u;
const uint MEDIUM_AIR = 0xffffffffu;

struct Media {
    uint material[MEDIA_MAX];   // entered and not left, in order
    uint count;
};

Media media_outside() {
    Media media;
    media.material = uint[MEDIA_MAX](MEDIUM_AIR, MEDIUM_AIR, MEDIUM_AIR, MEDIUM_AIR);
    media.count = 0u;
    return media;
}

uint media_current(Scene scene, Media media) {
    uint current = MEDIUM_AIR;
    uint priority = 0u;
    for (uint i = 0u; i < media.count; ++i) {
        uint candidate = MaterialTable(scene.materials).at[media.material[i]].medium_priority;
        if (current == MEDIUM_AIR || candidate >= priority) {
            current = media.material[i];
            priority = candidate;
        }
    }
    return current;
}

// Deeper nesting than MEDIA_MAX forgets the volume entered first.
Media media_enter(Media media, uint material) {
    if (media.count == MEDIA_MAX) {
        for (uint i = 1u; i < MEDIA_MAX; ++i) {
            media.material[i - 1u] = media.material[i];
        }
        media.count = MEDIA_MAX - 1u;
    }
    media.material[media.count] = material;
    media.count += 1u;
    return media;
}

// Removes the latest entry of this material; nothing where the path began inside it.
Media media_leave(Media media, uint material) {
    uint found = media.count;
    for (uint i = 0u; i < media.count; ++i) {
        if (media.material[i] == material) {
            found = i;
        }
    }
    if (found == media.count) {
        return media;
    }
    for (uint i = found + 1u; i < media.count; ++i) {
        media.material[i - 1u] = media.material[i];
    }
    media.count -= 1u;
    return media;
}

bool media_contains(Media media, uint material) {
    for (uint i = 0u; i < media.count; ++i) {
        if (media.material[i] == material) {
            return true;
        }
    }
    return false;
}

// 20 / Abbe number.
float medium_dispersion(Scene scene, uint medium) {
    uint lobes = !NEEDS_LOBES || medium == MEDIUM_AIR ? 0u : MaterialTable(scene.materials).at[medium].lobes;
    return lobes == 0u ? 0.0 : LobesTable(scene.material_lobes).at[lobes - 1u].dispersion;
}

// As a channel sees it (lib/dispersion.glsl).
float medium_ior(Scene scene, uint medium, uint channel) {
    if (medium == MEDIUM_AIR) {
        return 1.0;
    }
    float ior = MaterialTable(scene.materials).at[medium].ior;
    return NEEDS_LOBES ? dispersion_ior(ior, medium_dispersion(scene, medium), channel) : ior;
}

// Beer and Lambert over a distance. Bounded, so that a compiler that turns exp into exp2 cannot make it infinite: 0 x infinity is not 1.
const float LONGEST_M = 1e30;

vec3 medium_transmittance(Scene scene, uint medium, float distance_m) {
    if (medium == MEDIUM_AIR) {
        return vec3(1.0);
    }
    return exp(-MaterialTable(scene.materials).at[medium].attenuation_per_m * min(distance_m, LONGEST_M));
}

// What lies on both sides of a surface that encloses a volume, seen in the direction of travel.
struct Interface {
    uint before;
    uint after;
    Media media_after;
    bool bounds_volume; // false: a sheet or an opaque surface, the same medium on both sides
};

Interface media_interface(Scene scene, Media media, uint material, bool front) {
    Interface crossing;
    crossing.bounds_volume = true;
    if (front) {
        crossing.media_after = media_enter(media, material);
        crossing.before = media_current(scene, media);
    } else {
        // A path that begins inside a volume learns of it when it leaves.
        crossing.media_after = media_leave(media, material);
        Media inside = media;
        if (!media_contains(media, material)) {
            inside = media_enter(media, material);
        }
        crossing.before = media_current(scene, inside);
    }
    crossing.after = media_current(scene, crossing.media_after);
    return crossing;
}

#endif
