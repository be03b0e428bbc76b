// The parts of the CSG walk along a ray, from root to root, which keeps no hit lists.
// Provides holds(), isInside(), isBefore(), for the generated walk of all evaluators but `roth`. `span` holds the two
// roots of a primitive along the ray, and t is a distance along the ray.
//
// Just after the distance t the ray is inside or outside a solid, and stays so for a while. holds() gives both facts in
// one number: the distance up to which the state is sure to hold, positive if inside and negative if outside. So the
// CSG operators work as for signed distances:
//     A & B: min(a, b)        A | B: max(a, b)        not A: -a
// For example, outside both operands, an intersection's state holds up to the later of the two distances; inside one
// operand, a union's state holds up to the end of that operand. The walk then goes on from there, until the sign
// changes: there, and only there, is a surface of the solid.

#include "geometry/ray.glsl"

// The distance up to which the state just after t holds: positive inside the primitive, negative outside.
real holds(real2 span, real t) {
    return t < span.x ? -span.x : t < span.y ? span.y : -INF;
}

// Whether the ray is inside the primitive just after t: a root at t counts if the ray enters there.
bool isInside(real2 span, real t) {
    return span.x <= t && t < span.y;
}

// Whether the ray is inside the primitive just before t.
bool isBefore(real2 span, real t) {
    return span.x < t && t <= span.y;
}
