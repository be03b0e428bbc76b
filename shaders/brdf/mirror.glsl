// The ideal mirror: f = F delta(V - R) / N.L.
// Provides mirror(), mirrorMirrored(). A mirror reflects a point light to one direction only: so f is 0, and F is the
// factor of the ray to the mirror direction (Whitted 1980). Needs fresnel().

#include "materials.glsl"

vec3 mirror(Material m, vec3 N, vec3 L, vec3 V) {
    return vec3(0.0);
}

vec3 mirrorMirrored(Material m, vec3 N, vec3 V) {
    return fresnel(m, dot(N, V));
}
