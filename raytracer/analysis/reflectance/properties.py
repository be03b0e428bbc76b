"""Measured properties of a material, from the GLSL that renders: positivity, reciprocity, energy, sums over facets.

The measurement is independent of the expectations in `expectations.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import msgspec
import numpy as np

from raytracer.analysis.reflectance.quadrature import (
    NORMAL,
    Array,
    Fineness,
    Rule,
    facing_rule,
    halfway_rule,
    polar_rule,
    union_rule,
)
from raytracer.compiler.material_layout import make_layout
from raytracer.gpu.device import Device
from raytracer.rendering.brdf import call, evaluate
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# The models whose default parameters make a complete material: all except merl, which needs a file.
COMPLETE = [name for name, model in MODELS.items() if all(p.default is not None for p in model.parameters.values())]
# Angles to the normal at which albedos are measured, up to a cosine of 0.0017.
DEGREES = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0, 89.0, 89.5, 89.9)
# The largest error of a resolved albedo: absolute for albedos up to 1, relative above.
RESOLVED = 5e-4
# The fineness of the quadrature, and factors of increasing fineness: they are tried until two in a row agree.
_FINE = Fineness(6, 16)
_FINER = (0.7, 1.0, 2.0, 4.0, 6.0)
# Models whose lobes are polar about the mirror direction, and models without lobes. For others see _rule().
_ABOUT_MIRROR = ("phong", "phong_normalized", "strauss")
_WITHOUT_LOBES = ("lambert", "minnaert", "oren_nayar", "eon", "diffuse_microfacet", "lafortune")
# The largest relative difference of a reciprocal f: rounding to float32, of directions and of results.
RECIPROCAL = 1e-4
# The same of a measured table. Its format makes it reciprocal: wi and wo in the other order meet the same cells. But at
# grazing angles, rounding moves the place in the table, and neighbouring cells may differ much. The difference is up to
# 2.5e-4 for tables of smooth models, and 5e-4 for a table of random values that differ by a factor of e.
RECIPROCAL_TABLE = 1e-3
# The least cosine of directions in pairs for reciprocity, and the least f: smaller values have few or no bits of
# float32 left.
_LEAST_COSINE = 1e-3
_LEAST_VALUE = 1e-30
_PAIRS = 2048
# The share of f's median over all pairs that is the least denominator of relative differences.
_NOTHING = 1e-2
# The largest amount by which the measured albedo of an energy-conserving material may exceed 1.
CONSERVING = 1e-3
# Angles of the viewers of the sums over facets.
_FACET_DEGREES = (0.0, 45.0, 75.0, 85.0, 89.0)
# Finer than for albedos, because the masking of Beckmann's facets compensates exactly for D, to 1e-7.
_FACETS_FINE = Fineness(24, 12)


class Albedo(msgspec.Struct, frozen=True):
    """A directional albedo, the largest of the three channels."""

    degrees: float  # angle to the normal
    value: float
    error: float  # estimated; nan if the albedo is not finite

    @property
    def resolved(self) -> bool:
        """Whether the error is small. The value of an albedo that is not resolved has no meaning."""
        return self.error <= RESOLVED * max(1.0, abs(self.value))


class Facets(msgspec.Struct, frozen=True):
    """The largest differences from 1 of two integrals over facets. D is the facets' distribution, G1 their masking.

    `normals`: the integral of G1 D <wo.m> over all facets m, divided by cos(theta_o): equation (vi) of the
    article "Microfacet BRDFs from Scratch".
    `furnace`: the integral of G1 D / (4 cos(theta_o)) over all light, also from below, that a facet reflects to the
    viewer: the weak white furnace test of Heitz (2014). `error`: the estimated error of both.
    """

    normals: float
    furnace: float
    error: float


class MaterialProperties(msgspec.Struct, frozen=True):
    """The measured properties of a material."""

    material: Material
    least: float  # the least value of f cos(theta_i)
    finite: bool  # whether no value is NaN or infinite
    reciprocity: float  # the largest relative difference of f(wi, wo) and f(wo, wi)
    albedos: list[Albedo]  # the light seen from one direction, under equal light from everywhere
    beams: list[Albedo]  # the light that a beam from one direction sends everywhere; equal to `albedos` if reciprocal
    delta: bool  # whether a part is reflected to one direction only; the albedos include this part
    facets: Facets | None = None  # only of models with a distribution of facets and Smith's masking

    @property
    def positive(self) -> bool:
        return self.least >= 0.0

    @property
    def reciprocal(self) -> bool:
        return is_within_rounding(self.reciprocity, self.material)

    @property
    def largest(self) -> Albedo:
        """The largest albedo of the two kinds, at its first angle; or the largest that is not resolved, if any."""
        albedos = [*self.albedos, *self.beams]
        most = max(albedos, key=lambda a: (not a.resolved, a.value))
        return next(
            (a for a in albedos if most.resolved and a.value >= most.value - RESOLVED * max(1.0, most.value)), most
        )

    @property
    def conserving(self) -> bool | None:
        """Whether the material never reflects more light than it receives; None if albedos are not resolved."""
        if any(a.resolved and a.value > 1.0 + CONSERVING + a.error for a in (*self.albedos, *self.beams)):
            return False
        return True if self.largest.resolved else None


def measure_material(
    material: Material, degrees: Sequence[float] = DEGREES, device: Device | None = None
) -> MaterialProperties:
    """Measure all properties of a material. `degrees`: the angles to the normal at which albedos are measured."""
    seen = _RecordingEvaluator(material, device)
    extreme = _extreme_directions()
    pairs = len(extreme)
    seen(np.repeat(extreme, pairs, axis=0), np.tile(extreme, (pairs, 1)))  # only for `least` and `finite`
    reciprocity = _reciprocity(material, seen)
    delta = MODELS[material.model].mirrors
    mirrored = _mirrored(material, degrees, device) if delta else np.zeros((len(degrees), 3))
    albedos = _albedos(material, degrees, seen, mirrored, beams=False)
    is_reciprocal = is_within_rounding(reciprocity, material)
    beams = albedos if is_reciprocal else _albedos(material, degrees, seen, mirrored, beams=True)
    sums = measure_facets(material, device=device) if facet_distribution(material) else None
    return MaterialProperties(material, seen.least, seen.finite, reciprocity, albedos, beams, delta, sums)


def is_within_rounding(reciprocity: float, material: Material) -> bool:
    """Return whether rounding explains the relative difference of f(wi, wo) and f(wo, wi)."""
    return reciprocity <= (RECIPROCAL_TABLE if material.get("file") else RECIPROCAL)


class _RecordingEvaluator:
    """Calls evaluate(), and records the least value, and whether all values are finite."""

    def __init__(self, material: Material, device: Device | None) -> None:
        self._material, self._device = material, device
        self.least, self.finite = math.inf, True

    def __call__(self, wi: Array, wo: Array) -> Array:
        values = evaluate(self._material, wi, wo, device=self._device).astype(float)
        finite = np.isfinite(values)
        self.finite &= bool(finite.all())
        self.least = min(self.least, float(values.min(initial=math.inf, where=finite)))
        return values


def unit_direction(degrees: float, azimuth: float = 0.0) -> Array:
    """Return a direction near an angle to the normal, at an azimuth, both in degrees. It is unit also in float32.

    Near the horizon, a rounding error of the length moves halfway vectors as much as a much larger error of the angle:
    it changes the albedo of a lobe of 1e-3 at 89.9 degrees by 2e-3. So the angle is rounded there instead of the
    length: 89.9 +- 0.001.
    """
    theta, phi = math.radians(degrees), math.radians(azimuth)
    x, y = (float(np.float32(math.sin(theta) * part)) for part in (math.cos(phi), math.sin(phi)))
    return np.array([x, y, math.sqrt(1.0 - x * x - y * y) if theta > 0.5 else math.cos(theta)])


def _extreme_directions() -> Array:
    """Return directions straight above, at the horizon, and between, with their mirror directions."""
    directions = [NORMAL]
    for cosine in (0.5, 1e-2, 1e-4, 1e-6, 1e-12, 1e-30):
        sine = math.sqrt(1.0 - cosine * cosine)
        directions += [np.array([x * sine, y * sine, cosine]) for x, y in ((1, 0), (-1, 0), (0.6, 0.8))]
    directions += [np.array([sine, 0.0, 1.0]) for sine in (1e-6, 1e-12, 1e-30)]
    return np.array(directions)


def _reciprocity(material: Material, seen: Callable[[Array, Array], Array]) -> float:
    """Return the largest relative difference over random pairs of directions: half anywhere, half near lobes."""
    random = np.random.default_rng(1)
    wo = _raise_above_surface(random.normal(size=(2 * _PAIRS, 3)))
    wi = _raise_above_surface(random.normal(size=(2 * _PAIRS, 3)))
    factors = np.array(_factors(material))[np.arange(_PAIRS) % len(_factors(material))]
    axes = _normalize(factors * wo[:_PAIRS])
    angle = np.exp(random.uniform(np.log(1e-5), 0.0, (_PAIRS, 1)))
    wi[:_PAIRS] = np.cos(angle) * axes + np.sin(angle) * _normalize(np.cross(axes, wi[:_PAIRS]))
    keep = (wi[:, 2] > _LEAST_COSINE) & (wo[:, 2] > _LEAST_COSINE)
    wi, wo = (w[keep].astype(np.float32).astype(float) for w in (wi, wo))
    there, back = seen(wi, wo) / wi[:, 2:], seen(wo, wi) / wo[:, 2:]
    larger = np.maximum(np.abs(there), np.abs(back))
    # If terms almost cancel, as in the full form of Oren and Nayar, the terms' rounding errors remain.
    larger = np.maximum(larger, _NOTHING * np.median(larger, axis=0))
    counts = np.isfinite(larger) & (larger > _LEAST_VALUE)
    return float(np.max(np.abs(there - back)[counts] / larger[counts], initial=0.0))


def _raise_above_surface(vectors: Array) -> Array:
    return _normalize(np.column_stack([vectors[:, :2], np.abs(vectors[:, 2])]))


def _normalize(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def _factors(material: Material) -> list[tuple[float, ...]]:
    """Return the distinct factors that turn a direction into the axis of a lobe, component by component."""
    lobes = [
        tuple(channel) for lobe in material.get("lobes", ()) for channel in zip(lobe.cx, lobe.cy, lobe.cz, strict=True)
    ]
    return [*dict.fromkeys(lobe for lobe in lobes if any(lobe))] or [(-1.0, -1.0, 1.0)]


def _rule(material: Material, w: Array, fine: Fineness) -> Rule:
    if material.get("lobes"):
        axes = _normalize(np.array(_factors(material)) * w)
        return union_rule([axes[i] for i in np.unique(np.round(axes, 6), axis=0, return_index=True)[1]], fine)
    return _known_rule(material.model, tuple(w), fine)


@lru_cache(maxsize=64)
def _known_rule(model: str, w: tuple[float, ...], fine: Fineness) -> Rule:
    """Return the rule of a model without `lobes`. It is cached, because verifications use coarse rules many times."""
    if model in _WITHOUT_LOBES:
        return polar_rule(NORMAL, fine, kinks=np.array(w))
    if model in _ABOUT_MIRROR:
        return polar_rule(np.array(w) * (-1.0, -1.0, 1.0), fine)
    return halfway_rule(np.array(w), fine)


def _albedos(
    material: Material, degrees: Sequence[float], seen: Callable[[Array, Array], Array], mirrored: Array, beams: bool
) -> list[Albedo]:
    """Measure the albedo at each angle. An anisotropic material has the largest albedo of several azimuths."""
    whole = make_layout([material]).is_anisotropic
    azimuths = (0.0, 30.0, 60.0, 90.0) if whole else (0.0,)
    fine = msgspec.structs.replace(_FINE, whole=whole)
    directions = [unit_direction(angle, azimuth) for angle in degrees for azimuth in azimuths]
    values = np.zeros((len(directions), 3))
    errors = np.full(len(directions), math.inf)
    open_ = list(range(len(directions)))
    for level, factor in enumerate(_FINER):
        rules = [_rule(material, directions[i], fine.times(factor)) for i in open_]
        integrals = _integrals([directions[i] for i in open_], rules, seen, beams)
        if level:
            errors[open_] = np.abs(integrals - values[open_]).max(axis=1)
        values[open_] = integrals
        open_ = [i for i in open_ if not errors[i] <= RESOLVED * max(1.0, np.abs(values[i]).max())]
        if not open_ or not np.isfinite(values).all():
            break
    shape = (len(degrees), len(azimuths))
    largest = (values.reshape(*shape, 3) + mirrored[:, None]).max(axis=2)
    errors = errors.reshape(shape)
    picked = np.argmax(largest, axis=1)
    return [
        Albedo(_degrees(directions[i * len(azimuths) + k]), float(largest[i, k]), float(errors[i, k]))
        for i, k in enumerate(picked)
    ]


def _degrees(w: Array) -> float:
    return math.degrees(math.atan2(math.hypot(w[0], w[1]), w[2]))


def _integrals(
    directions: Sequence[Array], rules: Sequence[Rule], seen: Callable[[Array, Array], Array], beams: bool
) -> Array:
    """Integrate for each direction by its rule: over the light from everywhere, or over the targets of a beam."""
    fixed = np.concatenate([np.broadcast_to(w, rule[0].shape) for w, rule in zip(directions, rules, strict=True)])
    others = np.concatenate([rule[0] for rule in rules])
    values = seen(fixed, others) * (others[:, 2:] / fixed[:, 2:]) if beams else seen(others, fixed)
    ends = np.cumsum([len(rule[0]) for rule in rules])[:-1]
    parts = np.split(values, ends)
    with np.errstate(invalid="ignore"):
        return np.array([rule[1] @ part for rule, part in zip(rules, parts, strict=True)])


def _mirrored(material: Material, degrees: Sequence[float], device: Device | None) -> Array:
    """Return the share of light that is reflected to the mirror direction only (N, 3)."""
    views = [unit_direction(angle) for angle in degrees]
    return call(f"{material.model}Mirrored", material, NORMAL, views, device=device).astype(float)


def facet_distribution(material: Material) -> str | None:
    """Return the name of the facets' distribution, if the model has facets with Smith's masking; else None."""
    return material.model if material.model in ("ggx", "beckmann") else material.get("distribution")


def measure_facets(
    material: Material, degrees: Sequence[float] = _FACET_DEGREES, device: Device | None = None
) -> Facets:
    """Integrate a material's distribution D and masking G1 for viewers at these angles, in degrees."""
    kind = facet_distribution(material)
    viewers = [unit_direction(angle) for angle in degrees]
    cosines = np.array([wo[2] for wo in viewers])
    masking = cosines / call(f"{kind}Slope", material, cosines, device=device)

    def off(fine: Fineness) -> tuple[Array, Array]:
        """Return the differences from 1 of the two integrals, for each viewer."""
        rules = [facing_rule(wo, fine) for wo in viewers]
        counts = [len(weights) for _, weights in rules]
        m, weights = (np.concatenate([rule[i] for rule in rules]) for i in (0, 1))
        wo, g1 = np.repeat(viewers, counts, axis=0), np.repeat(masking / cosines, counts)
        wo_m = np.sum(wo * m, axis=1)
        wi = 2.0 * wo_m[:, None] * m - wo
        starts = np.cumsum([0, *counts[:-1]])
        D, D_halfway = (
            call(f"{kind}D", material, NORMAL, S, device=device).astype(float)
            for S in (m, wi.astype(np.float32) + wo.astype(np.float32))
        )
        normals = np.add.reduceat(weights * g1 * D * wo_m, starts)
        # The integral over light: d wi = 4 wo.m dm.
        furnace = np.add.reduceat(weights * 4.0 * wo_m * g1 * D_halfway / 4.0, starts)
        return normals - 1.0, furnace - 1.0

    normals, furnace = off(_FACETS_FINE)
    errors = np.abs(np.subtract([normals, furnace], off(_FACETS_FINE.times(0.7))))
    return Facets(float(np.abs(normals).max()), float(np.abs(furnace).max()), float(errors.max()))
