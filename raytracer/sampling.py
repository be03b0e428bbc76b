"""Where in a pixel its samples lie."""

from __future__ import annotations

# 1/p and 1/p^2 with p the plastic number, the real root of p^3 = p + 1.
_ALPHA = (0.7548776662466927, 0.5698402909980532)


def sample_point(k: int) -> tuple[float, float]:
    """Point k = 0, 1, 2, ... of a pixel, in [0, 1)^2: x from the left, y from the top.

    The additive recurrence R2 (Roberts 2018, "The unreasonable effectiveness of quasirandom
    sequences"), started so that point 0 is the pixel's centre. Any number of first points is
    spread evenly, so samples can be added one at a time.
    """
    return (0.5 + k * _ALPHA[0]) % 1.0, (0.5 + k * _ALPHA[1]) % 1.0
