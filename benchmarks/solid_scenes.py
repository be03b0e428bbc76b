"""Scenes of boxes, cylinders and tori for the benchmarks, the same in each run."""

import functools
import itertools
import operator

import numpy as np

import raytracer as rt
from benchmarks.scenes import GREY, RED, paint
from raytracer.scene.solids.flattening import with_leaves

_GROUND = rt.Plane((0, 1, 0), 0, GREY)
_LIGHTS = [rt.PointLight((4, 12, 8))]
_STEEL, _BRASS = paint(0.35, 0.45, 0.6), paint(0.8, 0.6, 0.2)
_BOXES, _TORI, _ROW = 1_000, 20, 10


def dice() -> rt.Scene:
    """Return the example `die`, with Phong's materials of the same colours, which POV-Ray has as well."""
    scene = rt.load("die")
    solids = [with_leaves(solid, lambda leaf: leaf.with_material(_phong(leaf.material))) for solid in scene.solids()]
    return rt.Scene(solids, scene.lights, scene.camera, background=scene.background, name="two dice")


def _phong(material: rt.Material) -> rt.Material:
    return paint(*material.rho)


def plate() -> rt.Scene:
    """Return a scene of a plate less 10 x 10 cylinders, one by one, above the ground."""
    slab: rt.Solid = rt.Box((-5.0, 1.0, -5.0), (5.0, 1.5, 5.0), _STEEL)
    middles = itertools.product((k - (_ROW - 1) / 2.0 for k in range(_ROW)), repeat=2)
    holes = (rt.Cylinder((x, 0.5, z), (x, 2.0, z), 0.33, _BRASS) for x, z in middles)
    solid = functools.reduce(operator.sub, holes, slab)
    camera = rt.Camera((3, 8, 10), (0, 0.8, 0), vertical_fov=45)
    return rt.Scene([solid, _GROUND], _LIGHTS, camera, name="plate with 100 holes")


def boxes() -> rt.Scene:
    """Return a scene of 1,000 boxes less a cylinder, in random directions, above the ground."""
    rng = np.random.default_rng(5)
    centers = rng.uniform((-10.0, 0.5, -20.0), (10.0, 6.0, 2.0), (_BOXES, 3)).tolist()
    sizes = rng.uniform(0.08, 0.3, (_BOXES, 3))
    axes, angles = rng.normal(size=(_BOXES, 3)).tolist(), rng.uniform(0.0, 360.0, _BOXES).tolist()
    solids = []
    for center, half, axis, angle in zip(centers, sizes, axes, angles, strict=True):
        x, y, z = half.tolist()
        bore = rt.Cylinder((0, -2 * y, 0), (0, 2 * y, 0), 0.7 * min(x, z), _BRASS)
        solids.append((rt.Box((-x, -y, -z), (x, y, z), RED) - bore).rotate(axis, angle).translate(center))
    camera = rt.Camera((0, 3, 6), (0, 2, 0))
    return rt.Scene([*solids, _GROUND], _LIGHTS, camera, name="1,000 boxes less cylinders")


def tori() -> rt.Scene:
    """Return a scene of 20 tori in random directions above the ground."""
    rng = np.random.default_rng(7)
    places = [(x, 1.5, z) for z in (-4.5, -1.5, 1.5, 4.5) for x in (-6.0, -3.0, 0.0, 3.0, 6.0)]
    axes, shares = rng.normal(size=(_TORI, 3)).tolist(), rng.uniform(0.2, 0.6, _TORI).tolist()
    solids = [
        rt.Torus(place, axis, 0.9, 0.9 * share, _STEEL) for place, axis, share in zip(places, axes, shares, strict=True)
    ]
    camera = rt.Camera((0, 8, 13), (0, 0.8, 0), vertical_fov=40)
    return rt.Scene([*solids, _GROUND], _LIGHTS, camera, name="20 tori")
