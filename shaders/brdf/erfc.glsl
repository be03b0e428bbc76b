// Provides erfcOf(): the complementary error function for x >= 0, to a relative 1.2e-7 and what exp adds
// (Press et al., "Numerical Recipes", section 6.2: Chebyshev's fit).

float erfcOf(float x) {
    float t = 1.0 / (1.0 + 0.5 * x);
    float fit = -1.26551223 + t * (1.00002368 + t * (0.37409196 + t * (0.09678418 + t * (-0.18628806
        + t * (0.27886807 + t * (-1.13520398 + t * (1.48851587 + t * (-0.82215223 + t * 0.17087277))))))));
    return t * exp(fit - x * x);
}
