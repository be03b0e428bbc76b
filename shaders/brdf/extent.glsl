// Provides ggxExtent(), beckmannExtent(): where a distribution's facets are, for a quadrature over their slopes. x: the
// slope at half of its elevations, 45 degrees in its coordinates; y: the largest of its slopes, over x. GGX has
// none; beyond 4 alpha, Beckmann's has 1e-7 of its facets.

#include "materials.glsl"

vec2 ggxExtent(Material m, float alpha) {
    return vec2(alpha, 1e30);
}

vec2 beckmannExtent(Material m, float alpha) {
    return vec2(2.0 * alpha, 2.0);
}
