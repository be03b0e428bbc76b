// Provides lights[]: point lights of the lecture, not attenuated by distance, in view space.

#include "real.glsl"

struct Light {
    real3 position;
    int on;      // sameAs() of the surface that it lies on (terms.glsl); 0 for none
    real3 n;     // and that surface's outward unit normal there
    vec3 color;  // I, linear RGB >= 0
};

layout(std140) uniform Lights {
    Light lights[LIGHTS];
};

// Those that a text names itself it has from the vertex shader (draw.glsl).
#if !defined(VERTEX) && LIGHTS <= 2
flat in Light light0;
#if LIGHTS == 2
flat in Light light1;
#endif
#endif
