// Provides shadow(): the lecture's diluted S for a point light at the end of a ray from a surface
// at P: 1 lit, or dist(P, Q) / distance with Q the first point that is in between.

float shadow(Ray ray, int light) {
    return min(float(blockedAt(ray, light) / ray.distance), 1.0);
}
