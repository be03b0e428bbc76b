// Rays, and the surfaces that their ends are known to lie on.
// Provides INF, struct Contact, struct Ray.
//
// All of shaders/ works in view space: the camera is at the origin, +x is right, +y is up, and the camera looks along
// -z. The host transforms the scene in float64. So nothing depends on how far a scene is from its own origin. A camera
// ray starts at exactly 0, and the small sideways parts of its direction keep all their bits, however narrow the field
// of view.

#include "geometry/real.glsl"

// A distance beyond any root. Lengths are at most 1e12, and the root of a ray that is nearly parallel to a plane is
// clamped to INF.
const real INF = 1e30;

// A surface that an end of a ray is known to lie on.
struct Contact {
    int surface;  // its coincidence number, which all surfaces at its place share, sameAs() of terms.glsl; 0 for none
    real3 n;      // its outward unit normal there
};

// A half-line ro + t rd with t > 0, in view space.
//
// A shadow ray names the surface that it starts on, and the surface, if any, that the light at its other end lies on.
// On these surfaces one root is known to be exactly 0, or exactly `distance`, and the other root follows from the
// normal without cancellation. So no shadow ray needs a bias (epsilon) against self-shadowing, and the root at the
// light does not block the light. For camera rays the host computes more terms: see terms.glsl.
struct Ray {
    real3 ro;
    real3 rd;       // unit to rounding
    bool ofCamera;  // whether it is this fragment's camera ray in perspective, which starts at the origin
    Contact start;
    Contact end;    // at t = distance
    real distance;
};
