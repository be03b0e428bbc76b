// The irradiance of a surface that faces a light, with the light's falloff.
// Provides irradiance(): the light's colour I, or I / distance^2 if the falloff is 1. `distance` is the distance to the
// light's centre, in the scene's unit of length. Inside a sphere light the irradiance is that on the light's sphere.

#include "shading/light.glsl"

// The square of the smallest length that a scene may have, 1e-12 (raytracer/core/validation.py).
const float LEAST_SQUARE = 1e-24;

uniform float mostLight;  // the upper bound of colours, so that no sum of lights and samples overflows

vec3 irradiance(Light light, real distance) {
#ifdef SPHERE_LIGHTS
    distance = max(distance, light.radius);
#endif
    if (light.falloff == 0) return light.color;
    if (light.falloff == 1) return min(light.color / max(float(distance * distance), LEAST_SQUARE), mostLight);
    return vec3(mostLight, 0.0, mostLight);  // a new falloff without a formula here: the picture shows it
}
