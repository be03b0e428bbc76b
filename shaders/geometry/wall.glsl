// Parts that all curved walls share: a wall is the set of zeros of a function of four affine forms.
// Provides wallPower(), wallSpeed(), wallGradient(). All vectors and lengths are in view space.
//
// A form is l(x) = dot(w, x) + c. Along a ray the forms are l = p + t d: p are their values at the ray's origin, and d
// are their slopes along ray.rd. The round and the cone walls bound the points with |(l1, l2, l3)| <= l0 (second-order
// cones). The values of all forms are lengths, and each |w| is at most 1.

#include "geometry/ray.glsl"

// The power of a point with the forms l: the product l0^2 - |(l1, l2, l3)|^2, which is positive inside. The host knows
// the power of the camera to more bits.
real wallPower(real4 l) {
    return l.x * l.x - dot(l.yzw, l.yzw);
}

// The length of the slopes d. Along the axis of a cylinder or nearly so, its square may be below the least number. So
// it is scaled by 2^60, and is right from 1e-36 to 1.
real wallSpeed(real4 d) {
    const real SCALE = 1152921504606846976.0;
    return length(d * SCALE) / SCALE;
}

// Minus half the gradient of the power at the point with the forms l. On a wall, it points outwards. w0 to w3 are the
// gradients of the forms.
real3 wallGradient(real4 l, real3 w0, real3 w1, real3 w2, real3 w3) {
    return l.y * w1 + l.z * w2 + l.w * w3 - l.x * w0;
}
