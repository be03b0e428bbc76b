"""The public function render(), which renders a scene to an image."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from raytracer.core.progress import Progress, check_progress
from raytracer.core.validation import check_flag, check_size
from raytracer.formats.image import Image
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import shared_renderer
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import Evaluator, Precision, Shadows
from raytracer.scene.scene import Scene, check_scene
from raytracer.scene.sequences import SampleSequence
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import Quality, SettingsPatch, patch_from_settings
from raytracer.scene.warnings import scene_warnings

if TYPE_CHECKING:
    from raytracer.gpu.context import Backend


def render(
    scene: Scene,
    size: tuple[int, int] = DEFAULT_SIZE,
    settings: Settings | None = None,
    *,
    quality: Quality | None = None,
    samples: int | None = None,
    adaptive: float | None = None,
    max_error: float | None = None,
    time: float | None = None,
    sequence: SampleSequence | None = None,
    shading: Shading | None = None,
    shadows: Shadows | None = None,
    evaluator: Evaluator | None = None,
    precision: Precision | None = None,
    bounces: int | None = None,
    geometry: bool = True,
    transparent: bool = False,
    backend: Backend | None = None,
    device: int | str | None = None,
    progress: Progress | None = None,
) -> Image:
    """Render `scene` to an image.

    Args:
        scene: the scene
        size: width and height in pixels. Default: (1280, 720).
        settings: settings that the following arguments override. Default: Settings().
        quality: preset of settings, "draft", "normal", "high" or "reference"; overrides `settings`
        samples, adaptive, max_error, time, sequence, shading, shadows, evaluator, precision, bounces: see `Settings`;
            they override `quality`. None leaves a setting unchanged. `adaptive` replaces `max_error` and `time`, and
            they replace `adaptive`. If one of these three is passed without `samples`, the limit is 4096 samples.
        geometry: whether the image has depth, normal, material and error. Default: True.
        transparent: whether to leave out the background where the camera sees it directly. The image then has `alpha`,
            the share of each pixel that surfaces cover, and its radiance is premultiplied. `max_error` and `adaptive`
            count the errors of this radiance. Default: False.
        backend: way to open OpenGL: "auto", "egl", "window" or "osmesa". Default: the environment variable
            RAYTRACER_BACKEND, else "auto".
        device: EGL device: its index, or a part of its name, as `raytracer doctor` lists them. Default: the environment
            variable RAYTRACER_DEVICE, else the first hardware device, else the first device.
        progress: called as progress(done, total) after each pass. With `max_error` or `time`, `total` is a prediction,
            which changes. `progress` must neither render, nor wait for a thread that renders, because that thread waits
            for this picture.

    The image's `estimate` states its error, whether the error is only a lower bound (`uncertain`), and whether
    `max_error` is `reached`. Depth, normal and material are drawn at the first access to one of them. The access waits
    for its turn like a call of render(); within `progress`, a new process draws them.

    The last scene stays in memory and on the device, with textures of up to 136 MB, until a call with another scene. A
    call with the same scene object and size, and any number of samples, then only draws and reads. The OpenGL context
    is kept, too.

    Threads take turns: a call waits until the call of another thread returns. The pictures have the same bits as
    without threads. After the first picture, a process must not be forked to render in the child, because OpenGL
    drivers do not survive a fork. Python before 3.14 forks by default in multiprocessing on Linux: use
    multiprocessing.get_context("spawn").

    Warns (UserWarning) about a scene whose distances and radii differ by more than 32 bits resolve, about soft shadows
    if no light has a radius, about soft and diluted shadows without a light, and about each material that reflects more
    light than it receives. Raises InputError for a wrong value or a scene beyond the driver's limits, ContextError if
    no OpenGL context opens or in a forked child, RuntimeError if `progress` calls render(), MemoryError if the picture
    does not fit into memory.
    """
    scene = check_scene(scene)
    chosen = SettingsPatch.without_none(
        quality=quality,
        samples=samples,
        adaptive=adaptive,
        max_error=max_error,
        time=time,
        sequence=sequence,
        shading=shading,
        shadows=shadows,
        evaluator=evaluator,
        precision=precision,
        bounces=bounces,
    )
    settings = (patch_from_settings(settings) | chosen).resolve()
    size = check_size(size)
    geometry, transparent = check_flag(geometry, "geometry"), check_flag(transparent, "transparent")
    check_progress(progress)
    for warning in scene_warnings(scene, settings):
        warnings.warn(warning, stacklevel=2)
    renderer = shared_renderer(shared_device(backend, device))
    return renderer.render(scene, size, settings, geometry=geometry, progress=progress, transparent=transparent)
