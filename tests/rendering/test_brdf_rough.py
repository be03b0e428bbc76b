"""Rough and empirical reflectance models: the GPU against float64, and against facts from the literature."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from raytracer import brdf, glsl
from raytracer.compiler.glsl import materials
from raytracer.compiler.material_layout import make_layout, pack_struct
from raytracer.ground_truth import rough_surfaces
from raytracer.ground_truth.reflectance import reflected
from raytracer.scene.materials.lobe import Lobe
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS

Array = NDArray[np.float64]
pytestmark = pytest.mark.gl

# Where both cosines are above GRAZING, the GPU and float64 agree to MOST, and in the median to MEDIAN.
GRAZING, MOST, MEDIAN = 1e-3, 1e-4, 1e-6
# Smaller values, far down the flank of a highlight, have lost digits to the exponent.
SMALLEST = 1e-12


def direction(cosine: Any, azimuth: Any) -> Array:
    """Return unit vectors in polar coordinates around +z."""
    cosine, azimuth = np.broadcast_arrays(np.asarray(cosine, float), np.asarray(azimuth, float))
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)


def pairs(count: int, seed: int = 0) -> tuple[Array, Array]:
    """Return directions of the light and of the viewer that are exact in float32.

    They are anywhere, grazing, along the normal, near the mirror direction, and back to the light.
    """
    rng = np.random.default_rng(seed)
    wi, wo = (
        direction(
            np.concatenate([rng.uniform(GRAZING, 1, count), 10 ** rng.uniform(np.log10(GRAZING) + 1e-6, 0, count)]),
            rng.uniform(0, 2 * np.pi, 2 * count),
        )
        for _ in range(2)
    )
    tilt = np.concatenate([10 ** rng.uniform(-5, -1, (count // 4, 1)) * rng.normal(size=(count // 4, 3))] * 2)
    few = wi[: len(tilt)]
    near = few * np.repeat([[-1, -1, 1], [1, 1, 1]], len(tilt) // 2, axis=0) + tilt
    up = np.array([0, 0, 1.0]) + tilt
    wi, wo = np.concatenate([wi, few, up]), np.concatenate([wo, near, up[::-1]])
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True) for w in (wi, wo))
    above = (wi[:, 2] > GRAZING) & (wo[:, 2] > GRAZING)
    return round_directions(wi[above]), round_directions(wo[above])


def round_directions(vectors: Array) -> Array:
    """Round vectors to float32, and normalise them again."""
    single = vectors.astype(np.float32).astype(float)
    return single / np.linalg.norm(single, axis=-1, keepdims=True)


def material(model: str, **parameters: Any) -> Material:
    """Return a material whose numbers are rounded to float32."""
    exact = lambda v: float(np.float32(v)) if isinstance(v, float) else v  # noqa: E731
    values: dict[str, Any] = {}
    for name, value in {**Material(model, **parameters).parameters, **parameters}.items():
        several = isinstance(value, tuple) and name != "lobes"
        values[name] = tuple(map(exact, value)) if several else exact(value)
    return Material(model, **values)


def reference(m: Material, wi: Array, wo: Array) -> Array:
    return reflected(m, np.broadcast_to([0.0, 0.0, 1.0], wi.shape), wi, wo)


def errors(m: Material, count: int = 2000) -> Array:
    """Return the relative errors of the GPU's values."""
    wi, wo = pairs(count)
    expected = reference(m, wi, wo)
    values = brdf.evaluate(m, wi, wo)
    assert np.isfinite(values).all() and (values >= 0).all()
    counts = expected > SMALLEST
    assert (values[~counts] <= 2 * SMALLEST).all()
    return np.abs(values - expected)[counts] / expected[counts]


def assert_agrees(m: Material, count: int = 2000) -> None:
    relative_errors = errors(m, count)
    assert np.median(relative_errors) <= MEDIAN and relative_errors.max() <= MOST, (
        m,
        np.median(relative_errors),
        relative_errors.max(),
    )


