"""The two halves of Settings: CompileOptions (which shaders are needed) and SamplingOptions (how pixels are sampled).

Each half checks its own fields. `Settings` has all fields and documents them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

import msgspec
from msgspec import UNSET

from raytracer.core.record import Record
from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean
from raytracer.core.validation import InputError, check_choice, integer, number, set_fields
from raytracer.scene.materials.models import MODELS, SHADINGS, Shading
from raytracer.scene.sequences import PROGRESSIVE, SEQUENCES, SampleSequence

if TYPE_CHECKING:
    from raytracer.scene.lights import PointLight
    from raytracer.scene.materials.material import Material

MAX_SAMPLES = 65536
# The default of `samples` if `max_error`, `time` or `adaptive` is set. Further samples would lower the error by less
# than 1e-3 (linear radiance).
DEFAULT_SAMPLE_LIMIT = 4096
MAX_BOUNCES = 64

Shadows = Literal["off", "hard", "diluted", "soft"]
Evaluator = Literal["cells", "walk", "roth"]
Precision = Literal[32, 64]


class CompileOptions(Record, frozen=True):
    """The settings on which the shaders and the arrays of a scene depend."""

    shading: Shading | None = None
    shadows: Shadows = "hard"
    evaluator: Evaluator = "cells"
    precision: Precision = 32
    bounces: int = 8

    def __post_init__(self) -> None:
        set_fields(
            self,
            bounces=integer(self.bounces, "bounces", 0, MAX_BOUNCES),
            shadows=check_choice(self.shadows, "shadows", get_args(Shadows)),
            evaluator=check_choice(self.evaluator, "evaluator", get_args(Evaluator)),
            precision=_check_precision(self.precision),
        )
        if self.shading is not None:
            set_fields(self, shading=check_shading(self.shading))

    def shaded(self, material: Material) -> Material:
        """Convert `material` to the model `shading`; return it unchanged if `shading` is None.

        Raises InputError if the conversion needs an exponent above 1e6.
        """
        if self.shading is None:
            return material
        from raytracer.scene.materials.convert import convert_material  # imported here, because few pictures need it

        return convert_material(material, self.shading)

    def effective_light(self, light: PointLight) -> PointLight:
        """Return `light` as it shines with these shadows: without its radius, unless shadows are soft."""
        return light if self.shadows == "soft" else msgspec.structs.replace(light, radius=0.0)


class SamplingOptions(Record, frozen=True):
    """The settings that decide how many samples the pixels get, and where in a pixel.

    Without an argument, `samples` is 1, or DEFAULT_SAMPLE_LIMIT if `adaptive`, `max_error` or `time` is set.
    """

    samples: int = cast("int", UNSET)
    sequence: SampleSequence = "sobol"
    adaptive: float | None = None
    max_error: float | None = None
    time: float | None = None

    def __post_init__(self) -> None:
        samples = self.samples
        if cast("Any", samples) is UNSET:
            samples = DEFAULT_SAMPLE_LIMIT if self.is_adaptive else 1
        set_fields(
            self,
            samples=integer(samples, "samples", 1, MAX_SAMPLES),
            sequence=check_choice(self.sequence, "sequence", SEQUENCES),
        )
        for key, unit in (("adaptive", "linear radiance"), ("max_error", "linear radiance"), ("time", "seconds")):
            if (value := getattr(self, key)) is not None:
                expected = f"a finite number above 0 ({unit})"
                set_fields(self, **{key: number(value, key, math.ulp(0.0), expected=expected)})
                fit = _ESTIMATING if key == "max_error" else PROGRESSIVE
                if self.sequence not in fit:
                    raise InputError(
                        f"expected {' or '.join(fit)} with {key}, got {format_value(self.sequence)}", "sequence"
                    )
        if self.adaptive is not None and self.has_stopping_rule:
            raise InputError(
                "cannot be combined with max_error or time, which distribute the samples by themselves: remove "
                "one or the other",
                "adaptive",
            )
        if self.sequence not in PROGRESSIVE and math.isqrt(self.samples) ** 2 != self.samples:
            expected = f"a square number, such as 16, for the sequence {self.sequence}"
            raise InputError(f"expected {expected}, got {self.samples}", "samples")

    @property
    def has_stopping_rule(self) -> bool:
        """Whether an error (`max_error`) or a time limit (`time`) ends the sampling."""
        return self.max_error is not None or self.time is not None

    @property
    def is_adaptive(self) -> bool:
        """Whether pixels may get different numbers of samples."""
        return self.adaptive is not None or self.has_stopping_rule

    @property
    def estimates_error(self) -> bool:
        """Whether the picture's error can be estimated: it needs two or more samples of Sobol's sequence."""
        return SEQUENCES[self.sequence].estimates_error and self.samples > 1


_ESTIMATING = tuple(name for name, traits in SEQUENCES.items() if traits.estimates_error)


def check_shading(name: Any, choices: tuple[str, ...] = SHADINGS) -> str:
    """Return `name` if it is one of the `choices`; raise InputError with a remedy otherwise.

    The list of choices is long, so the message has it only if no choice is similar to `name`.
    """
    if isinstance(name, str) and name not in choices:
        if name in MODELS:
            remedy = f'{name} needs a file, which only a material can name: model = "{name}", file = "brass.binary"'
            raise InputError(f"expected a model without a file, got {format_value(name)}; {remedy}", "shading")
        if name == "none":
            remedy = "the materials keep their models without this setting, in Python also with None"
            raise InputError(f"expected a reflectance model, got {format_value(name)}; {remedy}", "shading")
        if near := did_you_mean(name, choices):
            raise InputError(f"expected a reflectance model, got {format_value(name)}{near}", "shading")
    return check_choice(name, "shading", choices)


def _check_precision(bits: Any) -> int:
    try:
        result = integer(bits, "precision", 32, 64)
    except InputError:
        result = 0
    if result not in get_args(Precision):
        raise InputError(
            f"expected one of {', '.join(map(str, get_args(Precision)))}, got {format_value(bits)}", "precision"
        )
    return result
