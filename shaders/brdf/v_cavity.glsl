// Masking and shadowing by V-shaped cavities (Torrance and Sparrow 1967).
// Provides vCavity(): G / N.V, where G = min(1, 2 N.H N.V / V.H, 2 N.H N.L / V.H) is the share of facets that both the
// light and the viewer see, in the form of Blinn (1977). N is the unit normal, S = L + V; NoL and NoV are N.L
// and N.V. N.H / V.H is 2 N.S / |S|^2.
// Each term of G is divided by N.V separately: at N.V = 0 the quotient G / N.V would be 0 / 0.

float vCavity(vec3 N, vec3 S, float NoL, float NoV) {
    float open = 4.0 * dot(N, S) / max(dot(S, S), 1e-30);
    return min(min(1.0 / NoV, open), open * (NoL / NoV));
}
