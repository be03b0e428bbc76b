"""What is traded between speed and accuracy, apart from the scene."""

from __future__ import annotations

import math
from typing import Any, get_args

import msgspec

from raytracer.core.record import Record, public
from raytracer.core.validation import InputError, Vec3, check_choice, number, set_fields, shown, whole
from raytracer.scene.instances import Instances
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS, REFLECTED
from raytracer.scene.options import CompileOptions, Evaluator, Precision, SamplingOptions, Shading, Shadows
from raytracer.scene.scene import PointLight, Scene
from raytracer.scene.sequences import PROGRESSIVE, SEQUENCES, Sequence
from raytracer.scene.solids import Solid, Sphere, leaves

MAX_SAMPLES = 65536
# Where an error, a time or adaptive samples are asked for, unless a number of samples is, too: the error falls by less
# than 1e-3 then.
ASKED_SAMPLES = 4096
MAX_BOUNCES = 64


@public
class Settings(Record, frozen=True):
    """How to render.

    `samples` a pixel, 1 to 65536. `shadows`: "off", "hard" (a blocked light gives nothing),
    "diluted" (it gives the share dist(P, Q) / dist(P, light), Q the first blocking point) or "soft" (each sample
    looks at one point of each light that has a radius; under all others a light is its centre).
    `shading`: None for each material's own model, or the name of a model for all (convert.py). `evaluator`
    finds where a ray meets a CSG tree: "cells" (looks only at what a cell of the picture or of a light's
    surroundings can meet), "walk" (at everything) or "roth" (the assignment's hit lists, the readable one);
    their pictures agree. `precision`: bits of the numbers in which rays and
    surfaces are intersected: 32, or 64 for scenes beyond what 32 resolve (needs OpenGL 4.0).
    `adaptive`: None, or an error in linear radiance, above 0, such as 0.01: only where a pixel's mean is estimated
    to be off by more do pixels near it get more than 3 samples, up to `samples` (adaptive.py).
    `bounces`: how many mirrors in a row light is followed through, 0 to 64; what comes after is left out.
    `sequence`: where in a pixel its samples lie (sequences.py); "grid", "rotated" and "corners" take a square number.
    `max_error`: None, or the root mean square error in linear radiance, above 0, such as 0.002: samples are added,
    up to `samples`, until it is estimated to be less (error_estimate.py). `time`: None, or seconds, above 0: samples
    are added, up to `samples`, as long as they last. Programs are compiled before, and what the centre rays of pixels
    see (geometry) is found before.
    """

    samples: int = 1
    shading: Shading | None = None
    shadows: Shadows = "hard"
    evaluator: Evaluator = "cells"
    precision: Precision = 32
    adaptive: float | None = None
    bounces: int = 8
    sequence: Sequence = "sobol"
    max_error: float | None = None
    time: float | None = None

    def __post_init__(self) -> None:
        set_fields(
            self,
            samples=whole(self.samples, "samples", 1, MAX_SAMPLES),
            bounces=whole(self.bounces, "bounces", 0, MAX_BOUNCES),
            shadows=check_choice(self.shadows, "shadows", get_args(Shadows)),
            evaluator=check_choice(self.evaluator, "evaluator", get_args(Evaluator)),
            precision=_precision(self.precision),
            sequence=check_choice(self.sequence, "sequence", SEQUENCES),
        )
        if (shading := self.shading) is not None:
            hint = shading_hint(shading)
            set_fields(self, shading=check_choice(shading, "shading", get_args(Shading), hint=hint))
        for key, unit in (("adaptive", "linear radiance"), ("max_error", "linear radiance"), ("time", "seconds")):
            if (value := getattr(self, key)) is not None:
                expected = f"a finite number above 0 ({unit})"
                set_fields(self, **{key: number(value, key, math.ulp(0.0), expected=expected)})
                # The samples of no other tell the error.
                fit = ("sobol",) if key == "max_error" else PROGRESSIVE
                if self.sequence not in fit:
                    raise InputError(f"expected {' or '.join(fit)} with {key}, got {shown(self.sequence)}", "sequence")
        if self.adaptive is not None and self.asks:
            raise InputError(
                "expected none with max_error or time, which decide themselves where samples go: leave out one or the "
                "other",
                "adaptive",
            )
        if self.sequence not in PROGRESSIVE and math.isqrt(self.samples) ** 2 != self.samples:
            expected = f"a square number, such as 16, for the sequence {self.sequence}"
            raise InputError(f"expected {expected}, got {self.samples}", "samples")

    @property
    def compile_options(self) -> CompileOptions:
        """The half that decides shaders and arrays."""
        return CompileOptions(self.shading, self.shadows, self.evaluator, self.precision, self.bounces)

    @property
    def sampling(self) -> SamplingOptions:
        """The half that decides samples."""
        return SamplingOptions(self.samples, self.sequence, self.adaptive, self.max_error, self.time)

    @property
    def refines(self) -> bool:
        """Whether pixels may get different numbers of samples."""
        return self.adaptive is not None or self.asks

    @property
    def tells(self) -> bool:
        """Whether the samples tell the picture's error (error_estimate.py)."""
        return self.sequence == "sobol" and self.samples > 1

    @property
    def asks(self) -> bool:
        """Whether an error or a time is asked for, and the samples follow from that."""
        return self.max_error is not None or self.time is not None

    def shaded(self, material: Material) -> Material:
        """`material` under the shading override. Raises InputError if that would take an exponent above 1e6."""
        if not isinstance(material, Material):
            raise InputError(f"expected a Material, got {shown(material)}", "material")
        if self.shading is None:
            return material
        from raytracer.scene.materials.convert import translated  # few pictures need it

        return translated(material, self.shading)

    def cast(self, light: PointLight) -> PointLight:
        """`light` under these shadows: its centre, unless they are soft."""
        if not isinstance(light, PointLight):
            raise InputError(f"expected a PointLight, got {shown(light)}", "light")
        return light if self.shadows == "soft" else msgspec.structs.replace(light, radius=0.0)


