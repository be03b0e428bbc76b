// Provides shadow(): the lecture's S for a point light at `distance` along a ray from a surface:
// 1 lit, 0 where something is in between.

float shadow(Ray ray, float distance) {
    return firstBlocker(ray, distance) < distance ? 0.0 : 1.0;
}
