"""The rounds of loops that a pixel's rays may go through at most: llvmpipe computes no more than MAX_ROUNDS of them.

All bounds are of the texts as they are written: where a compiler unrolls a loop, there are fewer rounds.
"""

from __future__ import annotations

from collections.abc import Collection

from raytracer.compiler.batches import KIND_LEAVES

# Rounds of all its loops together after which llvmpipe has a shader leave every loop (cut_short.glsl).
MAX_ROUNDS = 65535
# Of an entry of a list (lists.glsl): an object of a kind takes one in the walk through the list, one in the search for
# it, and one for each root of its spheres and for the end. A code of a chain takes fewer, but for few rays that meet
# more than chain.glsl has room for.
OF_ENTRY = 2 + 2 * KIND_LEAVES + 1
# Of the reflectance models that have loops, for one light: diffuse_microfacet with 4096 nodes has 40 azimuths, for each
# of these four times 5 parts, of 5 nodes each; he three sums of 1,025 terms, and Newton's steps; lafortune 16 lobes of
# three channels.
_OF_MODELS = {"diffuse_microfacet": 40 * (1 + 4 * 5 * (1 + 5)), "he": 3 * (1025 + 5) + 2 + 4, "lafortune": 16 * (1 + 3)}


def of_models(models: Collection[str]) -> int:
    """Of reflectance models, for the light of one light at one point: those of the model with the most."""
    return max((_OF_MODELS.get(model, 0) for model in models), default=0)


def of_walk(surfaces: int) -> int:
    """Of one ray, for `walk`: the roots of all surfaces, a few at a time, and then from root to root."""
    return 3 * surfaces


def of_roth(loops: int, hits: int) -> int:
    """Of one ray, for `roth`: so many loops, each over at most `hits` of two solids, and their ends at infinity."""
    return loops * (hits + 4)


def of_pixel(ray: int, to_light: int, models: int, lights: int, bounces: int) -> int:
    """Of all rays of a pixel: one and one from each mirror, and from each point that these meet one to each light.

    `ray`, `to_light` and `models` are the rounds of one ray of either sort, and of of_models().
    """
    return (1 + bounces) * (1 + ray + lights * (1 + to_light + models))
