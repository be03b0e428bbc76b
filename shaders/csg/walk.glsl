// Provides holds(), isInside(), isBefore(): what the generated walk along a ray is made of.
//
// The evaluators but for roth carry no hit lists. Just after the distance t a ray is in a solid or not,
// and that holds on for a while: holds() says both in one number, the distance until which it surely
// holds, positive inside and negative outside. So the operators are those of signed distances:
//     A & B: min(a, b)        A | B: max(a, b)        not A: -a
// Outside both, an intersection holds until the later one; inside one, a union holds until that
// one's end; and so on. The walk goes on from there until the sign changes: there, and only there, is a
// surface. All roots at the same t are crossed at once, so coincident faces are one face or none.

#include "geometry/ray.glsl"

real holds(real2 span, real t) {
    return t < span.x ? -span.x : t < span.y ? span.y : -INF;
}

// Whether the ray is inside the primitive just after t: entries count, exits do not.
bool isInside(real2 span, real t) {
    return span.x <= t && t < span.y;
}

// Whether it is inside just before t.
bool isBefore(real2 span, real t) {
    return span.x < t && t <= span.y;
}
