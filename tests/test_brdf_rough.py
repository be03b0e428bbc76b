"""The rough and the empirical reflectance models: the GPU's float32 against float64, and facts from the literature."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from raytracer import brdf
from raytracer.material import Material
from raytracer.models import MODELS
from raytracer.reference_brdf import reflected

Array = NDArray[np.float64]
pytestmark = pytest.mark.gl

# Where both cosines are above this, the two agree to MOST, in the median to MEDIAN.
GRAZING, MOST, MEDIAN = 1e-3, 1e-4, 1e-6
# Values below, far down the flank of a highlight, have lost digits to its exponent.
SMALLEST = 1e-12


def direction(cosine: Any, azimuth: Any) -> Array:
    """Unit vectors, around +z."""
    cosine, azimuth = np.broadcast_arrays(np.asarray(cosine, float), np.asarray(azimuth, float))
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=-1)


def pairs(count: int, seed: int = 0) -> tuple[Array, Array]:
    """Directions of the light and of the viewer, as float32 holds them: anywhere, grazing, along the normal, near the
    mirror direction, and back to the light.
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
    return rounded(wi[above]), rounded(wo[above])


def rounded(vectors: Array) -> Array:
    """What float32 holds, of length 1 again."""
    found = vectors.astype(np.float32).astype(float)
    return found / np.linalg.norm(found, axis=-1, keepdims=True)


def material(model: str, **parameters: Any) -> Material:
    """A material whose numbers float32 holds."""
    exact = lambda v: float(np.float32(v)) if isinstance(v, float) else v  # noqa: E731
    given = {**{k: v for k, v in Material(model, **parameters).parameters.items() if k != "lobes"}, **parameters}
    return Material(
        model,
        **{k: tuple(map(exact, v)) if isinstance(v, tuple) and k != "lobes" else exact(v) for k, v in given.items()},
    )


def reference(m: Material, wi: Array, wo: Array) -> Array:
    return reflected(m, np.broadcast_to([0.0, 0.0, 1.0], wi.shape), wi, wo)


def errors(m: Material, count: int = 2000) -> Array:
    """The relative errors of the GPU's answers."""
    wi, wo = pairs(count)
    expected = reference(m, wi, wo)
    found = brdf.evaluate(m, wi, wo)
    assert np.isfinite(found).all() and (found >= 0).all()
    of = expected > SMALLEST
    assert (found[~of] <= 2 * SMALLEST).all()
    return np.abs(found - expected)[of] / expected[of]


def assert_agrees(m: Material, count: int = 2000) -> None:
    found = errors(m, count)
    assert np.median(found) <= MEDIAN and found.max() <= MOST, (m, np.median(found), found.max())


def assert_finite(m: Material) -> None:
    """Finite and not negative at the horizon, at the poles, in the mirror's direction and back to the light."""
    cosines = np.array([1.0, 0.9999999, 0.5, 1e-3, 1e-5, 1e-7, 1e-20, 0.0])
    azimuths = np.array([0.0, 1e-7, 1.0, np.pi / 2, np.pi - 1e-7, np.pi])
    i, o, a = (x.ravel() for x in np.meshgrid(cosines[:-1], cosines, azimuths))
    found = brdf.evaluate(m, direction(i, 0.0 * a), direction(o, a))
    assert np.isfinite(found).all() and (found >= 0).all(), m


def extremes(model: str) -> list[Material]:
    """The default, and each number and colour at the ends of its range."""
    default = Material(model)
    ends = [
        default.replace(**{name: end})
        for name, parameter in MODELS[model].parameters.items()
        if parameter.kind in ("number", "color") and name not in ("ka", "le") and name in default.parameters
        for end in (parameter.low, parameter.high)
    ]
    return [default, *ends]


def albedo(m: Material, cosine: float, nodes: int = 400) -> Array:
    """Of light from everywhere, what goes towards a viewer at that cosine: in float64, by quadrature over the light."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    theta, phi = np.meshgrid((x + 1) * np.pi / 4, (x + 1) * np.pi / 2, indexing="ij")
    weights = np.multiply.outer(w, w) * np.pi / 4 * np.pi / 2 * np.sin(theta) * 2
    wi = direction(np.cos(theta), phi).reshape(-1, 3)
    return weights.ravel() @ reference(m, wi, np.broadcast_to(direction(cosine, 0.0), wi.shape))


def assert_reciprocal(m: Material, tolerance: float = 1e-5) -> None:
    wi, wo = pairs(500)
    f, g = brdf.evaluate(m, wi, wo) / wi[:, 2:], brdf.evaluate(m, wo, wi) / wo[:, 2:]
    assert (np.abs(f - g) <= tolerance * (f + g) + SMALLEST).all()
