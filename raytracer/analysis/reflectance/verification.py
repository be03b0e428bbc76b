"""Verification of the reflectance models: measurements at the ends of their ranges, compared with expectations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import msgspec
import numpy as np

from raytracer.analysis.reflectance.closed_forms import ALBEDOS
from raytracer.analysis.reflectance.expectations import Expectation, find_expectation
from raytracer.analysis.reflectance.properties import DEGREES, RESOLVED, MaterialProperties, measure_material
from raytracer.analysis.reflectance.tried_parameters import Parameters, tried_parameters
from raytracer.core.progress import Progress
from raytracer.formats.material_library import MaterialLibrary
from raytracer.gpu.device import Device
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# Tolerances of the integrals over facets: in general, and for the rational fit of Beckmann's masking, whose own error
# is 0.35 %.
_FACETS = 1e-3
_FACETS_RATIONAL = 4e-3
# Tolerance of angles in degrees, more than their rounding error.
_SAME_ANGLE = 0.01


class Verification(msgspec.Struct, frozen=True):
    """The measured properties of a model, or of a published material, with some parameters, and the expectation.

    `differs` lists the differences between both in words. Published materials have no expectation.
    """

    name: str
    parameters: Parameters
    properties: MaterialProperties
    expectation: Expectation | None
    differences: list[str]


def verify(
    name: str, parameters: Parameters, device: Device | None = None, degrees: Sequence[float] = DEGREES
) -> Verification:
    """Measure a model, or a published material, with some parameters, and compare it with the expectation.

    Raises InputError for an unknown name or a wrong parameter.
    """
    properties = measure_material(make_material(name, parameters), degrees, device)
    expectation = find_expectation(properties.material) if name in MODELS else None
    return Verification(name, parameters, properties, expectation, list(_differences(properties, expectation)))


def make_material(name: str, parameters: Parameters) -> Material:
    """Return the material of a model, or a published material, with some parameters replaced."""
    return Material(name, **parameters) if name in MODELS else MaterialLibrary().material(name).replace(**parameters)


def verify_all(
    models: Sequence[str], device: Device | None = None, progress: Progress | None = None
) -> list[Verification]:
    """Verify models that need no file, each with all its tried parameters."""
    pairs = [(model, parameters) for model in models for parameters in tried_parameters(model)]
    verifications = []
    for i, (model, parameters) in enumerate(pairs):
        if progress:
            progress(i, len(pairs))
        verifications.append(verify(model, parameters, device))
    if progress:
        progress(len(pairs), len(pairs))
    return verifications


def _differences(properties: MaterialProperties, expectation: Expectation | None) -> Iterator[str]:
    if not properties.finite:
        yield "NaN or infinity"
    if not properties.positive:
        yield f"negative: {properties.least:.3g}"
    if facets := properties.facets:
        bound = _FACETS_RATIONAL if properties.material.get("smith") == "rational" else _FACETS
        for name, off in (("weak white furnace", facets.furnace), ("equation (vi)", facets.normals)):
            if off - facets.error > bound or (
                facets.error > bound and expectation is not None and expectation.resolved
            ):
                yield f"{name}: differs from 1 by {off:.2g} (+- {facets.error:.2g}), at most {bound:g} expected"
    yield from _albedos(properties)
    if expectation is None:
        return
    for name in ("reciprocal", "conserving"):
        is_, should = getattr(properties, name), getattr(expectation, name)
        if is_ is not None and should is not None and is_ != should:
            yield f"{'' if is_ else 'not '}{name}, {'' if should else 'not '}{name} expected"
    largest = properties.largest
    if expectation.resolved and not largest.resolved:
        yield f"not resolved at {largest.degrees:.4g} degrees: {largest.value:.4g} +- {largest.error:.1g}"
    if expectation.largest and not abs(largest.value - expectation.largest[0]) <= expectation.largest[1]:
        yield f"largest albedo {largest.value:.5g}, {expectation.largest[0]:.5g} +- {expectation.largest[1]:g} expected"
    if expectation.at is not None and abs(largest.degrees - expectation.at) > _SAME_ANGLE:
        yield f"largest albedo at {largest.degrees:.4g} degrees, at {expectation.at:g} expected"


def _albedos(properties: MaterialProperties) -> Iterator[str]:
    """Yield the differences between measured albedos and their closed form."""
    formula = ALBEDOS.get(properties.material.model)
    for albedo in properties.albedos if formula else ():
        exact = formula(properties.material, math.cos(math.radians(albedo.degrees))) if formula else None
        if exact is None or not albedo.resolved:
            continue
        value = float(np.max(exact))
        if not abs(albedo.value - value) <= 2.0 * RESOLVED * max(1.0, value):
            yield f"albedo {albedo.value:.6g} at {albedo.degrees:.4g} degrees, {value:.6g} by its closed form"
