"""Settings: how a picture is made, whatever it is of, traded between speed and accuracy."""

from __future__ import annotations

import msgspec

from raytracer.core.record import Record, public
from raytracer.core.shown import shown
from raytracer.core.validation import InputError, set_fields
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import CompileOptions, Evaluator, Precision, SamplingOptions, Shadows
from raytracer.scene.sequences import SampleSequence


@public
class Settings(Record, frozen=True):
    """The way to make a picture of a scene.

    `samples` a pixel, 1 to 65536. `shadows`: "off", "hard" (a blocked light gives nothing),
    "diluted" (it gives the share dist(P, Q) / dist(P, light), Q the first blocking point) or "soft" (each sample
    looks at one point of each light that has a radius; under all others a light is its centre).
    `shading`: None for each material's own model, or the name of a model for all (convert.py). `evaluator`
    finds where a ray meets a CSG tree: "cells" (looks only at surfaces that a cell of the picture or of a light's
    surroundings can meet), "walk" (at everything) or "roth" (the assignment's hit lists, the readable one);
    their pictures agree. `precision`: bits of the numbers in which rays and
    surfaces are intersected: 32, or 64 for scenes beyond what 32 resolve (needs OpenGL 4.0).
    `adaptive`: None, or an error in linear radiance, above 0, such as 0.01: only where a pixel's mean is estimated
    to be off by more do pixels near it get more than 3 samples, up to `samples` (stopping_rule.py).
    `bounces`: how many mirrors in a row light is followed through, 0 to 64; what comes after is left out.
    `sequence`: where in a pixel its samples lie (sequences.py); "grid", "rotated" and "corners" take a square number.
    `max_error`: None, or the root mean square error in linear radiance, above 0, such as 0.002: samples are added,
    up to `samples`, until it is estimated to be less, and the estimate is certain (estimator.py). `time`: None, or
    seconds, above 0: samples are added, up to `samples`, as long as they last. Programs are compiled before, and
    depth, normal and material are drawn when they are asked for.
    """

    samples: int = 1
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
        for half in (self.sampling, self.compile_options):  # each checks its fields
            set_fields(self, **msgspec.structs.asdict(half))

    @property
    def compile_options(self) -> CompileOptions:
        """The half that decides shaders and arrays."""
        return CompileOptions(*(getattr(self, name) for name in CompileOptions.__struct_fields__))

    @property
    def sampling(self) -> SamplingOptions:
        """The half that decides samples."""
        return SamplingOptions(*(getattr(self, name) for name in SamplingOptions.__struct_fields__))

    def shaded(self, material: Material) -> Material:
        """`material` under the shading override. Raises InputError if that would take an exponent above 1e6."""
        if not isinstance(material, Material):
            raise InputError(f"expected a Material, got {shown(material)}", "material")
        return self.compile_options.shaded(material)

    def cast(self, light: PointLight) -> PointLight:
        """`light` under these shadows: its centre, unless they are soft."""
        if not isinstance(light, PointLight):
            raise InputError(f"expected a PointLight, got {shown(light)}", "light")
        return self.compile_options.effective_light(light)
