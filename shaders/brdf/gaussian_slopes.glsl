// The distribution of facet normals with Gaussian slopes (Beckmann and Spizzichino 1963).
// Provides gaussianSlopes(): the density, in 1/sr, at the direction S, which need not be unit. It is
// exp(-tan^2 / alpha^2) / (pi alpha^2 cos^4) of the angle between S and the unit normal N. The slopes have the variance
// alpha^2 / 2 along each axis.

#include "brdf/numbers.glsl"

// The largest tan^2 / alpha^2: above it exp() underflows in float32, and the density is 0.
const float LARGEST_EXPONENT = 87.0;

float gaussianSlopes(float alpha, vec3 N, vec3 S) {
    vec3 x = cross(N, S);
    float c = dot(N, S), c2 = max(c * c, 1e-30);
    float t = dot(x, x) / (c2 * alpha * alpha);
    float q = dot(S, S) / c2;
    return c > 0.0 && t < LARGEST_EXPONENT ? exp(-t) * q * q / (PI * alpha * alpha) : 0.0;
}
