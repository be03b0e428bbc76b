"""Rows of the ledger on solids of all kinds but spheres and half-spaces: random trees, extremes, self-shadow."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import (
    MATTE,
    measure_scene,
)
from raytracer.analysis.numerics.scene_transforms import enlarge_scene, move_scene
from raytracer.analysis.numerics.specimens import KINDS, lit_scene, specimen
from raytracer.core.validation import Vec3
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.scene import Scene
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere

SIZE = (64, 40)
_RED, _BLUE, _GREEN, _GREY = MATTE
# Spheres and boxes that candidate lists need: the evaluator `cells` lists the primitives of larger scenes.
_LISTED = 13


def _turned(kind: str) -> Solid:
    return specimen(kind).rotate((1, 2, 3), 40)


def _still(kind: str) -> Scene:
    """Return a scene with a solid, a ball that shades it, and a ground that both shade."""
    return lit_scene(_turned(kind), Sphere((0.9, 0.9, 0.9), 0.4, _BLUE), Plane((0, 1, 0), -1.2, _GREY), eye=(0.4, 2, 4))


def solids_scale(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids of all kinds with a ball and a ground, 1e-6 to 1e6 times their size."""
    for kind in KINDS:
        for power in (-6, 6) if short else range(-6, 7, 2):
            scene = enlarge_scene(_still(kind), 10.0**power)
            yield from measure_scene(renderer, "scale of solids", f"{kind}, 1e{power}", scene, SIZE)


