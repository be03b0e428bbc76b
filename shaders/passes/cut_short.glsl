// A check whether the driver ended loops of this shader too early.
// Provides isCutShort(), CUT_SHORT.
//
// After 65,535 rounds of all loops of a shader together, llvmpipe leaves every further loop after its first round, for
// pixels that are drawn together. It reports nothing, and the picture is wrong there.

uniform int two;  // 2, but not a constant: the compiler must not unroll the loop below

// The value that visibility.frag writes for such a pixel: no surface has this number.
const int CUT_SHORT = -2147483647 - 1;

bool isCutShort() {
    int rounds = 0;
    for (int k = 0; k < two; k++) rounds++;
    return rounds < two;
}
