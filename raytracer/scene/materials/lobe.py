"""A lobe of Lafortune's model, which a material of that model has several of."""

from __future__ import annotations

import math
from typing import Any

from raytracer.core.record import Record, public
from raytracer.core.validation import MAX_COLOR, MAX_EXPONENT, InputError, set_fields, three

# Cosines of a lobe times its coefficients; above, its power would not stay finite with any exponent worth having.
MAX_COEFFICIENT = 1e3


@public
class Lobe(Record, frozen=True, repr_omit_defaults=True):
    """A lobe of Lafortune's model: scale (cx Lx Vx + cy Ly Vy + cz Lz Vz)^n where that is above 0, per channel.

    x is along the material's `tangent`, z along the normal. `cy` is `cx` unless it is given. Each is three numbers, or
    one that stands for three: cx, cy and cz in [-1000, 1000], n in [0, 1e6], scale in [0, 1e12]. Raises InputError for
    others, and where scale max(|cx|, |cy|, |cz|)^n is above 1e12.
    """

    cx: Any
    cz: Any
    n: Any
    cy: Any = None
    scale: Any = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        c = (-MAX_COEFFICIENT, MAX_COEFFICIENT)
        set_fields(
            self,
            cx=three(self.cx, "cx", *c),
            cy=None if self.cy is None else three(self.cy, "cy", *c),
            cz=three(self.cz, "cz", *c),
            n=three(self.n, "n", 0.0, MAX_EXPONENT),
            scale=three(self.scale, "scale", 0.0, MAX_COLOR),
        )
        for parts in zip(self.cx, self.cy or self.cx, self.cz, self.n, self.scale, strict=True):
            if peak(*parts) > MAX_COLOR:
                raise InputError(f"expected scale max(|cx|, |cy|, |cz|)^n of at most {MAX_COLOR:g}")


def peak(cx: float, cy: float, cz: float, n: float, scale: float) -> float:
    """The scale of a lobe whose coefficients are divided by the largest of them: inf if it overflows."""
    try:
        return scale * max(abs(cx), abs(cy), abs(cz)) ** n
    except OverflowError:
        return math.inf
