// The range of slopes of a distribution's facets, for a quadrature over them.
// Provides ggxExtent(), beckmannExtent(). x: the slope at half of the elevations, 45 degrees in the distribution's
// coordinates; y: the largest slope, over x. GGX has no largest slope. Beyond 4 alpha, Beckmann's has 1e-7 of its
// facets.

#include "materials.glsl"

vec2 ggxExtent(Material m, float alpha) {
    return vec2(alpha, 1e30);
}

vec2 beckmannExtent(Material m, float alpha) {
    return vec2(2.0 * alpha, 2.0);
}