def assert_finite(m: Material) -> None:
    """Check values at the horizon, at the poles, in the mirror direction and back to the light."""
    cosines = np.array([1.0, 0.9999999, 0.5, 1e-3, 1e-5, 1e-7, 1e-20, 0.0])
    azimuths = np.array([0.0, 1e-7, 1.0, np.pi / 2, np.pi - 1e-7, np.pi])
    i, o, a = (x.ravel() for x in np.meshgrid(cosines[:-1], cosines, azimuths))
    values = brdf.evaluate(m, direction(i, 0.0 * a), direction(o, a))
    assert np.isfinite(values).all() and (values >= 0).all(), m


def extremes(model: str) -> list[Material]:
    """Return the default material, and one material for each end of the range of each number and colour."""
    default = Material(model)
    ends = [
        default.replace(**{name: end})
        for name, parameter in MODELS[model].parameters.items()
        if parameter.kind in ("number", "color") and name not in ("ka", "le") and name in default.parameters
        for end in (parameter.low, parameter.high)
    ]
    return [default, *ends]


def albedo(m: Material, cosine: float, nodes: int = 400) -> Array:
    """Return the share of uniform light that is reflected towards a viewer, by quadrature over the light in float64."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    theta, phi = np.meshgrid((x + 1) * np.pi / 4, (x + 1) * np.pi / 2, indexing="ij")
    weights = np.multiply.outer(w, w) * np.pi / 4 * np.pi / 2 * np.sin(theta) * 2
    wi = direction(np.cos(theta), phi).reshape(-1, 3)
    return weights.ravel() @ reference(m, wi, np.broadcast_to(direction(cosine, 0.0), wi.shape))


def assert_reciprocal(m: Material, tolerance: float = 1e-5) -> None:
    wi, wo = pairs(500)
    f, g = brdf.evaluate(m, wi, wo) / wi[:, 2:], brdf.evaluate(m, wo, wi) / wo[:, 2:]
    assert (np.abs(f - g) <= tolerance * (f + g) + SMALLEST).all()


def call(function: str, m: Material, *arguments: Any) -> Any:
    """Call a GLSL function of the material's model. A str in `arguments` stands for the material."""
    layout = make_layout([m])
    generated = {
        "materials.glsl": materials.material_text(layout),
        "top.glsl": "\n".join(['#include "materials.glsl"', *materials.reflected_text(layout)]),
    }
    data = pack_struct(layout, m, glsl.struct_dtype("Material", "top.glsl", generated))
    passed = [data if isinstance(argument, str) else argument for argument in arguments]
    return glsl.call(function, *passed, generated=generated, file="top.glsl")


def grey(value: float) -> tuple[float, float, float]:
    return (value, value, value)


NORMAL = np.array([[0.0, 0.0, 1.0]])
EMPIRICAL = [
    *(
        material("strauss", smoothness=s, metalness=metal, color=(0.7, 0.01, 0.0))
        for s in (0.0, 0.3, 0.7, 0.99, 0.9999, 1.0 - 4e-6)
        for metal in (0.0, 1.0)
    ),
    material("strauss", kf=1.001, kg=1.001, transparency=1.0),
    material("strauss", kf=10.0, kg=10.0, kj=1.0),
    *(
        material("lafortune", rho=0.0, lobes=(Lobe(grey(-1.0), grey(1.0), grey(n)),))
        for n in (0.0, 1.0, 20.0, 1e3, 1e5, 1e6)
    ),
    material("lafortune", lobes=()),
]
# The first lobes of brushed metal and of house paint (Lafortune et al. 1997, from Cornell), over their largest value.
LOBES = (
    Lobe(grey(-1.0), (0.90539, 0.90723, 0.91143), (15.8708, 15.6489, 15.4571), scale=(5.92, 5.76, 5.79)),
    Lobe(grey(-1.0), (0.66020, 0.62230, 0.57820), (111.267, 88.9222, 65.2179), scale=(325.0, 250.0, 190.0)),
    Lobe(grey(1.0), (0.88941, 0.72327, 0.87432), (21.820103, 18.597755, 7.472717), scale=(0.0485, 0.057, 0.0507)),
)


