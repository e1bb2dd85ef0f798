// Orthonormal basis around a unit vector. In: the third axis. Out: the matrix from local to the vector's space. No branch, no special axis.
#ifndef LIB_BASIS
#define LIB_BASIS

// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017. Columns: tangent, bitangent, n.
mat3 basis_around(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(
        vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x),
        vec3(b, s + n.y * n.y * a, -n.y),
        n);
}

#endif
