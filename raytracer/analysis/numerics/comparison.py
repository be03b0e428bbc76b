"""Pictures of the GPU against the float64 reference, and scenes scaled and moved."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.numerics.ledger import Finding
from raytracer.analysis.pixel_doubt import resolution
from raytracer.core.validation import Vec3
from raytracer.core.vectors import add, dot, scaled
from raytracer.formats.image import Image
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.instances import Instances
from raytracer.scene.materials.material import Material
from raytracer.scene.options import Evaluator
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids import Plane, Primitive, Solid, Sphere, with_leaves

# Without ambient light or highlights: black where no light reaches, and only there.
MATTE = tuple(
    Material(ka=(0, 0, 0), kd=kd, ks=(0, 0, 0))
    for kd in ((0.8, 0.1, 0.1), (0.1, 0.2, 0.9), (0.1, 0.8, 0.2), (0.6, 0.6, 0.6))
)


@dataclass(frozen=True)
class Comparison:
    """What a picture of one sample has to do with the reference's. Errors are those of sure pixels."""

    wrong: int  # sure pixels that show another material, or none
    doubtful: float  # share of the pixels, and of those that show something, in which that is in doubt
    lit: int  # sure pixels that light reaches, or does not, and should not, or should
    unlit: float  # share of the sure hit pixels where that is in doubt
    anyhow: int  # pixels that are wrong in either way, doubtful or not
    bad: int  # values of any output that are not finite (but for a depth of nothing), or negative radiance
    depth_share: float  # largest error of the depth over its bound
    depth_median: tuple[float, float]  # the error in units in the last place of the depth; and its bound
    depth_largest: tuple[float, float]
    normal_share: float
    radiance_share: float


def compare(renderer: Renderer, scene: Scene, size: tuple[int, int], settings: Settings) -> Comparison:
    """A picture of `scene` against the reference's.

    Which lights reach a point is compared by where there is no light at all: scenes are to have one, and be MATTE.
    """
    image = renderer.render(scene, size, settings)
    truth = ray_tracer.render(scene, size, settings)
    resolved = resolution(scene, size, settings.precision)
    assert image.depth is not None and image.normal is not None and image.material is not None
    assert truth.depth is not None and truth.normal is not None and truth.material is not None
    sure = ~resolved.doubtful
    shown = (truth.material >= 0) | (image.material >= 0)
    other = image.material != truth.material
    dark = (image.radiance == 0.0).all(axis=2) != (truth.radiance == 0.0).all(axis=2)
    hit = sure & shown & ~other
    depth = np.abs(image.depth[hit] - truth.depth[hit])
    ulp, bound = (error / np.spacing(truth.depth[hit].astype(np.float32)) for error in (depth, resolved.depth[hit]))
    normal = np.linalg.norm(image.normal[hit] - truth.normal[hit], axis=1)
    same_light = hit & ~resolved.unlit
    radiance = np.abs(image.radiance - truth.radiance).max(axis=2)[same_light]
    return Comparison(
        wrong=int(np.sum(sure & other)),
        doubtful=float(np.sum(~sure) / max(1, np.sum(shown))),
        lit=int(np.sum(dark & same_light)),
        unlit=float(np.sum(hit & resolved.unlit) / max(1, np.sum(hit))),
        anyhow=int(np.sum(other | (shown & dark))),
        bad=invalid(image),
        depth_share=_largest(depth, resolved.depth[hit]),
        depth_median=(float(np.median(ulp)), float(np.median(bound))) if hit.any() else (0.0, 0.0),
        depth_largest=(float(ulp.max(initial=0.0)), float(bound.max(initial=0.0))),
        normal_share=_largest(normal, resolved.normal[hit]),
        radiance_share=_largest(radiance, resolved.radiance[same_light]),
    )


def invalid(image: Image) -> int:
    """How many values of an image none of its outputs may have: NaN; infinite or negative radiance; and so on."""
    assert image.depth is not None and image.normal is not None
    bad = np.sum(~(image.radiance >= 0.0) | np.isinf(image.radiance)) + np.sum(~np.isfinite(image.normal))
    return int(bad + np.sum(~(image.depth > 0.0)))


def unit(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (..., 3) made unit."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _largest(error: NDArray[np.float64], bound: NDArray[np.float64]) -> float:
    """The largest share of its bound that an error has; one above a bound of 0 is infinite."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nan_to_num(error / bound, nan=0.0, posinf=np.inf).max(initial=0.0))


def findings(
    renderer: Renderer,
    what: str,
    at: str,
    scene: Scene,
    size: tuple[int, int],
    evaluator: Evaluator = "cells",
    doubt: float = 0.01,
    dark: float = 0.05,
) -> Iterator[Finding]:
    """A scene at all precisions.

    At most a share `doubt` of what is seen, and `dark` of what is lit, may be in doubt with 32 bits; inf
    says that 32 bits do not resolve that. With 64 bits the bounds are always the defaults.
    """
    for bits in renderer.device.limits.precisions:
        found = compare(renderer, scene, size, Settings(precision=bits, evaluator=evaluator))
        yield Finding(what, at, bits, "wrong pixels", found.wrong, 0)
        yield Finding(what, at, bits, "doubtful pixels, of those hit", found.doubtful, doubt if bits == 32 else 0.01)
        if scene.lights:
            yield Finding(what, at, bits, "wrong shadows", found.lit, 0)
            yield Finding(what, at, bits, "doubtful shadows, of those hit", found.unlit, dark if bits == 32 else 0.05)
            yield Finding(what, at, bits, "radiance error, share of its bound", found.radiance_share, 1)
        yield Finding(what, at, bits, "wrong in fact, doubtful or not", found.anyhow, math.inf)
        yield Finding(what, at, bits, "NaN, infinite or negative values", found.bad, 0)
        yield Finding(what, at, bits, "depth error, ulp, median", *found.depth_median)
        yield Finding(what, at, bits, "depth error, ulp, largest", *found.depth_largest)
        yield Finding(what, at, bits, "depth error, share of its bound", found.depth_share, 1)
        yield Finding(what, at, bits, "normal error, share of its bound", found.normal_share, 1)


def mapped(scene: Scene, point: Callable[[Vec3], Vec3], scale: float, offset: Callable[[Plane], float]) -> Scene:
    """`scene` with all its points and lengths changed; `point` turns nothing, and takes lengths times `scale`."""

    def changed(leaf: Primitive) -> Solid:
        if isinstance(leaf, Sphere):
            return msgspec.structs.replace(leaf, center=point(leaf.center), radius=leaf.radius * scale)
        return msgspec.structs.replace(leaf, offset=offset(leaf))

    camera = msgspec.structs.replace(
        scene.camera, position=point(scene.camera.position), look_at=point(scene.camera.look_at)
    )
    lights = [
        msgspec.structs.replace(light, position=point(light.position), radius=light.radius * scale)
        for light in scene.lights
    ]
    objects = [
        Instances(o.solid, [point(p) for p in o.positions.tolist()], o.scales * scale)
        if isinstance(o, Instances)
        else with_leaves(o, changed)
        for o in scene.objects
    ]
    return msgspec.structs.replace(scene, objects=objects, camera=camera, lights=lights)


def enlarged(scene: Scene, by: float) -> Scene:
    """`scene`, `by` times as large in all."""
    return mapped(scene, lambda p: scaled(p, by), by, lambda plane: plane.offset * by)


def moved(scene: Scene, by: Vec3) -> Scene:
    """`scene`, moved by a vector as a whole."""
    return mapped(
        scene,
        lambda p: add(p, by),
        1.0,
        lambda plane: plane.offset + dot(plane.normal, by),
    )
