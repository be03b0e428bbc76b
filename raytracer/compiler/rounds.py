"""Upper bounds of the number of loop iterations, here called rounds, that a shader takes for a pixel's rays.

llvmpipe, Mesa's software renderer, computes no more than MAX_ROUNDS of them. The bounds hold for the shaders' texts. If
a compiler unrolls a loop, there are fewer rounds.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.batches import SHAPE_LEAVES
from raytracer.compiler.bodies import WALLS
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.roth_bounds import max_hits, roth_loops
from raytracer.compiler.surfaces import Surfaces

Ints = NDArray[np.int64]

# The number of rounds of all loops together after which llvmpipe leaves every loop of a shader (cut_short.glsl).
MAX_ROUNDS = 65535
# The most rounds for an entry of a candidate list (lists.glsl), without the rounds of bodies. An object of a common
# shape takes one round in the walk through the list, one in the search for it, one for each root of its leaves, and one
# for the end. A code of a chain takes fewer, except for the few rays that meet more leaves than chain.glsl has room
# for.
ENTRY_ROUNDS = 2 + 2 * SHAPE_LEAVES + 1
# The most rounds for the roots of both parts of a torus (torus_wall.glsl): steps of Newton's method with 64 bits, and
# two rounds for the ends of the ray.
_TORUS_ROUNDS = 5 + 4 * (1 + 16) + 2
# The most rounds of the reflectance models with loops, for one light. diffuse_microfacet with 4096 nodes has 40
# azimuths, four times 5 parts for each azimuth, and 5 nodes in each part. he has three sums of 1,025 terms, and
# Newton's steps. lafortune has 16 lobes of three channels.
_MODEL_ROUNDS = {
    "diffuse_microfacet": 40 * (1 + 4 * 5 * (1 + 5)),
    "he": 3 * (1025 + 5) + 2 + 4,
    "lafortune": 16 * (1 + 3),
}


def most_rounds(compiled: CompiledScene, ray: int, to_light: int) -> int:
    """Return the most rounds of loops for all rays of a pixel.

    `ray` is the most rounds of a ray from the camera or a mirror, `to_light` of a ray to a light. A pixel has one ray
    from the camera, one more for each bounce, and from each point that these rays meet one ray to each light.
    """
    to_light = to_light if compiled.options.shadows != "off" else 0
    at_light = 1 + to_light + _model_rounds(compiled.layout.models)
    bounces = compiled.options.bounces if compiled.has_mirrors else 0
    return (1 + bounces) * (1 + ray + len(compiled.lights) * at_light)


def ray_rounds(compiled: CompiledScene) -> int:
    """Return the most rounds of loops for one ray in a scene without candidate lists."""
    if compiled.options.evaluator == "roth":
        # Each loop is over at most max_hits() hits of two solids, and their ends at infinity.
        return roth_loops(compiled.scene) * (max(map(max_hits, compiled.scene.solids())) + 4)
    # The roots of all surfaces, then the walk from root to root.
    return 3 * compiled.surfaces.size + int(body_rounds(compiled.surfaces).sum())


def body_rounds(surfaces: Surfaces) -> Ints:
    """Return the most rounds for the roots of each body (B,): one for each slab, and the steps for a torus."""
    bodies = surfaces.bodies
    return np.diff(bodies.starts) + np.where(bodies.kinds == WALLS.index("torus"), _TORUS_ROUNDS, 0)


def may_take_many_rounds(compiled: CompiledScene) -> bool:
    """Return whether a pixel's rays may take more rounds of loops than llvmpipe computes (cut_short.glsl).

    Candidate lists count as arbitrarily long, because scenes that differ in the number of objects share their text.
    """
    if compiled.has_lists:
        return True
    ray = ray_rounds(compiled)
    return most_rounds(compiled, ray, ray) > MAX_ROUNDS


def has_model_loops(compiled: CompiledScene) -> bool:
    """Return whether the text of a reflectance model in use has loops."""
    return not _MODEL_ROUNDS.keys().isdisjoint(compiled.layout.models)


def _model_rounds(models: Collection[str]) -> int:
    """Return the most rounds of any of the models, for one light at one point."""
    return max((_MODEL_ROUNDS.get(model, 0) for model in models), default=0)
