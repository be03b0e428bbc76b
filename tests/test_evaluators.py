"""Every evaluator makes the picture of the walk, which looks at everything: bit for bit."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer import shader as shader_module
from raytracer.renderer import Renderer
from raytracer.settings import Settings

pytestmark = pytest.mark.gl


def check(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, scene: rt.Scene, size: tuple[int, int], settings: Settings
) -> int:
    """`cells` makes what `walk` makes, with a program for quiet cells, without, and by lists; how many pixels show an
    object."""
    walk = renderer.render(scene, size, msgspec.structs.replace(settings, evaluator="walk"), estimates=False)
    images = [renderer.render(scene, size, settings, only=only, estimates=False) for only in (False, True)]
    if settings.precision == 32:
        with monkeypatch.context() as patch:
            patch.setattr(shader_module, "FEW", 0)
            images.append(renderer.render(scene, size, settings, estimates=False))
    for image in images:
        for name in ("radiance", "depth", "normal", "material"):
            one, other = getattr(image, name), getattr(walk, name)
            if "llvmpipe" in renderer.context.info["GL_RENDERER"]:
                np.testing.assert_array_equal(one, other, name)
            else:  # other compilers may contract a product and a sum in one of two programs, and not in the other
                np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5, err_msg=name)
    assert walk.material is not None
    return int((walk.material >= 0).sum())


@pytest.mark.parametrize("precision", [32, 64])
def test_a_ball_beside_a_wide_view_is_seen(renderer: Renderer, monkeypatch: pytest.MonkeyPatch, precision: int) -> None:
    # The corners of the only cell span more than half of all directions.
    ball = rt.Sphere((-0.014780587448385951, -1.4029576615647563, 0.8244669686621453), 0.5152236804388914)
    at = (-2.614875843337293, 0.4450579249211968, 0.7516415816610956)
    settings = Settings(precision=precision)  # pyright: ignore[reportArgumentType]
    for fov, seen in ((160.0, 5), (170.0, 7), (179.0, 8), (179.9, 8)):
        camera = rt.Camera((0, 0, 0), at, vertical_fov=fov)
        scene = rt.Scene([ball], [], camera, background=(1, 1, 1))
        assert check(renderer, monkeypatch, scene, (16, 9), settings) == seen
