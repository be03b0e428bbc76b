"""Checks of values that several primitives have."""

from __future__ import annotations

import math
from typing import Any

from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, MIN_RADIUS, InputError, Vec3, vector
from raytracer.scene.materials.material import Material

# The expected value of a radius, for error messages.
RADIUS = f"a number above 0, in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"


def check_place(value: Any) -> Vec3:
    """Return three finite numbers of any size. Raises InputError."""
    return vector(value, "point", -math.inf, math.inf, "3 finite numbers")


def check_material(material: Any) -> None:
    """Raise InputError unless `material` is a Material."""
    if not isinstance(material, Material):
        raise InputError(f"expected a Material, got {format_value(material)}", "material")
