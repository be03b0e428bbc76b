"""Generates the GLSL text of rayCSG() and blockedAt() for a compiled scene, by its evaluator."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.glsl import csg, csg_lists
from raytracer.compiler.glsl.body_slots import body_slots
from raytracer.compiler.glsl.constants import Handed, named_planes, surface_texts
from raytracer.compiler.roth_bounds import max_hits
from raytracer.scene.scene import Scene
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.flattening import simplify
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere


def camera_query(compiled: CompiledScene, handed: Handed) -> list[str]:
    """Generate rayCSG() for camera rays."""
    if compiled.options.evaluator == "roth":
        return _roth(compiled, handed)
    if compiled.has_lists:
        planes = named_planes(compiled, handed)
        if not compiled.batches.programs:
            return csg.nearest_plane_text(planes, with_owner=True)
        return csg_lists.camera_query_text(compiled.batches.program_depth, compiled.batches.has_grids, planes)
    return _walk(compiled, handed, with_owner=True)


def mirror_query(compiled: CompiledScene, handed: Handed) -> list[str]:
    """Generate rayCSG() for rays from any origin. For some evaluators the text also has blockedAt()."""
    if not compiled.has_lists:
        return camera_query(compiled, handed)
    return [*shadow_query(compiled, handed), *csg_lists.mirror_query_text(named_planes(compiled, handed))]


def shadow_query(compiled: CompiledScene, handed: Handed) -> list[str]:
    """Generate blockedAt(), for rays to a light."""
    if compiled.options.evaluator == "roth":
        return _roth(compiled, handed)
    if compiled.has_lists:
        return csg_lists.shadow_query_text(
            compiled.batches.shapes,
            body_slots(compiled),
            bool(compiled.batches.programs),
            compiled.batches.program_depth,
            compiled.batches.has_grids,
            named_planes(compiled, handed),
            any_hit=compiled.options.shadows != "diluted" and not compiled.has_mirrors,
            with_owner=compiled.has_mirrors,
            has_area_lights=compiled.has_area_lights,
        )
    return _walk(compiled, handed, with_owner=False)


def _roth(compiled: CompiledScene, handed: Handed) -> list[str]:
    """Generate rayCSG() and blockedAt() of the evaluator `roth`."""
    most = max(map(max_hits, compiled.scene.solids()))
    ranges = _ranges(compiled)
    text = csg.roth_text(_trees(compiled.scene, ranges), ranges, surface_texts(compiled, handed))
    return [f"#define MAX_HITS {most}", '#include "csg/roth.glsl"', *text]


def _walk(compiled: CompiledScene, handed: Handed, *, with_owner: bool) -> list[str]:
    """Generate rayCSG() of the evaluator `walk`, or without `with_owner` blockedAt()."""
    ranges = _ranges(compiled)
    text = csg.walk_text(_trees(compiled.scene, ranges), ranges, surface_texts(compiled, handed), with_owner=with_owner)
    return ['#include "csg/walk.glsl"', *text]


def _ranges(compiled: CompiledScene) -> csg.Ranges:
    surfaces = compiled.surfaces
    return csg.Ranges(surfaces.spheres, surfaces.bounded, surfaces.size)


def _trees(scene: Scene, ranges: csg.Ranges) -> list[csg.Tree]:
    """Return the trees of all objects, with surface indices instead of leaves."""
    numbers: dict[type[Solid], Iterator[int]] = {
        Sphere: itertools.count(),
        Placed: itertools.count(ranges.spheres),
        Plane: itertools.count(ranges.bounded),
    }

    def numbered(node: Solid) -> Solid | int:
        return next(numbers[type(node)]) if type(node) in numbers else node

    return [[numbered(node) for node in simplify(solid)] for solid in scene.solids()]
