"""The public function sweep(), which renders a scene with many values."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from inspect import signature
from typing import Any

from raytracer.core.validation import check_size
from raytracer.farm.sweep_points import Point, list_points
from raytracer.farm.swept_scenes import SweepSource
from raytracer.formats.image import Image
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.value_texts import Value
from raytracer.rendering.picture import render
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch, patch_from_settings


def sweep(
    scene: Scene | str | os.PathLike[str],
    values: Mapping[str, Any] | Sequence[Mapping[str, Any]],
    size: tuple[int, int] | None = None,
    settings: Settings | None = None,
    **options: Any,
) -> Iterator[tuple[dict[str, Value], Image]]:
    """Render a scene once for each point of a sweep, and yield (values by path, image).

    A picture is rendered when the caller asks for it. Wrong paths are refused at the call.

    Args:
        scene: a scene file, or the name of an example scene. Paths then name values of its tables, such as
            "lights.0.position" and "materials.gold.alpha". Or a Scene. Paths then name its attributes, such as
            "camera.position", "lights.0.radius", "ambient" and "objects.0.material.kd". Both have the paths of
            settings, such as "settings.samples".
        values: a mapping from each path to its values, for the product of all, of which the first path changes slowest:
            {"lights.0.radius": np.linspace(0, 1, 5), "settings.samples": (1, 4)}. Or a sequence of mappings from each
            path to a value, one for each picture. A value is a number, a vector or a text. At most 100,000 pictures.
        size: width and height in pixels. Default: the file's size, else (1280, 720).
        settings: settings that replace the file's. Swept settings override them. Default: the file's settings.
        options: keywords of `render`, which override `settings`.

    Returns:
        An iterator of (values, image). The values are numbers, tuples and texts of Python.

    Raises:
        InputError: at the call, a wrong path, wrong options, or an option that overrides a swept setting. While
            iterating, values that the scene refuses: the message has the path of the wrong value.
        TypeError: `render` has no such keyword.
    """
    points = list_points(values)
    fields = [name for name in options if name in SettingsPatch.__struct_fields__]
    chosen = SettingsPatch.without_none(**{name: options.pop(name) for name in fields})
    signature(render).bind(scene, **options)  # raises TypeError for an unknown keyword here, not at the first picture
    base = scene if isinstance(scene, Scene) else read_document(find_scene(scene))
    source = SweepSource(
        base,
        None if size is None else check_size(size),
        None if settings is None else patch_from_settings(settings),
        chosen,
    )
    source.check(points)
    return _draw_points(source, points, options)


def _draw_points(
    source: SweepSource, points: Sequence[Point], options: Mapping[str, Any]
) -> Iterator[tuple[dict[str, Value], Image]]:
    for point in points:
        yield dict(point), render(*source.scene_at(point), **options)
