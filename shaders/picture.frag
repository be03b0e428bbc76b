// The light that reaches the camera, in one pass: visibility.frag and shade.frag in one, for what is
// quickly found.

#include "scene.glsl"
#include "lighting.glsl"

uniform vec3 background;

out vec4 radiance;

void main() {
    Ray view = cameraRay();
    real3 P, N;
    int mat;
    rayCSG(view, P, N, mat);
    radiance = vec4(mat == 0 ? background : radianceAt(mat, view), 1.0);
}
