// Pass 2: the light that reaches the camera from the surface that each pixel sees.
// If the host defines OVER_PLANES, `surface` leaves out half-spaces, all surfaces in it are nearer than the
// half-spaces, and this pass finds the half-spaces itself.
// If it defines TRANSPARENT, the background does not count where the camera sees it directly.

#include "scene.glsl"
#include "shading/lighting.glsl"
#ifdef MANY_ROUNDS
#include "passes/cut_short.glsl"
#endif

uniform isampler2D surface;  // from visibility.frag
flat in vec3 background;

#ifdef TRANSPARENT
layout(location = 0) out vec4 radiance;
layout(location = 1) out float coverage;  // 1 where a surface is visible, 0 where only the background is
#else
out vec4 radiance;  // linear RGB; .a is its squared length, and the sums of both give the error (error.frag)
#endif

void main() {
    Ray view = cameraRay();
    int mat = texelFetch(surface, ivec2(gl_FragCoord.xy), 0).x;
#ifdef MANY_ROUNDS
    bool wrong = mat == CUT_SHORT;
    if (wrong) mat = 0;
#endif
#ifdef OVER_PLANES
    if (mat == 0) {
        real3 P, N;
        rayCSG(view, P, N, mat);
    }
#endif
#ifdef BOUNCES
    vec3 c = radianceByMirrors(mat, view, background);
#else
    vec3 c = mat == 0 ? background : radianceAt(mat, view);
#endif
#ifdef TRANSPARENT
    if (mat == 0) c = vec3(0.0);
    coverage = mat == 0 ? 0.0 : 1.0;
#endif
    radiance = vec4(c, dot(c, c));
#ifdef MANY_ROUNDS
    // No light is negative, so a sum of -INF tells the host that the pixel is wrong, whatever other samples add.
    if (wrong || isCutShort()) radiance = vec4(-INF);
#endif
}
