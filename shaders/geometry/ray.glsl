// Rays, and the surfaces that their ends are known to lie on.
// Provides INF, struct Contact, struct Ray.
//
// All of shaders/ works in view space: the camera is at the origin, +x right, +y up, looking
// along -z. The host brings the scene there in float64. So nothing depends on how far a scene is
// from its own origin, a camera ray starts at exactly 0, and the small sideways parts of its
// direction keep all their bits however narrow the field of view.

#include "geometry/real.glsl"

// Further than any root: lengths are at most 1e12, and a ray that is all but parallel to a plane
// is clamped to this.
const real INF = 1e30;

// A surface that an end of a ray is known to lie on.
struct Contact {
    int surface;  // the number that it and all that coincide with it have, sameAs() of terms.glsl; 0 for none
    real3 n;      // its outward unit normal there
};

// A half-line ro + t rd, t > 0.
//
// A shadow ray says which surface it leaves, and which one the light at its other end lies on, if
// any: there one root is known to be exactly 0, or exactly `distance`, and the other follows from the
// normal without cancellation. So no shadow ray is pushed off its surface by a bias, and a
// light on a surface, which ends all roads to it, is in the shadow of none. For the camera's rays
// the host knows more: see terms.glsl.
struct Ray {
    real3 ro;
    real3 rd;       // unit to rounding
    bool ofCamera;  // whether it is this fragment's camera ray
    Contact start;
    Contact end;    // at t = distance
    real distance;
};
