"""Comparison of our reflectance models with an independent renderer, Mitsuba 3 (Jakob et al. 2022)."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.rendering.renderer import Renderer
from tests.directions import direction_pairs

pytestmark = pytest.mark.gl


@pytest.fixture
def mi() -> Any:
    """The module mitsuba. Tests are skipped if it is not installed.

    If it is installed and its import fails, only the tests that need it fail. Any exception is possible, for example
    NameError for a missing library.
    """
    try:
        return importlib.import_module("mitsuba")
    except ModuleNotFoundError as error:
        if error.name != "mitsuba":
            raise
        pytest.skip("an extra: pip install -e '.[peers]'")


N, K = (0.2, 0.4, 1.4), (3.6, 2.4, 1.9)
RGB_N, RGB_K = ({"type": "rgb", "value": list(value)} for value in (N, K))


@pytest.mark.parametrize(
    ("bsdf", "material"),
    [
        (
            {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.1, 0.5, 0.8]}},
            rt.Material("lambert", rho=(0.1, 0.5, 0.8)),
        ),
        *(
            (
                {"type": "roughconductor", "distribution": model, "alpha": alpha, "material": "none"},
                rt.Material(model, alpha=alpha, f0=1, masking="separable", **more),
            )
            for model, more in (("ggx", {}), ("beckmann", {"smith": "rational"}))
            for alpha in (0.0625, 0.25, 1.0)
        ),
        (
            {"type": "roughconductor", "distribution": "ggx", "alpha": 0.25, "eta": RGB_N, "k": RGB_K},
            rt.Material("ggx", alpha=0.25, fresnel="conductor", n=N, k=K, masking="separable"),
        ),
    ],
    ids=lambda value: repr(value) if isinstance(value, rt.Material) else "",
)
def test_mitsuba_agrees_to_1e_5(mi: Any, renderer: Renderer, bsdf: dict[str, Any], material: rt.Material) -> None:
    mi.set_variant("scalar_rgb")
    peer, context = mi.load_dict(bsdf), mi.BSDFContext()
    # No more grazing directions and no narrower lobes, because Mitsuba's float32 is inaccurate for them.
    wi, wo = direction_pairs(1000, least=0.05)

    def peer_values(i: np.ndarray, o: np.ndarray) -> np.ndarray:
        interaction = mi.SurfaceInteraction3f()
        interaction.wi = mi.Vector3f(*o.tolist())
        return np.array(peer.eval(context, interaction, mi.Vector3f(*i.tolist())))

    expected = np.array([peer_values(i, o) for i, o in zip(wi, wo, strict=True)])
    values = rt.brdf.evaluate(material, wi, wo, device=renderer.device)
    counts = expected > 1e-6 * expected.max()
    assert counts.mean() > 0.3
    np.testing.assert_allclose(values[counts], expected[counts], rtol=1e-5)
