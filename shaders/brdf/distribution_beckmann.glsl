// Provides beckmannD(), beckmannSlope(): Beckmann's distribution of the facets' normals, and Smith's masking of it;
// conventions as in distribution_ggx.glsl. Needs smith() of smith_*.glsl.

#include "brdf/extent.glsl"
#include "brdf/gaussian_slopes.glsl"
#include "materials.glsl"

float beckmannD(Material m, vec3 N, vec3 S) {
    return gaussianSlopes(m.alpha, N, S);
}

float beckmannSlope(Material m, float mu) {
    return smith(m, mu);
}
