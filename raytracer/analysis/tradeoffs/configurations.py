"""Table of the configurations that `raytracer trade` measures: each knob alone, and useful combinations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, get_args

import msgspec

from raytracer.scene.options import Evaluator, Shadows
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SEQUENCES
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import EMPTY_PATCH, SettingsPatch

# The radius of a light for soft shadows, in a scene whose lights have none, as a share of the light's distance from the
# point that the camera looks at. So penumbras look equally wide in all scenes. The sun has 0.005, a lamp over a table
# 0.05.
RADIUS_SHARE = 0.05


class Target(msgspec.Struct, frozen=True):
    """The scene and settings whose converged picture some configurations are compared with.

    With `same_samples`, the reference is instead the picture with exactly these settings, so that configurations with
    the same samples differ from it only by their approximation.
    """

    name: str
    scene: Scene
    settings: Settings
    same_samples: bool = False


class Configuration(msgspec.Struct, frozen=True):
    """One way to render a target's picture."""

    knobs: tuple[str, ...]  # the knobs whose series the configuration belongs to
    label: str
    target: str  # name of the target
    settings: Settings
    scale: float = 1.0  # the side of the rendered picture over the side of the target, to which it is resized
    estimates: bool = False  # whether the picture estimates its own error
    scene: Scene | None = None  # None: the target's scene


class Plan(msgspec.Struct):
    """The list of all measurements."""

    targets: dict[str, Target]
    configurations: list[Configuration]
    left_out: list[tuple[str, str]]  # knobs that are not measured, and why
    file_settings: SettingsPatch = EMPTY_PATCH  # the scene file's [settings]


class Extent(NamedTuple):
    """The values of each knob that are measured."""

    samples: Sequence[int] = (1, 2, 4, 8, 16, 32, 64, 128, 256)
    sequence_samples: Sequence[int] = (4, 16, 64, 256)
    thresholds: Sequence[float] = (0.1, 0.03, 0.01, 0.003, 0.001)
    adaptive_samples: Sequence[int] = (16, 64)
    errors: Sequence[float] = (0.01, 0.005, 0.002, 0.001, 0.0005)
    shadow_samples: Sequence[int] = (1, 4, 16, 64)
    rays: Sequence[int] = (1, 2, 4, 8, 16, 32, 64)
    scales: Sequence[float] = (0.25, 0.5, 2.0)
    scale_samples: Sequence[int] = (1, 4, 16)
    one: int = 16  # the number of samples if another knob varies
    nodes: Sequence[int] = (40, 64, 128, 256, 512, 1024)
    most_nodes: int = 4096
    terms: Sequence[int] = (16, 32, 64)
    most_terms: int = 128
    shading_samples: int = 1
    tables: bool = True  # whether to measure tables of measured materials, which take a while to draw


FULL = Extent()
QUICK = Extent(
    samples=(1, 4, 16),
    sequence_samples=(4, 16),
    thresholds=(0.03,),
    adaptive_samples=(16,),
    errors=(0.01,),
    shadow_samples=(4,),
    rays=(1, 4),
    scales=(0.5, 2.0),
    scale_samples=(1,),
    one=4,
    nodes=(64,),
    most_nodes=256,
    terms=(16,),
    most_terms=32,
    tables=False,
)

# The target of most knobs.
MAIN = "hard shadows"


def plan(scene: Scene, extent: Extent = FULL, file_settings: SettingsPatch = EMPTY_PATCH) -> Plan:
    """Plan the measurements on `scene`, without shading approximations (approximations.py).

    Settings that do not vary, and the base values of all knobs, come from the scene file's [settings], except hard
    shadows.
    """
    base = file_settings.without_sampling().resolve().replace(shadows="hard")
    round_scene, note = with_round_lights(scene)
    kinds = {"hard": scene, "off": scene, "diluted": scene, "soft": round_scene}
    targets = [
        Target(f"{kind} shadows", lit, msgspec.structs.replace(base, shadows=kind)) for kind, lit in kinds.items()
    ]
    left_out = [("soft shadows", note)] if note else []
    if not scene.lights:
        targets = targets[:1]
        left_out = [("shadows", "the scene has no lights")]
    planned = Plan({target.name: target for target in targets}, [], left_out, file_settings)
    merged: dict[object, Configuration] = {}
    for candidate in _configurations(extent, base):
        if candidate.target in planned.targets:
            key = candidate.target, candidate.settings, candidate.scale, candidate.estimates
            known = merged.get(key)
            merged[key] = (
                msgspec.structs.replace(known, knobs=tuple(dict.fromkeys((*known.knobs, *candidate.knobs))))
                if known
                else candidate
            )
    planned.configurations = list(merged.values())
    return planned


