// Provides INF, struct Ray, leavesSphere(), leavesPlane().
//
// All of shaders/ works in view space: the camera is at the origin, +x right, +y up, looking
// along -z. The host brings the scene there in float64. So nothing depends on how far a scene is
// from its own origin, a camera ray starts at exactly 0, and the small sideways parts of its
// direction keep all their bits however narrow the field of view.

#include "real.glsl"

// Further than any root: lengths are at most 1e12, and a ray that is all but parallel to a plane
// is clamped to this.
const real INF = 1e30;

// What surface a ray's origin is known to lie on.
const int NONE = 0, SPHERE = 1, PLANE = 2;

// A half-line ro + t rd, t > 0.
//
// A ray that leaves a surface (a shadow ray) says which one: for that surface one root is known
// to be exactly 0, and the other follows from the normal without cancellation. So no shadow ray
// is pushed off its surface by a bias. For the camera's rays the host knows more: see terms.glsl.
struct Ray {
    real3 ro;
    real3 rd;       // unit to rounding
    bool ofCamera;  // whether it is this fragment's camera ray
    int leaves;     // NONE, SPHERE or PLANE
    real4 surface;  // that sphere (center, radius) or plane (normal, offset)
    real3 n;        // and its outward unit normal at ro
};

// Whether the ray starts on this very surface, or on one that coincides with it.
bool leavesSphere(Ray ray, real4 sphere) {
    return ray.leaves == SPHERE && ray.surface == sphere;
}

bool leavesPlane(Ray ray, real4 plane) {
    return ray.leaves == PLANE && (ray.surface == plane || ray.surface == -plane);
}
