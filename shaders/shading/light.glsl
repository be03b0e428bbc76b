// The lights of the scene, in view space.
// Provides struct Light, lights[]. If the host defines SPHERE_LIGHTS, some have a radius; if FALLOFF, some are
// attenuated.

#include "geometry/real.glsl"

struct Light {
    real3 position;
    int on;      // sameAs() of the surface that it lies on (terms.glsl); 0 for none
    real3 n;     // and that surface's outward unit normal there
#ifdef SPHERE_LIGHTS
    real radius; // 0 for a point; of others `on` is the sphere that is the light's own, and n is not given
#endif
    vec3 color;  // I, linear RGB >= 0
#ifdef FALLOFF
    int falloff; // see irradiance.glsl
#endif
};

layout(std140) uniform Lights {
    Light lights[LIGHTS];
};

// The vertex shader (draw.glsl) hands on the lights that a text names. If the driver has no room for them there, the
// host defines FETCHED_LIGHTS.
#if !defined(VERTEX) && LIGHTS <= 2
#ifdef FETCHED_LIGHTS
#define light0 lights[0]
#define light1 lights[1]
#else
flat in Light light0;
#if LIGHTS == 2
flat in Light light1;
#endif
#endif
#endif
