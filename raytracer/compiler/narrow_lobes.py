"""A material's reflectance in a few numbers, which give the light of its highlight to a factor of 2."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from raytracer.core.validation import Vec3
from raytracer.core.vectors import scale_by
from raytracer.scene.materials.convert import WITHOUT_PI, normal_reflectance
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

# The diffuse reflectance of materials without a known one: the middle between black and white.
_GREY = 0.5 / math.pi, 0.5 / math.pi, 0.5 / math.pi
# The factors of D F G / (N.L N.V), by their names in models.py.
_CONSTANTS = {"modern": 0.25, "cook": 1.0 / math.pi, "unnormalized": 1.0}


class Lobe(NamedTuple):
    """A highlight around the mirror direction.

    At the mirror direction, with the cosine c of the angles to the normal, f cos(theta_i) is peak c^power F, with F by
    Schlick's formula for `f0`. The solid angle of the highlight, in sr around the normal, is size / c^widening: halfway
    vectors in it would carry all of the highlight's light if they all had the peak.
    """

    size: float
    widening: float
    peak: Vec3
    power: float
    f0: Vec3


def highlight_lobe(material: Material) -> Lobe | None:
    """Return the highlight of a material. None for models without one, and for lafortune, he and merl."""
    make = _LOBES.get(material.model)
    return make(material) if make else None


def mirrored_share(material: Material) -> Vec3:
    """Estimate the share of the light that a material reflects as a mirror does."""
    f0 = normal_reflectance(material)
    if f0 is None or not MODELS[material.model].mirrors:
        return 0.0, 0.0, 0.0
    r, g, b = f0
    if material.model == "he":  # roughness scatters the rest of the light
        phases = (4.0 * math.pi * material.sigma0 / length for length in material.wavelength)
        x, y, z = (k * math.exp(-(p**2)) for k, p in zip(material.ks, phases, strict=True))
        return x * r, y * g, z * b
    return f0


def diffuse_reflectance(material: Material) -> Vec3:
    """Estimate a material's diffuse reflectance f, the radiance for each unit of irradiance."""
    if material.model in ("phong", "blinn"):
        return material.kd
    albedo = next(filter(None, map(material.get, ("kd", "rho", "color"))), None)
    if not albedo or not any(albedo):
        return _GREY
    return albedo if material.model in WITHOUT_PI else scale_by(albedo, 1.0 / math.pi)


def _around_normal(h: float, peak: Vec3, power: float) -> Lobe:
    """Return the lobe (N.H)^h."""
    return Lobe(2.0 * math.pi / h if h else math.inf, 0.0, peak, power, (1.0, 1.0, 1.0))


def _around_mirror_direction(h: float, peak: Vec3, power: float) -> Lobe:
    """Return the lobe (R.V)^h. A normal that turns by an angle turns the mirror direction by twice the angle."""
    return Lobe(math.pi / 2.0 / h if h else math.inf, 1.0, peak, power, (1.0, 1.0, 1.0))


def _phong(m: Material) -> Lobe:
    return _around_mirror_direction(m.h, m.ks, 0.0)


def _blinn(m: Material) -> Lobe:
    return _around_normal(m.h, m.ks, 0.0)


def _phong_normalized(m: Material) -> Lobe:
    return _around_mirror_direction(m.h, scale_by(m.ks, (m.h + 2.0) / (2.0 * math.pi)), 1.0)


def _blinn_normalized(m: Material) -> Lobe:
    constant = (m.h + 2.0) * (m.h + 4.0) / (8.0 * math.pi * (2.0 ** (-m.h / 2.0) + m.h))
    return _around_normal(m.h, scale_by(m.ks, constant), 1.0)


def _strauss(m: Material) -> Lobe:
    share = m.smoothness**3 * (1.0 - m.transparency)
    r, g, b = (share * (1.0 - m.metalness + m.metalness * c) for c in m.color)
    return _around_mirror_direction(3.0 / (1.0 - m.smoothness), (r, g, b), 0.0)


def _facets(m: Material) -> Lobe:
    return _facet_lobe(m.alpha, (0.25, 0.25, 0.25), normal_reflectance(m))


def _split(m: Material) -> Lobe:
    r, g, b = ((1.0 - m.metalness) * f + m.metalness * c for f, c in zip(m.f0, m.rho, strict=True))
    return _facet_lobe(m.alpha, (0.25, 0.25, 0.25), (r, g, b))


def _v_cavities(m: Material) -> Lobe:
    # D has the peak `c`, and 1 / (pi m^2) where that is 0 or missing.
    height = math.pi * m.m**2 * m.get("c", 0.0) or 1.0
    return _facet_lobe(m.m, scale_by(m.ks, _CONSTANTS[m.constant] * height), normal_reflectance(m))


def _facet_lobe(width: float, factor: Vec3, f0: Vec3 | None) -> Lobe:
    """Return the lobe of mirror facets whose normals have the solid angle pi width^2."""
    assert f0  # models of facets have a Fresnel factor
    size = math.pi * width**2
    return Lobe(size, 0.0, scale_by(factor, 1.0 / size), -1.0, f0)


_LOBES: dict[str, Callable[[Material], Lobe]] = {
    "phong": _phong,
    "blinn": _blinn,
    "phong_normalized": _phong_normalized,
    "blinn_normalized": _blinn_normalized,
    "strauss": _strauss,
    "ggx": _facets,
    "beckmann": _facets,
    "split": _split,
    "cook_torrance": _v_cavities,
    "torrance_sparrow": _v_cavities,
}