def round_lobes(lobes: tuple[Lobe, ...]) -> tuple[Lobe, ...]:
    """Round the numbers of lobes to float32."""
    exact = lambda values: tuple(float(np.float32(v)) for v in values) if values else None  # noqa: E731
    return tuple(Lobe(*(exact(getattr(lobe, name)) for name in ("cx", "cz", "n", "cy", "scale"))) for lobe in lobes)


TURNED_LOBES = round_lobes((Lobe((-1.0, 0.5, 0.25), (0.9, -1.0, 1.0), (100.0, 3.0, 40.0), cy=(-0.5, 0.25, -1.0)),))
ROUGH = [
    material("lafortune", rho=0.03, lobes=round_lobes(LOBES)),
    material("lafortune", lobes=TURNED_LOBES, tangent=(3.0, 4.0, 1.0)),
    material("lafortune", lobes=TURNED_LOBES, tangent=(0.0, 0.0, 2.0)),
    *(material("oren_nayar", form=form, sigma=s) for form in ("full", "short") for s in (0.0, 1.0, 17.0, 30.0)),
    material("oren_nayar", form="short", sigma=90.0),
    *(material("eon", roughness=r, rho=rho) for r in (0.0, 1e-4, 0.3, 1.0) for rho in (0.01, 1.0)),
]
WAVES = [
    material("he", **parameters)
    for parameters in (
        {},
        {"sigma0": 1e-4},
        {"sigma0": 0.01},
        {"tau": 0.5},
        {"tau": 100.0},
        {"sigma0": 0.5, "tau": 1.0},
        {"sigma0": 3.0, "tau": 20.0, "rho": 0.3},
        {"sigma0": 0.647, "tau": 28.0, "fresnel": "conductor"},
    )
]


@pytest.mark.parametrize("m", [*EMPIRICAL, *ROUGH, *WAVES], ids=repr)
def test_the_gpu_agrees_with_float64(m: Material) -> None:
    assert_agrees(m, 500 if m.model == "he" else 2000)


@pytest.mark.parametrize("masking", ["correlated", "separable"])
@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
@pytest.mark.parametrize("alpha", [2e-4, 0.03, 0.3, 1.0])
def test_the_gpu_agrees_with_float64_for_the_same_quadrature(alpha: float, distribution: str, masking: str) -> None:
    assert_agrees(material("diffuse_microfacet", alpha=alpha, distribution=distribution, masking=masking), 200)


@pytest.mark.parametrize("nodes", [40, 512, 4096])
def test_the_gpu_agrees_for_any_number_of_nodes(nodes: int) -> None:
    assert_agrees(material("diffuse_microfacet", nodes=nodes), 50)


@pytest.mark.parametrize("model", ["strauss", "lafortune", "oren_nayar", "eon", "diffuse_microfacet", "he"])
def test_a_model_is_finite_at_the_ends_of_its_ranges_and_at_the_horizon(model: str) -> None:
    for m in extremes(model):
        assert_finite(m)


@pytest.mark.parametrize(
    "m",
    [
        Material("strauss", smoothness=1 - 3e-6, kf=1.001, kg=1.001),
        Material(
            "lafortune", lobes=[{"cx": 0, "cz": 0, "n": 0}, {"cx": 0, "cz": 0, "n": 5}, {"cx": 0, "cz": 1, "n": 1e6}]
        ),
        Material("lafortune", lobes=[{"cx": -1, "cy": 0, "cz": 0, "n": 0.5}], tangent=(1e-7, 0, 1)),
        Material("oren_nayar", form="short", sigma=90),
        Material("diffuse_microfacet", distribution="beckmann", alpha=1e-4, masking="separable"),
        Material("diffuse_microfacet", distribution="ggx", alpha=1e-4, masking="separable"),
        Material("he", sigma0=1e3, tau=1e6, wavelength=0.1),
        Material("he", sigma0=1e3, tau=1e-3, wavelength=0.1),
        Material("he", sigma0=0, tau=1e6, wavelength=0.1),
    ],
    ids=repr,
)
def test_combinations_of_extreme_parameters_are_finite(m: Material) -> None:
    assert_finite(m)


