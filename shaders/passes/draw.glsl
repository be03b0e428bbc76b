// The constants of one draw, which the vertex shaders hand on to the fragment shaders.
// Provides struct Draw, draw, handOn(), placeOf().
//
// They are not uniforms of the fragment shaders, because llvmpipe loads each uniform anew for every few pixels: some 20
// cycles each, a third of a simple picture's time. It keeps the flat outputs of a vertex shader in registers.

#include "geometry/real.glsl"

struct Draw {
    vec2 resolution;    // W, H of the whole picture in pixels
    vec2 tileOrigin;    // the lower left pixel of the tile being drawn
    vec4 viewport;      // lower left pixel, width and height of the tile plus a margin: OpenGL does not draw points
                        // whose centre is outside the viewport
    vec2 samplePlace;   // the sample point, from the pixel's upper left corner, in units of 2^-24 pixel
    real scatter;       // a mask of the digits of samplePlace that pixels may flip (camera.glsl): -1 all, 0 none.
                        // Not an int: llvmpipe corrupts a double that is alone in its slot, as pixelScale would be.
    real pixelScale;    // tan(fov/2) / H, or half the side of a pixel of an orthographic picture
    vec3 ambient;
    vec3 background;
    int firstPlane;     // the index of the first plane (surfaces.glsl)
    int grid;           // the number of cells along each side of a hemisphere around a light (lists.glsl)
    float depthScale;   // the factor that makes the distances of all objects of common shapes less than 1
#ifdef SPHERE_LIGHTS
    int lightIndex;     // the index of the sample point on each light (sobol.glsl)
#endif
};

uniform Draw draw;
#ifdef SAMPLES
uniform vec2 samplePlaces[SAMPLES];  // the place of each sample, if several are drawn at once
#endif

flat out vec2 resolution;
flat out vec2 tileOrigin;
#ifdef SAMPLES
flat out vec2 samplePlace0;
flat out vec2 samplePlace1;
flat out vec2 samplePlace2;
flat out vec2 samplePlace3;
#else
flat out vec2 samplePlace;
#endif
flat out real scatter;
flat out real pixelScale;
flat out vec3 ambient;
flat out vec3 background;
#ifdef LISTS
flat out int firstPlane;
flat out int grid;
flat out float depthScale;
#endif
#ifdef SPHERE_LIGHTS
flat out int lightIndex;
#endif

void handOn() {
    resolution = draw.resolution;
    tileOrigin = draw.tileOrigin;
#ifdef SAMPLES
    samplePlace0 = samplePlaces[0];
    samplePlace1 = samplePlaces[1];
    samplePlace2 = samplePlaces[2];
    samplePlace3 = samplePlaces[3];
#else
    samplePlace = draw.samplePlace;
#endif
    scatter = draw.scatter;
    pixelScale = draw.pixelScale;
    ambient = draw.ambient;
    background = draw.background;
#ifdef LISTS
    firstPlane = draw.firstPlane;
    grid = draw.grid;
    depthScale = draw.depthScale;
#endif
#ifdef SPHERE_LIGHTS
    lightIndex = draw.lightIndex;
#endif
}

// The clip coordinates of a point of the picture, which is in pixels from the picture's lower left.
vec4 placeOf(vec2 pixel) {
    return vec4(2.0 * (pixel - draw.viewport.xy) / draw.viewport.zw - 1.0, 0.0, 1.0);
}
