"""Planar depth: the distance from the camera along its direction of view, from the distance along each ray."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from raytracer.scene.camera import Camera


def planar_depth(depth: NDArray[Any], camera: Camera) -> NDArray[Any]:
    """Return the planar depth [H, W] of the points at the distances `depth` [H, W] along the rays of a picture.

    The rays go through the pixels' centres, the top row first. Rays that hit nothing have an infinite depth.
    """
    if camera.projection == "orthographic":  # all rays have the direction of view
        return depth
    height, width = depth.shape
    # The side of a pixel on the plane at the distance 1.
    side = 2.0 * math.tan(math.radians(camera.vertical_fov) / 2.0) / height
    x = side * (np.arange(width) + 0.5 - width / 2.0)
    y = side * (np.arange(height) + 0.5 - height / 2.0)
    cosine = 1.0 / np.sqrt(1.0 + np.square(x) + np.square(y)[:, None])
    return (depth * cosine).astype(depth.dtype)
