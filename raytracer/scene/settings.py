"""Render settings: the trade-off between speed and accuracy, independent of the scene."""

from __future__ import annotations

from typing import Any, Self, cast

import msgspec
from msgspec import UNSET

from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, set_fields
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import DEFAULT_SAMPLE_LIMIT, CompileOptions, Evaluator, Precision, SamplingOptions, Shadows
from raytracer.scene.sequences import SampleSequence


@public
class Settings(Record, frozen=True):
    """Render settings.

    Args:
        samples: the number of samples per pixel; with `adaptive`, `max_error` or `time`, the largest number. Range: 1
            to 65536. Default: 1, with `adaptive`, `max_error` or `time` 4096.
        shading: a reflectance model to which all materials are converted. None keeps the material's own model.
            Default: None.
        shadows: the shadow of an occluded point P. Default: "hard".
            "off": no shadows.
            "hard": a blocked light contributes nothing.
            "diluted": a blocked light contributes the share dist(P, Q) / dist(P, light), where Q is the first blocking
            point on the way to the light.
            "soft": lights with a radius are spheres, and each sample tests one random point of each sphere. With all
            other shadows a light is a point.
        evaluator: the algorithm that intersects rays with CSG trees. All produce the same picture. Default: "cells".
            "cells": tests only the surfaces that may be met in a screen tile or in a range of directions from a light.
            "walk": steps along the ray through all surfaces.
            "roth": merges sorted hit lists, the diagrams of S. D. Roth (1982). The shader is written to be read.
        precision: bits of the floating-point numbers in which rays and surfaces are intersected: 32, or 64 for scenes
            that 32 bits do not resolve (needs OpenGL 4.0). Default: 32.
        adaptive: an error in linear radiance, above 0, such as 0.01. Every pixel gets 3 samples. Only pixels whose
            estimated error exceeds it, and their neighbours, get more. Excludes `max_error` and `time`. None disables
            it. Default: None.
        bounces: the largest number of successive mirror reflections that are traced. Light from further reflections
            is left out. Range: 0 to 64. Default: 8.
        sequence: the positions of the samples in a pixel: "sobol" (scrambled Sobol' points), "r2", "random", "grid",
            "rotated" (rotated grid) or "corners". The last three need a square number of samples, and do not go with
            `adaptive`, `max_error` or `time`; `max_error` needs "sobol". Default: "sobol".
        max_error: the accepted root mean square error of the picture in linear radiance, above 0, such as 0.002.
            Samples are added, up to `samples`, until the estimated error is below it and the estimate is reliable.
            None disables it. Default: None.
        time: a time limit in seconds, above 0. Samples are added, up to `samples`, until it ends. Not included are the
            compilation of shaders before, and drawing depth, normals and materials, which happens at their first use.
            None disables it. Default: None.

    Raises:
        InputError: a wrong value, or settings that exclude each other.
    """

    samples: int = cast("int", UNSET)
    shading: Shading | None = None
    shadows: Shadows = "hard"
    evaluator: Evaluator = "cells"
    precision: Precision = 32
    adaptive: float | None = None
    bounces: int = 8
    sequence: SampleSequence = "sobol"
    max_error: float | None = None
    time: float | None = None

    def __post_init__(self) -> None:
        for half in (self.sampling, self.compile_options):  # whose constructors check the fields
            set_fields(self, **msgspec.structs.asdict(half))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with other values for some fields. The new values are checked as in the constructor.

        A new `adaptive`, `max_error` or `time` raises a `samples` of 1, which cannot be its limit, to the default 4096.
        Cancelling all of them sets the limit 4096 back to 1. Neither happens if `changes` sets `samples`. Raises
        InputError for a wrong value and for an unknown field.
        """
        was = self.sampling.is_adaptive
        will_be = any(changes.get(name, getattr(self, name)) is not None for name in ("adaptive", "max_error", "time"))
        if was != will_be and self.samples == (DEFAULT_SAMPLE_LIMIT if was else 1):
            changes = {"samples": UNSET, **changes}
        return super().replace(**changes)

    __replace__ = replace

    @property
    def compile_options(self) -> CompileOptions:
        """The settings on which the shaders and arrays of a scene depend."""
        return CompileOptions(*(getattr(self, name) for name in CompileOptions.__struct_fields__))

    @property
    def sampling(self) -> SamplingOptions:
        """The settings that decide the number and the positions of the samples."""
        return SamplingOptions(*(getattr(self, name) for name in SamplingOptions.__struct_fields__))

    def shaded(self, material: Material) -> Material:
        """Convert `material` to the model `shading`; return it unchanged if `shading` is None.

        Raises InputError if the conversion needs an exponent above 1e6.
        """
        if not isinstance(material, Material):
            raise InputError(f"expected a Material, got {format_value(material)}", "material")
        return self.compile_options.shaded(material)

    def cast(self, light: PointLight) -> PointLight:
        """Return `light` as it shines with these shadows: without its radius, unless shadows are soft."""
        if not isinstance(light, PointLight):
            raise InputError(f"expected a PointLight, got {format_value(light)}", "light")
        return self.compile_options.effective_light(light)
