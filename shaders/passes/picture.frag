// Both passes in one: the light that reaches the camera, for scenes of few primitives and for plane-only cells.
// In a plane-only cell nothing but half-spaces is visible, and no other object casts a shadow
// (raytracer/compiler/grounds.py). If the host defines SAMPLES, the result is the sum of that many samples.
// If it defines TRANSPARENT, the background does not count where the camera sees it directly.

#include "scene.glsl"
#include "shading/lighting.glsl"
#ifdef MANY_ROUNDS
#include "passes/cut_short.glsl"
#endif

flat in vec3 background;

#ifdef TRANSPARENT
layout(location = 0) out vec4 radiance;
layout(location = 1) out float coverage;  // 1 where a surface is visible, 0 where only the background is
#else
out vec4 radiance;  // linear RGB; .a is its squared length, and the sums of both give the error (error.frag)
#endif

vec4 sampled() {
    Ray view = cameraRay();
    real3 P, N;
    int mat;
    rayCSG(view, P, N, mat);
#ifdef BOUNCES
    vec3 c = radianceByMirrors(mat, view, background);
#else
    vec3 c = mat == 0 ? background : radianceAt(mat, view);
#endif
#ifdef TRANSPARENT
    if (mat == 0) c = vec3(0.0);
    coverage += mat == 0 ? 0.0 : 1.0;
#endif
    return vec4(c, dot(c, c));
}

void main() {
#ifdef TRANSPARENT
    coverage = 0.0;
#endif
#ifdef SAMPLES
    // The samples are written out: in a loop they would take llvmpipe as long as separate draws.
    samplePlace = samplePlace0;
    radiance = sampled();
    samplePlace = samplePlace1;
    radiance += sampled();
    samplePlace = samplePlace2;
    radiance += sampled();
    samplePlace = samplePlace3;
    radiance += sampled();
#else
    radiance = sampled();
#endif
#ifdef MANY_ROUNDS
    if (isCutShort()) radiance = vec4(-INF);  // the host's sign that the pixel is wrong (shade.frag)
#endif
}
