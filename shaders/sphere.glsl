// Provides sphereSpan(), powerOf(): where a ray is inside a ball.
//
// Returns (t0, t1), the ray's two roots along its whole line, t0 < t1, also behind the origin;
// (INF, -INF) for a miss. A tangent ray misses.
//
// `power` is |center - ro|^2 - radius^2, the power of the ray's origin: the product of the two
// roots. The host knows it in float64 for camera rays (terms.glsl), which keeps the bits that
// float32 would lose beside a huge sphere; powerOf() is for all others.
//
// Far from the sphere the discriminant is r^2 - |perp|^2 with perp the part of center - ro across
// the ray (Hearn and Baker 2004; Haines et al., Ray Tracing Gems 2019, ch. 7), which does not
// square the distance, so a small far sphere keeps its bits; its error is a few units in the last
// place of |center - ro|. Where the sphere's middle is nearer than its radius, along^2 - power has
// the smaller terms to subtract. The nearer root comes from the product, without cancellation
// (Press et al., Numerical Recipes, ch. 5.6).

#include "ray.glsl"

float powerOf(vec3 ro, vec3 center, float radius) {
    float distance = length(center - ro);
    return (distance - radius) * (distance + radius);
}

vec2 sphereSpan(Ray ray, vec3 center, float radius, float power) {
    if (leavesSphere(ray, vec4(center, radius))) {
        float chord = -2.0 * radius * dot(ray.n, ray.rd);
        return vec2(min(chord, 0.0), max(chord, 0.0));
    }
    vec3 toCenter = center - ray.ro;
    float along = dot(toCenter, ray.rd);
    vec3 perp = toCenter - along * ray.rd;
    float discriminant =
        abs(along) < radius ? along * along - power : radius * radius - dot(perp, perp);
    if (discriminant <= 0.0) return vec2(INF, -INF);
    float halfChord = sqrt(discriminant);
    float outer = along < 0.0 ? along - halfChord : along + halfChord;
    float inner = power / outer;
    return vec2(min(inner, outer), max(inner, outer));
}
