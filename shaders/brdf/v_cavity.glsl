// Masking and shadowing by V-shaped cavities (Torrance and Sparrow 1967).
// Provides vCavity(): G / N.V, G = min(1, 2 N.H N.V / V.H, 2 N.H N.L / V.H), for S = L + V: N.H / V.H is
// 2 N.S / |S|^2. G is divided by N.V term by term, as 0 / 0 has no bits.

float vCavity(vec3 N, vec3 S, float NoL, float NoV) {
    float open = 4.0 * dot(N, S) / max(dot(S, S), 1e-30);
    return min(min(1.0 / NoV, open), open * (NoL / NoV));
}
