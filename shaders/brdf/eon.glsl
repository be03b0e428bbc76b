// The EON model of rough diffuse surfaces, which keeps the light that bounces between facets.
// Provides eon(): f cos(theta_i), per colour channel (Portsmouth, Kutz and Hill 2025). It is Fujii's form of Oren and
// Nayar's model plus the light that this form loses between facets, so a white surface reflects all light. The albedo E
// is the exact one.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
//
// With roughness r, c1 = 1/2 - 2 / (3 pi), c2 = 2/3 - 28 / (15 pi), A = 1 / (1 + c1 r):
//     f = rho / pi A (1 + r s / t) + rho_ms / pi (1 - E(N.L)) (1 - E(N.V)) / (1 - <E>),
// where s = L.V - N.L N.V, t = max(N.L, N.V) if s > 0, else 1, and rho_ms = rho^2 <E> / (1 - rho (1 - <E>)). The rho_ms
// in the code is this divided by rho.
// 1 - E = A r k(mu) and 1 - <E> = A r (c1 - c2) would cancel for a small r or mu. So eonLost() sums k directly, and r
// drops out. For s near -1, the code computes 1 + s as (|l + v|^2 + (N.L)^2 + (N.V)^2) / 2, where l and v are the parts
// of L and V in the tangent plane.

#include "brdf/angle.glsl"
#include "materials.glsl"

// k = (1 - E(mu)) / (A r) for a direction with the cosine mu and its sine; 0 at mu = 0.
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