# Materials that get a warning each; a scene may have a million.
_NAMED = 5


def scene_warnings(scene: Scene, settings: Settings) -> list[str]:
    """Everything to tell a user whose picture of `scene` may well be another one than meant: one sentence each."""
    single = precision_warning(scene, settings), shadows_warning(scene, settings)
    return [*filter(None, single), *brightness_warnings(scene)]


NO_RADIUS = "no light has a radius"


def shadows_warning(scene: Scene, settings: Settings) -> str | None:
    """A warning of soft shadows where every light is a point, or None."""
    if settings.shadows != "soft" or not scene.lights or any(light.radius for light in scene.lights):
        return None
    return f"soft shadows are hard ones here, as {NO_RADIUS}: give a light one, such as radius = 0.5"


def brightness_warnings(scene: Scene) -> list[str]:
    """A warning for each material that reflects more light than reaches it, such as one of colours from 0 to 255."""
    bright = [(i, material, keys) for i, material in enumerate(scene.materials) if (keys := _too_bright(material))]
    warnings = [
        f"material {shown(material.name or i)}: {keys}: above 1 more light is reflected than comes in (colours are "
        "linear and from 0 to 1, not from 0 to 255)"
        for i, material, keys in bright[:_NAMED]
    ]
    if len(bright) > _NAMED:
        warnings.append(f"{len(bright) - _NAMED} more materials reflect more light than comes in")
    return warnings


def _too_bright(material: Material) -> str:
    """The parameters of a material that are above 1, and should not be; "" if none is."""
    values = material.parameters
    colors = (p.name for p in MODELS[material.model].parameters.values() if p.unit == REFLECTED and p.name in values)
    return ", ".join(
        f"{name} = {str(max(values[name])).removesuffix('.0')}" for name in colors if max(values[name]) > 1.0
    )


# In float32 a point at distance d is known to about 4 x 2^-24 d. Once that is 1 % of a sphere's
# radius, its cuts and the shadows on it begin to be visibly off: a ratio of 41943.
_RESOLVED = 0.01 * 2.0**24 / 4.0


def precision_warning(scene: Scene, settings: Settings) -> str | None:
    """What to tell a user whose scene goes beyond what its precision resolves, or None.

    The measure is the largest distance from the camera at which a sphere can be seen over the smallest radius.
    """
    if settings.precision == 64:
        return None
    eye = scene.camera.position
    reached = [_reach_of_many(o, eye) if isinstance(o, Instances) else _reach(o, eye) for o in scene.objects]
    farthest, smallest = max(far for far, _ in reached), min(small for _, small in reached)
    if farthest <= _RESOLVED * smallest:
        return None
    return (
        f"the largest distance ({farthest:.2g}) is {farthest / smallest:.2g} times the smallest radius "
        f"({smallest:.2g}), more than the {_RESOLVED:.0f} that 32 bits resolve to 1 %: try --precision 64"
    )


def _reach(solid: Solid, eye: Vec3) -> tuple[float, float]:
    """The largest distance at which a sphere can be seen, and the smallest radius; (0, inf) without spheres.

    From outside it is seen as far as its outline, from inside as far as its other side.
    """
    spheres = [leaf for leaf in leaves(solid) if isinstance(leaf, Sphere)]
    farthest = 0.0
    for sphere in spheres:
        power = sphere.power(eye)
        far = math.sqrt(power) if power > 0.0 else math.dist(sphere.center, eye) + sphere.radius
        farthest = max(farthest, far)
    return farthest, min((sphere.radius for sphere in spheres), default=math.inf)


def _reach_of_many(instances: Instances, eye: Vec3) -> tuple[float, float]:
    """As _reach(), all at once: float64 is exact enough for a warning."""
    import numpy as np

    centers, radii = instances.spheres()
    distance = np.linalg.norm(centers - eye, axis=2)
    outside = distance > radii
    outline = np.sqrt(np.where(outside, (distance - radii) * (distance + radii), 0.0))
    far = np.where(outside, outline, distance + radii)
    return float(far.max(initial=0.0)), float(radii.min(initial=math.inf))


def shading_hint(name: Any) -> str:
    """The end of an error about a shading that is none, where it is a model that needs more than numbers; else ""."""
    if isinstance(name, str) and name in MODELS and name not in get_args(Shading):
        return f'; {name} needs a file, so only a material can have it: model = "{name}", file = "brass.binary"'
    return ""


def _precision(bits: Any) -> int:
    try:
        result = whole(bits, "precision", 32, 64)
    except InputError:
        result = 0
    if result not in get_args(Precision):
        raise InputError(f"expected one of {', '.join(map(str, get_args(Precision)))}, got {shown(bits)}", "precision")
    return result


def checked_settings(settings: Any) -> dict[str, Any]:
    """The fields of `settings`, none of None. Raises InputError for another type."""
    if settings is None:
        return {}
    if not isinstance(settings, Settings):
        makers = "Settings(), quality() or load_settings() make them"
        raise InputError(f"expected Settings ({makers}), got {shown(settings)}", "settings")
    return msgspec.structs.asdict(settings)
