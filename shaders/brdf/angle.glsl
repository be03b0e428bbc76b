// An angle from its sine and cosine, to the last bits of float32.
// Provides angle(): the angle in [0, pi/2] whose sine and cosine are in the ratio of the two arguments, both >= 0; 0
// where both are 0. Relative error 2e-7. GLSL's atan may be off by 4096 ulp, Mesa's is by 2e-5; and acos of a
// float32 cosine has lost angles below 3e-4.
// Folded to |t| <= tan(pi/8), then a polynomial (minimax for atan(t)/t, 2e-8).

float angle(float sine, float cosine) {
    float less = min(sine, cosine), more = max(max(sine, cosine), 1e-37);
    bool middle = less > 0.41421356 * more;
    float t = middle ? (less - more) / (less + more) : less / more, z = t * t;
    float a = t + t * z * (-0.333329552 + z * (0.199779259 + z * (-0.138798481 + z * 0.0806030259)));
    a = middle ? 0.785398163 + a : a;
    return sine > cosine ? 1.57079633 - a : a;
}
