"""The cache of the scene drawn last: it saves preparations, and its pictures equal the pictures of a new renderer."""

from __future__ import annotations

import gc
import shutil
import weakref
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.glsl import preprocessor
from raytracer.compiler.meshes import SEVERAL
from raytracer.gpu import gl
from raytracer.gpu.device import Device
from raytracer.gpu.scene_buffers import SceneBuffers
from raytracer.rendering import renderer as renderer_module
from raytracer.rendering.accumulation import Accumulation
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.settings import Settings
from tests import scenes

pytestmark = pytest.mark.gl

SIZE = 80, 45
CROWD = scenes.lit_scene(
    *(rt.Sphere((0.4 * i - 3, 0.5, 0), 0.2, scenes.COLORS[i % 4]) for i in range(16)), scenes.FLOOR
)


def move_light(scene: rt.Scene, x: float) -> rt.Scene:
    """Return the scene with its first light at another place."""
    first, *others = scene.lights
    return msgspec.structs.replace(scene, lights=[msgspec.structs.replace(first, position=(x, 7.0, 4.0)), *others])


@pytest.fixture
def own(renderer: Renderer) -> Renderer:
    return Renderer(Device(renderer.device.context))


def draw_radiance(renderer: Renderer, scene: rt.Scene, size: tuple[int, int], settings: Settings) -> np.ndarray:
    return renderer.render(scene, size, settings, geometry=False).radiance


@pytest.mark.parametrize("scene", [scenes.assignment(), CROWD], ids=["few", "many"])
def test_the_same_scene_is_drawn_again_without_preparations(
    own: Renderer, monkeypatch: pytest.MonkeyPatch, scene: rt.Scene
) -> None:
    before = [draw_radiance(own, scene, SIZE, Settings(samples=samples)) for samples in (16, 1, 5)]
    for module, name in (
        (renderer_module, "make_frame"),
        (renderer_module, "picture_programs"),
        (renderer_module, "TileRenderer"),
        (renderer_module, "BlockMeasurements"),
        (SceneBuffers, "_write_block"),
    ):
        monkeypatch.setattr(module, name, lambda *_, name=name, **__: pytest.fail(name))
    for samples, radiance in zip((16, 1, 5), before, strict=True):
        np.testing.assert_array_equal(draw_radiance(own, scene, SIZE, Settings(samples=samples)), radiance)


