"""Warnings about scenes and settings that probably do not give the intended picture.

Each warning is one sentence for the user.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from raytracer.core.shown import format_value
from raytracer.core.validation import Vec3
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.models import MODELS, REFLECTED
from raytracer.scene.scene import Scene
from raytracer.scene.scene_objects import SceneObjects
from raytracer.scene.settings import Settings

# The number of materials that are warned about one by one. A scene may have a million materials.
_NAMED = 5


def scene_warnings(scene: Scene, settings: Settings) -> list[str]:
    """Return all warnings about a scene and its settings."""
    single = precision_warning(scene, settings), shadows_warning(scene, settings)
    return [*filter(None, single), *brightness_warnings(scene)]


NO_RADIUS = "no light has a radius"


def shadows_warning(scene: Scene, settings: Settings) -> str | None:
    """Return a warning if soft or diluted shadows have no effect, else None."""
    if not scene.lights and settings.shadows in ("soft", "diluted"):
        return f"{settings.shadows} shadows have no effect here, because the scene has no light: add one to [[lights]]"
    if settings.shadows != "soft" or any(light.radius for light in scene.lights):
        return None
    return f"soft shadows look like hard ones here, because {NO_RADIUS}: set one for a light, such as radius = 0.5"


def brightness_warnings(scene: Scene) -> tuple[str, ...]:
    """Return a warning for each material that reflects more light than it receives, such as for colours up to 255."""
    assert isinstance(scene.objects, SceneObjects)
    return scene.objects.derive("brightness", scene.materials, lambda: tuple(_brightness_warnings(scene.materials)))


def _brightness_warnings(materials: Sequence[Material]) -> list[str]:
    shares = {
        model: [parameter.name for parameter in MODELS[model].parameters.values() if parameter.unit == REFLECTED]
        for model in {material.model for material in materials}
    }
    bright = [
        (format_value(material.name or i), keys)
        for i, material in enumerate(materials)
        if (keys := _too_bright(material, shares[material.model]))
    ]
    warnings = [
        f"material {name}: {keys}: a value above 1 reflects more light than comes in (colours are linear and range "
        "from 0 to 1, not from 0 to 255)"
        for name, keys in bright[:_NAMED]
    ]
    if len(bright) > _NAMED:
        warnings.append(f"{len(bright) - _NAMED} more materials reflect more light than comes in")
    return warnings


def _too_bright(material: Material, shares: list[str]) -> str:
    """Name the parameters above 1 among `shares`, which should be at most 1; "" if there is none."""
    largest = {name: max(material.get(name, (0.0,))) for name in shares if not material.has_default(name)}
    return ", ".join(f"{name} = {str(value).removesuffix('.0')}" for name, value in largest.items() if value > 1.0)


# The largest ratio of distance and radius that float32 resolves: 41943. The error of a point at distance d is about
# 4 x 2^-24 d. When it reaches 1 % of a sphere's radius, cuts of the sphere and shadows on it become visibly wrong. The
# same holds for half the thickness of other solids.
_RESOLVED = 0.01 * 2.0**24 / 4.0


def precision_warning(scene: Scene, settings: Settings) -> str | None:
    """Return a warning if 32 bits do not resolve the scene's bounded solids, else None.

    The measure is the largest distance from the camera to a visible point of a sphere, or of the bounding ball of
    another solid, divided by the smallest radius, or by half the smallest thickness.
    """
    if settings.precision == 64:
        return None
    objects, eye = scene.objects, scene.camera.position
    assert isinstance(objects, SceneObjects)
    farthest, smallest = objects.derive("reach", eye, lambda: _reach(objects, eye))
    if farthest <= _RESOLVED * smallest:
        return None
    return (
        f"the largest distance ({farthest:.2g}) is {farthest / smallest:.2g} times the smallest radius or "
        f"half thickness ({smallest:.2g}), more than the {_RESOLVED:.0f} that 32 bits resolve to 1 %: "
        "try --precision 64"
    )


def _reach(objects: SceneObjects, eye: Vec3) -> tuple[float, float]:
    """Return the largest distance of a visible point, and the smallest radius; (0, inf) without bounded solids.

    From outside, the farthest visible points of a ball are on its outline, from inside on its opposite side. float64
    is accurate enough for a warning.
    """
    import numpy as np

    from raytracer.scene.sizes import find_sizes

    centers, radii, halves = objects.derive("sizes", None, lambda: find_sizes(objects))
    distance = np.linalg.norm(centers - eye, axis=1)
    outside = distance > radii
    outline = np.sqrt(np.where(outside, (distance - radii) * (distance + radii), 0.0))
    far = np.where(outside, outline, distance + radii)
    return float(far.max(initial=0.0)), float(halves.min(initial=math.inf))
