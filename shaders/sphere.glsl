// Provides sphereSpan(): where a ray is inside a ball.
//
// Returns (t0, t1), the ray's two roots along its whole line, t0 < t1, also behind the origin;
// (INF, -INF) for a miss. A tangent ray misses.
//
// The discriminant is r^2 - |perp|^2 with perp the part of center - ro across the ray (Hearn and
// Baker 2004; Haines et al., Ray Tracing Gems 2019, ch. 7): unlike b^2 - c it does not square the
// distance to the sphere, so a small far sphere keeps its bits. Its error is a few units in the
// last place of |center - ro|.

#include "ray.glsl"

vec2 sphereSpan(Ray ray, vec3 center, float radius) {
    if (leavesSphere(ray, vec4(center, radius))) {
        float chord = -2.0 * radius * dot(ray.n, ray.rd);
        return vec2(min(chord, 0.0), max(chord, 0.0));
    }
    vec3 toCenter = center - ray.ro;
    float along = dot(toCenter, ray.rd);
    vec3 perp = toCenter - along * ray.rd;
    float discriminant = radius * radius - dot(perp, perp);
    if (discriminant <= 0.0) return vec2(INF, -INF);
    float halfChord = sqrt(discriminant);
    return vec2(along - halfChord, along + halfChord);
}
