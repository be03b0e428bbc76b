// The power of a cosine, accurate for small angles and large exponents.
// Provides cosineLobe(): max(cos(a, b), 0)^h for the angle between a and b and an exponent h in
// [0, 1e6], with x^0 = 1 also for x = 0, which GLSL's pow leaves undefined. The vectors need not
// be unit: their lengths, and the rounding of these, cancel.
//
// Near 1 a float32 cosine has lost the angle: 1 - angle^2 / 2 rounds to 1 below 2.4e-4 rad, where a
// highlight with h = 1e6 is still at its brightest, and an error u of the cosine is h u of its
// power. So there the power is made of the tangent, cos^-2 = 1 + tan^2, by
// log(1 + x) = 2 artanh(z), z = x / (2 + x), and its series.
// The sine is that of a and b - a, which is exact where two unit vectors are close; the products of a x b
// would cancel there, and leave u instead of u tan.
// Relative error, with u = 2^-24: 8 h (tan + tan^2) u for the angle, where a and b give it to some u, and 8 h tan^2 u
// where they are exact; and (8 + 4 |log value|) u for the functions.

// Up to this tan^2 five terms of the series suffice: the sixth is below 1e-8.
const float SERIES = 0.5;

float cosineLobe(vec3 a, vec3 b, float h) {
    float cosine = dot(a, b);
    vec3 sine = cross(a, b - a);
    // L + V may be so short that its square is 0.
    float x = dot(sine, sine) / max(cosine * cosine, 1e-30);
    float z = x / (2.0 + x), z2 = z * z;
    float series = 2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 / 9.0))));
    float logarithm = x > SERIES ? log(1.0 + x) : series;
    return h == 0.0 ? 1.0 : cosine > 0.0 ? exp(-0.5 * h * logarithm) : 0.0;
}
