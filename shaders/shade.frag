// The light that reaches the camera from what each pixel sees.

#include "scene.glsl"
#include "lighting.glsl"

uniform isampler2D surface;  // from visibility.frag
uniform vec3 background;

out vec4 radiance;

void main() {
    int mat = texelFetch(surface, ivec2(gl_FragCoord.xy), 0).x;
    radiance = vec4(mat == 0 ? background : radianceAt(mat, cameraRay()), 1.0);
}
