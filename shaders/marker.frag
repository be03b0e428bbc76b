// The place of a light in the window: a disk of the light's colour, or only a ring where the light
// itself is out of view. White and black rims are seen on every ground.

#include "srgb.glsl"

uniform vec2 center;    // pixels of the window
uniform float radius;   // pixels
uniform vec3 fill;      // linear, in [0, 1]
uniform bool inView;

out vec4 color;

void main() {
    float r = length(gl_FragCoord.xy - center) / radius;
    if (r > 1.0 || (!inView && r < 0.4)) discard;
    color = vec4(r > 0.8 ? vec3(0.0) : r > 0.6 ? vec3(1.0) : inView ? srgbFromLinear(fill) : vec3(0.0), 1.0);
}
