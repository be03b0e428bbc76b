// Provides isInside(), isBefore(), nextRoot(): what the generated walk along a ray is made of.
//
// The default evaluator carries no hit lists. Every primitive keeps its two roots (span.x,
// span.y); the walk goes from root to root, evaluates the object's tree just after each, and
// stops where that changes: there, and only there, is a surface. All roots at the same t are
// crossed at once, so coincident faces are one face or none, as in roth.glsl.

#include "real.glsl"

// Whether the ray is inside the primitive just after t: entries count, exits do not.
bool isInside(real2 span, real t) {
    return span.x <= t && t < span.y;
}

// Whether it is inside just before t.
bool isBefore(real2 span, real t) {
    return span.x < t && t <= span.y;
}

// The nearer of `next` and the first root of the span after t.
real nextRoot(real2 span, real t, real next) {
    if (span.x > t) next = min(next, span.x);
    if (span.y > t) next = min(next, span.y);
    return next;
}
