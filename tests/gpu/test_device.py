"""A device keeps programs while somebody holds them, and restores OpenGL's state after each block."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.glsl.preprocessor import assemble
from raytracer.core.validation import InputError
from raytracer.gpu import gl
from raytracer.gpu.device import ADD, Device, shared_device
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.rendering.progressive import ProgressivePicture
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes

pytestmark = pytest.mark.gl

SIZE = (32, 18)
RED_HALF = "out vec4 color;\nvoid main() { color = vec4(0.5, 0.0, 0.0, 1.0); }\n"


def draw_twice(device: Device) -> list[float]:
    """Draw 0.5 twice, and return a pixel's red after each draw. The context must be current."""
    program = device.program(assemble("half", None, {"half": RED_HALF}))
    context = device.context
    framebuffer = context.simple_framebuffer((4, 4), 4, dtype="f4")
    framebuffer.use()
    framebuffer.clear()
    array = context.vertex_array(program, [])
    reds: list[float] = []
    for _ in range(2):
        array.render(moderngl.TRIANGLES, 3)
        reds.append(float(np.frombuffer(framebuffer.read(components=1, dtype="f4"), np.float32)[0]))
    context.detect_framebuffer(0).use()
    array.release()
    framebuffer.release()
    return reds


def test_a_block_has_its_own_state_and_later_draws_have_the_default_state(renderer: Renderer) -> None:
    device = renderer.device
    with device.turn():
        with device.state(blending=ADD):
            assert draw_twice(device) == [0.5, 1.0]
        assert draw_twice(device) == [0.5, 0.5]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_interrupted_block_leaves_no_state_behind(renderer: Renderer, error: type[BaseException]) -> None:
    device = renderer.device
    with device.turn():
        with pytest.raises(error), device.state(blending=ADD, depth_test=True):
            raise error
        assert draw_twice(device) == [0.5, 0.5]


def test_a_turn_begins_with_the_default_state_after_any_other_state(renderer: Renderer) -> None:
    device = renderer.device
    with device.turn():
        device.context.enable(moderngl.BLEND | moderngl.DEPTH_TEST)
        device.context.blend_func = moderngl.ONE, moderngl.ONE
    with device.turn():
        assert draw_twice(device) == [0.5, 0.5]


def test_a_window_that_rereads_its_shaders_keeps_the_programs_of_another_window(renderer: Renderer) -> None:
    settings, scene, other = Settings(samples=2), scenes.lit_scene(rt.Sphere((0, 0, 0), 1)), scenes.assignment()
    own = Renderer(Device(renderer.device.context))
    expected = renderer.render(other, SIZE, settings).radiance
    with own.device.context:
        first, second = ProgressivePicture(own.device, budget=1.0), ProgressivePicture(own.device, budget=1.0)
        second.start(other, settings, "picture", SIZE, moving=False)
        second.step()
        first.start(scene, settings, "picture", SIZE, moving=False)
        first.reread()
        first.start(scene, settings, "picture", SIZE, moving=False)
        second.step()
        radiance = second.image({}).radiance
        first.close()
        second.close()
        own.device.forget()
    np.testing.assert_allclose(radiance, expected, rtol=1e-6)


def test_programs_are_released_once_no_owner_holds_them(renderer: Renderer) -> None:
    device = Device(renderer.device.context)

    class Owner:
        """Holds a program."""

    owner = Owner()
    with device.turn():
        program = device.program(assemble("half", None, {"half": RED_HALF}))
        device.hold(owner, [program])
        device.forget()
        assert not isinstance(program.mglo, moderngl.InvalidObject)
        del owner
        device.forget()
        assert isinstance(program.mglo, moderngl.InvalidObject)


def test_all_requests_for_the_default_device_return_one_device(renderer: Renderer) -> None:
    assert shared_device() is shared_device() is renderer.device


@pytest.mark.gl
def test_a_texture_that_does_not_fit_into_memory_raises_an_error(renderer: Renderer) -> None:
    if not renderer.device.limits.is_llvmpipe:
        pytest.skip("a GPU may have memory for it")
    with renderer.device.turn():
        player = DrawPlayer(renderer.device)
        with pytest.raises(InputError, match="memory on the GPU for a texture of 16000x16000 pixels"):
            player.add_texture("radiance", (16000, 16000), 4)
        player.close()


@pytest.mark.gl
def test_rows_are_read_top_first_also_if_the_driver_cannot_flip_them(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = np.random.default_rng(2).uniform(0, 1, (5, 7, 4)).astype(np.float32)
    with renderer.device.turn():
        player = DrawPlayer(renderer.device)
        player.add_texture("radiance", (9, 6), 4)
        player.write("radiance", values)
        pictures = []
        for extension in (gl._INVERTING, "no such extension"):
            monkeypatch.setattr(gl, "_INVERTING", extension)
            pictures.append(np.empty((4, 6, 3), np.float32))
            player.read_top_first("radiance", (1, 1, 6, 4), pictures[-1])
        lowest_first = player.read("radiance", (1, 1, 6, 4), 3)
        player.close()
    for picture in pictures:
        np.testing.assert_array_equal(picture, values[1:5, 1:7, :3][::-1])
    np.testing.assert_array_equal(lowest_first, values[1:5, 1:7, :3])
