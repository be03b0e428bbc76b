// The place of a light in the window: a disk of the light's colour, or only a ring where the light
// itself is out of view. White and black rims are seen on every ground.

#include "srgb.glsl"

uniform vec2 center;    // pixels of the window
uniform float radius;   // pixels
uniform vec3 fill;      // linear, in [0, 1]
uniform bool inView;

out vec4 color;

const vec3 BLACK = vec3(0.0), WHITE = vec3(1.0);
// Where the black rim, the white rim and the ring's hole begin, as shares of the radius.
const float RIM = 0.8, INNER_RIM = 0.6, HOLE = 0.4;

void main() {
    float r = length(gl_FragCoord.xy - center) / radius;
    if (r > 1.0 || (!inView && r < HOLE)) discard;
    color = vec4(r > RIM ? BLACK : r > INNER_RIM ? WHITE : inView ? srgbFromLinear(fill) : BLACK, 1.0);
}
