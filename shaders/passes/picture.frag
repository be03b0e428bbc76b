// The light that reaches the camera, in one pass: visibility.frag and shade.frag in one, for what is
// quickly found.

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
