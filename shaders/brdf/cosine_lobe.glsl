// The power of a cosine, accurate for small angles and large exponents.
// Provides cosineLobe(a, b, h): max(cos(a, b), 0)^h for the angle between the vectors a and b and an exponent h in
// [0, 1e6]. x^0 is 1 also for x = 0, which GLSL's pow leaves undefined. The vectors need not be unit: their lengths,
// and the rounding errors of the lengths, cancel.
//
// Near 1 a float32 cosine cannot resolve the angle: 1 - angle^2 / 2 rounds to 1 below 2.4e-4 rad, where a highlight
// with h = 1e6 is still at its brightest, and an error u of the cosine becomes h u of its power. So the power is
// computed from the tangent there: cos^-2 = 1 + tan^2, with log(1 + x) = 2 artanh(z), z = x / (2 + x), and the series
// of artanh. The sine comes from a x (b - a): the difference b - a is exact if two unit vectors are close. In a x b the
// products would cancel, with an error of u instead of u tan.
// Relative error, with u = 2^-24: (8 + 4 |log value|) u from the functions, plus 8 h (tan + tan^2) u if a and b give
// the angle to some u, or 8 h tan^2 u if they are exact.

// The largest tan^2 for which five terms of the series suffice: the sixth term is below 1e-8.
const float SERIES = 0.5;

float cosineLobe(vec3 a, vec3 b, float h) {
    float cosine = dot(a, b);
    vec3 sine = cross(a, b - a);
    // The square of a vector such as L + V may underflow to 0.
    float x = dot(sine, sine) / max(cosine * cosine, 1e-30);
    float z = x / (2.0 + x), z2 = z * z;
    float series = 2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 / 9.0))));
    float logarithm = x > SERIES ? log(1.0 + x) : series;
    return h == 0.0 ? 1.0 : cosine > 0.0 ? exp(-0.5 * h * logarithm) : 0.0;
}
