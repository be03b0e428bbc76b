// Provides lights[]: point lights of the lecture, not attenuated by distance, in view space.

#include "real.glsl"

struct Light {
    real3 position;
    vec3 color;  // I, linear RGB >= 0
    int on;      // the surface that it lies on, numbered as in hit.glsl; 0 for none
};

layout(std140) uniform Lights {
    Light lights[LIGHTS];
};
