// Both passes in one: the light that reaches the camera, for scenes of few primitives and for plane-only cells.
// A plane-only cell sees nothing but half-spaces, and no other object casts a shadow there (raytracer/compiler/culling.py).
// If the host defines SAMPLES, it is the sum of so many samples.

#include "scene.glsl"
#include "shading/lighting.glsl"
#ifdef MANY_ROUNDS
#include "passes/cut_short.glsl"
#endif

flat in vec3 background;

out vec4 radiance;  // and, in a, its squared length: the sums of both tell their error (error.frag)

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
    return vec4(c, dot(c, c));
}

void main() {
#ifdef SAMPLES
    // Written out: in a loop llvmpipe takes as long as for one sample after another.
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
    if (isCutShort()) radiance = vec4(-INF);  // as in shade.frag
#endif
}
