// The normal of the visible surface, as a colour.
// The colour is 0.5 + 0.5 N in sRGB, where N is the unit normal in world space: x red, y green, z blue; black if no
// surface is visible.

#include "window/srgb.glsl"

uniform sampler2D normalDepth;  // from visibility.frag
uniform isampler2D surface;
uniform mat3 toWorld;           // from view space

out vec4 radiance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 N = toWorld * texelFetch(normalDepth, pixel, 0).xyz;
    bool hit = texelFetch(surface, pixel, 0).x != 0;
    radiance = vec4(hit ? linearFromSrgb(0.5 + 0.5 * N) : vec3(0.0), 1.0);
}
