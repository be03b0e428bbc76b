"""Depth, normal and material are drawn at the first access, with identical values in any thread, process and order."""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer import glsl
from raytracer.formats.image import Geometry
from raytracer.gpu import device as devices
from raytracer.rendering import geometry
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes
from tests.threads import run_in_threads

pytestmark = pytest.mark.gl

SIZE = (48, 27)
SETTINGS = Settings(samples=3)
NAMES = Geometry._fields
GREEN = rt.Material(kd=(0.1, 0.8, 0.2))
SCENE = scenes.lit_scene(
    rt.Sphere((0, 0, 0), 1.2) - rt.Sphere((0.3, 0.2, 1), 0.6, GREEN), rt.Plane((0, 1, 0), -1, GREEN)
)


def arrays(image: rt.Image) -> list[np.ndarray]:
    """Return copies of depth, normal and material."""
    return [np.array(getattr(image, name)) for name in NAMES]


def assert_same(values: list[np.ndarray], expected: list[np.ndarray]) -> None:
    for name, one, other in zip(NAMES, values, expected, strict=True):
        assert one.dtype == other.dtype, name
        np.testing.assert_array_equal(one, other, err_msg=name)


@pytest.fixture
def expected(renderer: Renderer) -> list[np.ndarray]:
    """The geometry of SCENE, drawn right after the picture."""
    return arrays(picture(renderer))


def picture(renderer: Renderer, scene: rt.Scene = SCENE, settings: Settings = SETTINGS, **options: Any) -> rt.Image:
    return renderer.render(scene, SIZE, settings, **options)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[geometry.GeometryRequest]:
    """The list of views whose geometry this process has drawn."""
    views: list[geometry.GeometryRequest] = []
    draw = geometry.draw_geometry

    def record_view(device: devices.Device, view: geometry.GeometryRequest) -> Geometry:
        views.append(view)
        return draw(device, view)

    monkeypatch.setattr(geometry, "draw_geometry", record_view)
    return views


def test_the_first_access_draws_all_three_arrays_once(
    renderer: Renderer, drawn: list[geometry.GeometryRequest], expected: list[np.ndarray]
) -> None:
    drawn.clear()
    image = picture(renderer)
    assert not drawn
    assert image.normal is not None and len(drawn) == 1
    assert_same(arrays(image), expected)
    assert image.depth is image.depth and len(drawn) == 1


def test_functions_that_need_no_geometry_draw_none(
    renderer: Renderer, drawn: list[geometry.GeometryRequest], tmp_path: Path
) -> None:
    image = picture(renderer)
    image.save(tmp_path / "a.png")
    others = [copy.copy(image), image.replace(metadata={"Title": "none"})]
    assert image not in others and len({image, *others}) == 3 and repr(others[0]) == repr(image)
    np.testing.assert_array_equal(np.asarray(others[1]), image)
    assert others[1].png() != image.png() and rt.compare(image, others[0]).rmse == 0.0
    assert image.samples is None and image.error is not None and image.estimate and image.metadata
    assert not drawn


def test_an_image_without_geometry_has_none(renderer: Renderer, drawn: list[geometry.GeometryRequest]) -> None:
    image = picture(renderer, geometry=False)
    assert image.depth is None and image.normal is None and image.material is None and not drawn


def test_other_pictures_and_calls_in_between_change_nothing(renderer: Renderer, expected: list[np.ndarray]) -> None:
    image = picture(renderer)
    for other in (scenes.assignment(), scenes.lit_scene(rt.Sphere((0, 0, 0), 3)), SCENE):
        arrays(picture(renderer, other, Settings(samples=2, shadows="diluted", bounces=0)))
    rt.brdf.evaluate(rt.Material("ggx"), (0, 0, 1), (0, 0, 1))
    glsl.call("isInside", [[0, 1]], 0.5)
    assert_same(arrays(image), expected)


def test_released_programs_are_compiled_again(renderer: Renderer, expected: list[np.ndarray]) -> None:
    image = picture(renderer)
    with renderer.device.turn():
        renderer.device.forget()
    assert_same(arrays(image), expected)


