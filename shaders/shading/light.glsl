// The lights of the scene, in view space.
// Provides struct Light, lights[]. The host defines SPHERE_LIGHTS if any light has a radius, and FALLOFF if any light
// is attenuated with distance.

#include "geometry/real.glsl"

struct Light {
    real3 position;
    int on;      // coincidence number (sameAs(), terms.glsl) of the surface that the light lies on; 0 for none
    real3 n;     // the outward unit normal of that surface at the light
#ifdef SPHERE_LIGHTS
    real radius; // 0 for a point light; for others, `on` is the light's own sphere in the scene, and n is unused
#endif
    vec3 color;  // I, linear RGB >= 0
#ifdef FALLOFF
    int falloff; // 0: none, 1: by the square of the distance (irradiance.glsl)
#endif
};

layout(std140) uniform Lights {
    Light lights[LIGHTS];
};

// The vertex shader (draw.glsl) hands on the lights that a text names. If the driver has too few varyings for them, the
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
