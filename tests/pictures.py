"""Two ways to the same picture, compared bit by bit."""

import numpy as np

from raytracer.formats.image import Image
from raytracer.rendering.renderer import Renderer


def assert_same(renderer: Renderer, one: Image, other: Image) -> None:
    """Two images of one scene by programs of the same formulas have the same bits, also of what the pixels see."""
    for name in ("radiance", "depth", "normal", "material"):
        a, b = getattr(one, name), getattr(other, name)
        if "llvmpipe" in renderer.device.limits.driver:
            np.testing.assert_array_equal(a, b, name)
        else:  # other compilers may contract a product and a sum in one of two programs, and not in the other
            np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-5, err_msg=name)
