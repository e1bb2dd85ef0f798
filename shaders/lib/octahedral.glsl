// Unit vectors in 32 bits. In: a unit vector. Out: two 16-bit octahedral coordinates, or back.
// Error: half a step is 1/65534 in each coordinate, stretched at most sqrt(18) times (middle of a face): below 6.5e-5 rad.
#ifndef LIB_OCTAHEDRAL
#define LIB_OCTAHEDRAL

// The code of no vector: packSnorm2x16 makes no -32768.
const uint OCTAHEDRAL_NONE = 0x80008000u;

vec2 octahedral_fold(vec2 v) {
    return (1.0 - abs(v.yx)) * vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

// Meyer et al., "On Floating-Point Normal Vectors", EGSR 2010; Cigolle et al., JCGT 3(2), 2014.
uint octahedral_encode(vec3 n) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return packSnorm2x16(n.z < 0.0 ? octahedral_fold(p) : p);
}

vec3 octahedral_decode(uint encoded) {
    vec2 p = unpackSnorm2x16(encoded);
    float z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3(z < 0.0 ? octahedral_fold(p) : p, z)); // its length is at least 1/sqrt(3)
}

#endif
