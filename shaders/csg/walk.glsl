// The parts of the CSG walk along a ray, from root to root, which keeps no hit lists.
// Provides holds(), isInside(), isBefore(), for the generated walk of all evaluators but roth.
//
// Just after the distance t the ray is inside a solid or outside, and it stays so for a while. holds() gives both
// in one number: the distance until which the state surely holds, positive inside and negative outside. So the
// operators are those of signed distances:
//     A & B: min(a, b)        A | B: max(a, b)        not A: -a
// Outside both operands, an intersection holds until the later of the two distances; inside one, a union holds
// until that one ends; and so on. The walk goes on from there until the sign changes: there, and only there, is a

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
