"""The choice of the objects that have grids (chain_grids.py): long chains of holes, of which a ray crosses many."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from raytracer.compiler.csg_pruning import LEAF_SHIFT, NEGATED, OR_LEAF, Pruner
from raytracer.scene.solids.bounds import EVERYWHERE, Bounds
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Primitive, Solid
from raytracer.scene.solids.sphere import Sphere

# The smallest number of leaves of a long chain, which has a grid. For shorter chains, the lists of cells are short.
LONG = 48
# The smallest mean number of holes that a line through a long chain crosses. For fewer holes, lists of cells are as
# fast as a grid or up to twice as fast: a plate of 600 holes side by side, a cube less 3,000 small balls. For more, a
# grid is faster: three times for a cube less a lattice of 50 bars, which has 4. It is 0 for a chain of _MANY leaves,
# whose lists take too long to make.
CROSSED, _MANY = 3.0, 4096
# The largest number of leaves of a long chain that every ray is tested against, CORE of grid.glsl.
CORE = 4


def is_long_chain(pruner: Pruner, tree: Sequence[Solid]) -> bool:
    """Return whether a tree is a chain of which all leaves but a few are holes, and a line crosses many of them.

    A hole is a negated and bounded leaf. A union is the complement of a conjunction, whose leaves are holes.
    """
    leaves = [leaf for leaf in tree if isinstance(leaf, Primitive)]
    if len(leaves) < LONG or not pruner.is_chain:
        return False
    codes = pruner.whole_program()
    places = codes >> LEAF_SHIFT
    is_plane = np.array([isinstance(leaf, Plane) for leaf in leaves])
    negated = ((codes & NEGATED) != 0) != ((codes[-1] & 7) == OR_LEAF)
    is_hole = negated & ~is_plane[places]
    if int(np.count_nonzero(~is_hole)) > CORE:
        return False
    if len(leaves) >= _MANY:
        return True
    return _crossed_holes([leaves[k] for k in places[is_hole]], [leaves[k] for k in places[~is_hole]]) >= CROSSED


def _crossed_holes(holes: Sequence[Primitive], core: Sequence[Primitive]) -> float:
    """Return about the mean number of holes that a line through a chain crosses, by the boxes around its leaves.

    Lines of all directions that cross a convex body are in proportion to its surface (Cauchy). The surface of a ball is
    pi / 6 of its box's surface.
    """
    around = functools.reduce(Bounds.common, [leaf.bounds() for leaf in core], EVERYWHERE)
    boxes = [hole.bounds() for hole in holes]
    shares = [math.pi / 6.0 if isinstance(hole, Sphere) else 1.0 for hole in holes]
    whole = functools.reduce(Bounds.union, boxes).common(around)
    surface = _box_surface(whole)
    crossed = sum(share * _box_surface(box.common(whole)) for share, box in zip(shares, boxes, strict=True))
    return crossed / surface if surface else 0.0


def _box_surface(box: Bounds) -> float:
    """Return half the surface of a box; 0 if it is empty."""
    x, y, z = (max(high - low, 0.0) for low, high in zip(*box, strict=True))
    return x * y + y * z + z * x if x and y and z else 0.0