def test_programs_are_kept_within_the_limit(
    renderer: Renderer, expected: list[np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(devices, "KEPT_TEXT", 0)
    images = [picture(renderer) for _ in range(3)]
    for image in images:
        assert_same(arrays(image), expected)
    with renderer.device.turn():
        assert len(renderer.device._programs_without_holder()) <= 6


def test_tiles_of_any_size_make_the_same_geometry(renderer: Renderer, expected: list[np.ndarray]) -> None:
    for side in (8, 16, 40):
        assert_same(arrays(picture(renderer, tile=side)), expected)


@pytest.mark.parametrize(
    "settings",
    [
        Settings(),
        Settings(samples=4, sequence="random"),
        Settings(samples=8, adaptive=0.01),
        Settings(samples=64, max_error=0.01),
        Settings(samples=2, shadows="off"),
        Settings(samples=2, shadows="soft", bounces=0),
        Settings(samples=2, shading="lambert"),
    ],
)
def test_samples_shadows_and_shading_do_not_change_the_geometry(
    renderer: Renderer, expected: list[np.ndarray], settings: Settings
) -> None:
    assert_same(arrays(picture(renderer, settings=settings)), expected)


def test_threads_get_the_same_geometry_while_another_thread_renders(
    renderer: Renderer, expected: list[np.ndarray]
) -> None:
    images = [picture(renderer) for _ in range(6)]
    *results, others = run_in_threads(
        *(lambda image=image: arrays(image) for image in images),
        lambda: [picture(renderer, scenes.assignment()) for _ in range(4)],
    )
    assert isinstance(others, list), others
    for geometry_arrays in results:
        assert isinstance(geometry_arrays, list), geometry_arrays
        assert_same(geometry_arrays, expected)


def test_concurrent_accesses_draw_the_geometry_once(renderer: Renderer, drawn: list[geometry.GeometryRequest]) -> None:
    image = picture(renderer)
    depths = run_in_threads(*[lambda: image.depth] * 8)
    assert len(drawn) == 1
    assert all(depth is image.depth for depth in depths)


def test_a_progress_callback_gets_the_geometry_and_does_not_change_the_picture(
    renderer: Renderer, expected: list[np.ndarray]
) -> None:
    other = picture(renderer, scenes.assignment(), Settings(samples=2))
    image, calls = picture(renderer), []

    def read(done: int, total: int) -> None:
        assert_same(arrays(image), expected)
        calls.append(done)

    again = picture(renderer, scenes.assignment(), Settings(samples=2), progress=read)
    assert calls
    np.testing.assert_array_equal(again.radiance, other.radiance)
    assert_same(arrays(again), arrays(other))


def test_a_callback_gets_the_geometry_that_another_thread_waits_to_draw(
    renderer: Renderer, expected: list[np.ndarray]
) -> None:
    image = picture(renderer)
    begun = threading.Event()

    def wait_for_turn() -> list[np.ndarray]:
        begun.wait(30)
        return arrays(image)

    def ask(done: int, total: int) -> None:
        begun.set()
        threading.Event().wait(0.1)
        assert_same(arrays(image), expected)

    waited, other = run_in_threads(
        wait_for_turn, lambda: picture(renderer, scenes.assignment(), Settings(), progress=ask)
    )
    assert isinstance(other, rt.Image), other
    assert isinstance(waited, list), waited
    assert_same(waited, expected)


def test_copies_share_the_drawn_geometry(
    renderer: Renderer, drawn: list[geometry.GeometryRequest], expected: list[np.ndarray]
) -> None:
    drawn.clear()
    image = picture(renderer)
    copies = [copy.copy(image), image.replace(metadata={}), image.replace(depth=np.zeros(SIZE[::-1], np.float32))]
    assert copies[2].depth is not None and not copies[2].depth.any() and not drawn
    assert image.depth is copies[0].depth is copies[1].depth
    assert all(one.material is image.material for one in copies)
    assert len(drawn) == 1
    assert_same(arrays(copies[1]), expected)
    assert image.replace(depth=None).depth is None


def test_a_radiance_of_another_size_than_the_geometry_is_refused(renderer: Renderer) -> None:
    image = picture(renderer)
    with pytest.raises(rt.InputError, match=r"^depth: expected an array \(5, 6\) .*, got one of shape \(27, 48\)"):
        image.replace(radiance=np.zeros((5, 6, 3), np.float32))
    other = rt.Image(np.zeros((5, 6, 3), np.float32), depth=None)
    with pytest.raises(rt.InputError, match=r"^normal: expected an array \(5, 6, 3\)"):
        other.replace(normal=image.normal)


def test_a_deep_copy_has_its_own_arrays(renderer: Renderer, expected: list[np.ndarray]) -> None:
    image = picture(renderer)
    other = copy.deepcopy(image)
    assert_same(arrays(other), expected)
    assert image.depth is not None and other.depth is not None
    other.depth[:] = 0
    assert_same(arrays(image), expected)


# Reads the arrays of a pickled image, and checks that this does not load OpenGL.
READ = """
import pickle, sys
image = pickle.load(open(sys.argv[1], "rb"))
assert "moderngl" not in sys.modules
import numpy as np
np.savez(sys.argv[2], *[getattr(image, name) for name in sys.argv[3:]])
assert "moderngl" not in sys.modules
"""


def test_a_pickle_contains_the_arrays_and_needs_no_opengl(
    renderer: Renderer, expected: list[np.ndarray], tmp_path: Path
) -> None:
    image = picture(renderer)
    for protocol in (0, pickle.HIGHEST_PROTOCOL):
        other = pickle.loads(pickle.dumps(image, protocol))
        assert_same(arrays(other), expected)
        np.testing.assert_array_equal(other.radiance, image.radiance)
        assert other.estimate == image.estimate and other.metadata == image.metadata
    (tmp_path / "image.pickle").write_bytes(pickle.dumps(picture(renderer)))
    files = [str(tmp_path / name) for name in ("image.pickle", "arrays.npz")]
    environment = os.environ | {"RAYTRACER_BACKEND": "no such", "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-c", READ, *files, *NAMES], env=environment, timeout=60, check=True)
    with np.load(files[1]) as read:
        assert_same([read[name] for name in read.files], expected)


def test_an_npz_file_contains_the_arrays(renderer: Renderer, expected: list[np.ndarray], tmp_path: Path) -> None:
    picture(renderer).save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as read:
        assert_same([read[name] for name in NAMES], expected)


def test_deleted_scene_files_do_not_matter(renderer: Renderer, tmp_path: Path) -> None:
    def images() -> list[rt.Image]:
        (tmp_path / "m.json").write_text('{"materials": {"green": {"model": "phong", "kd": [0, 1, 0]}}}')
        (tmp_path / "a.toml").write_text(scenes.ASSIGNMENT.read_text())
        return [rt.render(rt.load(tmp_path / "a.toml"), SIZE)]

    [first] = images()
    before = arrays(first)
    [second] = images()
    for path in tmp_path.iterdir():
        path.unlink()
    assert_same(arrays(second), before)


def test_render_refuses_a_scene_before_the_geometry_is_drawn(renderer: Renderer) -> None:
    with pytest.raises(rt.InputError, match="at most 512 primitives"):
        picture(
            renderer, scenes.lit_scene(*[rt.Sphere((i, 0, 0), 0.4) for i in range(513)]), Settings(evaluator="walk")
        )


def test_errors_of_drawing_are_raised_at_each_access_until_the_geometry_is_drawn(
    renderer: Renderer, expected: list[np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    image = picture(renderer)

    def fail(device: devices.Device, view: geometry.GeometryRequest) -> Geometry:
        raise rt.InputError("expected fewer", "objects")

    with monkeypatch.context() as patch:
        patch.setattr(geometry, "draw_geometry", fail)
        for _ in range(2):
            with pytest.raises(rt.InputError, match=r"^objects: expected fewer$"):
                _ = image.depth
        with pytest.raises(rt.InputError, match=r"^objects: expected fewer$"):
            pickle.dumps(image)
    assert_same(arrays(image), expected)


def in_fork(call: Callable[[], object], name: str) -> Any:
    """Run `call` in a forked process named `name`, and return its result or its exception."""
    receiver, sender = multiprocessing.get_context("fork").Pipe(duplex=False)

    def run() -> None:
        try:
            sender.send(call())
        except BaseException as error:
            sender.send(error)

    process = multiprocessing.get_context("fork").Process(target=run, name=name, daemon=True)
    process.start()
    try:
        assert receiver.poll(60), "the forked process hangs"
        return receiver.recv()
    finally:
        process.join(10)
        process.kill()


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_a_forked_process_gets_the_same_geometry(renderer: Renderer, expected: list[np.ndarray]) -> None:
    image = picture(renderer)
    in_child = in_fork(lambda: arrays(image), "child")
    assert isinstance(in_child, list), in_child
    assert_same(in_child, expected)
    assert_same(arrays(image), expected)
    in_second_child = in_fork(lambda: arrays(image), "child of a process with drawn geometry")
    assert_same(in_second_child, expected)


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_a_fork_while_other_threads_draw_gets_the_same_geometry(renderer: Renderer, expected: list[np.ndarray]) -> None:
    image, forked = picture(renderer), threading.Event()
    inside = threading.Event()

    def hold(done: int, total: int) -> None:
        inside.set()
        forked.wait(60)

    drawing = threading.Thread(
        target=lambda: picture(renderer, scenes.assignment(), Settings(), progress=hold), daemon=True
    )
    waiting = threading.Thread(target=lambda: image.depth, daemon=True)
    drawing.start()
    assert inside.wait(30)
    waiting.start()
    try:
        in_child = in_fork(lambda: arrays(image), "child of a process that draws")
    finally:
        forked.set()
        drawing.join(30)
        waiting.join(30)
    assert isinstance(in_child, list), in_child
    assert_same(in_child, expected)


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_a_forked_process_that_cannot_start_another_process_raises_an_error(renderer: Renderer) -> None:
    image = picture(renderer)

    def ask() -> object:
        sys.executable = "/bin/false"
        return image.depth

    error = in_fork(ask, "child")
    assert isinstance(error, rt.ContextError) and "forked" in str(error), error
