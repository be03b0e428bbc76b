"""A picture as a function: what `raytracer render` makes."""

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
from raytracer.scene.scene import Scene, checked_scene
from raytracer.scene.sequences import SampleSequence
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import Quality, SettingsPatch, checked_patch
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
    backend: Backend | None = None,
    device: int | str | None = None,
    progress: Progress | None = None,
) -> Image:
    """Render `scene` at `size` (width, height) in pixels, with `samples` rays a pixel.

    See `Settings` for `samples` to `bounces`. Those given come before `quality`, a name for some, that before the
    fields of `settings`, and these before the defaults; None takes nothing back. `adaptive` is in place of
    `max_error` and `time`, and these of it. `samples` is 4096 where one of the three is given here without it.
    The image's `estimate` says how wrong it is, whether that is but a lower bound (`uncertain`), and whether
    `max_error` is `reached`. Depth, normal and material are drawn at the first access to one of them, which takes its
    turn as a call of render() does; within `progress` a new process draws them.
    `geometry=False` leaves out these three and error.
    `backend` is how OpenGL is reached: "auto" (the default, unless the variable RAYTRACER_BACKEND is set), "egl",
    "window" or "osmesa"; the context is kept for the next call. `device` is one of EGL's, its index or a part of its
    name, as `raytracer doctor` lists them (default: the variable RAYTRACER_DEVICE, or the first that is
    hardware, or the first). `progress(done, total)` is called after each pass, and must not render itself,
    nor wait for a thread that renders: that thread waits for this picture.

    The scene drawn last stays in memory and on the device, with textures of up to 136 MB, until a call for another
    scene: a call for the same object and size, with any number of samples, then only draws and reads.

    Threads take turns: a call waits until the call of another thread is done, and gives the same bits. After the first
    picture a process must not be forked to render in the child, as multiprocessing does by default on Linux before
    Python 3.14: OpenGL drivers do not survive that. Use multiprocessing.get_context("spawn").

    Warns (UserWarning) of a scene whose distances and radii are further apart than 32 bits resolve, of soft shadows
    where no light has a radius, and of each material that reflects more light than comes in. Raises
    InputError for a wrong value or a scene beyond this driver's limits, ContextError if no OpenGL
    context opens or in such a child, RuntimeError if called by `progress`, MemoryError if the picture does not fit.
    """
    scene = checked_scene(scene)
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
    settings = (checked_patch(settings) | chosen).resolve()
    size = check_size(size)
    geometry = check_flag(geometry, "geometry")
    check_progress(progress)
    for warning in scene_warnings(scene, settings):
        warnings.warn(warning, stacklevel=2)
    renderer = shared_renderer(shared_device(backend, device))
    return renderer.render(scene, size, settings, geometry=geometry, progress=progress)