def _configurations(extent: Extent, base: Settings) -> Iterator[Configuration]:
    for n in extent.samples:
        yield make_configuration("samples", base, samples=n)
    for n in extent.shadow_samples:
        yield make_configuration("error estimate", base, samples=n, estimates=True)
    for sequence in SEQUENCES:
        for n in extent.sequence_samples:
            yield make_configuration("sequence", base, samples=n, sequence=sequence)
            if n <= max(extent.rays):
                yield make_configuration("sequence, soft shadows", base, samples=n, sequence=sequence, shadows="soft")
    yield make_configuration("sequence", base, samples=1)
    for n in extent.adaptive_samples:
        yield make_configuration("adaptive", base, samples=n)
        for threshold in extent.thresholds:
            yield make_configuration("adaptive", base, samples=n, adaptive=threshold)
    for error in extent.errors:
        yield make_configuration("max error", base, samples=4096, max_error=error)
    for kind in get_args(Shadows):
        for n in extent.rays if kind == "soft" else extent.shadow_samples:
            yield make_configuration("shadows", base, samples=n, shadows=kind)
    for precision in (32, 64):
        yield make_configuration("precision", base, samples=extent.one, precision=precision)
    for evaluator in get_args(Evaluator):
        yield make_configuration("evaluator", base, samples=extent.one, evaluator=evaluator)
    for n in extent.scale_samples:
        for scale in (1.0, *extent.scales):
            yield make_configuration("resolution", base, scale, samples=n)


def make_configuration(
    knob: str, base: Settings, scale: float = 1.0, *, estimates: bool = False, **changes: Any
) -> Configuration:
    """Return the configuration of `base` with some changes, and with a label that names them."""
    settings = msgspec.structs.replace(base, **changes)
    label = describe(settings, base)
    if scale != 1.0:
        label += f", at {scale:g} x the size"
    if estimates:
        label += ", with its error"
    return Configuration((knob,), label, f"{settings.shadows} shadows", settings, scale, estimates)


def describe(settings: Settings, base: Settings) -> str:
    """Describe settings in words, without the shadows, and without settings that `base` has, too."""
    parts = []
    if settings.max_error is not None:
        parts.append(f"error {settings.max_error:g}")
    elif settings.samples == 1:
        parts.append("1 sample, the centre")
    else:
        side = math.isqrt(settings.samples)
        grid = f" {side} x {side}" if settings.sequence in ("grid", "corners") else ""
        parts.append(f"{settings.samples} {settings.sequence}{grid}")
    if settings.adaptive is not None:
        parts.append(f"adaptive {settings.adaptive:g}")
    if settings.precision != base.precision:
        parts.append(f"{settings.precision} bits")
    if settings.evaluator != base.evaluator:
        parts.append(settings.evaluator)
    return ", ".join(parts)


def with_round_lights(scene: Scene) -> tuple[Scene, str]:
    """Return `scene` with lights that have a radius, and a note about the change: "" if it already has such lights."""
    if not scene.lights or any(light.radius for light in scene.lights):
        return scene, ""
    lights = [
        msgspec.structs.replace(light, radius=max(RADIUS_SHARE * math.dist(light.position, scene.camera.look_at), 1e-9))
        for light in scene.lights
    ]
    return msgspec.structs.replace(scene, lights=lights), (
        "no light of the scene has a radius: for soft shadows each light has a radius of "
        f"{RADIUS_SHARE:g} of its distance from the point that the camera looks at"
    )
