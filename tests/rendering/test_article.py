"""Tests of the rendering GLSL against the article "Microfacet BRDFs from Scratch", named by its equation numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from raytracer.analysis.reflectance.properties import measure_facets, measure_material, unit_direction
from raytracer.analysis.reflectance.quadrature import NORMAL, Fineness, facing_rule, polar_rule
from raytracer.rendering.brdf import call, evaluate
from raytracer.scene.materials.material import Material

FINE = Fineness(24, 24)
VIEWS = (0.0, 30.0, 60.0, 80.0, 88.0)
FACETS = [Material(model, alpha=alpha) for model in ("ggx", "beckmann") for alpha in (1e-3, 0.05, 0.3, 1.0)]


def unit(random: np.random.Generator, count: int, least: float = 0.05) -> NDArray[np.float64]:
    """Return random directions whose cosines are at least `least`."""
    z = random.uniform(least, 1.0, count)
    phi = random.uniform(0.0, 2.0 * np.pi, count)
    s = np.sqrt(1.0 - z * z)
    return np.column_stack([s * np.cos(phi), s * np.sin(phi), z])


def D(material: Material, m: Any) -> NDArray[np.float64]:
    return call(f"{material.model}D", material, NORMAL, m).astype(float)


def G1(material: Material, cosine: float) -> float:
    return cosine / float(call(f"{material.model}Slope", material, cosine)[0])


@pytest.mark.gl
@pytest.mark.parametrize("material", FACETS, ids=repr)
def test_ii_and_vi_visible_facets_have_the_projected_area(material: Material) -> None:
    """(ii) A surface of area 1 has the projected area cos(theta_o). (vi) The visible facets have this area, too:
    cos(theta_o) = int G1(wo, m) <wo.m> D(m) dm."""
    for degrees in VIEWS:
        wo = unit_direction(degrees)
        m, weights = facing_rule(wo, FINE)
        seen = weights @ (G1(material, wo[2]) * (m @ wo) * D(material, m))
        assert seen == pytest.approx(wo[2], rel=1e-4)


@pytest.mark.gl
def test_ii_all_facets_are_visible_straight_from_above() -> None:
    """(ii) for theta_o = 0, where nothing is masked: int D(m) <n.m> dm = 1."""
    for material in FACETS:
        m, weights = facing_rule(NORMAL, FINE)
        assert G1(material, 1.0) == pytest.approx(1.0, abs=1e-6)
        assert weights @ (D(material, m) * m[:, 2]) == pytest.approx(1.0, rel=1e-4)


@pytest.mark.gl
def test_iv_facets_have_more_area_than_the_surface() -> None:
    """(area) int D(m) dm is the area of the facets.

    It is at least 1, the area of the surface, and grows with roughness.
    """
    m, weights = facing_rule(NORMAL, FINE)
    areas = [float(weights @ D(Material("beckmann", alpha=alpha), m)) for alpha in (1e-3, 0.1, 0.3, 1.0)]
    assert areas[0] == pytest.approx(1.0, abs=1e-4) and areas == sorted(areas)
    # With Gaussian slopes the area is the mean of sqrt(1 + s^2), where s^2 is exponential with the mean alpha^2.
    x, w = np.polynomial.laguerre.laggauss(100)
    assert areas[3] == pytest.approx(float(w @ np.sqrt(1.0 + x)), rel=1e-4)


@pytest.mark.gl
def test_ix_visible_normals_are_a_distribution() -> None:
    """(ix) D_wo(m) = G1(wo, m) D(m) <wo.m> / cos(theta_o) is never negative, and its integral is 1.

    The article states that D_wo is between 0 and 1. It is a density, however, and exceeds 1 on
    smooth surfaces, where all facets have nearly the same normal.
    """
    for material in FACETS:
        for degrees in VIEWS:
            wo = unit_direction(degrees)
            m, weights = facing_rule(wo, FINE)
            visible = G1(material, wo[2]) * D(material, m) * (m @ wo) / wo[2]
            assert (visible >= 0.0).all() and weights @ visible == pytest.approx(1.0, rel=1e-4)
            if material.alpha < 0.1:
                assert visible.max() > 1.0


@pytest.mark.gl
@pytest.mark.parametrize("material", FACETS, ids=repr)
def test_the_weak_white_furnace_is_white(material: Material) -> None:
    """(vi) integrated over light directions, by the Jacobian (xx): int G1 D / (4 cos(theta_o)) dwi = 1 (Heitz 2014)."""
    measured = measure_facets(material)
    assert measured.error < 1e-4 and measured.furnace < 1e-3 and measured.normals < 1e-4


def test_xx_is_the_jacobian_of_the_halfway_vector() -> None:
    """(xx) dwh / dwo = 1 / (4 |wo.wh|), by central differences in the plane perpendicular to each direction."""
    random = np.random.default_rng(3)
    step = 1e-5
    for wi, wo in zip(unit(random, 200), unit(random, 200), strict=True):
        h = (wi + wo) / np.linalg.norm(wi + wo)
        x, y = (np.cross(wo, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
        x /= np.linalg.norm(x)
        y = np.cross(wo, x)

        def halfway(v: Any, wi: Any = wi) -> Any:
            s = wi + v / np.linalg.norm(v)
            return s / np.linalg.norm(s)

        du, dv = ((halfway(wo + step * t) - halfway(wo - step * t)) / (2.0 * step) for t in (x, y))
        area = abs(float(np.dot(np.cross(du, dv), h)))
        assert area == pytest.approx(1.0 / (4.0 * float(wo @ h)), rel=1e-5)


@pytest.mark.gl
@pytest.mark.parametrize("masking", ["correlated", "separable"])
@pytest.mark.parametrize("model", ["ggx", "beckmann"])
def test_xxii_the_specular_reflectance_is_the_product_of_its_factors(model: str, masking: str) -> None:
    """(xxii) F G D / (4 |n.wi| |n.wo|), from separate calls of D and G1.

    G is Smith's, not the printed G1(wi, wo, wh).
    """
    material = Material(model, alpha=0.3, f0=(0.1, 0.5, 1.0), masking=masking)
    random = np.random.default_rng(4)
    wi, wo = unit(random, 300), unit(random, 300)
    h = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    F = np.array(material.f0) + (1.0 - np.array(material.f0)) * (1.0 - np.sum(wo * h, axis=1, keepdims=True)) ** 5
    gi, go = (w[:, 2] / call(f"{model}Slope", material, w[:, 2]).astype(float) for w in (wi, wo))
    G = gi * go if masking == "separable" else 1.0 / (1.0 / gi + 1.0 / go - 1.0)
    expected = F * (G * D(material, h) / (4.0 * wi[:, 2] * wo[:, 2]))[:, None] * wi[:, 2:]
    np.testing.assert_allclose(evaluate(material, wi, wo), expected, rtol=2e-5, atol=1e-20)


@pytest.mark.gl
def test_xxii_reflects_all_light_from_smooth_facets() -> None:
    """(xvii) to (xxii): smooth facets with F = 1, and without losses below the horizon, reflect all light."""
    measured = measure_material(Material("beckmann", alpha=1e-3, f0=1.0), (0.0, 30.0, 60.0))
    assert [a.value for a in measured.albedos] == pytest.approx([1.0] * 3, abs=1e-3)


@pytest.mark.gl
@pytest.mark.parametrize("alpha", [0.1, 0.3, 0.6, 0.99])
def test_xxiii_has_a_closed_form_straight_from_above(alpha: float) -> None:
    """(xxiii) for wi = wo = n, where G is 1: f = rho / pi int <n.m>^2 D(m) dm, for GGX with b = 1 - alpha^2

    pi f = rho (1 - alpha^2 / sqrt(b) asinh(sqrt(b) / alpha)) / b.
    """
    b = 1.0 - alpha * alpha
    expected = (1.0 - alpha * alpha / math.sqrt(b) * math.asinh(math.sqrt(b) / alpha)) / b
    measured = evaluate(Material("diffuse_microfacet", rho=1.0, alpha=alpha, nodes=512), NORMAL, NORMAL)
    assert math.pi * float(measured[0, 0]) == pytest.approx(expected, rel=1e-3)


@pytest.mark.gl
@pytest.mark.parametrize(("alpha", "expected"), [(0.3, 0.9600), (0.6, 0.8753), (1.0, 0.7579)])
def test_xxiii_is_the_mean_cosine_of_beckmanns_facets_straight_from_above(alpha: float, expected: float) -> None:
    """(xxiii) for wi = wo = n and Gaussian slopes: rho E[cos] over the facets, an exponential integral."""
    material = Material("diffuse_microfacet", rho=1.0, alpha=alpha, distribution="beckmann", nodes=512)
    x, w = np.polynomial.laguerre.laggauss(120)
    # E[cos], with x the square of a slope over alpha^2.
    assert float(w @ (1.0 / np.sqrt(1.0 + alpha**2 * x))) == pytest.approx(expected, abs=5e-5)
    assert math.pi * float(evaluate(material, NORMAL, NORMAL)[0, 0]) == pytest.approx(expected, rel=1e-3)


@pytest.mark.gl
def test_xxiii_is_lambert_for_smooth_facets() -> None:
    """(xxiii) with D a delta function at n: f = 1/pi for all directions of light and viewer."""
    random = np.random.default_rng(5)
    wi, wo = unit(random, 100, 0.2), unit(random, 100, 0.2)
    measured = evaluate(Material("diffuse_microfacet", rho=1.0, alpha=1e-3), wi, wo) / wi[:, 2:]
    np.testing.assert_allclose(math.pi * measured, 1.0, atol=1e-3)


@pytest.mark.gl
def test_a_lambertian_brdf_of_one_over_pi_reflects_all_light() -> None:
    """(Lambertian) BRDF = 1/pi reflects all light: the integral of cos(theta) over the hemisphere is pi.

    By (dw), a solid angle is dw = sin(theta) dphi dtheta.
    """
    wo, weights = polar_rule(NORMAL, FINE)
    assert weights @ wo[:, 2] == pytest.approx(math.pi, rel=1e-6)
    wi = unit_direction(40.0)
    f = evaluate(Material("lambert", rho=1.0), wi, wo) / wi[2]
    np.testing.assert_allclose(f, 1.0 / math.pi, rtol=1e-6)
    assert (weights * wo[:, 2]) @ f == pytest.approx([1.0] * 3, rel=1e-6)
