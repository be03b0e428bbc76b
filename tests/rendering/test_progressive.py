"""The window's progressive picture and its canvas, without a window: samples, display, compilation and errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.app.viewer import canvas
from raytracer.app.viewer.canvas import MARKER_RADIUS, Canvas
from raytracer.app.viewer.orbit import turn_camera, turn_light
from raytracer.compiler.draws import SAMPLES_PER_SUM
from raytracer.compiler.glsl.shaders import Show
from raytracer.compiler.meshes import Rectangle
from raytracer.compiler.view_space import project_point
from raytracer.core.vectors import add
from raytracer.formats.srgb import encode_srgb8
from raytracer.gpu.device import Device
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.gpu.gl import BufferTexture, release
from raytracer.rendering.progressive import Pace, ProgressivePicture
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import Evaluator
from raytracer.scene.settings import Settings
from raytracer.scene.solids.flattening import with_leaves
from raytracer.scene.solids.solid import Primitive, Solid
from tests import scenes

pytestmark = pytest.mark.gl

SIZE = (160, 90)
ONE = Settings()


class Live(ProgressivePicture):
    """A progressive picture, and the canvas that shows it."""

    def __init__(self, renderer: Renderer, budget: float) -> None:
        super().__init__(renderer.device, budget)
        with renderer.device.context:
            self.canvas = Canvas(renderer.device)

    def close(self) -> None:
        super().close()
        self.canvas.close()


@pytest.fixture
def live(renderer: Renderer) -> Iterator[Live]:
    live = Live(renderer, 1e9)
    yield live
    with renderer.device.context:
        live.close()


def present_pixels(live: Live, renderer: Renderer, marked: rt.PointLight | None = None) -> np.ndarray:
    """Draw the picture on the canvas, and return its pixels, top row first [H, W, 3] int."""
    context = renderer.device.context
    with context:
        target = context.texture(live.size, 4)
        screen = context.framebuffer([target])
        live.canvas.present(screen, live, marked, scenes.assignment().camera, 1.0)
        pixels = np.frombuffer(screen.read(components=3), np.uint8).reshape(live.size[1], live.size[0], 3)
        release(context, screen, target)
    return pixels[::-1].astype(int)


def draw_pixels(
    live: Live, renderer: Renderer, scene: rt.Scene, settings: Settings, show: Show = "picture"
) -> np.ndarray:
    with renderer.device.context:
        live.start(scene, settings, show, SIZE, moving=False)
        for _ in range(settings.samples):
            live.step()
    return present_pixels(live, renderer)


def refine(live: Live, scene: rt.Scene, settings: Settings, show: Show = "picture") -> None:
    live.start(scene, settings, show, SIZE, moving=False)
    while not live.is_done:
        live.step()


@pytest.mark.parametrize("samples", [4, 37, 64, 600])
def test_the_estimate_of_a_picture_at_rest_equals_that_of_render(live: Live, renderer: Renderer, samples: int) -> None:
    settings = Settings(samples=samples)
    image = renderer.render(scenes.assignment(), SIZE, settings)
    assert image.estimate and image.estimate.rmse
    with renderer.device.context:
        refine(live, scenes.assignment(), settings)
        estimate = live.estimate()
    assert estimate and estimate.rmse == pytest.approx(image.estimate.rmse, rel=1e-4)
    assert estimate.worst == pytest.approx(image.estimate.worst, rel=1e-4) and estimate.samples == samples


def test_a_picture_at_rest_stops_at_the_requested_error_time_or_samples(live: Live, renderer: Renderer) -> None:
    scene, settings = scenes.assignment(), Settings(samples=4096, max_error=0.002)
    truth = renderer.render(scene, SIZE, Settings(samples=1024, sequence="r2")).radiance
    with renderer.device.context:
        refine(live, scene, settings)
        estimate = live.estimate()
        assert 8 <= live.samples <= 128 and estimate and estimate.reached
        assert np.sqrt(np.mean((live.image({}).radiance - truth) ** 2)) < 0.002
        refine(live, scene, msgspec.structs.replace(settings, max_error=1e-9, time=0.1))
        assert 1 <= live.samples < 4096  # the number depends on how busy the machine is
        refine(live, scene, msgspec.structs.replace(settings, max_error=1e-9, samples=64))
        assert live.samples == 64


def test_blocks_with_bright_features_continue_as_in_render(live: Live, renderer: Renderer) -> None:
    settings = Settings(samples=128, max_error=0.01)
    image = renderer.render(scenes.glint(), SIZE, settings, geometry=False)
    with renderer.device.context:
        refine(live, scenes.glint(), settings)
        estimate = live.estimate()
    assert estimate and image.estimate and estimate.samples == image.estimate.samples
    assert estimate.reached is image.estimate.reached is False


def test_a_moving_picture_or_another_display_has_no_estimate(renderer: Renderer) -> None:
    live, settings, scene = Live(renderer, 1e-9), Settings(samples=16), scenes.assignment()
    centers = renderer.render(scene, SIZE, Settings(), geometry=False).radiance
    with renderer.device.context:
        live.start(scene, settings, "picture", SIZE, moving=True)
        live.step()
        assert live.is_moving and live.estimate() is None
        np.testing.assert_array_equal(live.image({}).radiance, centers)
        live.start(scene, settings, "picture", SIZE, moving=True)
        assert live.is_moving and live.enlarged > 1
        refine(live, scene, settings, "normal")
        assert not live.is_moving and live.estimate() is None
        refine(live, scene, settings)
        assert live.estimate()
        live.close()


def test_a_mistake_in_the_shader_of_the_error_estimate_leaves_the_picture(renderer: Renderer, shaders: Path) -> None:
    own, settings = Renderer(Device(renderer.device.context)), Settings(samples=8)
    live, file = Live(own, 1e9), shaders / "sampling/movement.frag"
    good = file.read_text()
    file.write_text(good.replace("vec3 moved =", "vec2 moved ="))
    with renderer.device.context:
        live.start(scenes.assignment(), settings, "picture", SIZE, moving=False)
        with pytest.raises(rt.ShaderError, match=r"sampling/movement\.frag:\d+"):
            live.step()
        while not live.is_done:
            live.step()
        assert live.samples == 8 and live.estimate() is None
        file.write_text(good)
        live.reread()
        refine(live, scenes.assignment(), settings)
        assert live.estimate() is not None
        live.close()


@pytest.mark.parametrize("shadows", ["off", "hard", "diluted", "soft"])
def test_the_refined_picture_equals_that_of_render(live: Live, renderer: Renderer, shadows: str) -> None:
    settings = Settings(samples=16, shadows=shadows)  # pyright: ignore[reportArgumentType]
    scene = scenes.with_light_radii(scenes.assignment(), 0.5)
    image = renderer.render(scene, SIZE, settings)
    assert np.abs(draw_pixels(live, renderer, scene, settings) - image.srgb8()).max() <= 1
    with renderer.device.context:
        # render() may sum the samples of plane-only cells in another order, four at a time.
        np.testing.assert_allclose(live.image({}).radiance, image.radiance, rtol=1e-6)


def test_the_window_shows_blocks_that_stopped_and_others_when_a_second_sum_begins(
    live: Live, renderer: Renderer
) -> None:
    with renderer.device.context:
        live.start(
            scenes.assignment(), Settings(samples=2 * SAMPLES_PER_SUM, adaptive=0.005), "picture", SIZE, moving=False
        )
        while live.samples < SAMPLES_PER_SUM + 20:
            live.step()
        picture = live.image({}).srgb8()
        assert not live.is_done and "blockSamples" in live.textures(), "some blocks have stopped, and others have not"
    assert np.abs(present_pixels(live, renderer) - picture).max() <= 1


def test_normals_depth_and_materials_have_the_documented_colours(live: Live, renderer: Renderer) -> None:
    scene = scenes.assignment()
    image = renderer.render(scene, SIZE, ONE)
    assert image.normal is not None and image.depth is not None and image.material is not None
    hit = image.material >= 0

    normals = np.where(hit[..., None], 0.5 + 0.5 * image.normal, 0.0) * 255
    assert np.abs(draw_pixels(live, renderer, scene, ONE, "normal") - normals).max() <= 1

    focus = np.linalg.norm(np.subtract(scene.camera.position, scene.camera.look_at))
    for camera in (scene.camera, scene.camera.replace(projection="orthographic", height=4)):
        view = scene.replace(camera=camera)
        distances = renderer.render(view, SIZE, ONE).depth
        assert distances is not None
        depth = 255 / (1 + distances / focus)
        assert np.abs(draw_pixels(live, renderer, view, ONE, "depth") - depth[..., None]).max() <= 1

    materials = draw_pixels(live, renderer, scene, ONE, "material")
    colors = [np.unique(materials[image.material == i], axis=0) for i in range(-1, 4)]
    assert [len(color) for color in colors] == [1] * 5, "one colour for each material"
    distances = [np.abs(a[0] - b[0]).max() for i, a in enumerate(colors) for b in colors[:i]]
    assert min(distances) > 60, "the colours are distinguishable"


def test_moving_the_light_and_the_camera_requests_no_program(
    live: Live, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scenes.assignment()
    draw_pixels(live, renderer, scene, ONE)

    def refuse(*_: object) -> None:
        raise AssertionError("a program was requested")

    monkeypatch.setattr(renderer.device, "program", refuse)
    for angle in (0.1, 0.2, 0.3):
        moved = turn_camera(turn_light(scene, 0, angle, angle), angle, 0.0)
        picture = draw_pixels(live, renderer, moved, ONE)
        monkeypatch.undo()
        assert np.abs(picture - renderer.render(moved, SIZE, ONE).srgb8()).max() <= 1
        monkeypatch.setattr(renderer.device, "program", refuse)


def changed_scenes(scene: rt.Scene) -> Iterator[rt.Scene]:
    """Yield the scene with more and more of its numbers changed, one kind after the other."""

    def with_leaves_of(change: Callable[[Primitive], Solid]) -> rt.Scene:
        objects = [with_leaves(solid, change) for solid in scene.solids()]
        return msgspec.structs.replace(scene, objects=objects, materials=())

    def moved(leaf: Primitive) -> Solid:
        if isinstance(leaf, rt.Sphere):
            return rt.Sphere(add(leaf.center, (0.1, -0.2, 0.3)), leaf.radius, leaf.material)
        assert isinstance(leaf, rt.Plane)
        return rt.Plane(add(leaf.normal, (0.1, 0, 0.2)), leaf.offset - 0.5, leaf.material)

    def scaled(leaf: Primitive) -> Solid:
        return msgspec.structs.replace(leaf, radius=1.1 * leaf.radius) if isinstance(leaf, rt.Sphere) else leaf

    def painted(leaf: Primitive) -> Solid:
        kd = (0.2, 0.7 - leaf.material.kd[0], 0.1)
        material = leaf.material.replace(ka=(0.1, 0, 0), kd=kd, ks=(0.9, 0.1, 0), h=7.5)
        return msgspec.structs.replace(leaf, material=material)

    for change in (moved, scaled, painted):
        scene = with_leaves_of(change)
        yield scene
    for change in (
        {"lights": [rt.PointLight((-4, 5, 3), (0.2, 0.9, 0.4)) for _ in scene.lights]},
        {"camera": rt.Camera((1, 0.4, -6), (0, 1, 0), (0.1, 1, 0), 80)},
        {"background": (0.1, 0.2, 0), "ambient": (0.5, 3, 1)},
        {"lights": [rt.PointLight((0, -5, 0)) for _ in scene.lights]},
        {"camera": rt.Camera((0, 2, 1), (0, -1, -9), vertical_fov=2)},
    ):
        scene = msgspec.structs.replace(scene, **change)
        yield scene


@pytest.mark.parametrize("evaluator", ["cells", "walk"])
def test_changing_any_number_of_a_scene_compiles_nothing(renderer: Renderer, evaluator: Evaluator) -> None:
    settings = Settings(evaluator=evaluator)
    scene = scenes.assignment()
    own = Renderer(Device(renderer.device.context))
    live = Live(own, 1e9)
    draw_pixels(live, own, scene, settings)
    own.render(scene, SIZE, settings)
    before = dict(own.device._programs)
    for k, other in enumerate(changed_scenes(scene)):
        picture = draw_pixels(live, own, other, settings)
        assert np.abs(picture - own.render(other, SIZE, settings).srgb8()).max() <= 1
        assert own.device._programs == before, k
        own.render(other, (SIZE[0] + 16 * k, 33), settings)
        assert own.device._programs == before, "another size compiles nothing either"
    with renderer.device.context:
        live.close()
        own.device.forget()


def test_enlarged_pixels_show_a_smaller_picture_and_a_resize_a_larger_one(renderer: Renderer) -> None:
    scene = scenes.assignment()
    live = Live(renderer, budget=1e-9)
    with renderer.device.context:
        live.start(scene, ONE, "picture", SIZE, moving=True)
        assert live.enlarged == 1, "no time of a sample is known yet"
        live.step()
    for size, moving, small in (
        ((160, 90), True, (10, 6)),
        ((161, 97), True, (11, 7)),
        ((320, 180), False, (320, 180)),
    ):
        with renderer.device.context:
            live.start(scene, ONE, "picture", size, moving=moving)
            live.step()
        enlarged = 16 if moving else 1
        image = renderer.render(scene, small, ONE).srgb8().repeat(enlarged, 0).repeat(enlarged, 1)
        pixels = present_pixels(live, renderer)
        assert pixels.shape == (size[1], size[0], 3) and live.enlarged == enlarged
        assert np.abs(pixels - image[-size[1] :, : size[0]]).max() <= 1, "the enlarged pixels start at the lower left"
    with renderer.device.context:
        for enlarged in (16, 1):  # the time of a sample with other settings is not known
            live.start(scene, Settings(shadows="off"), "picture", SIZE, moving=True)
            assert live.enlarged == enlarged
        live.close()


def test_the_marker_is_drawn_only_at_the_place_of_the_light(live: Live, renderer: Renderer) -> None:
    scene = scenes.assignment()
    plain = draw_pixels(live, renderer, scene, ONE)
    light = rt.PointLight((0.5, 2.5, 1.0), (9.0, 0.0, 0.0))
    x, y, in_view = project_point(scene.camera, light.position, SIZE, MARKER_RADIUS)
    assert in_view
    marked = present_pixels(live, renderer, light)
    rows, columns = np.nonzero((marked != plain).any(axis=2))
    assert np.hypot(columns + 0.5 - x, SIZE[1] - rows - 0.5 - y).max() <= MARKER_RADIUS
    assert tuple(marked[SIZE[1] - 1 - int(y), int(x)]) == (255, 0, 0), "in the light's colour"


def test_in_picture_inverts_the_camera_rays() -> None:
    camera = scenes.assignment().camera
    right, up, forward = np.array(camera.axes())
    scale = 2 * np.tan(np.radians(camera.vertical_fov) / 2) / 90
    for x, y in ((80.0, 45.0), (20.5, 70.25), (150.0, 9.0)):
        point = camera.position + 7.0 * (forward + scale * ((x - 80) * right + (y - 45) * up))
        assert project_point(camera, tuple(point), SIZE, 8.0) == (pytest.approx(x), pytest.approx(y), True)
    rightmost, top = (152, 45), (80, 82)
    sides = [(right, rightmost), (-right, (8, 45)), (up, top), (right - forward, rightmost), (0.01 * up - forward, top)]
    for side, place in sides:
        x, y, in_view = project_point(camera, tuple(camera.position + 3 * side), SIZE, 8.0)
        assert (x, y) == pytest.approx(place) and not in_view
    assert project_point(camera, camera.position, SIZE, 8.0) == (80.0, 82.0, False)


def test_the_program_for_plain_pictures_shows_the_same_as_the_general_programs(
    live: Live, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = draw_pixels(live, renderer, scenes.assignment(), ONE)
    for general in ("present_enlarged", "present_refined"):
        monkeypatch.setitem(canvas._SOURCES, "present", canvas._SOURCES[general])
        with renderer.device.context:
            live.canvas.load_programs()
        assert np.array_equal(present_pixels(live, renderer), plain)


# A mistake in a file, and its message. The second and third mistake are valid GLSL, but do not match the host's types.
MISTAKES = [
    ("shading/lighting.glsl", "I += m.ka * ambient;", "I += m.kb * ambient;", r"shading/lighting\.glsl:\d+"),
    ("passes/draw.glsl", "real pixelScale;    // ", "int pixelScale;  // ", r"uniform draw\.pixelScale"),
    ("window/present.frag", "uniform int enlarged;", "uniform ivec2 enlarged;", "uniform enlarged"),
    ("window/show_depth.frag", "// The distance", "// Die L\xe4nge", "window/show_depth.frag:1: .*UTF-8"),
    ("geometry/camera.glsl", "real2(2.0 * (", "real2(2.0 * nothing * (", r"geometry/camera\.glsl:\d+"),
]


@pytest.mark.parametrize(("name", "old", "new", "message"), MISTAKES)
def test_a_mistake_in_a_shader_keeps_the_old_picture_until_it_is_corrected(
    renderer: Renderer, shaders: Path, name: str, old: str, new: str, message: str
) -> None:
    scene = scenes.assignment()
    show: Show = "depth" if "depth" in name else "picture"
    own = Renderer(Device(renderer.device.context))
    live = Live(own, 1e9)
    before = draw_pixels(live, own, scene, ONE, show)
    file = shaders / name
    good = file.read_text()
    assert old in good
    file.write_text(good.replace(old, new), encoding="latin-1")
    for _ in range(3):
        live.reread()
        with pytest.raises(rt.ShaderError, match=message), renderer.device.context:
            live.canvas.load_programs()
            live.start(scene, ONE, show, SIZE, moving=False)
        assert np.array_equal(draw_pixels(live, own, scene, ONE, show), before), "the old programs stay in use"
    file.write_text(good)
    live.reread()
    assert np.array_equal(draw_pixels(live, own, scene, ONE, show), before)
    # The canvas has five programs, the picture three, and the display of the depth two.
    assert len(own.device._programs) == 5 + (3 if show == "picture" else 2), "programs with mistakes are released"
    with renderer.device.context:
        live.close()


def test_a_changed_shader_is_used_only_after_reread(live: Live, renderer: Renderer, shaders: Path) -> None:
    before = draw_pixels(live, renderer, scenes.assignment(), ONE)
    file = shaders / "shading/lighting.glsl"
    file.write_text(file.read_text().replace("I += m.ka * ambient;", "I += vec3(0.5);"))
    assert np.array_equal(draw_pixels(live, renderer, scenes.assignment(), ONE), before)
    live.reread()
    assert not np.array_equal(draw_pixels(live, renderer, scenes.assignment(), ONE), before)


def test_toggling_between_two_shadings_compiles_each_once(renderer: Renderer) -> None:
    own = Renderer(Device(renderer.device.context))
    live = Live(own, 1e9)
    counts = []
    for shading in (None, "ggx", None, "ggx", "mirror", "ggx", "mirror"):
        draw_pixels(live, own, scenes.assignment(), Settings(shading=shading))
        counts.append(len(own.device._programs))
    assert counts[0] < counts[1] == counts[2] == counts[3] < counts[4] == counts[5] == counts[6]
    with renderer.device.context:
        live.close()


def test_a_window_beyond_the_limits_of_the_driver_is_refused(live: Live, renderer: Renderer) -> None:
    with pytest.raises(rt.InputError, match="size: expected a window of at most"), renderer.device.context:
        live.start(scenes.assignment(), ONE, "picture", (renderer.device.limits.target + 1, 8), moving=False)


def test_pixels_are_enlarged_to_keep_the_budget_of_a_sample() -> None:
    pace = Pace(0.033)
    assert pace.enlarged(921_600) == 1, "no time is known yet"
    pace.add(9.0)  # a sample whose programs had to be compiled
    pace.add(0.1 / 921_600)
    assert pace.enlarged(921_600) == 2 and pace.enlarged(921_600 // 4) == 1
    pace.add(1000.0)  # one slow sample, because of another process
    assert pace.enlarged(921_600) == 2
    for _ in range(5):
        pace.add(1000.0)
    assert pace.enlarged(921_600) == 16, "the scene has become slow"


def test_radiance_above_1_is_displayed_as_1(live: Live, renderer: Renderer) -> None:
    bright = msgspec.structs.replace(scenes.assignment(), ambient=(1e12, 1e12, 0.0), background=(0, 0, 1e12))
    picture = draw_pixels(live, renderer, bright, ONE)
    assert picture[0, 0].tolist() == [0, 0, 255] and picture[-1, 0, :2].tolist() == [255, 255]


def test_each_changed_part_of_a_scene_reaches_the_picture(live: Live, renderer: Renderer) -> None:
    scene = scenes.assignment()
    green = rt.Sphere((0, 2, 0), 1.5, rt.Material(kd=(0, 1, 0)))
    changes: list[dict[str, object]] = [
        {"lights": [rt.PointLight((-4, 7, 4))]}, {"camera": rt.Camera((1, 3, 6), (0, 2, 0))}, {"ambient": (2, 2, 2)},
        {"objects": [green]}, {"objects": [rt.Sphere((0, 2, 0), 1.0, green.material)]},
        {"objects": [rt.Sphere((0, 2, 0), 1.0, rt.Material(kd=(1, 0, 0)))]},
        {"lights": [rt.PointLight((-4, 7, 4)), rt.PointLight((4, 7, 4))]}, {"lights": []},
    ]  # fmt: skip
    for change in changes:
        scene = msgspec.structs.replace(scene, **change)
        assert np.abs(draw_pixels(live, renderer, scene, ONE) - renderer.render(scene, SIZE, ONE).srgb8()).max() <= 1


@pytest.mark.parametrize(
    "settings",
    [
        Settings(samples=600),
        Settings(samples=600, adaptive=0.05),
        Settings(samples=16, adaptive=0.01),
        Settings(samples=4096, max_error=0.004),
    ],
)
def test_the_window_stops_at_the_samples_of_render_with_the_same_picture(
    live: Live, renderer: Renderer, settings: Settings
) -> None:
    scene = scenes.random_scene(3)
    image = renderer.render(scene, SIZE, settings)
    assert image.estimate and image.estimate.rmse
    with renderer.device.context:
        refine(live, scene, settings)
        np.testing.assert_allclose(live.image({}).radiance, image.radiance, rtol=1e-6)
        estimate = live.estimate()
    assert estimate and estimate.samples == pytest.approx(image.estimate.samples)
    # The means of both agree to 1e-6, and so do their differences, from which the estimate follows.
    assert estimate.rmse == pytest.approx(image.estimate.rmse, rel=1e-5, abs=1e-6)
    assert live.samples == settings.samples or live.samples < 4096
    assert np.abs(present_pixels(live, renderer) - image.srgb8()).max() <= 1, (
        "the canvas divides by the samples of each block"
    )


@pytest.mark.parametrize("settings", [Settings(samples=8), Settings(samples=64, adaptive=0.05)])
def test_very_bright_light_does_not_change_the_display_of_other_pixels(
    live: Live, renderer: Renderer, settings: Settings
) -> None:
    ball = rt.Sphere((0, 0, 0), 1, rt.Material(ka=(1e3, 1e3, 1e3)))
    grey = rt.Sphere((1.5, 0, 0), 1, rt.Material(ka=(2e-13, 1e-13, 3e-13)))
    scene = rt.Scene([ball, grey], [], rt.Camera((0, 0, 6), (0, 0, 0)), ambient=(1e12, 1e12, 1e12))
    picture = draw_pixels(live, renderer, scene, settings)
    with renderer.device.context:
        assert np.abs(picture - live.image({}).srgb8()).max() <= 1
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3


def test_a_change_of_samples_uploads_nothing(live: Live, renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scenes.random_scene(3)
    draw_pixels(live, renderer, scene, Settings(samples=16))

    def refuse(*_: object) -> None:
        raise AssertionError("texels were written")

    monkeypatch.setattr(BufferTexture, "write", refuse)
    for samples in (1, 4, 1):
        draw_pixels(live, renderer, scene, Settings(samples=samples))


def test_frames_between_decisions_read_nothing_back(
    live: Live, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[tuple[int, str]] = []
    original = DrawPlayer.read

    def record_read(self: DrawPlayer, name: str, area: Rectangle, components: int) -> np.ndarray:
        read.append((live.samples, name))
        return original(self, name, area, components)

    monkeypatch.setattr(DrawPlayer, "read", record_read)
    with renderer.device.context:
        refine(live, scenes.assignment(), Settings(samples=40))
    # Reads after the last sample measure the error of the finished picture.
    assert [entry for entry in read if entry[0] < 40] == [(n, "blocks") for n in (1, 2, 4, 8, 16, 32)]


def test_active_blocks_are_shown_with_all_samples_after_the_first_sum(live: Live, renderer: Renderer) -> None:
    settings = Settings(samples=SAMPLES_PER_SUM + 128, adaptive=0.004)
    with renderer.device.context:
        live.start(scenes.assignment(), settings, "picture", SIZE, moving=False)
        while live.samples < settings.samples:
            live.step()
        mean = live.image({}).radiance
        assert live.textures().keys() == {"radianceSum", "summedBefore", "blockSamples"}
    assert np.abs(present_pixels(live, renderer) - encode_srgb8(mean)).max() <= 1
