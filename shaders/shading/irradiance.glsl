// Provides irradiance(): what a light gives a surface that faces it, at a distance of its centre: I, or, where its falloff
// is 1, I / distance^2. On a sphere light that is as much as inside it.

#include "shading/light.glsl"

// The smallest length that a scene has, 1e-12, squared; and the most that colours are (raytracer/checks.py), so that
// no sum of lights and samples overflows.
const float LEAST_SQUARE = 1e-24, MOST = 1e12;

vec3 irradiance(Light light, real distance) {
#ifdef SPHERE_LIGHTS
    distance = max(distance, light.radius);
#endif
    if (light.falloff == 0) return light.color;
    return min(light.color / max(float(distance * distance), LEAST_SQUARE), MOST);
}
