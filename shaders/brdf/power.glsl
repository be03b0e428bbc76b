// Provides power(): x^h for a cosine x >= 0 and an exponent h >= 0, with x^0 = 1.
// GLSL leaves pow(0, 0) undefined.

float power(float x, float h) {
    return h == 0.0 ? 1.0 : pow(x, h);
}
