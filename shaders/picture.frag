// The light that reaches the camera, in one pass: visibility.frag and shade.frag in one, for what is
// quickly found. If there is nothing to be seen, the host defines EMPTY.

#include "camera.glsl"
#ifndef EMPTY
#include "scene.glsl"
#include "lighting.glsl"
#endif

uniform vec3 background;

out vec4 radiance;

void main() {
    radiance = vec4(background, 1.0);
#ifndef EMPTY
    Ray view = cameraRay();
    real3 P, N;
    int mat;
    rayCSG(view, P, N, mat);
    if (mat != 0) radiance.rgb = radianceAt(mat, view);
#endif
}
