"""The GLSL of the reflectance models, compared with the float64 reference."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer import glsl
from raytracer.ground_truth import microfacets, ray_tracer, reflectance
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.models import MODELS, Parameter
from raytracer.scene.settings import Settings
from tests.directions import direction_pairs, extreme_pairs

pytestmark = pytest.mark.gl

# All values are exact in float32, so that the GPU and the reference have the same parameters.
ALPHA, INDEX = 2.0**-10, 1.0009765625
MATERIALS = [
    rt.Material("phong"),
    rt.Material("phong", h=1e6),
    rt.Material("blinn"),
    rt.Material("blinn", h=1e6),
    rt.Material("lambert"),
    rt.Material("minnaert"),
    rt.Material("minnaert", k=0),
    rt.Material("minnaert", k=10),
    rt.Material("phong_normalized", h=0),
    rt.Material("phong_normalized", h=1e6),
    rt.Material("blinn_normalized", h=0),
    rt.Material("blinn_normalized", h=1e6),
    *(
        rt.Material(model, alpha=alpha, masking=masking)
        for model, alpha, masking in itertools.product(
            ("ggx", "beckmann"), (ALPHA, 0.25, 1.0), ("correlated", "separable")
        )
    ),
    rt.Material("beckmann", smith="rational"),
    rt.Material("ggx", fresnel="dielectric", ior=1.5),
    rt.Material("ggx", fresnel="dielectric", ior=INDEX),
    rt.Material("ggx", fresnel="dielectric", ior=0.75),
    rt.Material("ggx", fresnel="conductor"),
    rt.Material("ggx", fresnel="conductor", n=(0.015625, 1, 100), k=(0, 0.015625, 100)),
    rt.Material("split", metalness=0.5),
    rt.Material("split", distribution="beckmann", alpha=0.125),
    *(rt.Material(model, m=m) for model in ("torrance_sparrow", "cook_torrance") for m in (ALPHA, 0.25, 2.0)),
    rt.Material("torrance_sparrow", c=2.0, constant="cook"),
    rt.Material("cook_torrance", constant="unnormalized"),
]


@pytest.mark.parametrize("material", MATERIALS, ids=repr)
def test_each_model_agrees_with_float64_to_1e_4_and_in_the_median_to_1e_6(
    renderer: Renderer, material: rt.Material
) -> None:
    wi, wo = direction_pairs()
    values = rt.brdf.evaluate(material, wi, wo, device=renderer.device)
    up = np.broadcast_to((0.0, 0.0, 1.0), wi.shape)
    expected = reflectance.reflected(material, up, wi.astype(float), wo.astype(float))
    # Values below 1e-8 of the largest value do not count: in narrow lobes they are rounding of a large exponent.
    counts = expected > 1e-8 * expected.max()
    assert counts.mean() > 0.05
    error = np.abs(values[counts] / expected[counts] - 1.0)
    assert np.median(error) <= 1e-6 and error.max() <= 1e-4
    assert (values[~counts] <= 1.001e-8 * expected.max()).all()


def ends(parameter: Parameter) -> list[object]:
    """Return both ends of a parameter's range, or all its choices."""
    match parameter.kind:
        case "number" | "whole" | "color":
            return [parameter.low, parameter.high]
        case "choice":
            return list(parameter.choices)
    return []


@pytest.mark.parametrize("model", [m for m in MODELS if m != "merl"])
def test_nothing_is_nan_infinite_or_negative_at_any_extreme(renderer: Renderer, model: str) -> None:
    wi, wo = extreme_pairs()
    for parameter in MODELS[model].parameters.values():
        for value in ends(parameter):
            parameters: dict[str, Any] = {parameter.name: value} | (
                {parameter.when[0]: parameter.when[1]} if parameter.when else {}
            )
            values = rt.brdf.evaluate(rt.Material(model, **parameters), wi, wo, device=renderer.device)
            assert np.isfinite(values).all() and (values >= 0.0).all(), (parameters, wi[~(values >= 0).all(1)])
            assert not values[(wi[:, 2] <= 0) | (wo[:, 2] <= 0)].any(), "no reflection below the horizon"


@pytest.mark.parametrize("ior", [1.0, 1.5, 0.75])
def test_a_mirror_reflects_between_0_and_1_also_just_below_its_horizon(renderer: Renderer, ior: float) -> None:
    cosine = np.array([1.0, 1e-3, 1e-7, 0.0, -1e-12, -1e-7, -1e-4])
    V = np.stack([np.sqrt(1.0 - cosine**2), 0.0 * cosine, cosine], -1)
    for material in (
        rt.Material("mirror", fresnel="dielectric", ior=ior),
        rt.Material("mirror", fresnel="conductor", n=ior, k=0),
        rt.Material("he", fresnel="dielectric", ior=ior),
    ):
        values = rt.brdf.call(f"{material.model}Mirrored", material, (0, 0, 1), V, device=renderer.device)
        assert ((values >= 0.0) & (values <= 1.0 + 1e-6)).all(), (material, values)


