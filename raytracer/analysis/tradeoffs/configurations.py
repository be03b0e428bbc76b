"""Configurations to be tried: a table of all knobs, and of the combinations that are of use."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, get_args

import msgspec

from raytracer.scene.options import Evaluator, Shadows
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SEQUENCES
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import EMPTY, SettingsPatch

# Lights of a scene none of which has a radius get one for soft shadows: this share of their distance from what the
# camera looks at, so penumbras are seen as wide everywhere. The sun's is 0.005, a bulb's over a table 0.05.
RADIUS_SHARE = 0.05


class Target(msgspec.Struct, frozen=True):
    """The aim of some configurations: the picture that `scene` converges to with `settings`.

    `same_samples`: instead, the picture with just these settings, so that configurations with the same samples differ
    from it by nothing but what they approximate.
    """

    name: str
    scene: Scene
    settings: Settings
    same_samples: bool = False


class Configuration(msgspec.Struct, frozen=True):
    """One way to make a target's picture.

    `knobs`: those whose series it belongs to. `scale`: of the side of the picture that is rendered, which is then
    brought to its size. `estimates`: the picture also tells its own error. `scene`: one that differs from the target's.
    """

    knobs: tuple[str, ...]
    label: str
    target: str
    settings: Settings
    scale: float = 1.0
    estimates: bool = False
    scene: Scene | None = None


class Plan(msgspec.Struct):
    """All that is to be measured; `left_out` says of which knobs there is nothing, and why.

    `file_settings`: what the scene file's [settings] give.
    """

    targets: dict[str, Target]
    configurations: list[Configuration]
    left_out: list[tuple[str, str]]
    file_settings: SettingsPatch = EMPTY


class Extent(NamedTuple):
    """How much of each knob is tried."""

    samples: Sequence[int] = (1, 2, 4, 8, 16, 32, 64, 128, 256)
    sequence_samples: Sequence[int] = (4, 16, 64, 256)
    thresholds: Sequence[float] = (0.1, 0.03, 0.01, 0.003, 0.001)
    adaptive_samples: Sequence[int] = (16, 64)
    errors: Sequence[float] = (0.01, 0.005, 0.002, 0.001, 0.0005)
    shadow_samples: Sequence[int] = (1, 4, 16, 64)
    rays: Sequence[int] = (1, 2, 4, 8, 16, 32, 64)
    scales: Sequence[float] = (0.25, 0.5, 2.0)
    scale_samples: Sequence[int] = (1, 4, 16)
    one: int = 16  # samples where the knob is another one
    nodes: Sequence[int] = (40, 64, 128, 256, 512, 1024)
    most_nodes: int = 4096
    terms: Sequence[int] = (16, 32, 64)
    most_terms: int = 128
    shading_samples: int = 1
    tables: bool = True  # of measured materials, whose making takes a while


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

# The target whose pictures most knobs are about.
MAIN = "hard shadows"


def plan(scene: Scene, extent: Extent = FULL, file_settings: SettingsPatch = EMPTY) -> Plan:
    """Plan what to try on `scene`, apart from shading (approximations.py).

    What is no knob, and what knobs are turned from, is as the scene file's [settings] have it; but for the shadows.
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
    made_plan = Plan({target.name: target for target in targets}, [], left_out, file_settings)
    merged: dict[object, Configuration] = {}
    for made in _configurations(extent, base):
        if made.target in made_plan.targets:
            key = made.target, made.settings, made.scale, made.estimates
            known = merged.get(key)
            merged[key] = (
                msgspec.structs.replace(known, knobs=tuple(dict.fromkeys((*known.knobs, *made.knobs))))
                if known
                else made
            )
    made_plan.configurations = list(merged.values())
    return made_plan


def _configurations(extent: Extent, base: Settings) -> Iterator[Configuration]:
    for n in extent.samples:
        yield configuration("samples", base, samples=n)
    for n in extent.shadow_samples:
        yield configuration("error estimate", base, samples=n, estimates=True)
    for sequence in SEQUENCES:
        for n in extent.sequence_samples:
            yield configuration("sequence", base, samples=n, sequence=sequence)
            if n <= max(extent.rays):
                yield configuration("sequence, soft shadows", base, samples=n, sequence=sequence, shadows="soft")
    yield configuration("sequence", base, samples=1)
    for n in extent.adaptive_samples:
        yield configuration("adaptive", base, samples=n)
        for threshold in extent.thresholds:
            yield configuration("adaptive", base, samples=n, adaptive=threshold)
    for error in extent.errors:
        yield configuration("max error", base, samples=4096, max_error=error)
    for kind in get_args(Shadows):
        for n in extent.rays if kind == "soft" else extent.shadow_samples:
            yield configuration("shadows", base, samples=n, shadows=kind)
    for precision in (32, 64):
        yield configuration("precision", base, samples=extent.one, precision=precision)
    for evaluator in get_args(Evaluator):
        yield configuration("evaluator", base, samples=extent.one, evaluator=evaluator)
    for n in extent.scale_samples:
        for scale in (1.0, *extent.scales):
            yield configuration("resolution", base, scale, samples=n)


def configuration(
    knob: str, base: Settings, scale: float = 1.0, *, estimates: bool = False, **changes: Any
) -> Configuration:
    """`base` with some changes, labelled by what it is."""
    settings = msgspec.structs.replace(base, **changes)
    label = describe(settings, base)
    if scale != 1.0:
        label += f", at {scale:g} x the size"
    if estimates:
        label += ", with its error"
    return Configuration((knob,), label, f"{settings.shadows} shadows", settings, scale, estimates)


def describe(settings: Settings, base: Settings) -> str:
    """In words, but for the shadows, and for what `base` has, too."""
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
    """`scene` with lights that have a radius, and what was done for that; "" if it has such lights."""
    if not scene.lights or any(light.radius for light in scene.lights):
        return scene, ""
    lights = [
        msgspec.structs.replace(light, radius=max(RADIUS_SHARE * math.dist(light.position, scene.camera.look_at), 1e-9))
        for light in scene.lights
    ]
    return msgspec.structs.replace(scene, lights=lights), (
        "no light of the scene has a radius: here they have one that is "
        f"{RADIUS_SHARE:g} of their distance from what the camera looks at"
    )
