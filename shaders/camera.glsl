// Provides cameraRay(): the ray through this fragment's sample point, from the origin along -z.
//
// The direction goes through ((2 (x + sx) / W - 1) tan(fov/2) W/H, (1 - 2 (y + sy) / H) tan(fov/2), -1)
// for pixel (x, y) from the top left and sample point (sx, sy) in it. Pixel numbers are kept as
// whole and half numbers, which float32 holds exactly, until the one multiplication.

#include "ray.glsl"

uniform vec2 resolution;   // W, H of the whole picture in pixels
uniform vec2 tileOrigin;   // the lower left pixel of the tile being drawn
uniform vec2 samplePoint;  // from the pixel's centre, in half pixels, +y up: within [-1, 1)
uniform float pixelScale;  // tan(fov/2) / H

Ray cameraRay() {
    vec2 p = (2.0 * (gl_FragCoord.xy + tileOrigin) - resolution + samplePoint) * pixelScale;
    return ray(vec3(0.0), normalize(vec3(p, -1.0)));
}