def test_a_scene_of_all_models_agrees_with_float64(renderer: Renderer) -> None:
    materials = [rt.Material(model) for model in MODELS if model != "merl"]
    materials += [rt.published("lafortune/clay"), rt.published("conductors/gold"), rt.Material("beckmann", le=0.1)]
    balls = [rt.Sphere((i % 6 - 2.5, i // 6 - 1.5, 0), 0.45, m) for i, m in enumerate(materials)]
    scene = rt.Scene(balls, [rt.PointLight((3, 4, 6), (3, 3, 3))], rt.Camera((0, 0, 6), (0, 0, 0), vertical_fov=40))
    for settings in (Settings(), Settings(evaluator="walk", bounces=1)):
        image = renderer.render(scene, (120, 80), settings)
        expected = ray_tracer.trace(scene, (120, 80), settings)
        assert image.material is not None and expected.material is not None
        assert np.array_equal(image.material, expected.material)
        error = np.abs(image.radiance - expected.radiance).max(axis=2)
        assert np.quantile(error, 0.99) < 1e-4 and error.max() < 2e-2 * expected.radiance.max()


@pytest.mark.parametrize("alpha", [2.0**-13, 2.0**-10, 0.125])  # powers of two from 1.2e-4, exact in float32
def test_ggxs_distribution_is_exact_to_1e_3_for_any_normal(renderer: Renderer, alpha: float) -> None:
    # Random normals, because the rounding of vectors, 1e-7 relative to the angle alpha, shows only off the axes.
    rng = np.random.default_rng(3)

    def unit(v: np.ndarray) -> np.ndarray:
        return v / np.linalg.norm(v, axis=1, keepdims=True)

    N = unit(rng.normal(size=(4000, 3)))
    H = unit(N + unit(rng.normal(size=N.shape)) * rng.uniform(0, 5 * alpha, (4000, 1)))
    N, H = (v.astype(np.float32) for v in (N, H))
    material = rt.Material("ggx", alpha=alpha)
    values = rt.brdf.call("ggxD", material, N, H, device=renderer.device)
    n, h = (unit(v.astype(float)) for v in (N, H))
    sine = np.linalg.norm(np.cross(n, h), axis=1)
    expected = microfacets.distribution(material, "ggx", np.sqrt(1.0 - sine**2))
    np.testing.assert_allclose(values, expected, rtol=1e-3)


@pytest.mark.parametrize("sigma0", [0.0625, 0.1875, 0.5, 2.0])
def test_the_error_of_hes_sum_falls_with_its_terms(renderer: Renderer, sigma0: float) -> None:
    wi, wo = direction_pairs(2000, least=0.05)
    up = np.broadcast_to((0.0, 0.0, 1.0), wi.shape)
    wave = (0.625, 0.5625, 0.4375)
    material = rt.Material("he", sigma0=sigma0, wavelength=wave)
    series = reflectance.reflected(material, up, wi.astype(float), wo.astype(float))
    counts = series > 1e-8 * series.max()
    for terms, bound in ((16, 0.3), (24, 2e-2), (32, 1e-3), (64, 1e-5), (1024, 1e-5)):
        values = rt.brdf.evaluate(material.replace(terms=terms), wi, wo, device=renderer.device)
        assert np.abs(values[counts] / series[counts] - 1.0).max() <= bound, terms


def test_angles_are_exact_to_the_last_bits_of_float32(renderer: Renderer) -> None:
    t = np.concatenate([10.0 ** -np.linspace(0, 8, 500), np.linspace(0, np.pi / 2, 500)])
    b = np.stack([np.sin(t), np.zeros_like(t), np.cos(t)], -1).astype(np.float32)
    exact = np.arctan2(b[:, 0].astype(float), b[:, 2].astype(float))
    np.testing.assert_allclose(glsl.call("angle", b[:, 0], b[:, 2], device=renderer.device), exact, rtol=4e-7)


def test_erfc_is_exact_to_1e_6(renderer: Renderer) -> None:
    import math

    x = np.linspace(0, 9, 1000).astype(np.float32)
    exact = [math.erfc(float(value)) for value in x]
    # The exponential function of values down to -81 is less exact, so small arguments have a tighter bound.
    np.testing.assert_allclose(glsl.call("erfc", x, device=renderer.device), exact, rtol=1e-5)
    np.testing.assert_allclose(glsl.call("erfc", x[:300], device=renderer.device), exact[:300], rtol=1e-6)


@pytest.mark.parametrize(
    ("wi", "message"),
    [((0, 0, 2), "wi: expected unit"), ((0, 0), "wi: .*shape"), ((0, 0, float("nan")), "wi"), ([[[0, 0, 1]]], "wi")],
)
def test_vectors_that_are_no_unit_directions_are_refused(wi: object, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        rt.brdf.evaluate(rt.Material(), wi, (0, 0, 1))  # pyright: ignore[reportArgumentType]
