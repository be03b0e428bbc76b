"""The two halves of settings: options of which shaders are made, and options of how many samples are drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import msgspec

from raytracer.core.record import Record
from raytracer.scene.sequences import Sequence

if TYPE_CHECKING:
    from raytracer.scene.lights import PointLight
    from raytracer.scene.materials.material import Material

Shadows = Literal["off", "hard", "diluted", "soft"]
# All models but those that need more than numbers.
Shading = Literal[
    "phong",
    "blinn",
    "lambert",
    "minnaert",
    "phong_normalized",
    "blinn_normalized",
    "strauss",
    "lafortune",
    "oren_nayar",
    "eon",
    "torrance_sparrow",
    "cook_torrance",
    "ggx",
    "beckmann",
    "split",
    "diffuse_microfacet",
    "he",
    "mirror",
]
Evaluator = Literal["cells", "walk", "roth"]
Precision = Literal[32, 64]


class CompileOptions(Record, frozen=True):
    """The settings that decide the shaders and the arrays of a scene. Fields are as in Settings, which checks them."""

    shading: Shading | None = None
    shadows: Shadows = "hard"
    evaluator: Evaluator = "cells"
    precision: Precision = 32
    bounces: int = 8

    def shaded(self, material: Material) -> Material:
        """Convert `material` to the model of `shading`, if there is one.

        Raises InputError if the conversion needs an exponent above 1e6.
        """
        if self.shading is None:
            return material
        from raytracer.scene.materials.convert import translated  # few pictures need it

        return translated(material, self.shading)

    def effective_light(self, light: PointLight) -> PointLight:
        """Reduce `light` to its center, unless shadows are soft."""
        return light if self.shadows == "soft" else msgspec.structs.replace(light, radius=0.0)


class SamplingOptions(Record, frozen=True):
    """The settings that decide how many samples are drawn, and where. Fields are as in Settings, which checks them."""

    samples: int = 1
    sequence: Sequence = "sobol"
    adaptive: float | None = None
    max_error: float | None = None
    time: float | None = None

    @property
    def has_stopping_rule(self) -> bool:
        """Whether `max_error` or `time` ends the sampling."""
        return self.max_error is not None or self.time is not None

    @property
    def is_adaptive(self) -> bool:
        """Whether pixels may get different numbers of samples."""
        return self.adaptive is not None or self.has_stopping_rule

    @property
    def estimates_error(self) -> bool:
        """Whether the samples tell the picture's error: more than one, of the sequence sobol."""
        return self.sequence == "sobol" and self.samples > 1
