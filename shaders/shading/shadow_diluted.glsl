// Diluted shadows: the lecture's factor S is smaller the nearer the occluder is to the surface.
// Provides shadow(), for a ray from a point P of a surface to a point light: 1 if the light is visible, else
// dist(P, Q) / distance, Q the first occluding point.

float shadow(Ray ray, int light) {
    return min(float(blockedAt(ray, light) / ray.distance), 1.0);
}
