// Hard shadows: the lecture's factor S is 1 for a visible light and 0 for an occluded one.
// Provides shadow(), for a ray from a surface to the light number `light`, a point. Soft shadows use it too: each
// sample tests one point on the light.
// Needs the generated blockedAt(), the distance to the first occluding point, or to the light.

float shadow(Ray ray, int light) {
    return blockedAt(ray, light) < ray.distance ? 0.0 : 1.0;
}
