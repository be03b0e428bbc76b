// The camera ray through this fragment's sample point, from the origin along -z.
// Provides cameraRay(), cameraSlope().
//
// The direction goes through ((2 (x + sx) / W - 1) tan(fov/2) W/H, (1 - 2 (y + sy) / H) tan(fov/2), -1)
// for pixel (x, y) from the top left and sample point (sx, sy) in it.
//
// All pixels share one sequence of sample points, but each pixel flips other binary digits of them (Kollig and Keller
// 2002, "Efficient multidimensional sampling", random digits). The points stay as evenly spread. The error along an
// edge, however, then changes its sign from pixel to pixel instead of being the same all along the edge. So a mean
// over pixels says how large the error is.

#include "geometry/ray.glsl"

flat in vec2 resolution;    // W, H of the whole picture in pixels
flat in vec2 tileOrigin;    // the lower left pixel of the tile being drawn
#ifdef SAMPLES
flat in vec2 samplePlace0;  // of each of the SAMPLES samples, as samplePlace
flat in vec2 samplePlace1;
flat in vec2 samplePlace2;
flat in vec2 samplePlace3;
vec2 samplePlace;           // of the sample that is drawn, one of these
#else
flat in vec2 samplePlace;   // from the pixel's upper left corner, in 2^-24 of the pixel
#endif
flat in real scatter;       // which of these digits are flipped: all, -1, or none, 0
flat in real pixelScale;    // tan(fov/2) / H

// The pixel's centre from the picture's, in half pixels: whole numbers, so exact.
real2 halfPixels() {
    return real2(2.0 * (gl_FragCoord.xy + tileOrigin) - resolution);
}

// Which digits a pixel flips: those of a lattice, so that in each direction one pixel after another comes to them
// evenly. Along x and y its steps are 2^32 times Roberts's 2018 for x; times a number for y with which each step, and the
// sum and the difference of both, is as far from simple fractions (of 200,000 random numbers the best).
uvec2 pixelDigits() {
    uvec2 steps = uvec2(gl_FragCoord.xy + tileOrigin) * uvec2(3242174889u, 2447445413u);
    uint place = steps.x + steps.y;
    return uvec2(place, place * 1010068087u) >> 8;
}

// From the pixel's centre, in half pixels, +y up: within [-1, 1], and exact, as OpenGL does not promise of exp2().
real2 samplePoint() {
    uvec2 place = uvec2(samplePlace) ^ (pixelDigits() & uint(int(scatter)));
    return real2(vec2(place) * (1.0 / 8388608.0) - 1.0) * real2(1.0, -1.0);
}

real3 cameraDirection() {
    return real3((halfPixels() + samplePoint()) * pixelScale, -1.0);
}

// To make cameraDirection() unit.
real cameraScale() {
    return 1.0 / length(cameraDirection());
}

Ray cameraRay() {
    Contact none = Contact(0, real3(0.0));
    return Ray(real3(0.0), cameraScale() * cameraDirection(), true, none, none, INF);
}

// dot(v, cameraRay().rd) for a vector v, a plane's normal or a sphere's centre, without the
// cancellation that would spoil the depth of a ground, flat or round, near its horizon. The sum
// over the unnormalised direction is linear in the pixel, a x + b y + c. The host splits each
// coefficient into a coarse part and the fine rest, coarse parts being multiples of so large a
// power of two that the sum of their products with whole numbers is exact in float32. Only what
// is left of it is rounded: the error is (W + H) 2^-46 |v| and a few units in the last place.
real cameraSlope(real3 coarse, real3 fine) {
    real3 pixel = real3(halfPixels(), 1.0);
    real rest = dot(fine, pixel) + dot(coarse.xy + fine.xy, samplePoint());
    return (dot(coarse, pixel) + rest) * cameraScale();
}