def solids_distance(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids of all kinds seen from 10 to 1e7 times their size away, and with the camera up to 1e6 sizes from the
    origin."""
    row = "distance of solids"
    for kind in KINDS:
        for power in (3,) if short else range(1, 8):
            distance = 10.0**power
            x, y, z = (distance * np.array((0.36, 0.48, 0.8))).tolist()
            fov = 2.0 * math.degrees(math.atan(1.3 / distance))
            scene = lit_scene(_turned(kind), eye=(x, y, z), look_at=(0.1, -0.05, 0.02), fov=fov)
            # Pixels whose chord is shorter than the errors of both its ends are doubtful: near edges of faces, a share
            # in proportion to the errors. A torus has the larger errors of a quartic, above all in shadows: 32 bits do
            # not resolve them from some 100 sizes away.
            pixels, shadows = (1024.0, 20480.0) if kind == "torus" else (256.0, 512.0)
            doubt, dark = (
                base + share if share < 0.2 else math.inf
                for base, share in ((0.01, pixels * 2.0**-24 * distance), (0.05, shadows * 2.0**-24 * distance))
            )
            at = f"{kind}, from 1e{power}"
            yield from measure_scene(renderer, row, at, scene, SIZE, doubt=doubt, dark=dark)
        for power in (6,) if short else (2, 4, 6):
            away = 10.0**power
            scene = move_scene(_still(kind), (0.61 * away, 0.37 * away, -0.7 * away))
            yield from measure_scene(renderer, row, f"{kind}, moved by 1e{power}", scene, SIZE)


# Places on the specimens, and names of them.
_PLACES: dict[str, dict[str, Vec3]] = {
    "box": {"inside": (0.125, 0.25, 0), "a face": (0.75, 0.125, 0.25), "an edge": (0.75, 0.5, 0.125)},
    "cylinder": {
        "inside": (0.125, 0.25, 0),
        "a cap": (0.125, 0.75, 0.25),
        "a wall": (0.5, 0.125, 0),
        "an edge": (0.5, 0.75, 0),
    },
    "cone": {"inside": (0.125, 0.25, 0), "a cap": (0.125, 1, 0), "a wall": (0.5, 0, 0), "an edge": (0.75, -1, 0)},
    "ellipsoid": {"inside": (0.125, 0.25, 0), "a wall": (0, 0.5, 0)},
    "torus": {
        "inside": (0.875, 0.125, 0),
        "the hole": (0, 0.125, 0.125),
        "the outer equator": (1, 0, 0),
        "the inner equator": (0.5, 0, 0),
        "the top": (0.75, 0.25, 0),
    },
    "polyhedron": {
        "inside": (0.125, 0.25, 0),
        "a face": (0.25, 0.25, 0.5),
        "an edge": (0.5, 0.5, 0),
        "a corner": (1, 0, 0),
    },
    "paraboloid": {
        "inside": (0.125, -0.25, 0),
        "a cap": (0.125, -0.75, 0),
        "a wall": (0.375, 0.375, 0),
        "an edge": (0.75, -0.75, 0),
        "the vertex": (0, 0.75, 0),
    },
}


def camera_at_solids(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """The camera inside solids of all kinds, and exactly on their faces, edges and corners.

    It does not see a surface at its own place.
    """
    for kind, places in _PLACES.items():
        for where, eye in places.items():
            for name, look_at in (("in", (-0.02, -0.3, 0.06)), ("out", (3.0, 2.0, 1.5)), ("along", (1.0, 2.5, -0.25))):
                if short and name != "in":
                    continue
                scene = lit_scene(
                    specimen(kind),
                    Sphere((3, 2, 1), 0.75, _BLUE),
                    Plane((0, 1, 0), -1.25, _GREY),
                    eye=eye,
                    look_at=look_at,
                    fov=90.0,
                )
                at = f"{kind}, {where}, looks {name}"
                # Where rays leave a torus along its tangent plane, a quartic's two roots are near each other.
                doubt = 0.03 if kind == "torus" else 0.01
                yield from measure_scene(renderer, "camera at solids", at, scene, SIZE, doubt=doubt)


def solids_tangents(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Views along generators of cylinders and cones, along the faces of a box, and in tangent planes of a torus.

    The middle row or column of these pictures is exactly tangent.
    """
    slant = np.array((-0.25, 1.0, 0.0))  # of the generator of the cone through (0.75, -1, 0)
    generator = (np.array((0.5, 0.0, 0.0)) + 4.0 * slant).tolist()
    views: dict[str, tuple[str, Vec3, Vec3]] = {
        "along a generator of a cylinder": ("cylinder", (0.5, 5, 0), (0.5, -0.75, 0)),
        "along a generator of a cone": ("cone", tuple(generator), (0.75, -1, 0)),
        "at a cylinder from the side": ("cylinder", (0.5, 0.25, 5), (0.5, 0.25, 0)),
        "in the top plane of a torus": ("torus", (0, 0.25, 5), (0, 0.25, 0)),
        "in the middle plane of a torus, at its hole": ("torus", (0.5, 0, 5), (0.5, 0, 0)),
        "along the axis of a torus, at its hole": ("torus", (0.5, 5, 0), (0.5, 0, 0)),
        "across a torus, along its outer equator": ("torus", (1, 0, 5), (1, 0, 0)),
        "along a face of a box": ("box", (0.25, 0.5, 5), (0.25, 0.5, 0)),
        "along an edge of a box": ("box", (0.75, 0.5, 5), (0.75, 0.5, 0)),
        "at an ellipsoid's outline": ("ellipsoid", (0, 0.5, 5), (0, 0.5, 0)),
        "at the vertex of a paraboloid": ("paraboloid", (0, 0.75, 5), (0, 0.75, 0)),
        "along an edge of a polyhedron": ("polyhedron", (4, -3, 0), (0, 1, 0)),
    }
    for name, (kind, eye, look_at) in views.items():
        for fov in (2.0,) if short else (0.01, 2.0, 40.0):
            solid = specimen(kind)
            camera = Camera(eye, look_at, (0, 0, 1) if abs(eye[1]) > 2.5 else (0, 1, 0), fov)
            scene = Scene([solid, Plane((0.25, 1, 0.5), -2, _GREY)], [PointLight((4, 7, 4))], camera)
            # A row and a column of pixels see a tangent, and float32 resolves an outline to about 1e-6 radians.
            doubt, tangent = 2e-6 / math.radians(fov), 1 / 49 + 1 / 33
            at = f"{name}, {fov:g} degrees"
            yield from measure_scene(renderer, "tangents of solids", at, scene, (49, 33), doubt=doubt, tangent=tangent)


def slivers(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids of all kinds under stretches of 1e4 and under nearly singular maps, down to a shortest axis of 1e-9."""
    stretches = {
        "a plate of 1e-4": (1.0, 1e-4, 1.0),
        "a needle of 1e-4": (1e-4, 1.0, 1e-4),
        "axes of 1, 1e-3, 1e-6": (1.0, 1e-3, 1e-6),
        "axes of 1, 1, 1e-9": (1.0, 1.0, 1e-9),
    }
    for kind in KINDS:
        for name, factors in list(stretches.items())[:: 3 if short else 1]:
            solid = specimen(kind).rotate((1, 1, 1), 50).scale(factors).rotate((1, 2, 3), 40)
            scene = lit_scene(solid, Plane((0, 1, 0), -1.5, _GREY), eye=(0.5, 2.0, 4.0))
            # 32 bits do not resolve chords shorter than some 1e-6.
            rough = math.inf if min(factors) < 1e-4 else 0.05
            at = f"{kind}, {name}"
            yield from measure_scene(renderer, "slivers", at, scene, SIZE, doubt=max(rough, 0.01), dark=rough)
