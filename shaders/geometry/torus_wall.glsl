// The intersection of a ray with a torus: up to two intervals, and the normals at their ends.
// Provides torusRoots(), torusEnds(), torusGradient(), torusNormal(). All vectors and lengths are in view space.
//
// The torus has the points with (hypot(l1, l2) - 1)^2 + l3^2 <= l0^2 for a constant l0 < 1. `p` and `d` are the forms
// of wall.glsl along the ray, so d.x is 0. l1, l2, l3 are the coordinates in the torus's frame in units of the major
// radius, and l0 is the minor radius in the same unit. w1 to w3 are the gradients of the forms. A ray has up to two
// intervals in the torus, its parts 0 and 1 in their order along the ray.
//
// With the unit direction e = (d1, d2, d3) / |d| and the point m of the ray nearest to the centre, the points of the
// ray are m + s e. Where Q(s) = s^4 + 2 P s^2 + 4 K s + C is negative, they are in the torus. The quartic has no cubic
// term, so the zeros of its derivative are those of a depressed cubic. They split the ray into brackets of one root
// each. In a bracket, Newton's method finds the root of
//     F(s) = (rho - 1)^2 - (l0 - z)(l0 + z),
// whose sign is that of Q, and whose terms are small near the tube: rho is the distance from the axis, and z the
// height.
//
// Error bounds. u is 2^-24 (2^-53 for doubles); |dp|, |dd| and |de| are as in round_wall.glsl. All lengths of the
// torus's frame are below 2.
//     |dm| <= 2 |dB| + 4 u |m|, with |dB| of round_wall.glsl: the error of the ray's place
//     |dF| <= 2 l0 (|dm| + 2 |de| + 4 u) + 4 u l0^2 at a root
//     |ds| <= |dF| / |F'|, to first order;  |dt| <= (|ds| + |d along|) / |d| + |t| (|dd| / |d| + 4 u)
// The number of roots is in doubt where F at one of the zeros of Q' is within |dF| of 0.
// raytracer/analysis/rounding_bounds.py evaluates these bounds, and the tests check the roots against them.

#include "geometry/wall.glsl"

// Steps of Newton's method from the first guesses, which have float32's bits or fewer: each step doubles the number of
// right bits. Near a tangent the first steps only halve the distance to the root. The last step is shorter than
// ROOT_ERROR, the rounding of a length in the torus's frame: about 3 u.
#ifdef DOUBLES
const int CUBIC_STEPS = 5, ROOT_STEPS = 16;
const real ROOT_ERROR = 4.0e-16;
#else
const int CUBIC_STEPS = 3, ROOT_STEPS = 12;
const real ROOT_ERROR = 2.0e-7;
#endif

// A ray in the torus's frame.
struct TorusRay {
    real minor;   // l0
    real speed;   // |d|
    real3 e;      // unit direction
    real3 m;      // the point nearest to the centre
    real middle;  // its place on the ray
};

TorusRay torusRay(real4 p, real4 d) {
    real speed = length(d.yzw);
    real3 e = d.yzw / speed;
    return TorusRay(p.x, speed, e, cross(e, cross(p.yzw, e)), -dot(p.yzw, e));
}

// F at s, and half its derivative.
real2 torusValue(TorusRay ray, real s) {
    real3 x = ray.m + s * ray.e;
    real rho = length(x.xy), off = rho - 1.0;
    // On the axis the direction from it is arbitrary.
    real growth = rho > 0.0 ? dot(x.xy, ray.e.xy) / rho : length(ray.e.xy);
    return real2(off * off - (ray.minor - x.z) * (ray.minor + x.z), off * growth + x.z * ray.e.z);
}

// The zero of s^3 + P s + K that is farthest from 0. The two others have the opposite sign, so it is simple.
real outerZero(real P, real K) {
    // Cardano's and Viete's formulas in float32 give the first guess; OpenGL has no such functions of doubles.
    float linear = float(P) / 3.0, constant = abs(float(K)) / 2.0;
    float square = constant * constant + linear * linear * linear;
    float guess;
    if (square >= 0.0) {
        float cube = pow(constant + sqrt(square), 1.0 / 3.0);
        guess = cube > 0.0 ? cube - linear / cube : 0.0;
    } else {
        float scale = sqrt(-linear);
        guess = 2.0 * scale * cos(acos(clamp(constant / (scale * scale * scale), 0.0, 1.0)) / 3.0);
    }
    real s = K > 0.0 ? -guess : guess;
    for (int i = 0; i < CUBIC_STEPS; i++) {
        real slope = 3.0 * s * s + P;
        if (slope > 0.0) s -= ((s * s + P) * s + K) / slope;
    }
    return s;
}

// The root of F between `outside`, where F >= 0, and `inside`, where F <= 0. The first guess is `s`.
real torusRoot(TorusRay ray, real outside, real inside, real s) {
    // Compilers do not unroll a loop with such a count. An unrolled loop would take all steps for all pixels.
    for (int left = 1 << (ROOT_STEPS - 1); left != 0; left >>= 1) {
        real2 F = torusValue(ray, s);
        if (F.x > 0.0) outside = s; else inside = s;
        real next = s - 0.5 * F.x / F.y;
        bool kept = next >= min(outside, inside) && next <= max(outside, inside);
        real before = s;
        s = kept ? next : 0.5 * (outside + inside);
        if (abs(s - before) <= ROOT_ERROR) break;
    }
    return s;
}

