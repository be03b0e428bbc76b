// The range of slopes of a distribution's facets, for a quadrature over them.
// Provides ggxExtent(), beckmannExtent(). A slope is the tangent of a facet's angle to the mean surface, alpha the
// roughness. .x is the slope at half of the elevations, that is at 45 degrees in the distribution's coordinates; .y is
// the largest slope divided by .x. GGX has no largest slope. Beyond 4 alpha, Beckmann's distribution has 1e-7 of its
// facets.

#include "materials.glsl"

vec2 ggxExtent(Material m, float alpha) {
    return vec2(alpha, 1e30);
}

vec2 beckmannExtent(Material m, float alpha) {
    return vec2(2.0 * alpha, 2.0);
}
