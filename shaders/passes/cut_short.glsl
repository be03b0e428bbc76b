// A check whether the driver ended loops of this shader too early.
// Provides isCutShort(), CUT_SHORT.
//
// llvmpipe leaves every loop after its first round once a shader has gone through 65,535 rounds of all its loops,
// for some pixels that are drawn together. It reports nothing, and the picture is wrong there.

uniform int two;  // 2; the compiler does not know

// The value of `surface` (visibility.frag) then: no surface has this number.
const int CUT_SHORT = -2147483647 - 1;

bool isCutShort() {
    int rounds = 0;
    for (int k = 0; k < two; k++) rounds++;
    return rounds < two;
}
