"""All models at the ends of their ranges: what is measured, held against what is written down."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import msgspec
import numpy as np

from raytracer.analysis.reflectance.closed_forms import ALBEDOS
from raytracer.analysis.reflectance.expectations import Settings, Verdict, expected, settings_of
from raytracer.analysis.reflectance.measure import DEGREES, RESOLVED, Measured, measure
from raytracer.core.progress import Progress
from raytracer.formats.material_library import MaterialLibrary
from raytracer.gpu.device import Device
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# Of what the facets' areas add up to. The rational fit of Beckmann's masking is itself 0.35 % off.
_FACETS = 1e-3
_FACETS_RATIONAL = 4e-3
# Angles are rounded by less.
_SAME_ANGLE = 0.01


class Check(msgspec.Struct, frozen=True):
    """What was measured of a model, or of a published material, with some settings.

    `differs` says in words how that is not what the verdict says; there is none on published materials.
    """

    name: str
    settings: Settings
    measured: Measured
    verdict: Verdict | None
    differs: list[str]


def check(name: str, settings: Settings, device: Device | None = None, degrees: Sequence[float] = DEGREES) -> Check:
    """Measure a model, or a published material, with some settings, and compare. InputError for wrong settings."""
    measured = measure(material_of(name, settings), degrees, device)
    verdict = expected(measured.material) if name in MODELS else None
    return Check(name, settings, measured, verdict, list(_differences(measured, verdict)))


def material_of(name: str, settings: Settings) -> Material:
    """The model, or published material, of that name, with these settings."""
    return Material(name, **settings) if name in MODELS else MaterialLibrary().material(name).replace(**settings)


def check_all(models: Sequence[str], device: Device | None = None, progress: Progress | None = None) -> list[Check]:
    """Each of these models, which need no file, with each of its settings."""
    todo = [(model, settings) for model in models for settings in settings_of(model)]
    found = []
    for i, (model, settings) in enumerate(todo):
        if progress:
            progress(i, len(todo))
        found.append(check(model, settings, device))
    if progress:
        progress(len(todo), len(todo))
    return found


def _differences(found: Measured, verdict: Verdict | None) -> Iterator[str]:
    if not found.finite:
        yield "NaN or infinity"
    if not found.positive:
        yield f"negative: {found.least:.3g}"
    if added := found.facets:
        bound = _FACETS_RATIONAL if found.material.get("smith") == "rational" else _FACETS
        for name, off in (("weak white furnace", added.furnace), ("equation (vi)", added.normals)):
            if off - added.error > bound or (added.error > bound and verdict is not None and verdict.resolved):
                yield f"{name}: {off:.2g} off (+- {added.error:.2g}), at most {bound:g} expected"
    yield from _albedos(found)
    if verdict is None:
        return
    for name in ("reciprocal", "conserving"):
        is_, should = getattr(found, name), getattr(verdict, name)
        if is_ is not None and should is not None and is_ != should:
            yield f"{'' if is_ else 'not '}{name}, {'' if should else 'not '}{name} expected"
    largest = found.largest
    if verdict.resolved and not largest.resolved:
        yield f"not resolved at {largest.degrees:.4g} degrees: {largest.value:.4g} +- {largest.error:.1g}"
    if verdict.largest and not abs(largest.value - verdict.largest[0]) <= verdict.largest[1]:
        yield f"largest albedo {largest.value:.5g}, {verdict.largest[0]:.5g} +- {verdict.largest[1]:g} expected"
    if verdict.at is not None and abs(largest.degrees - verdict.at) > _SAME_ANGLE:
        yield f"largest albedo at {largest.degrees:.4g} degrees, at {verdict.at:g} expected"


def _albedos(found: Measured) -> Iterator[str]:
    """Where albedos are not what a closed form says."""
    formula = ALBEDOS.get(found.material.model)
    for albedo in found.albedos if formula else ():
        right = formula(found.material, math.cos(math.radians(albedo.degrees))) if formula else None
        if right is None or not albedo.resolved:
            continue
        value = float(np.max(right))
        if not abs(albedo.value - value) <= 2.0 * RESOLVED * max(1.0, value):
            yield f"albedo {albedo.value:.6g} at {albedo.degrees:.4g} degrees, {value:.6g} by its closed form"
