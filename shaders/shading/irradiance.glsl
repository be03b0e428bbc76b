// The irradiance of a surface that faces a light, with the light's falloff.
// Provides irradiance(): I, or I / distance^2 if the falloff is 1. `distance` is the distance to the light's centre.
// Inside a sphere light the irradiance is that on its sphere.

#include "shading/light.glsl"

// The smallest length that a scene has, 1e-12, squared (raytracer/core/validation.py).
const float LEAST_SQUARE = 1e-24;

uniform float mostLight;  // the most that colours are, so that no sum of lights and samples overflows

vec3 irradiance(Light light, real distance) {
#ifdef SPHERE_LIGHTS
    distance = max(distance, light.radius);
#endif
    if (light.falloff == 0) return light.color;
    return min(light.color / max(float(distance * distance), LEAST_SQUARE), mostLight);
}
