// Hashes of words, and a word as a number in [0, 1). In: integers. Out: well mixed ones.
#ifndef LIB_HASH
#define LIB_HASH

// PCG-RXS-M-XS as a hash: O'Neill 2014; Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
uint hash_pcg(uint v) {
    uint state = v * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

uint hash_combine(uint a, uint b) {
    return hash_pcg(b ^ (hash_pcg(a) * 0x9e3779b9u + 0x7f4a7c15u));
}

// pcg4d of the same article: four words in, four well mixed words out.
uvec4 hash_pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The upper 24 bits as a float: exact, and below 1.
float unit_float(uint x) {
    return float(x >> 8u) * 5.9604644775390625e-8;
}

#endif
