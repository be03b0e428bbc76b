"""What is traded between speed and accuracy, apart from the scene."""

from __future__ import annotations

from typing import Literal, get_args

import msgspec

from raytracer.checks import MAX_EXPONENT, InputError, shown
from raytracer.scene import MODELS, Material

Shadows = Literal["off", "hard", "diluted"]
Shading = Literal["phong", "blinn"]
Evaluator = Literal["walk", "roth"]
Precision = Literal[32, 64]

MAX_SAMPLES = 65536


class Settings(msgspec.Struct, frozen=True):
    """How to render.

    `samples` a pixel, 1 to 65536. `shadows`: "off", "hard" (a blocked light gives nothing) or
    "diluted" (it gives the share dist(P, Q) / dist(P, light), Q the first blocking point).
    `shading`: None for each material's own model, or "phong" or "blinn" for all. `evaluator`
    finds where a ray meets a CSG tree: "walk" (fast) or "roth" (the assignment's hit lists, the
    readable one); their pictures agree. `precision`: bits of the numbers in which rays and
    surfaces are intersected: 32, or 64 for scenes beyond what 32 resolve (needs OpenGL 4.0).
    """

    samples: int = 1
    shading: Shading | None = None
    shadows: Shadows = "hard"
    evaluator: Evaluator = "walk"
    precision: Precision = 32

    def __post_init__(self) -> None:
        if isinstance(self.samples, bool) or not isinstance(self.samples, int) or not 1 <= self.samples <= MAX_SAMPLES:
            raise InputError(f"samples: expected a whole number in [1, {MAX_SAMPLES}], got {shown(self.samples)}")
        _check_choice("shading", self.shading, (None, *get_args(Shading)))
        _check_choice("shadows", self.shadows, get_args(Shadows))
        _check_choice("evaluator", self.evaluator, get_args(Evaluator))
        _check_choice("precision", self.precision, get_args(Precision))

    def shaded(self, material: Material) -> Material:
        """`material` under the shading override.

        Blinn's highlight with 4 h has the size of Phong's with h (the lecture, after Blinn 1977),
        so a material that changes its model changes its exponent too. Raises InputError where 4 h
        is above 1e6.
        """
        if self.shading is None or self.shading == material.model:
            return material
        h = material.h * 4.0 if self.shading == "blinn" else material.h / 4.0
        if h > MAX_EXPONENT:
            expected = f"exponents h of at most {MAX_EXPONENT / 4:g}, which blinn takes times 4"
            raise InputError(f"shading: expected {expected}, got {material.h:g}")
        return msgspec.structs.replace(material, model=self.shading, h=h)


def _check_choice(key: str, value: object, choices: tuple[str | int | None, ...]) -> None:
    if value not in choices:
        raise InputError(f"{key}: expected one of {', '.join(map(str, choices))}, got {shown(value)}")


assert get_args(Shading) == MODELS
