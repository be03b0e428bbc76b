// Provides INF, struct Ray, ray(), leavesSphere(), leavesPlane().
//
// All of shaders/ works in view space: the camera is at the origin, +x right, +y up, looking
// along -z. The host brings the scene there in float64, so that a camera ray starts at exactly
// 0 and nothing depends on how far a scene is from its own origin.

// Further than any root: lengths are at most 1e12, and a ray that is all but parallel to a plane
// is clamped to this.
const float INF = 1e30;

// A half-line ro + t rd, t > 0.
//
// A ray that leaves a surface (a shadow ray) says which one: for that surface one root is known
// to be exactly 0, and the other follows from the normal without cancellation. So no shadow ray
// is pushed off its surface by a bias.
struct Ray {
    vec3 ro;
    vec3 rd;       // unit
    bool leaves;   // whether ro lies on a surface, the one below
    vec4 surface;  // its sphere (center, radius) or plane (normal, offset)
    bool isSphere; // which of the two
    vec3 n;        // its outward unit normal at ro
};

Ray ray(vec3 ro, vec3 rd) {
    return Ray(ro, rd, false, vec4(0.0), false, vec3(0.0));
}

// Whether the ray starts on this very surface, or on one that coincides with it.
bool leavesSphere(Ray ray, vec4 sphere) {
    return ray.leaves && ray.isSphere && ray.surface == sphere;
}

bool leavesPlane(Ray ray, vec4 plane) {
    return ray.leaves && !ray.isSphere && (ray.surface == plane || ray.surface == -plane);
}
