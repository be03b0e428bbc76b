// Hard shadows: the lecture's factor S is 1 for a visible light and 0 for an occluded one.
// Provides shadow(), for a ray from a surface to a point light. Soft shadows use it for one point of the light.

float shadow(Ray ray, int light) {
    return blockedAt(ray, light) < ray.distance ? 0.0 : 1.0;
}
