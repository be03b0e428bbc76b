"""Comparisons of pictures: with another way to the same bits, and with the float64 reference."""

import msgspec
import numpy as np

import raytracer as rt
from raytracer.analysis.pixel_doubt import PixelDoubt, find_pixel_doubt
from raytracer.formats.image import Image
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tiles import TILE
from raytracer.scene.settings import Settings
from tests.compiled import compiled


def assert_same(renderer: Renderer, one: Image, other: Image) -> None:
    """Assert that two images of one scene, by programs with the same formulas, have the same bits in all arrays."""
    for name in ("radiance", "depth", "normal", "material"):
        a, b = getattr(one, name), getattr(other, name)
        if "llvmpipe" in renderer.device.limits.driver:
            np.testing.assert_array_equal(a, b, name)
        else:  # other compilers may contract a product and a sum in only one of two programs
            np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-5, err_msg=name)


def assert_agrees(image: Image, truth: Image, resolved: PixelDoubt, doubt: float = 0.01) -> None:
    """Assert that `image` agrees with `truth`, within the rounding bounds of each pixel.

    At most a share `doubt` of the pixels may be doubtful.
    """
    assert image.depth is not None and image.normal is not None and image.material is not None
    assert truth.depth is not None and truth.normal is not None and truth.material is not None
    certain = ~resolved.doubtful
    assert resolved.doubtful.mean() <= doubt
    np.testing.assert_array_equal(image.material[certain], truth.material[certain])
    np.testing.assert_array_equal(np.isinf(image.depth)[certain], np.isinf(truth.depth)[certain])
    hit = certain & (truth.material >= 0)
    assert (np.abs(image.depth[hit] - truth.depth[hit]) <= resolved.depth[hit]).all()
    assert (np.linalg.norm(image.normal[certain] - truth.normal[certain], axis=1) <= resolved.normal[certain]).all()


def assert_agrees_with_truth(renderer: Renderer, scene: rt.Scene, size: tuple[int, int], settings: Settings) -> None:
    """Assert that the GPU's picture agrees with the float64 reference."""
    image = renderer.render(scene, size, settings)
    assert_agrees(image, ray_tracer.trace(scene, size, settings), find_pixel_doubt(scene, size, settings.precision))
    assert np.isfinite(image.radiance).all() and (image.radiance >= 0).all()


def assert_lists_agree(
    renderer: Renderer, scene: rt.Scene, size: tuple[int, int] = (128, 72), **settings: object
) -> None:
    """Assert that candidate lists make the picture that the walk makes, which tests all primitives."""
    chosen = Settings(**settings)  # pyright: ignore[reportArgumentType]
    assert compiled(scene, chosen).has_lists
    cells = renderer.render(scene, size, chosen)
    walk = renderer.render(scene, size, msgspec.structs.replace(chosen, evaluator="walk"))
    assert_same(renderer, cells, walk)


def assert_cells_agree(
    renderer: Renderer,
    scene: rt.Scene,
    size: tuple[int, int] = (160, 90),
    settings: Settings | None = None,
    tile: int = TILE,
) -> None:
    """Assert that a picture with plane-only cells has the radiance of the walk's picture."""
    settings = settings or Settings()
    assert settings.evaluator == "cells", "the default"
    cells = renderer.render(scene, size, settings, geometry=False, tile=tile).radiance
    walk = msgspec.structs.replace(settings, evaluator="walk")
    expected = renderer.render(scene, size, walk, geometry=False).radiance
    if "llvmpipe" in renderer.device.limits.driver:
        np.testing.assert_array_equal(cells, expected)
        only = renderer.render(scene, size, settings, geometry=False, tile=tile, single_picture=True).radiance
        np.testing.assert_array_equal(only, expected)
    else:  # other compilers may contract a product and a sum in only one of two programs
        np.testing.assert_allclose(cells, expected, rtol=0, atol=1e-6)
