// Colour encodings. In: linear Rec.709. Out: encoded values, or back. Knows no exposure and no tone map.
#ifndef LIB_COLOR
#define LIB_COLOR

// sRGB transfer function (IEC 61966-2-1), per channel; negative input is clamped.
vec3 srgb_encode(vec3 linear_rgb) {
    vec3 x = max(linear_rgb, vec3(0.0));
    vec3 high = 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055;
    return mix(high, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}

vec3 srgb_decode(vec3 encoded) {
    vec3 x = max(encoded, vec3(0.0));
    vec3 high = pow((x + 0.055) / 1.055, vec3(2.4));
    return mix(high, x / 12.92, lessThanEqual(x, vec3(0.04045)));
}

// What the window target holds: the UI shader encodes user textures with pow 1/2.2, so that srgb(x)^2.2 reaches the screen as srgb(x).
vec3 window_encode(vec3 linear_rgb) {
    return pow(srgb_encode(linear_rgb), vec3(2.2));
}

// A share, 0..1, as blue, green, yellow, red.
vec3 ramp_color(float share) {
    const vec3 colors[4] = vec3[4](vec3(0.02, 0.1, 0.8), vec3(0.05, 0.6, 0.1), vec3(0.9, 0.8, 0.05), vec3(0.8, 0.03, 0.02));
    float x = 3.0 * clamp(share, 0.0, 1.0);
    uint first = min(uint(x), 2u);
    return mix(colors[first], colors[first + 1u], x - float(first));
}

#endif