def test_strauss_f_and_g_are_functions_of_angles() -> None:
    """F rises from 0 to 1 and G falls from 1 to 0 with the angle. As functions of the cosine they would be reversed."""
    m = Material("strauss")
    x = np.array([0.0, 0.5, 0.9, 1.0], np.float32)
    assert call("straussF", m, x, 1 - x, 1.12) == pytest.approx([0, 0.0263, 0.2894, 1], abs=5e-5)
    assert call("straussG", m, 1 - x, 1.01)[[0, 2, 3]] == pytest.approx([1, 0.9918, 0], abs=5e-5)


def test_strauss_metal_has_a_coloured_highlight_and_plastic_a_white_one() -> None:
    color = np.array([0.8, 0.4, 0.2])
    metal, plastic = (Material("strauss", color=tuple(color), smoothness=0.9, metalness=k) for k in (1.0, 0.0))
    assert brdf.evaluate(metal, NORMAL, NORMAL)[0] / color == pytest.approx(0.729 + 0.1 * 0.271, rel=1e-5)
    assert brdf.evaluate(plastic, NORMAL, NORMAL)[0] - 0.271 * color == pytest.approx(0.729, rel=1e-5)


@pytest.mark.parametrize("n", [1.0, 10.0, 1e4])
def test_a_lafortune_lobe_can_equal_phongs_lobe(n: float) -> None:
    """Cx = Cy = -Cz = -((n + 2) / 2 pi)^(1/n) makes the lobe (n + 2) / 2 pi (R.V)^n."""
    c = ((n + 2) / (2 * np.pi)) ** (1 / n)
    m = Material("lafortune", rho=0, lobes=[{"cx": -c, "cz": c, "n": n}])
    wi, wo = pairs(500)
    cosine = np.maximum(np.sum(wi * [-1, -1, 1] * wo, axis=-1), 0)
    expected = wi[:, 2] * (n + 2) / (2 * np.pi) * cosine**n
    assert brdf.evaluate(m, wi, wo)[:, 0] == pytest.approx(expected, rel=2e-5, abs=1e-7)


def test_a_quarter_turn_of_the_tangent_swaps_cx_and_cy() -> None:
    lobe = Lobe((-1.0, 0.5, 0.25), grey(0.75), grey(4.0), (-0.5, 0.25, -1.0))
    swapped = Lobe(lobe.cy, lobe.cz, lobe.n, lobe.cx)
    wi, wo = pairs(200)
    a = brdf.evaluate(Material("lafortune", lobes=[lobe], tangent=(0, 3, 0)), wi, wo)
    b = brdf.evaluate(Material("lafortune", lobes=[swapped], tangent=(5, 0, 1)), wi, wo)
    assert a == pytest.approx(b, rel=1e-5)


@pytest.mark.parametrize("m", [*ROUGH, *WAVES[:4]], ids=repr)
def test_the_model_is_reciprocal(m: Material) -> None:
    # With a tangent along the normal, the direction of the light replaces the tangent.
    if m.model != "lafortune" or m.tangent != (0.0, 0.0, 2.0):
        assert_reciprocal(m, 1e-4)


def test_oren_nayar_without_roughness_is_lambert() -> None:
    wi, wo = pairs(200)
    for form in ("full", "short"):
        values = brdf.evaluate(Material("oren_nayar", sigma=0, rho=0.5, form=form), wi, wo)
        assert values == pytest.approx(np.repeat(0.5 / np.pi * wi[:, 2:], 3, axis=1), rel=1e-6)


def test_oren_nayar_has_the_known_albedos() -> None:
    """For rho = 1 and sigma = 0.3 and 1 rad. The full form reflects more than all light at grazing angles."""
    for sigma, form, cosine, expected in (
        (0.3, "full", 0.1, 1.027),
        (0.3, "short", 0.1, 0.998),
        (1.0, "full", 1.0, 0.775),
        (1.0, "short", 1.0, 0.624),
    ):
        m = Material("oren_nayar", sigma=np.degrees(sigma), rho=1, form=form)
        assert albedo(m, cosine)[0] == pytest.approx(expected, abs=6e-4)


