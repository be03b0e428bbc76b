// The light that reaches the camera from what each pixel sees.

#include "scene.glsl"
#include "lighting.glsl"

uniform isampler2D surface;  // from visibility.frag
flat in vec3 background;

out vec4 radiance;  // and, in a, its squared length: the sums of both tell their error (error.frag)

void main() {
    int mat = texelFetch(surface, ivec2(gl_FragCoord.xy), 0).x;
    vec3 c = mat == 0 ? background : radianceAt(mat, cameraRay());
    radiance = vec4(c, dot(c, c));
}
