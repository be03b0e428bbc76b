// The diffuse microfacet model: Lambertian facets, without light from facet to facet.
// Provides diffuse_microfacet(): f cos(theta_i), per colour channel, by numerical integration over the facets m:
//     f = rho / (N.L N.V) 1/pi int <L.m> <V.m> G(L, V) D(m) dm.
// This is rho times equation (xxiii) of "Microfacet BRDFs from Scratch" (S. J. Khadka), with G in place of its G1. The
// integral has no closed form (Heitz and Dupuy 2015). G is Smith's masking, equal for all m.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
//
// The quadrature is a product of rules over the azimuth and the elevation of m, in coordinates in which the
// distribution is nearly flat: m is along (scale sin(theta) cos(phi), scale sin(theta) sin(phi), cos(theta)). In these
// (theta, phi) with scale = alpha, GGX is a stretched hemisphere.
// The azimuths are split where the facets' slopes turn away from L or from V. Beyond such an azimuth, the range of
// elevations ends where the first of L and V no longer sees the facet. So the integrand is smooth, also for grazing
// directions on opposite sides, from which few facets are visible to both.
// Over azimuths: the midpoint rule in Sidi's variable x - sin(2 pi x) / (2 pi) (Sidi 1993), which clusters nodes at the
// ends. Over elevations: Gauss's rule with 5 nodes, on several equal parts if there are many nodes. The nodes of (V, L)
// mirror the nodes of (L, V), so the result is reciprocal to rounding.
//
// Relative error, for random directions with cosines in [0.02, 1]: with 128 nodes median 1e-3 and maximum 2e-2, with
// 512 nodes 1e-4 and 1e-3, with 2048 nodes 3e-6 and 4e-5. If both cosines are smaller and the directions on opposite
// sides, the relative error may reach 1, of a value that is tiny.
// With very many nodes a large picture may take a GPU longer than its system allows for one draw.

#include "brdf/angle.glsl"
#include "materials.glsl"

const int GAUSS = 5;
const float GAUSS_AT[GAUSS] = float[](0.046910077, 0.230765345, 0.5, 0.769234655, 0.953089923);
const float GAUSS_WEIGHT[GAUSS] = float[](0.118463443, 0.239314335, 0.284444444, 0.239314335, 0.118463443);

// The integral over the elevations of one azimuth, in `parts` equal parts. The cosines of a facet with L (.x) and V
// (.y) are side sin(theta) + up cos(theta), up to a common factor.
float meridian(Material m, vec2 side, vec2 up, vec2 range, int parts) {
    vec2 last = vec2(side.x < 0.0 ? -up.x / side.x : range.y, side.y < 0.0 ? -up.y / side.y : range.y);
    float width = angle(min(range.y, min(last.x, last.y)), 1.0) / float(parts), sum = 0.0;
    for (int k = 0; k < parts; k++) {
        for (int i = 0; i < GAUSS; i++) {
            float theta = width * (float(k) + GAUSS_AT[i]), sine = sin(theta), cosine = cos(theta);
            vec3 n = vec3(range.x * sine, 0.0, cosine);
            vec2 seen = max(side * sine + up * cosine, 0.0);
            float nn = dot(n, n);
            // dm = scale^2 / |n|^3 sin(theta) dtheta dphi, and `seen` is |n| times the two cosines.
            sum += GAUSS_WEIGHT[i] * seen.x * seen.y * sine * D(m, vec3(0.0, 0.0, 1.0), n) / (nn * nn * sqrt(nn));
        }
    }
    return sum * width * range.x * range.x;
}

vec3 diffuse_microfacet(Material m, vec3 N, vec3 L, vec3 V) {
    const float PI = 3.14159265;
    vec2 range = extent(m, m.alpha);
    vec2 up = vec2(dot(N, L), max(dot(N, V), 0.0));
    vec3 l = cross(N, L), v = cross(N, V);
    vec2 side = range.x * vec2(length(l), length(v));

    // `one`: the azimuth between L and V, which is the width of the range where only one of the two sees the facets of
    // all elevations. `both`: the rest of pi, which is the width of the range where both see them.
    float acute = angle(length(cross(l, v)), abs(dot(l, v)));
    float one = dot(l, v) < 0.0 ? PI - acute : acute, both = dot(l, v) < 0.0 ? acute : PI - acute;

    int parts = max(int(sqrt(m.nodes / 120.0)), 1), count = max(int(m.nodes) / (4 * GAUSS * parts), 2);
    float sum = 0.0;
    for (int i = 0; i < count; i++) {
        float x = (float(i) + 0.5) / float(count), y = (float(count - i) - 0.5) / float(count);
        float s = sin(PI * x), weight = 2.0 * s * s / float(count);
        float from = x - sin(2.0 * PI * x) / (2.0 * PI), to = y - sin(2.0 * PI * y) / (2.0 * PI);
        vec2 a = side * vec2(sin(both * to), sin(both * from));
        sum += weight * both * (meridian(m, a, up, range, parts) + meridian(m, -a, up, range, parts));
        float less = sin(one * from), more = sin(one * to);
        sum += weight * one * (meridian(m, side * vec2(-less, more), up, range, parts)
            + meridian(m, side * vec2(more, -less), up, range, parts));
    }
    float hidden = masking(m, slope(m, up.x), slope(m, up.y), up.x, up.y);
    return m.rho * (sum * hidden * up.x / PI);
}
