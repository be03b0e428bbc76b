// The camera ray through this fragment's sample point, from the origin along -z.
// Provides cameraRay(), and cameraSlope() in perspective. All vectors are in view space.
//
// For pixel (x, y), counted from the top left, and its sample point (sx, sy) in [0, 1)^2, the direction is
//     ((2 (x + sx) / W - 1) tan(fov/2) W/H, (1 - 2 (y + sy) / H) tan(fov/2), -1).
// If the host defines ORTHOGRAPHIC, the direction is (0, 0, -1). The x and y above are those of the ray's origin, with
// half the picture's height instead of tan(fov/2), and its z is 0. Then the ray is like any other ray: the error of its
// origin X is 3 u |X|, with u as in sphere.glsl. The direction is exact, so a slope has only the error of its vector's
// z.
//
// All pixels share one sequence of sample points, but each pixel flips its own set of binary digits of their
// coordinates (Kollig and Keller 2002, "Efficient multidimensional sampling", random digits). The points stay as evenly
// spread. But the error along an edge changes its sign from pixel to pixel, instead of being equal all along the edge.
// So a mean over pixels shows how large the error is.

#include "geometry/ray.glsl"

flat in vec2 resolution;    // W, H of the whole picture in pixels
flat in vec2 tileOrigin;    // the lower left pixel of the tile being drawn
#ifdef SAMPLES
flat in vec2 samplePlace0;  // the places of the SAMPLES samples, in the units of samplePlace
flat in vec2 samplePlace1;
flat in vec2 samplePlace2;
flat in vec2 samplePlace3;
vec2 samplePlace;           // the place of the sample that is drawn now
#else
flat in vec2 samplePlace;   // the sample point, from the pixel's upper left corner, in units of 2^-24 pixel
#endif
flat in real scatter;       // a mask of the digits that may be flipped: -1 for all, 0 for none
flat in real pixelScale;    // tan(fov/2) / H, or half the side of a pixel if ORTHOGRAPHIC

// The vector from the picture's centre to the pixel's centre, in half pixels: whole numbers, so exact.
real2 halfPixels() {
    return real2(2.0 * (gl_FragCoord.xy + tileOrigin) - resolution);
}

// The 24 digits of x and of y that a pixel flips. They follow a lattice over the picture, so that in each direction
// successive pixels go through all values evenly. For x, the steps along both axes are 2^32 times the steps of Roberts
// (2018). For y, they are multiplied by a constant such that each step, and the sum and the difference of the two, is
// far from simple fractions too (the best of 200,000 random constants).
uvec2 pixelDigits() {
    uvec2 steps = uvec2(gl_FragCoord.xy + tileOrigin) * uvec2(3242174889u, 2447445413u);
    uint place = steps.x + steps.y;
    return uvec2(place, place * 1010068087u) >> 8;
}

// The vector from the pixel's centre to the sample point, in half pixels, +y up: within [-1, 1]. It is exact. (The
// scale is a constant because OpenGL does not promise that exp2() is exact.)
real2 samplePoint() {
    uvec2 place = uvec2(samplePlace) ^ (pixelDigits() & uint(int(scatter)));
    return real2(vec2(place) * (1.0 / 8388608.0) - 1.0) * real2(1.0, -1.0);
}

#ifdef ORTHOGRAPHIC
Ray cameraRay() {
    Contact none = Contact(0, real3(0.0));
    real3 origin = real3((halfPixels() + samplePoint()) * pixelScale, 0.0);
    // This is 1, but no constant: compilers simplify constants, in one evaluator and not in another.
    real one = real(min(resolution.x, 1.0));
    return Ray(origin, real3(0.0, 0.0, -one), false, none, none, INF);
}
#else
// The direction through the sample point, with z = -1.
real3 cameraDirection() {
    return real3((halfPixels() + samplePoint()) * pixelScale, -1.0);
}

// The factor that makes cameraDirection() unit.
real cameraScale() {
    return 1.0 / length(cameraDirection());
}

Ray cameraRay() {
    Contact none = Contact(0, real3(0.0));
    return Ray(real3(0.0), cameraScale() * cameraDirection(), true, none, none, INF);
}

// dot(v, cameraRay().rd) for a vector v, which is a plane's normal or a sphere's centre. It avoids the cancellation
// that would spoil the depth of a flat or round ground near its horizon. With the unnormalised direction, the sum is
// linear in the pixel, a x + b y + c. The host splits each coefficient into a coarse part and a fine rest. Coarse parts
// are multiples of a power of two, large enough that the sum of their products with whole numbers is exact in float32.
// Only the rest is rounded: the error is (W + H) 2^-46 |v| and a few units in the last place.
real cameraSlope(real3 coarse, real3 fine) {
    real3 pixel = real3(halfPixels(), 1.0);
    real rest = dot(fine, pixel) + dot(coarse.xy + fine.xy, samplePoint());
    return (dot(coarse, pixel) + rest) * cameraScale();
}
#endif
