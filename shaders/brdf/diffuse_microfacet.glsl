// The diffuse microfacet model: Lambertian facets, each seen and lit by itself.
// Provides diffuse_microfacet():
//     f = rho / (N.L N.V) 1/pi int <L.m> <V.m> G(L, V) D(m) dm,
// the article's equation xxiii; it has no closed form (Heitz and Dupuy 2015). G is Smith's, the same for all m. Light
// that goes from facet to facet is lost.
//
// The rule is a product over azimuth and elevation of m, in coordinates in which the distribution is nearly flat:
// m is along (scale sin(theta) cos(phi), scale sin(theta) sin(phi), cos(theta)), and GGX is a hemisphere of these
// (theta, phi) for scale = alpha, stretched. Azimuths are parted where the facets' slopes turn from L, or from V: beyond, an
// elevation ends where the first of the two is no longer seen. So what is integrated is smooth, also for grazing
// directions on opposite sides, of which both see few facets. Over azimuths: the midpoint rule in Sidi's variable
// x - sin(2 pi x) / (2 pi) (Sidi 1993), which puts nodes close to these ends; over elevations: Gauss's rule of 5
// nodes, in each of equal parts if there are many nodes. Reciprocal to rounding: the nodes of (L, V) mirror those of
// (V, L).
// Very many nodes in a large picture may take a GPU longer than its system lets a draw last.
// Relative error with 128 nodes, random directions with cosines in [0.02, 1]: median 1e-3, most 2e-2; with 512, median
// 1e-4, most 1e-3; with 2048, 3e-6 and 4e-5. Where both cosines are below that and on opposite sides, it may reach 1,
// of very little.

#include "brdf/angle.glsl"
#include "materials.glsl"

const int GAUSS = 5;
const float GAUSS_AT[GAUSS] = float[](0.046910077, 0.230765345, 0.5, 0.769234655, 0.953089923);
const float GAUSS_WEIGHT[GAUSS] = float[](0.118463443, 0.239314335, 0.284444444, 0.239314335, 0.118463443);

// Over the elevations of one azimuth. What L and V see of a facet there is side sin(theta) + up cos(theta).
float meridian(Material m, vec2 side, vec2 up, vec2 range, int parts) {
    vec2 last = vec2(side.x < 0.0 ? -up.x / side.x : range.y, side.y < 0.0 ? -up.y / side.y : range.y);
    float width = angle(min(range.y, min(last.x, last.y)), 1.0) / float(parts), sum = 0.0;
    for (int k = 0; k < parts; k++) {
        for (int i = 0; i < GAUSS; i++) {
            float theta = width * (float(k) + GAUSS_AT[i]), sine = sin(theta), cosine = cos(theta);
            vec3 n = vec3(range.x * sine, 0.0, cosine);
            vec2 seen = max(side * sine + up * cosine, 0.0);
            float nn = dot(n, n);
            // dm = scale^2 / |n|^3 sin(theta) dtheta dphi, and seen is |n| times its cosines.
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

    // The azimuth between L and V, as wide as where one of them sees the facets of all elevations; and what it lacks to
    // pi, as wide as where both do.
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
