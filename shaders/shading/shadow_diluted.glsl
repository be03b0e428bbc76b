// Diluted shadows: the lecture's factor S is smaller the nearer the occluder is to the surface.
// Provides shadow(), for a ray from a point P of a surface to the light number `light`, a point: 1 if the light is
// visible, else dist(P, Q) / distance, where Q is the first occluding point.
// Needs the generated blockedAt(), the distance from P to Q, or to the light.

float shadow(Ray ray, int light) {
    return min(float(blockedAt(ray, light) / ray.distance), 1.0);
}
