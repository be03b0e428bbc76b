// Both passes in one: the light that reaches the camera, for plane-only cells.
// Such a cell sees nothing but half-spaces, and no other object casts a shadow there (raytracer/compiler/culling.py).

#include "scene.glsl"
#include "shading/lighting.glsl"
#ifdef MANY_ROUNDS
#include "passes/cut_short.glsl"
#endif

flat in vec3 background;

out vec4 radiance;  // and, in a, its squared length: the sums of both tell their error (error.frag)

void main() {
    Ray view = cameraRay();
    real3 P, N;
    int mat;
    rayCSG(view, P, N, mat);
    vec3 c = mat == 0 ? background : radianceAt(mat, view);
    radiance = vec4(c, dot(c, c));
#ifdef MANY_ROUNDS
    if (isCutShort()) radiance = vec4(-INF);  // as in shade.frag
#endif
}