def test_negative_values_of_the_full_form_are_clamped_to_zero() -> None:
    """For opposite grazing directions the paper's C1 + cos(phi) C2 tan(beta) + ... changes its sign."""
    m = Material("oren_nayar", sigma=90)
    wi, wo = direction([0.01], 0), direction([0.01], np.pi)
    assert (brdf.evaluate(m, wi, wo) == 0).all() and (reference(m, wi, wo) == 0).all()
    assert (brdf.evaluate(m, direction([0.5], 0), wo) > 0).all()


@pytest.mark.parametrize("r", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("cosine", [1.0, 0.5, 0.1, 0.01])
def test_white_eon_reflects_all_light(r: float, cosine: float) -> None:
    assert albedo(Material("eon", roughness=r, rho=1), cosine) == pytest.approx(1, abs=1e-6)


def test_eons_albedo_without_interreflection_has_the_known_values() -> None:
    assert rough_surfaces.eon_mean_albedo(1.0) == pytest.approx(0.83281, abs=5e-6)
    assert rough_surfaces.eon_albedo(np.array([0.0]), 1.0) == pytest.approx(0.77652, abs=5e-6)


@pytest.mark.parametrize("alpha", [0.3, 0.6, 0.999])
def test_lambertian_ggx_facets_have_a_closed_form_at_normal_incidence(alpha: float) -> None:
    b = np.sqrt(1 - alpha**2)
    expected = (1 - alpha**2 / b * np.arcsinh(b / alpha)) / b**2
    assert integral("ggx", alpha, NORMAL, NORMAL) * np.pi == pytest.approx(expected, abs=1e-7)
    m = Material("diffuse_microfacet", alpha=alpha, rho=1, nodes=2048)
    assert brdf.evaluate(m, NORMAL, NORMAL)[0] * np.pi == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("alpha", "expected"), [(0.3, 0.9600), (0.6, 0.8753), (1.0, 0.7579)])
def test_lambertian_beckmann_facets_have_the_known_values_at_normal_incidence(alpha: float, expected: float) -> None:
    assert integral("beckmann", alpha, NORMAL, NORMAL) * np.pi == pytest.approx(expected, abs=3e-4)
    m = Material("diffuse_microfacet", alpha=alpha, rho=1, distribution="beckmann", nodes=2048)
    assert brdf.evaluate(m, NORMAL, NORMAL)[0] * np.pi == pytest.approx(expected, abs=3e-4)


def integral(distribution: str, alpha: float, wi: Array, wo: Array) -> Array:
    """Return f cos(theta_i) of white Lambertian facets, exact to 1e-6 for cosines above 0.02."""
    m = Material("diffuse_microfacet", alpha=alpha, distribution=distribution, rho=1)
    return rough_surfaces.diffuse_microfacet_integral(m, np.broadcast_to(NORMAL, wi.shape), wi, wo)[:, 0]


def test_the_integral_equals_a_plain_sum_over_normals() -> None:
    """The directions have large cosines, so a sum over theta and phi needs no substitution.

    It is equation (xxiii) of the article "Microfacet BRDFs from Scratch".
    """
    alpha, wi, wo = 0.5, direction([0.8], 0.3), direction([0.6], 2.0)
    x, w = np.polynomial.legendre.leggauss(1000)
    theta, phi = (x + 1) * np.pi / 4, 2 * np.pi * np.arange(1000) / 1000
    normals = direction(np.cos(theta)[:, None], phi).reshape(-1, 3)
    D = alpha**2 / (np.pi * (1 - (1 - alpha**2) * np.cos(theta) ** 2) ** 2)
    weights = np.repeat(w * np.pi / 4 * 2 * np.pi / 1000 * np.sin(theta) * D, 1000)
    a, b = (np.sqrt(1 + alpha**2 * (1 / w[0, 2] ** 2 - 1)) for w in (wi, wo))
    facets = weights @ (np.maximum(normals @ wi[0], 0) * np.maximum(normals @ wo[0], 0))
    expected = facets / ((a + b) / 2) / np.pi / 0.6
    assert integral("ggx", alpha, wi, wo) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("distribution", "alpha"), [("ggx", 0.1), ("ggx", 0.6), ("beckmann", 0.3), ("beckmann", 1.0)])
