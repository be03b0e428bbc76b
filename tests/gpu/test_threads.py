"""Threads take turns with OpenGL and get identical pictures. A forked process renders, or raises an error at once."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

import raytracer as rt
from raytracer import glsl
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.threads import run_in_threads

SIZE = (48, 27)
SETTINGS = Settings(samples=2)


def scene_number(k: int) -> rt.Scene:
    """Return scene k: all these scenes share one structure and its programs, and differ in numbers only."""
    return scenes.lit_scene(
        rt.Sphere((0, 0, 0), 1 + 0.1 * k, rt.Material(kd=(0.1 * k, 0.5, 0.2))) - rt.Sphere((0, 0, 1), 0.5)
    )


@pytest.mark.gl
def test_concurrent_threads_get_the_same_pictures_as_one_thread(renderer: Renderer) -> None:
    alone = [renderer.render(scene_number(k), SIZE, SETTINGS) for k in range(3)]
    material = rt.Material(model="ggx")
    wi, wo = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, 0.8]])
    value = rt.brdf.evaluate(material, wi, wo)

    def images(k: int) -> list[rt.Image]:
        return [renderer.render(scene_number(k), SIZE, SETTINGS) for _ in range(4)]

    def others() -> list[object]:
        return [(rt.brdf.evaluate(material, wi, wo), glsl.call("isInside", [[0, 1]], 0.5)) for _ in range(8)]

    *pictures, values = run_in_threads(*(lambda k=k: images(k) for k in range(3)), others)
    for k, several in enumerate(pictures):
        assert isinstance(several, list), several
        for image in several:
            np.testing.assert_array_equal(image.radiance, alone[k].radiance)
            np.testing.assert_array_equal(image.material, alone[k].material)
    assert isinstance(values, list), values
    assert all(np.array_equal(f, value) and inside for f, inside in values)


@pytest.mark.gl
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_interrupted_picture_gives_up_its_turn(renderer: Renderer, error: type[BaseException]) -> None:
    expected = renderer.render(scene_number(1), SIZE, SETTINGS).radiance

    def interrupt(done: int, total: int) -> None:
        raise error

    with pytest.raises(error):
        renderer.render(scene_number(1), SIZE, SETTINGS, progress=interrupt)
    [image] = run_in_threads(lambda: renderer.render(scene_number(1), SIZE, SETTINGS))
    assert isinstance(image, rt.Image), image
    np.testing.assert_array_equal(image.radiance, expected)
    np.testing.assert_array_equal(renderer.render(scene_number(1), SIZE, SETTINGS).radiance, expected)


@pytest.mark.gl
def test_a_progress_callback_must_not_render(renderer: Renderer) -> None:
    expected = renderer.render(scene_number(1), SIZE, SETTINGS).radiance
    for use in (lambda: renderer.render(scene_number(2), SIZE, SETTINGS), lambda: glsl.call("isInside", [[0, 1]], 0.5)):
        refused: list[str] = []

        def progress(done: int, total: int, use: Callable[[], object] = use, refused: list[str] = refused) -> None:
            with pytest.raises(RuntimeError, match=r"^expected no use of OpenGL from within a picture's progress") as e:
                use()
            refused.append(str(e.value))

        image = renderer.render(scene_number(1), SIZE, SETTINGS, progress=progress)
        assert refused
        np.testing.assert_array_equal(image.radiance, expected)


# A parent that has rendered ("warm") or not, forked children that render, and the parent again. Each prints a line.
FORKS = """
import multiprocessing, sys, threading
import raytracer as rt

scene = rt.Scene([rt.Sphere((0, 0, 0), 1)], [rt.PointLight((4, 7, 4))], rt.Camera((0, 0, 5), (0, 0, 0)))

def picture(_=0):
    try:
        return rt.render(scene, (32, 18), samples=2).radiance.sum().item()
    except rt.ContextError as error:
        return str(error)

def child(depth):
    print(picture(), flush=True)
    if depth:
        start(depth - 1)

def start(depth):
    process = fork.Process(target=child, args=(depth,))
    process.start()
    process.join()

fork = multiprocessing.get_context("fork")
if sys.argv[1] == "warm":
    print(picture())
sys.stdout.flush()
start(1 if sys.argv[1] == "warm" else 0)
with fork.Pool(2) as pool:
    print(*pool.map(picture, range(2)), sep="\\n")
sys.stdout.flush()
if sys.argv[1] == "warm":
    other = threading.Thread(target=rt.render, args=(scene, (320, 180)), kwargs={"samples": 64})
    other.start()
    start(0)
    other.join()
print(picture())
"""


@pytest.mark.gl
@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_a_fork_after_a_picture_raises_an_error_and_the_parent_continues() -> None:
    # Warnings are ignored, because Python 3.12 warns about every fork in a process with threads.
    code = [sys.executable, "-W", "ignore", "-c", FORKS, "warm"]
    lines = subprocess.run(code, timeout=120, check=True, capture_output=True, text=True).stdout.splitlines()
    first, *children, last = lines
    assert first == last
    assert len(children) == 5
    for line in children:
        assert "forked" in line and 'multiprocessing.get_context("spawn")' in line


@pytest.mark.gl
@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_a_fork_before_the_first_picture_renders() -> None:
    code = [sys.executable, "-W", "ignore", "-c", FORKS, "cold"]
    lines = subprocess.run(code, timeout=120, check=True, capture_output=True, text=True).stdout.splitlines()
    assert len(lines) == 4 and len(set(lines)) == 1 and float(lines[0]) > 0.0