// The half of a chord through the point at s, by the parabola that has F's value and Q's shape there.
real halfChord(TorusRay ray, real F, real P, real s) {
    real rho = length(ray.m.xy + s * ray.e.xy);
    real H = (rho + 1.0) * (rho + 1.0);  // Q = F (H + z^2 - l0^2)
    real curvature = 6.0 * s * s + 2.0 * P;  // half of Q's second derivative
    return curvature > 0.0 ? sqrt(max(-F * H / curvature, 0.0)) : real(0.0);
}

// Both intervals of the ray's whole line, .xy and .zw; (INF, -INF) for one that the ray does not have. Only the roots
// from number `first` to `end` - 1 of the four are computed.
real4 torusRoots(real4 p, real4 d, int first, int end) {
    TorusRay ray = torusRay(p, d);
    real square = dot(ray.m, ray.m), reach = (1.0 + ray.minor) * (1.0 + ray.minor) - square;
    // All points of the torus are within +-far. The factor covers the rounding of reach.
    real far = sqrt(max(reach, 0.0)) * 1.00001 + 0.00001;
    real P = square + (1.0 - ray.minor) * (1.0 + ray.minor) - 2.0 * dot(ray.e.xy, ray.e.xy);
    real K = 2.0 * ray.m.z * ray.e.z;
    real outer = outerZero(P, K);
    // The two other zeros are those of s^2 + outer s + (outer^2 + P).
    real others = -3.0 * outer * outer - 4.0 * P;
    real3 zeros = real3(outer);
    if (others > 0.0) {
        // The zero with the larger magnitude has no cancellation, and the sum of all three is 0.
        real wide = 0.5 * (-outer + (outer < 0.0 ? sqrt(others) : -sqrt(others))), narrow = -outer - wide;
        zeros = real3(min(outer, wide), narrow, max(outer, wide));
    }
    zeros = clamp(zeros, -far, far);
    real3 F = real3(torusValue(ray, zeros.x).x, torusValue(ray, zeros.y).x, torusValue(ray, zeros.z).x);
    // The four brackets are between an end of the ray or the middle zero, outside, and a zero inside.
    bool before = F.x < 0.0, behind = F.z < 0.0, isOne = F.y < 0.0;
    int parts = reach <= 0.0 ? 0 : isOne || before != behind ? 1 : before ? 2 : 0;
    real4 outside = real4(-far, zeros.y, zeros.y, far), inside = zeros.xxzz;
    if (isOne) {
        inside.x = before ? zeros.x : zeros.y;
        inside.y = behind ? zeros.z : zeros.y;
        outside.y = far;
    } else if (!before) {
        outside.xy = outside.zw;
        inside.xy = inside.zw;
    }
    real4 roots = real4(INF, -INF, INF, -INF);
    for (int i = first; i < min(end, 2 * parts); i++) {
        real reached = halfChord(ray, torusValue(ray, inside[i]).x, P, inside[i]);
        real guess = inside[i] + ((i & 1) == 0 ? -reached : reached);
        bool kept = reached > 0.0 && guess >= min(inside[i], outside[i]) && guess <= max(inside[i], outside[i]);
        guess = kept ? guess : 0.5 * (inside[i] + outside[i]);
        roots[i] = (torusRoot(ray, outside[i], inside[i], guess) + ray.middle) / ray.speed;
    }
    return roots;
}

// Half the gradient of (hypot(l1, l2) - 1)^2 + l3^2 at l. On the torus, it points outwards.
real3 torusGradient(real3 l) {
    return real3(l.xy - l.xy / length(l.xy), l.z);
}

// The interval of a ray that starts or ends on the torus, or both. The root nearest to the known point counts as exact:
// the nearest exit if the ray leaves the torus there, the nearest entry if not. `slope` is the slope of an outward
// normal of any length at the start. torusRoots() has computed `span` for `part`, and `other` for the other part.
real2 torusEnds(Ray ray, int part, bool starts, bool ends, real slope, real2 span, real2 other) {
    for (int i = 0; i < 2; i++) {
        if (!(i == 0 ? starts : ends)) continue;
        real known = i == 0 ? real(0.0) : ray.distance;
        bool leaves = (i == 0 ? slope : dot(ray.end.n, ray.rd)) >= 0.0;
        bool isHere = span.x < span.y, isThere = other.x < other.y;
        real here = isHere ? abs((leaves ? span.y : span.x) - known) : INF;
        real there = isThere ? abs((leaves ? other.y : other.x) - known) : INF;
        if (!isHere) return span;
        if (here < there || here == there && part == 0)
            span = leaves ? real2(min(span.x, known), known) : real2(known, max(span.y, known));
        else
            span = part == 0 ? min(span, known) : max(span, known);
    }
    return span;
}

// The outward unit normal at the root t, by torusRoots(). It comes from the chord, as a sphere's normal does: one more
// step of Newton's method takes back the rounding of t, which is in proportion to the distance.
real3 torusNormal(real4 p, real4 d, real t, real3 w1, real3 w2, real3 w3) {
    TorusRay ray = torusRay(p, d);
    real s = t * ray.speed - ray.middle;
    real2 F = torusValue(ray, s);
    real step = 0.5 * F.x / F.y;
    if (abs(step) < 0.25 * ray.minor) s -= step;
    real3 x = torusGradient(ray.m + s * ray.e);
    return normalize(x.x * w1 + x.y * w2 + x.z * w3);
}
