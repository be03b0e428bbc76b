"""The uniforms of a frame: the numbers that all samples share and that are in no texture or block."""

from __future__ import annotations

import math

import numpy as np

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.scene_lists import GRIDS, LightLists
from raytracer.compiler.view_space import View, pixel_scale
from raytracer.core.validation import MAX_COLOR


def frame_uniforms(
    compiled: CompiledScene, view: View, lists: LightLists | None, size: tuple[int, int]
) -> dict[str, object]:
    """Return the values of the uniforms that all samples share, by their names in the shaders."""
    scene, camera = compiled.scene, view.camera
    farthest = lists.camera.farthest if lists else 1.0
    return {
        "draw.resolution": size,
        "draw.pixelScale": pixel_scale(camera, size[1]),
        "draw.ambient": scene.ambient,
        "draw.background": scene.background,
        "mostLight": MAX_COLOR,
        "draw.firstPlane": compiled.surfaces.bounded,
        "draw.grid": lists.grid if lists else GRIDS[0],
        "draw.depthScale": 2.0 ** -math.frexp(farthest)[1],
        # OpenGL reads the matrix by columns, so the rows of the rotation make its inverse, from view to world space.
        "toWorld": tuple(view.rotation.astype(np.float32).ravel().tolist()),
        "advance": view.advance,
        "focus": math.dist(camera.position, camera.look_at),
        "everything": lists.everything if lists else (0, 0),
    }
