"""Lobe: one of the generalised cosine lobes of the reflectance model of Lafortune et al. (1997)."""

from __future__ import annotations

import math
from typing import Any

from raytracer.core.record import Record, public
from raytracer.core.validation import MAX_COLOR, MAX_EXPONENT, InputError, set_fields, three_numbers

# The largest coefficient of a lobe. With larger ones, the lobe overflows for any useful exponent.
MAX_COEFFICIENT = 1e3


@public
class Lobe(Record, frozen=True, repr_omit_defaults=True):
    """A lobe of the model "lafortune": scale max(0, cx Lx Vx + cy Ly Vy + cz Lz Vz)^n for each colour channel.

    L is the direction to the light and V the direction to the viewer. Axis x is along the material's `tangent`, z along
    the normal. Each argument is three numbers, one per channel, or one number for all channels.

    Args:
        cx: coefficient of x. Range: -1000 to 1000. cx = cy = -1, cz = 1 is a lobe around the mirror direction.
        cz: coefficient of z. Range: -1000 to 1000.
        n: the exponent. Range: 0 to 1e6.
        cy: coefficient of y. Range: -1000 to 1000. Default: `cx`.
        scale: the factor of the lobe. Range: 0 to 1e12. Default: 1.

    Raises:
        InputError: a value out of range, or scale max(|cx|, |cy|, |cz|)^n above 1e12.

    Source: Lafortune, Foo, Torrance and Greenberg 1997, "Non-linear approximation of reflectance functions".
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
            cx=three_numbers(self.cx, "cx", *c),
            cy=None if self.cy is None else three_numbers(self.cy, "cy", *c),
            cz=three_numbers(self.cz, "cz", *c),
            n=three_numbers(self.n, "n", 0.0, MAX_EXPONENT),
            scale=three_numbers(self.scale, "scale", 0.0, MAX_COLOR),
        )
        for parts in zip(self.cx, self.cy or self.cx, self.cz, self.n, self.scale, strict=True):
            if peak(*parts) > MAX_COLOR:
                raise InputError(f"expected scale max(|cx|, |cy|, |cz|)^n of at most {MAX_COLOR:g}")


def peak(cx: float, cy: float, cz: float, n: float, scale: float) -> float:
    """Return the largest value of a lobe, scale max(|cx|, |cy|, |cz|)^n, or inf if it overflows."""
    try:
        return scale * max(abs(cx), abs(cy), abs(cz)) ** n
    except OverflowError:
        return math.inf
