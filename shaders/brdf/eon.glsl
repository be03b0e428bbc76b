// The EON model of rough diffuse surfaces, which keeps the light that bounces between facets.
// Provides eon(): Oren, Nayar and Fujii's rough diffuse reflectance and the light that it loses between facets, so
// that a white surface sends back all (Portsmouth, Kutz and Hill 2025), with the exact albedo E.
//
// With roughness r, c1 = 1/2 - 2 / (3 pi), c2 = 2/3 - 28 / (15 pi), A = 1 / (1 + c1 r):
//     f = rho / pi A (1 + r s / t) + rho_ms / pi (1 - E(N.L)) (1 - E(N.V)) / (1 - <E>),
// s = L.V - N.L N.V, t = max(N.L, N.V) where s > 0, else 1. Of this, 1 - E = A r k(mu) and 1 - <E> = A r (c1 - c2) cancel
// where r or mu is small; so k is summed by itself, and r is cancelled. Where s is near -1, 1 + s is
// (|l + v|^2 + (N.L)^2 + (N.V)^2) / 2, l and v the parts in the surface.

#include "brdf/angle.glsl"
#include "materials.glsl"

// (1 - E(mu)) / (A r), 0 at mu = 0, for the cosine and sine of a direction.
float eonLost(float mu, float sine) {
    const float PI = 3.14159265;
    float S = min(sine, 1.0), mu2 = mu * mu;
    return (mu2 / (1.0 + S) * (PI / 2.0 - 2.0 / 3.0) + S * angle(mu, S)
        + S * mu * (S - 2.0 / 3.0 * (1.0 + S + S * S) / (1.0 + S))) / PI;
}

vec3 eon(Material m, vec3 N, vec3 L, vec3 V) {
    const float c1 = 0.28779342, c2 = 0.072488213;
    float NoL = dot(N, L), NoV = max(dot(N, V), 0.0), r = m.roughness, A = 1.0 / (1.0 + c1 * r);
    vec3 l = L - NoL * N, v = V - NoV * N, both = l + v;
    float s = dot(l, v);
    float single = s > 0.0 ? NoL + r * s * (NoL / max(NoL, NoV))
        : NoL * (1.0 - r + 0.5 * r * (dot(both, both) + NoL * NoL + NoV * NoV));

    float mean = A * (1.0 + c2 * r);
    vec3 rho_ms = m.rho * mean / (1.0 - m.rho * (A * r * (c1 - c2)));
    float several = NoL * r / (c1 - c2) * eonLost(NoL, length(l)) * eonLost(NoV, length(v));
    return m.rho * (0.31830989 * A * (single + rho_ms * several));
}
