// Beckmann's distribution of facet normals, and Smith's masking for it.
// Provides beckmannD(): the density D, in 1/sr, at the direction S = L + V, which need not be unit. Provides
// beckmannSlope(): mu (1 + Lambda) for a direction with the cosine mu to the normal, Lambda being Smith's auxiliary
// function. Sources: Beckmann and Spizzichino 1963; Smith 1967. N is the unit normal.
// Needs the generated smith(), which calls the exact or the rational form.

#include "brdf/extent.glsl"
#include "brdf/gaussian_slopes.glsl"
#include "materials.glsl"

float beckmannD(Material m, vec3 N, vec3 S) {
    return gaussianSlopes(m.alpha, N, S);
}

float beckmannSlope(Material m, float mu) {
    return smith(m, mu);
}
