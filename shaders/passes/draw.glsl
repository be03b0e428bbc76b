// The constants of one draw, which the vertex shaders hand on to the fragment shaders.
// Provides struct Draw, draw, handOn(), placeOf().
//
// They are not uniforms of the fragment shaders: llvmpipe loads each number of those anew for every few pixels, some
// 20 cycles each, a third of a simple picture's time. It keeps in registers what a vertex shader hands on flat.

#include "geometry/real.glsl"

struct Draw {
    vec2 resolution;    // W, H of the whole picture in pixels
    vec2 tileOrigin;    // the lower left pixel of the tile being drawn
    vec4 viewport;      // its lower left pixel, width and height: a tile and a margin, as points with a centre
                        // beyond it are not drawn
    vec2 samplePlace;   // where in the pixel the sample lies, from its upper left corner, in 2^-24 of the pixel
    real scatter;       // which digits of that are flipped, for each pixel others (camera.glsl): all, -1, or none, 0.
                        // Not an int: llvmpipe mixes up a double, the next one, that shares its slot with none.
    real pixelScale;    // tan(fov/2) / H
    vec3 ambient;
    vec3 background;
    int firstPlane;     // how many spheres there are (surfaces.glsl)
    int grid;           // cells of a side of each hemisphere around a light (lists.glsl)
    float depthScale;   // of distances, so that those of all objects of common shapes (raytracer/compiler/batches.py) are below 1
#ifdef SPHERE_LIGHTS
    int lightIndex;     // of the point on each light (sobol.glsl)
#endif
};

uniform Draw draw;
#ifdef SAMPLES
uniform vec2 samplePlaces[SAMPLES];  // where each sample lies, if there are several
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

// Where a point of the picture, in pixels from its lower left, is in the viewport.
vec4 placeOf(vec2 pixel) {
    return vec4(2.0 * (pixel - draw.viewport.xy) / draw.viewport.zw - 1.0, 0.0, 1.0);
}
