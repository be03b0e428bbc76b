"""Properties of a material, measured of the GLSL that renders: positivity, reciprocity, energy, sums over facets.

Nothing here knows what is expected: see `expectations.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import msgspec
import numpy as np

from raytracer.analysis.reflectance.quadrature import NORMAL, Array, Fineness, Rule, about_all, facing, halfway, polar
from raytracer.compiler.material_layout import make_layout
from raytracer.gpu.device import Device
from raytracer.rendering.brdf import call, evaluate
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# The models that their parameters' defaults make a material of: all but merl, which needs a file.
COMPLETE = [name for name, model in MODELS.items() if all(p.default is not None for p in model.parameters.values())]
# Angles to the normal at which albedos are measured, up to a cosine of 0.0017.
DEGREES = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0, 89.0, 89.5, 89.9)
# An albedo, or its share of what is reflected if that is more than 1, is resolved to this or not at all.
RESOLVED = 5e-4
# How fine the quadrature is; then by how much finer, until two in a row agree.
_FINE = Fineness(6, 16)
_FINER = (0.7, 1.0, 2.0, 4.0, 6.0)
# Of these models the lobes are polar about the mirror direction; or there are none. Of all others see `_rule`.
_ABOUT_MIRROR = ("phong", "phong_normalized", "strauss")
_WITHOUT_LOBES = ("lambert", "minnaert", "oren_nayar", "eon", "diffuse_microfacet", "lafortune")
# What a value times 1 + this may be: rounding of float32, of directions and of what is made of them.
RECIPROCAL = 1e-4
# Pairs of directions for reciprocity are so far above the horizon; f below this has few bits of float32 left, or none.
_LEAST_COSINE = 1e-3
_LEAST_VALUE = 1e-30
_PAIRS = 2048
# The share of f's median over all pairs below which a difference is one of that much.
_NOTHING = 1e-2
# An albedo of 1 that is measured may be above by this.
CONSERVING = 1e-3
# Angles at which facets are added up.
_FACET_DEGREES = (0.0, 45.0, 75.0, 85.0, 89.0)
# Finer than for albedos: the masking of Beckmann's facets makes up for all that D leaves, to 1e-7.
_FACETS_FINE = Fineness(24, 12)


class Albedo(msgspec.Struct, frozen=True):
    """A directional albedo, the largest of the three channels: `error` is estimated; nan if it is not finite."""

    degrees: float
    value: float
    error: float

    @property
    def resolved(self) -> bool:
        """Whether the error is small. What is not resolved may be anything."""
        return self.error <= RESOLVED * max(1.0, abs(self.value))


class Facets(msgspec.Struct, frozen=True):
    """Largest differences from 1, and by how much they may be wrong: D is the facets' distribution, G1 their masking.

    `normals`: of the integral of G1 D <wo.m> over all facets m, over cos(theta_o): the article's equation (vi).
    `furnace`: of the integral of G1 D / (4 cos(theta_o)) over all light, also from below, that a facet reflects to the
    viewer: the weak white furnace of Heitz (2014).
    """

    normals: float
    furnace: float
    error: float


class MaterialProperties(msgspec.Struct, frozen=True):
    """The measured properties of a material."""

    material: Material
    least: float  # the least value of f cos(theta_i)
    finite: bool  # no NaN or infinity anywhere
    reciprocity: float  # largest relative difference of f(wi, wo) and f(wo, wi)
    albedos: list[Albedo]  # of what is seen from a direction under equal light from everywhere
    beams: list[Albedo]  # of what light from one direction sends everywhere; the same, if it is reciprocal
    delta: bool  # whether a part is reflected to one direction only; it is in the albedos
    facets: Facets | None = None  # of models with a distribution of facets and Smith's masking

    @property
    def positive(self) -> bool:
        return self.least >= 0.0

    @property
    def reciprocal(self) -> bool:
        return self.reciprocity <= RECIPROCAL

    @property
    def largest(self) -> Albedo:
        """The largest albedo of the two kinds, at the first angle if there are several; or one that is not resolved."""
        albedos = [*self.albedos, *self.beams]
        most = max(albedos, key=lambda a: (not a.resolved, a.value))
        return next(
            (a for a in albedos if most.resolved and a.value >= most.value - RESOLVED * max(1.0, most.value)), most
        )

    @property
    def conserving(self) -> bool | None:
        """Whether it never reflects more than it gets; None if that is not resolved."""
        if any(a.resolved and a.value > 1.0 + CONSERVING + a.error for a in (*self.albedos, *self.beams)):
            return False
        return True if self.largest.resolved else None


def measure_material(
    material: Material, degrees: Sequence[float] = DEGREES, device: Device | None = None
) -> MaterialProperties:
    """Measure all properties of a material; albedos at these angles to the normal."""
    seen = _Seen(material, device)
    extreme = _extreme_directions()
    pairs = len(extreme)
    seen(np.repeat(extreme, pairs, axis=0), np.tile(extreme, (pairs, 1)))
    reciprocity = _reciprocity(material, seen)
    delta = MODELS[material.model].mirrors
    mirrored = _mirrored(material, degrees, device) if delta else np.zeros((len(degrees), 3))
    albedos = _albedos(material, degrees, seen, mirrored, beams=False)
    beams = albedos if reciprocity <= RECIPROCAL else _albedos(material, degrees, seen, mirrored, beams=True)
    added = facets(material, device=device) if distribution_of(material) else None
    return MaterialProperties(material, seen.least, seen.finite, reciprocity, albedos, beams, delta, added)


class _Seen:
    """evaluate(), noting what it gives."""

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
    """A unit direction at an angle to the normal, nearly, and an azimuth in degrees, whose float32 form is unit too.

    Near the horizon a length that is off by a rounding moves halfway vectors like an angle that is off by a lot more:
    the albedo of a lobe of 1e-3 at 89.9 degrees by 2e-3. So there the angle is rounded, not the length: 89.9 +- 0.001.
    """
    theta, phi = math.radians(degrees), math.radians(azimuth)
    x, y = (float(np.float32(math.sin(theta) * part)) for part in (math.cos(phi), math.sin(phi)))
    return np.array([x, y, math.sqrt(1.0 - x * x - y * y) if theta > 0.5 else math.cos(theta)])


def _extreme_directions() -> Array:
    """Straight above, at the horizon, and between: with their mirror directions."""
    directions = [NORMAL]
    for cosine in (0.5, 1e-2, 1e-4, 1e-6, 1e-12, 1e-30):
        sine = math.sqrt(1.0 - cosine * cosine)
        directions += [np.array([x * sine, y * sine, cosine]) for x, y in ((1, 0), (-1, 0), (0.6, 0.8))]
    directions += [np.array([sine, 0.0, 1.0]) for sine in (1e-6, 1e-12, 1e-30)]
    return np.array(directions)


def _reciprocity(material: Material, seen: Callable[[Array, Array], Array]) -> float:
    """Largest relative difference over random pairs of directions: half of them anywhere, half near lobes."""
    random = np.random.default_rng(1)
    wo = _upper(random.normal(size=(2 * _PAIRS, 3)))
    wi = _upper(random.normal(size=(2 * _PAIRS, 3)))
    factors = np.array(_factors(material))[np.arange(_PAIRS) % len(_factors(material))]
    axes = _unit(factors * wo[:_PAIRS])
    angle = np.exp(random.uniform(np.log(1e-5), 0.0, (_PAIRS, 1)))
    wi[:_PAIRS] = np.cos(angle) * axes + np.sin(angle) * _unit(np.cross(axes, wi[:_PAIRS]))
    keep = (wi[:, 2] > _LEAST_COSINE) & (wo[:, 2] > _LEAST_COSINE)
    wi, wo = (w[keep].astype(np.float32).astype(float) for w in (wi, wo))
    there, back = seen(wi, wo) / wi[:, 2:], seen(wo, wi) / wo[:, 2:]
    larger = np.maximum(np.abs(there), np.abs(back))
    # Where others all but cancel, as the full form of Oren and Nayar's, the rounding is that of what cancels.
    larger = np.maximum(larger, _NOTHING * np.median(larger, axis=0))
    counts = np.isfinite(larger) & (larger > _LEAST_VALUE)
    return float(np.max(np.abs(there - back)[counts] / larger[counts], initial=0.0))


def _upper(vectors: Array) -> Array:
    return _unit(np.column_stack([vectors[:, :2], np.abs(vectors[:, 2])]))


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def _factors(material: Material) -> list[tuple[float, ...]]:
    """The factors that make a direction the axis of a lobe, part by part: those of each lobe, once."""
    lobes = [
        tuple(channel) for lobe in material.get("lobes", ()) for channel in zip(lobe.cx, lobe.cy, lobe.cz, strict=True)
    ]
    return [*dict.fromkeys(lobe for lobe in lobes if any(lobe))] or [(-1.0, -1.0, 1.0)]


def _rule(material: Material, w: Array, fine: Fineness) -> Rule:
    if material.get("lobes"):
        axes = _unit(np.array(_factors(material)) * w)
        return about_all([axes[i] for i in np.unique(np.round(axes, 6), axis=0, return_index=True)[1]], fine)
    return _known_rule(material.model, tuple(w), fine)


@lru_cache(maxsize=64)
def _known_rule(model: str, w: tuple[float, ...], fine: Fineness) -> Rule:
    """The rule by these values alone. It is kept, because verifications ask for coarse rules again and again."""
    if model in _WITHOUT_LOBES:
        return polar(NORMAL, fine, kinks=np.array(w))
    if model in _ABOUT_MIRROR:
        return polar(np.array(w) * (-1.0, -1.0, 1.0), fine)
    return halfway(np.array(w), fine)


def _albedos(
    material: Material, degrees: Sequence[float], seen: Callable[[Array, Array], Array], mirrored: Array, beams: bool
) -> list[Albedo]:
    """The albedo at each angle: of an anisotropic material, the largest of some azimuths."""
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
    """The integral of each direction by its rule: over light from everywhere, or over where a beam from there goes."""
    fixed = np.concatenate([np.broadcast_to(w, rule[0].shape) for w, rule in zip(directions, rules, strict=True)])
    others = np.concatenate([rule[0] for rule in rules])
    values = seen(fixed, others) * (others[:, 2:] / fixed[:, 2:]) if beams else seen(others, fixed)
    ends = np.cumsum([len(rule[0]) for rule in rules])[:-1]
    parts = np.split(values, ends)
    with np.errstate(invalid="ignore"):
        return np.array([rule[1] @ part for rule, part in zip(rules, parts, strict=True)])


def _mirrored(material: Material, degrees: Sequence[float], device: Device | None) -> Array:
    """The share of light that is reflected to the mirror direction only, (N, 3)."""
    views = [unit_direction(angle) for angle in degrees]
    return call(f"{material.model}Mirrored", material, NORMAL, views, device=device).astype(float)


def distribution_of(material: Material) -> str | None:
    """The distribution of a model of facets with Smith's masking."""
    return material.model if material.model in ("ggx", "beckmann") else material.get("distribution")


