// Provides cameraRay(), cameraSlope(): the ray through this fragment's sample point, from the
// origin along -z.
//
// The direction goes through ((2 (x + sx) / W - 1) tan(fov/2) W/H, (1 - 2 (y + sy) / H) tan(fov/2), -1)
// for pixel (x, y) from the top left and sample point (sx, sy) in it.

#include "ray.glsl"

flat in vec2 resolution;    // W, H of the whole picture in pixels
flat in vec2 tileOrigin;    // the lower left pixel of the tile being drawn
flat in real2 samplePoint;  // from the pixel's centre, in half pixels, +y up: within [-1, 1)
flat in real pixelScale;    // tan(fov/2) / H

// The pixel's centre from the picture's, in half pixels: whole numbers, so exact.
real2 halfPixels() {
    return real2(2.0 * (gl_FragCoord.xy + tileOrigin) - resolution);
}

real3 cameraDirection() {
    return real3((halfPixels() + samplePoint) * pixelScale, -1.0);
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
    real rest = dot(fine, pixel) + dot(coarse.xy + fine.xy, samplePoint);
    return (dot(coarse, pixel) + rest) * cameraScale();
}
