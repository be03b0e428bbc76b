"""Drivers with lower limits, or other implementations, than the driver of this machine."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.draws import sample_at
from raytracer.compiler.frame import make_frame
from raytracer.rendering.programs import find_programs
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import compiled
from tests.processes import run_for_output

pytestmark = pytest.mark.gl

SIZE = (48, 27)
# A scene with few primitives, and a scene with so many that rays test candidate lists.
SCENE = """
import raytracer as rt
balls = [rt.Sphere((x, y, -y), 0.45) for x in range(-3, 4) for y in range(3)]
few = rt.Scene([*balls[:2], rt.Plane((0, 1, 0), -1)], [rt.PointLight((4, 7, 4))], rt.Camera((0, 2, 6), (0, 0, 0)))
many = rt.Scene([*balls, rt.Plane((0, 1, 0), -1)], [rt.PointLight((4, 7, 4))], rt.Camera((0, 2, 6), (0, 0, 0)))
"""


def test_softpipe_draws_the_same_pictures(renderer: Renderer, tmp_path: Path) -> None:
    # softpipe is Mesa's simple software driver. Its buffer textures have 65,536 texels, the minimum of OpenGL 3.3.
    if "llvmpipe" not in renderer.device.limits.driver:
        pytest.skip("another driver than Mesa's")
    code = f"{SCENE}\nfor n, s in dict(few=few, many=many).items(): rt.render(s, {SIZE}).save(f'{tmp_path}/{{n}}.npz')"
    environment = os.environ | {"GALLIUM_DRIVER": "softpipe", "RAYTRACER_BACKEND": "egl"}
    run_for_output(sys.executable, "-c", code, env=environment)
    namespace: dict[str, rt.Scene] = {}
    exec(SCENE, namespace)
    for name in ("few", "many"):
        other, own = np.load(tmp_path / f"{name}.npz"), renderer.render(namespace[name], SIZE, Settings())
        assert own.material is not None
        same = other["material"] == own.material
        assert same.mean() > 0.995 and len(np.unique(own.material)) > 1, name
        difference = np.abs(other["radiance"] - own.radiance).max(axis=2)[same]
        assert np.mean(difference > 1e-4) < 0.005, name


def test_a_scene_beyond_the_limits_of_the_driver_is_refused_every_time(
    renderer: Renderer,
) -> None:
    # Spheres all around several lights, so that the candidate lists of the lights are long for any number of cells.
    around = [(4 + math.cos(i), 7 + math.sin(3 * i), 4 + math.sin(i)) for i in range(20)]
    lights = [rt.PointLight((4 + 0.1 * i, 7, 4)) for i in range(4)]
    scene = msgspec.structs.replace(scenes.lit_scene(*(rt.Sphere(place, 0.8) for place in around)), lights=lights)
    settings = Settings()
    for most in (10, 70, 90):
        limits = msgspec.structs.replace(renderer.device.limits, buffer_texels=most)
        for _ in range(2):
            with pytest.raises(rt.InputError, match=rf"^objects: expected at most {most} .*buffer textures\), got"):
                make_frame(compiled(scene), SIZE, limits)
    with renderer.device.context:
        tiles = TileRenderer(renderer.device, SIZE)
        frame = make_frame(compiled(scene), SIZE, renderer.device.limits)
        tiles.load(find_programs(renderer.device, frame.compiled), frame)
        tiles.draw((0, 0, *SIZE), [sample_at(0, settings.sampling)])
        radiance = tiles.read_sums((0, 0, *SIZE))
        tiles.close()
    np.testing.assert_array_equal(radiance, renderer.render(scene, SIZE, settings).radiance)
