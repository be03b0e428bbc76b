"""Rows of the ledger on views: scale, distance, huge spheres, fields of view."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import MATTE, measure_scene, normalize
from raytracer.analysis.numerics.scene_transforms import enlarge_scene, move_scene
from raytracer.analysis.rounding_bounds import UNIT
from raytracer.core.validation import Vec3
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.sphere import Sphere

SIZE = (96, 54)
# The size of the still life, the unit of "scene sizes".
EXTENT = 10.0

_RED, _BLUE, _GREEN, _GREY = MATTE


def still_life() -> Scene:
    """Return the assignment's scene in matte colours."""
    lens = Sphere((-1, 2, 0), 1.5, _RED) & Sphere((1, 2, 0), 1.5, _RED)
    solid = (lens | Sphere((0, 2.7, -0.3), 0.8, _BLUE)) - Sphere((0, 2.8, 0.3), 0.8, _GREEN)
    camera = Camera((0, 3, 6), (0, 2, 0))
    return Scene([solid, Plane((0, 1, 0), 0, _GREY)], [PointLight((4, 7, 4))], camera)


def scene_scale(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The whole scene, 1e-6 to 1e6 times its size."""
    for power in (-6, 0, 6) if short else range(-6, 7):
        yield from measure_scene(renderer, "scene scale", f"1e{power}", enlarge_scene(still_life(), 10.0**power), SIZE)


def distance_from_origin(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Scene and camera moved away from the origin together, up to the limit of coordinates."""
    row = "distance from the origin"
    home = enlarge_scene(still_life(), 1.37)  # whole numbers would keep their bits when moved
    at_home = renderer.render(home, SIZE, Settings())
    assert at_home.depth is not None
    for power in (6,) if short else range(0, 11):
        away = 10.0**power * EXTENT
        scene = move_scene(home, (0.61 * away, 0.37 * away, -0.7 * away))
        at = f"1e{power} scene sizes"
        yield from measure_scene(renderer, row, at, scene, SIZE)
        # The effect of rounding the scene's own numbers so far from the origin. No precision of the shaders can
        # reduce it.
        image = renderer.render(scene, SIZE, Settings())
        assert image.depth is not None
        both = np.isfinite(image.depth) & np.isfinite(at_home.depth)
        change = float(np.median(np.abs(image.depth[both] / at_home.depth[both].astype(float) - 1.0)))
        theory = 2.0**-22 + 2.0**-53 * away
        note = "the scene's own numbers have fewer bits here than float32" if change > 2.0**-22 else ""
        yield Finding(row, at, 32, "median change of depth by the move", change, theory, note)


def far_sphere(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """One sphere that fills the picture, at all distances and sizes."""
    distances = {f"unit sphere at {d:g}": (1.0, d) for d in (100.0, 200.0, 2000.0, 4100.0, 1e5)}
    ratios = {f"radius / distance 1e-{k}": (1.0, 10.0**k) for k in range(1, 8)}
    ratios["radius / distance 0.999"] = (0.999, 1.0)
    chosen = {**distances, **ratios}
    for at in list(chosen)[3::4] if short else chosen:
        radius, distance = chosen[at]
        # Half the picture's height is 1.3 radii, and the sphere is a little off the middle.
        fov = 2.0 * math.degrees(math.atan(1.3 * radius / distance))
        direction = np.array((0.36, 0.48, -0.8))
        center = tuple((direction * distance).tolist())
        look_at = tuple((direction * distance + radius * np.array((0.2, -0.1, 0.05))).tolist())
        light = tuple((direction * (distance - 3.0 * radius) + np.array((2.0 * radius, radius, 0.0))).tolist())
        scene = Scene([Sphere(center, radius, _RED)], [PointLight(light)], Camera((0, 0, 0), look_at, vertical_fov=fov))
        # A pixel is doubtful if half the chord is shorter than the errors of the roots at both its ends.
        share = (16.0 * UNIT[32] * distance / radius) ** 2
        doubt, dark = (0.001 + share, max(0.05, share)) if share < 1.0 else (math.inf, math.inf)
        yield from measure_scene(renderer, "sphere far away", at, scene, SIZE, doubt=doubt, dark=dark)


def beside_a_huge_sphere(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The camera 1e-3 above and below the surface. From above the nearer root counts, from below the farther root."""
    for power in (4, 7) if short else range(8):
        radius = 10.0**power
        for height, where in ((1e-3, "above"), (-1e-3, "below")):
            # Look at the horizon, and from below also down to the far side.
            look_at = (1.0, height - 0.2, 0.3) if height > 0 else (1.0, height + 0.1, 0.3)
            scene = Scene(
                [Sphere((0, -radius, 0), radius, _RED)],
                [PointLight((3.0, math.copysign(5.0, height), 2.0))],
                Camera((0, height, 0), look_at, vertical_fov=70),
            )
            # Seen from the other side, at a distance of 1e7, rounding may move a light 5 from the surface behind it.
            dark = math.inf if power == 7 and height < 0 else 0.05
            at = f"1e-3 {where} radius 1e{power}"
            yield from measure_scene(renderer, "beside a huge sphere", at, scene, SIZE, dark=dark)


def on_a_huge_sphere(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """A ball on a huge sphere, or partly sunk into it, and the shadows of both under a low light."""
    rng = np.random.default_rng(9)
    for power in (7,) if short else (4, 5, 6, 7):
        radius = 10.0**power
        for sunk in (1.0, 0.3, -0.4):
            up, other = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
            side = np.cross(up, other) / np.linalg.norm(np.cross(up, other))
            center = -radius * up
            foot = center + radius * normalize(radius * up + rng.uniform(-2.0, 2.0) * side)
            ball = foot + sunk * normalize(foot - center)
            light = 30.0 * (0.2 * up + side + rng.normal(size=3) * 0.3)
            eye = 6.0 * np.cross(up, side) + 1.5 * up
            scene = Scene(
                [Sphere(_point(center), radius, _GREY), Sphere(_point(ball), 1.0, _RED)],
                [PointLight(_point(light))],
                Camera(_point(eye), _point(ball), _point(up), 60.0),
            )
            yield from measure_scene(renderer, "on a huge sphere", f"{sunk:g} above, radius 1e{power}", scene, SIZE)


def camera_on_a_surface(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The camera exactly on a sphere or on a plane, whose surface it does not see at its own place."""
    ball, plane = Sphere((0, 0, 0), 1.0, _RED), Plane((0, 1, 0), 1.0, _GREY)
    for at, eye, solid in (
        ("on a sphere, outside", (0.0, 0.0, 1.0), ball | Sphere((0, 0, 4), 1.0, _BLUE)),
        ("on a sphere, inside", (0.0, 0.0, 1.0), ~ball),
        ("on a plane", (2.0, 1.0, 3.0), plane | Sphere((0, 1.5, 0), 1.0, _BLUE)),
    ):
        for look_at in ((0.1, 0.7, 5.0), (0.2, 0.9, -3.0)):
            camera = Camera(eye, look_at, vertical_fov=100)
            scene = Scene([solid], [PointLight((0.3, 4.0, 2.0))], camera)
            yield from measure_scene(renderer, "camera on a surface", f"{at}, towards z = {look_at[2]:g}", scene, SIZE)


def field_of_view(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """From 1e-4 to 179.9 degrees, towards an outline: the edge of the blue sphere in front of the ground."""
    scene = still_life()
    eye, center, radius = np.array(scene.camera.position), np.array((0, 2.7, -0.3)), 0.8
    to_center = center - eye
    distance = np.linalg.norm(to_center)
    side = np.cross(to_center, (0.3, 1.0, 0.0))
    sine = radius / distance
    toward = to_center / distance * math.sqrt(1.0 - sine**2) + side / np.linalg.norm(side) * sine
    for fov in (1e-4, 179.9) if short else (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 90.0, 150.0, 179.0, 179.9):
        camera = Camera(scene.camera.position, tuple((eye + toward).tolist()), vertical_fov=fov)
        view = Scene(scene.objects, scene.lights, camera)
        # An outline is accurate to about 1e-6 radians, which are many pixels in a narrow field of view.
        doubt = 0.001 + 1e-6 / math.radians(fov)
        yield from measure_scene(renderer, "field of view", f"{fov:g} degrees", view, SIZE, doubt=doubt)


def _point(v: np.ndarray) -> Vec3:
    x, y, z = v.tolist()
    return x, y, z
