// Beckmann's distribution of facet normals, and Smith's masking for it.
// Provides beckmannD(), beckmannSlope(); conventions as in distribution_ggx.glsl. Needs smith() of smith_*.glsl.

#include "brdf/extent.glsl"
#include "brdf/gaussian_slopes.glsl"
#include "materials.glsl"

float beckmannD(Material m, vec3 N, vec3 S) {
    return gaussianSlopes(m.alpha, N, S);
}

float beckmannSlope(Material m, float mu) {
    return smith(m, mu);
}
