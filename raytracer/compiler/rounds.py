"""The rounds of loops that a pixel's rays may go through at most: llvmpipe computes no more than MAX_ROUNDS of them.

All bounds are of the texts as they are written: where a compiler unrolls a loop, there are fewer rounds.
"""

from __future__ import annotations

from collections.abc import Collection

from raytracer.compiler.batches import SHAPE_LEAVES
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.roth_bounds import max_hits, roth_loops

# Rounds of all its loops together after which llvmpipe has a shader leave every loop (cut_short.glsl).
MAX_ROUNDS = 65535
# Rounds for an entry of a list (lists.glsl). An object of a common shape takes one in the walk through the list, one in
# the search for it, and one for each root of its spheres and for the end. A code of a chain takes fewer, but for few
# rays that meet more than chain.glsl has room for.
ENTRY_ROUNDS = 2 + 2 * SHAPE_LEAVES + 1
# Rounds of the reflectance models that have loops, for one light. diffuse_microfacet with 4096 nodes has 40 azimuths,
# for each of these four times 5 parts, of 5 nodes each; he has three sums of 1,025 terms, and Newton's steps; lafortune
# has 16 lobes of three channels.
_MODEL_ROUNDS = {
    "diffuse_microfacet": 40 * (1 + 4 * 5 * (1 + 5)),
    "he": 3 * (1025 + 5) + 2 + 4,
    "lafortune": 16 * (1 + 3),
}


def most_rounds(compiled: CompiledScene, ray: int, to_light: int) -> int:
    """Rounds of loops that all rays of a pixel go through at most, by the rounds of one ray, and of one to a light.

    A pixel has one ray, and one from each mirror, and from each point that these meet one to each light.
    """
    to_light = to_light if compiled.options.shadows != "off" else 0
    at_light = 1 + to_light + _model_rounds(compiled.layout.models)
    bounces = compiled.options.bounces if compiled.has_mirrors else 0
    return (1 + bounces) * (1 + ray + len(compiled.lights) * at_light)


def ray_rounds(compiled: CompiledScene) -> int:
    """Rounds of loops in which one ray is evaluated at most, where there are no lists."""
    if compiled.options.evaluator == "roth":
        # Each loop is over at most so many hits of two solids, and their ends at infinity.
        return roth_loops(compiled.scene) * (max(map(max_hits, compiled.scene.solids())) + 4)
    return 3 * compiled.surfaces.size  # the roots of all surfaces, a few at a time, and then from root to root


def may_take_many_rounds(compiled: CompiledScene) -> bool:
    """Whether a pixel's rays may go through more rounds of loops than llvmpipe has (cut_short.glsl).

    Lists of any length are assumed: scenes that differ in the number of objects share their text.
    """
    if compiled.has_lists:
        return True
    ray = ray_rounds(compiled)
    return most_rounds(compiled, ray, ray) > MAX_ROUNDS


def has_model_loops(compiled: CompiledScene) -> bool:
    """Whether the text of a reflectance model has loops."""
    return not _MODEL_ROUNDS.keys().isdisjoint(compiled.layout.models)


def _model_rounds(models: Collection[str]) -> int:
    """Rounds of the reflectance model with the most, for the light of one light at one point."""
    return max((_MODEL_ROUNDS.get(model, 0) for model in models), default=0)