def facets(material: Material, degrees: Sequence[float] = _FACET_DEGREES, device: Device | None = None) -> Facets:
    """Sum up a material's distribution D and masking G1, as seen from these angles."""
    kind = distribution_of(material)
    viewers = [unit_direction(angle) for angle in degrees]
    cosines = np.array([wo[2] for wo in viewers])
    masking = cosines / call(f"{kind}Slope", material, cosines, device=device)

    def off(fine: Fineness) -> tuple[Array, Array]:
        """How far from 1 the two are, for each viewer."""
        rules = [facing(wo, fine) for wo in viewers]
        counts = [len(weights) for _, weights in rules]
        m, weights = (np.concatenate([rule[i] for rule in rules]) for i in (0, 1))
        wo, g1 = np.repeat(viewers, counts, axis=0), np.repeat(masking / cosines, counts)
        wo_m = np.sum(wo * m, axis=1)
        wi = 2.0 * wo_m[:, None] * m - wo
        starts = np.cumsum([0, *counts[:-1]])
        D, of_sum = (
            call(f"{kind}D", material, NORMAL, S, device=device).astype(float)
            for S in (m, wi.astype(np.float32) + wo.astype(np.float32))
        )
        normals = np.add.reduceat(weights * g1 * D * wo_m, starts)
        # Of light: d wi = 4 wo.m dm.
        furnace = np.add.reduceat(weights * 4.0 * wo_m * g1 * of_sum / 4.0, starts)
        return normals - 1.0, furnace - 1.0

    normals, furnace = off(_FACETS_FINE)
    errors = np.abs(np.subtract([normals, furnace], off(_FACETS_FINE.times(0.7))))
    return Facets(float(np.abs(normals).max()), float(np.abs(furnace).max()), float(errors.max()))
