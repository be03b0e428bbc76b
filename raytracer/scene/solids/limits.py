"""Limits of the sizes of solids and scenes, and a bound of rounding."""

# The most leaves of one solid, more than any evaluator handles. With shared operands, a tree may be astronomically big.
MAX_LEAVES = 65536
# The most nodes of one solid: twice as many as binary operators need, which leaves room for complements.
MAX_NODES = 4 * MAX_LEAVES
# The most leaves of all solids of a scene, with each instance counted. 2^20 leaves of four float32 take 16 MiB, which
# any GPU has, and leaf numbers up to 2^24 are exact in float32.
MAX_SURFACES = 1048576
# Bound of the rounding error of a sum of a few rounded float64 numbers, relative to the largest number.
ROUNDING = 8.0 * 2.0**-53
