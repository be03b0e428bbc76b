// Provides shadow(): the lecture's S for a point light at the end of a ray from a surface:
// 1 lit, 0 where something is in between.

float shadow(Ray ray, int light) {
    return blockedAt(ray, light) < ray.distance ? 0.0 : 1.0;
}