@pytest.mark.parametrize(("nodes", "median", "most"), [(64, 5e-2, 5e-1), (128, 2e-3, 3e-2), (512, 2e-4, 2e-3)])
def test_the_error_of_the_quadrature_is_within_the_documented_bounds(
    distribution: str, alpha: float, nodes: int, median: float, most: float
) -> None:
    """The errors that diffuse_microfacet.glsl states for its numbers of nodes."""
    rng = np.random.default_rng(3)
    wi, wo = (direction(rng.uniform(0.02, 1, 60), rng.uniform(0, 2 * np.pi, 60)) for _ in range(2))
    m = Material("diffuse_microfacet", alpha=alpha, distribution=distribution, nodes=nodes, rho=1)
    relative_errors = np.abs(brdf.evaluate(m, wi, wo)[:, 0] / integral(distribution, alpha, wi, wo) - 1)
    assert np.median(relative_errors) <= median and relative_errors.max() <= most


@pytest.mark.parametrize("masking", ["correlated", "separable"])
@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
def test_lambertian_facets_are_reciprocal_to_rounding(distribution: str, masking: str) -> None:
    assert_reciprocal(Material("diffuse_microfacet", alpha=0.5, distribution=distribution, masking=masking, nodes=60))


def test_flat_lambertian_facets_are_lambert() -> None:
    wi, wo = (direction(np.array([0.9, 0.2, 0.5]), azimuth) for azimuth in (0.0, 2.0))
    values = brdf.evaluate(Material("diffuse_microfacet", alpha=1e-4, rho=0.5), wi, wo)
    assert values[:, 0] == pytest.approx(0.5 / np.pi * wi[:, 2], rel=1e-3)


def test_hes_sum_of_64_terms_is_the_whole_series() -> None:
    """For g up to 1e6 the largest terms are about the millionth.

    The paper's series would need all terms before them.
    """
    rng = np.random.default_rng(0)
    g = np.float32(10 ** rng.uniform(-7, 6, 100))
    b = np.float32(g * 10 ** rng.uniform(-2, 1, 100))
    expected = rough_surfaces.he_series(g.astype(float), b.astype(float)) / g
    sums = call("heSum", Material("he"), g, b, 64.0)
    counts = expected * g > 1e-12
    assert sums[counts] == pytest.approx(expected[counts], rel=5e-6) and counts.sum() > 50


def test_hes_printed_products_of_polarisations_are_one() -> None:
    """The float64 reference has the printed products, and the shader has (v.v / v.N)^2; tests above compare the two.

    In the limit, f at L = V = N is the Fresnel factor over 4 pi alpha^2, and not a quarter of it.
    """
    alpha = 0.2
    m = Material("he", sigma0=100, tau=2 * 100 / alpha, f0=1)
    assert brdf.evaluate(m, NORMAL, NORMAL)[0] == pytest.approx(1 / (4 * np.pi * alpha**2), rel=1e-5)


def test_he_tends_to_geometric_optics_with_beckmanns_distribution_on_very_rough_surfaces() -> None:
    alpha = 0.2
    m = Material("he", sigma0=100, tau=2 * 100 / alpha, f0=0.8)
    rng = np.random.default_rng(1)
    wi, wo = (round_directions(direction(rng.uniform(0.8, 1, 200), rng.uniform(0, 2 * np.pi, 200))) for _ in range(2))
    H = (wi + wo) / np.linalg.norm(wi + wo, axis=-1, keepdims=True)
    tan2 = 1 / H[:, 2] ** 2 - 1
    D = np.exp(-tan2 / alpha**2) / (np.pi * alpha**2 * H[:, 2] ** 4)
    F = 0.8 + 0.2 * (1 - np.sum(wi * H, axis=-1)) ** 5
    # The shadowing factor at these angles is 1, with an error of 1e-3.
    assert brdf.evaluate(m, wi, wo)[:, 0] == pytest.approx(F * D / (4 * wo[:, 2]), rel=3e-3)


