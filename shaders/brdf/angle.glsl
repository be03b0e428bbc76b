// An angle from its sine and cosine, to the last bits of float32.
// Provides angle(sine, cosine): the angle in radians, in [0, pi/2]. Both arguments are >= 0. Only their ratio counts,
// so they may have a common factor; the angle is 0 if both are 0.
// Relative error: 2e-7. GLSL's own functions are worse: atan may be off by 4096 units in the last place (Mesa's is off
// by 2e-5), and acos of a float32 cosine cannot resolve angles below 3e-4.
// Method: reduce the ratio t to |t| <= tan(pi/8), then a minimax polynomial for atan(t) / t (error 2e-8).

float angle(float sine, float cosine) {
    float less = min(sine, cosine), more = max(max(sine, cosine), 1e-37);
    bool middle = less > 0.41421356 * more;
    float t = middle ? (less - more) / (less + more) : less / more, z = t * t;
    float a = t + t * z * (-0.333329552 + z * (0.199779259 + z * (-0.138798481 + z * 0.0806030259)));
    a = middle ? 0.785398163 + a : a;
    return sine > cosine ? 1.57079633 - a : a;
}