def test_only_changed_parts_are_prepared_again(own: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    draw_radiance(own, CROWD, SIZE, Settings())
    monkeypatch.setattr(renderer_module, "picture_programs", lambda *_, **__: pytest.fail("texts"))
    assert own._kept
    frame = own._kept.frame
    draw_radiance(own, move_light(CROWD, 2.0), SIZE, Settings())
    after = own._kept.frame
    assert after.surfaces is frame.surfaces and after.materials is frame.materials and after.view is frame.view
    assert after.lights is not frame.lights


def test_any_sequence_of_pictures_equals_the_pictures_of_new_renderers(own: Renderer) -> None:
    rng = np.random.default_rng(5)
    two_lights = msgspec.structs.replace(
        scenes.assignment(), lights=[*scenes.assignment().lights, rt.PointLight((-3, 5, 3))]
    )
    every = [scenes.assignment(), CROWD, two_lights]
    for step in range(40):
        scene = move_light(every[rng.integers(3)], float(rng.choice([-2.0, 4.0])))
        size = [SIZE, (48, 32), (100, 30)][rng.integers(3)]
        settings = Settings(samples=int(rng.choice([1, 2, 4, 9, 16])), shadows=rng.choice(["off", "hard"]).item())
        if rng.random() < 0.3:
            settings = msgspec.structs.replace(settings, samples=32, adaptive=0.02)
        tile, single = int(rng.choice([32, 2048])), bool(rng.random() < 0.5)
        arguments: dict[str, Any] = {"tile": tile, "single_picture": single}
        image = own.render(scene, size, settings, **arguments)
        fresh = Renderer(own.device).render(scene, size, settings, **arguments)
        for name in ("radiance", "samples", "error"):
            mine, theirs = getattr(image, name), getattr(fresh, name)
            np.testing.assert_array_equal(mine, theirs, f"step {step}: {name}, {settings}, {size}, {tile}")
        assert image.estimate and fresh.estimate and image.estimate.rmse == fresh.estimate.rmse


def test_renderers_that_share_programs_do_not_mix_up_their_scenes(own: Renderer) -> None:
    dark = msgspec.structs.replace(scenes.assignment(), ambient=(0, 0, 0), background=(0.9, 0.1, 0.2))
    other = Renderer(own.device)
    light = draw_radiance(own, scenes.assignment(), SIZE, Settings())
    red = draw_radiance(other, dark, SIZE, Settings())
    assert not np.array_equal(light, red)
    np.testing.assert_array_equal(draw_radiance(own, scenes.assignment(), SIZE, Settings()), light)
    np.testing.assert_array_equal(draw_radiance(other, dark, SIZE, Settings()), red)


def test_an_interrupted_picture_drops_the_kept_scene(own: Renderer) -> None:
    before = draw_radiance(own, CROWD, SIZE, Settings(samples=8))

    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        own.render(CROWD, SIZE, Settings(samples=8), progress=interrupt)
    assert own._kept is None
    np.testing.assert_array_equal(draw_radiance(own, CROWD, SIZE, Settings(samples=8)), before)


def test_a_changed_shader_is_reread(own: Renderer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / "shaders"
    shutil.copytree(preprocessor.shaders_folder(), folder)
    monkeypatch.setattr(preprocessor, "shaders_folder", lambda: folder)
    before = draw_radiance(own, scenes.assignment(), SIZE, Settings())
    file = folder / "passes" / "empty.frag"
    file.write_text(file.read_text().replace("= samples *", "= 2.0 * samples *"))
    after = draw_radiance(own, scenes.assignment(), SIZE, Settings())
    np.testing.assert_array_equal(after[0, 0], 2.0 * before[0, 0])


def test_a_changed_shader_of_measurements_is_reread(
    own: Renderer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def error() -> np.ndarray:
        pixels = own.render(scenes.assignment(), SIZE, Settings(samples=8)).error
        assert pixels is not None
        return pixels

    folder = tmp_path / "shaders"
    shutil.copytree(preprocessor.shaders_folder(), folder)
    monkeypatch.setattr(preprocessor, "shaders_folder", lambda: folder)
    before = error()
    file = folder / "sampling" / "variance.frag"
    file.write_text(file.read_text().replace("variance = ", "variance = float(pixel.x >= 40) * "))
    assert before[:, :40].any()
    after = error()
    assert not after[:, :40].any() and after[:, 40:].any()


def test_a_picture_with_a_time_limit_has_no_program_for_several_samples(own: Renderer) -> None:
    for settings, has_several in ((Settings(samples=64, time=0.01), False), (Settings(samples=64), True)):
        draw_radiance(own, scenes.assignment(), SIZE, settings)
        assert own._kept and (SEVERAL in own._kept.programs.by_name) is has_several


def test_large_pictures_are_not_kept_and_the_next_scene_replaces_the_kept_scene(
    own: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scenes.lit_scene(rt.Sphere((0, 1, 0), 1))
    draw_radiance(own, scene, SIZE, Settings(samples=2))
    assert own._kept
    alive = weakref.ref(own._kept.frame.compiled.surfaces.centers)
    del scene
    draw_radiance(own, CROWD, SIZE, Settings())
    gc.collect()
    assert alive() is None
    monkeypatch.setattr(renderer_module, "_KEPT_PIXELS", SIZE[0] * SIZE[1] - 1)
    draw_radiance(own, CROWD, SIZE, Settings(samples=2))
    assert own._kept is None


def test_only_the_sums_of_one_tile_are_kept(own: Renderer) -> None:
    settings = Settings(samples=64, max_error=1e-9)
    own.render(scenes.assignment(), SIZE, settings, tile=32)
    assert own._kept
    before = own._kept.tiles.player._textures.keys()
    assert {"radiance", "earlierSum"} <= before and not any(name[-1].isdigit() for name in before)
    draw_radiance(own, scenes.assignment(), SIZE, settings)


@pytest.mark.parametrize("sequence", ["sobol", "random", "r2"])
def test_samples_drawn_together_make_the_picture_of_samples_drawn_one_by_one(
    own: Renderer, monkeypatch: pytest.MonkeyPatch, sequence: Any
) -> None:
    for scene in (scenes.assignment(), CROWD):
        settings = Settings(samples=23, sequence=sequence)
        at_once = draw_radiance(own, scene, SIZE, settings)
        with monkeypatch.context() as patch:
            patch.setattr(Accumulation, "_can_draw_together", lambda _: False)
            np.testing.assert_allclose(at_once, draw_radiance(own, scene, SIZE, settings), rtol=1e-6)


def test_an_interrupt_between_uniforms_does_not_affect_other_renderers(
    own: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Renderer(own.device)
    before = draw_radiance(own, scenes.assignment(), SIZE, Settings())
    set_uniforms = gl.set_uniforms

    def interrupted(program: Any, **values: object) -> None:
        set_uniforms(program, **values)
        if "draw.ambient" in values:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(gl, "set_uniforms", interrupted)
        with pytest.raises(KeyboardInterrupt):
            draw_radiance(other, msgspec.structs.replace(scenes.assignment(), ambient=(0, 0, 0)), SIZE, Settings())
    np.testing.assert_array_equal(draw_radiance(own, scenes.assignment(), SIZE, Settings()), before)


def test_a_renderer_works_after_an_interrupt_while_it_closed(own: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    before = draw_radiance(own, scenes.assignment(), SIZE, Settings())
    close = TileRenderer.close

    def interrupted(self: TileRenderer) -> None:
        close(self)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, own.device.turn(), pytest.raises(KeyboardInterrupt):
        patch.setattr(TileRenderer, "close", interrupted)
        own.close()
    np.testing.assert_array_equal(draw_radiance(own, scenes.assignment(), SIZE, Settings()), before)