def mirrored(m: Material, cosines: Array) -> Array:
    V = direction(cosines, 0.0)
    return call("heMirrored", m, "m", NORMAL.astype(np.float32), V.astype(np.float32))


def test_hes_mirrored_part_agrees_with_float64() -> None:
    cosines = np.array([1.0, 0.9, 0.5, 0.1, 0.01], np.float32).astype(float)
    for m in (material("he"), material("he", sigma0=0.03), material("he", sigma0=0.5, tau=1.0)):
        V = round_directions(direction(cosines, 0.0))
        expected = rough_surfaces.he_mirrored(m, np.broadcast_to(NORMAL, V.shape), V)
        assert mirrored(m, cosines) == pytest.approx(expected, rel=2e-5, abs=1e-12)


def test_a_smooth_he_surface_is_a_mirror_and_a_rough_one_has_no_mirrored_part() -> None:
    cosines = np.array([1.0, 0.5, 0.1])
    smooth, rough = (Material("he", sigma0=s, f0=0.5) for s in (0.0, 5.0))
    F = 0.5 + 0.5 * (1 - cosines) ** 5
    assert mirrored(smooth, cosines)[:, 0] == pytest.approx(F, rel=1e-6)
    assert (mirrored(rough, cosines)[:2] == 0).all()
    wi, wo = pairs(200)
    assert (brdf.evaluate(smooth, wi, wo) == 0).all()


@pytest.mark.parametrize("sigma0", [0.01, 0.03, 0.05, 0.1])
def test_the_mirrored_and_the_scattered_part_of_he_sum_to_1(sigma0: float) -> None:
    """For F = 1 at normal incidence the parts sum to 1: the heights of the surface shift phases and lose no light."""
    m = Material("he", sigma0=sigma0, tau=5, f0=1, wavelength=0.55)
    together = mirrored(m, np.array([1.0]))[0, 0] + albedo(m, 1.0, 60)[0]
    assert together == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize(
    "m",
    [
        *EMPIRICAL[14:18],
        *ROUGH,
        *(m for m in WAVES[:7] if m.tau < 50),
        material("diffuse_microfacet"),
        material("diffuse_microfacet", alpha=1e-3),
    ],
    ids=repr,
)
def test_the_gpu_agrees_for_any_normal(m: Material) -> None:
    """For a normal that is no axis, components in the surface are rounded differences.

    The materials have no lobes narrower than 0.01 rad, for which the error is larger (median 3e-6, at most 3e-4 for an
    exponent of 1e6).
    """
    wi, wo = pairs(300)
    axes, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(len(wi), 3, 3)))
    N, L, V = (round_directions(np.einsum("nij,nj->ni", axes, np.broadcast_to(w, wi.shape))) for w in (NORMAL, wi, wo))
    expected = reflected(m, N, L, V)
    values = call(m.model, m, "m", *(w.astype(np.float32) for w in (N, L, V)))
    assert np.isfinite(values).all() and (values >= 0).all()
    counts = (np.minimum(np.sum(N * L, axis=-1), np.sum(N * V, axis=-1))[:, None] > 1e-2) & (expected > 1e-9)
    error = np.abs(values - expected)[counts] / expected[counts]
    assert np.median(error) <= MEDIAN and error.max() <= MOST

    # A viewer that rounding puts below the horizon.
    below = round_directions(V - (np.sum(N * V, axis=-1) + 1e-7)[:, None] * N).astype(np.float32)
    values = call(m.model, m, "m", N.astype(np.float32), L.astype(np.float32), below)
    assert np.isfinite(values).all() and (values >= 0).all()
