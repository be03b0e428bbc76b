"""The objects of a scene, and values that depend on the objects alone: trees, materials, spheres.

Only the functions that make arrays import NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from raytracer.core.validation import InputError
from raytracer.scene.instances import Instances, sphere_arrays
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.flattening import simplify
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Primitive, Solid
from raytracer.scene.solids.sphere import Sphere

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

T = TypeVar("T")

# The most nodes per leaf in a tree without double complements: the leaf, an operator, and a complement of each.
_NODES_PER_LEAF = 4


class Run(NamedTuple):
    """A sequence of objects: successive plain solids, or one Instances object. `nodes` holds the nodes of all trees."""

    nodes: list[Solid]
    instances: Instances | None

    @property
    def spheres(self) -> list[Sphere]:
        """The spheres among the nodes."""
        return [node for node in self.nodes if type(node) is Sphere]

    @property
    def planes(self) -> list[Plane]:
        """The half-spaces among the nodes."""
        return [node for node in self.nodes if type(node) is Plane]


class SceneObjects(tuple[Solid | Instances, ...]):
    """The objects of a scene: a tuple with the trees of its solids and the materials of all primitives.

    Scenes that differ only in lights or camera share it, so that a window with very many objects reads them once.
    Raises InputError for no objects, and for more than MAX_SURFACES primitives.
    """

    # The trees of all objects, one after another, in the order of simplify(): tree i is
    # nodes[starts[i] : starts[i + 1]].
    nodes: list[Solid]
    starts: list[int]
    # The distinct materials, in the order of the primitives.
    materials: tuple[Material, ...]
    # The cache of derive(): name -> (key, value). It lives as long as the objects.
    derived: dict[str, tuple[object, Any]]

    def __init__(self, objects: tuple[Solid | Instances, ...]) -> None:
        if not objects:
            raise InputError("expected at least one", "objects")
        self.nodes, self.starts, self.derived = [], [0], {}
        self._instances: dict[int, Instances] = {}  # index among the objects -> object
        for i, item in enumerate(objects):
            if isinstance(item, Instances):
                self._instances[i] = item
                item = item.solid
            self.nodes += simplify(item)
            self.starts.append(len(self.nodes))
            # Stop early: objects may share solids, so that all trees written out may not fit into memory.
            if len(self.nodes) > _NODES_PER_LEAF * MAX_SURFACES:
                break
        leaves = _leaves(self.nodes)
        count = len(leaves) + sum(
            (len(instances) - 1) * len(_leaves(self.tree(i))) for i, instances in self._instances.items()
        )
        if count > MAX_SURFACES:
            least = "at least " if len(self.starts) <= len(objects) else ""
            raise InputError(f"expected at most {MAX_SURFACES} primitives, got {least}{count}", "objects")
        self.materials = tuple(dict.fromkeys([leaf.material for leaf in leaves]))

    def __reduce__(self) -> tuple[type, tuple[list[Solid | Instances]]]:
        """Pickle as a plain tuple. Unpickling the scene that holds it computes the other values again."""
        return tuple, (list(self),)

    def tree(self, i: int) -> list[Solid]:
        """Return the nodes of object i, in postfix order."""
        return self.nodes[self.starts[i] : self.starts[i + 1]]

    def runs(self) -> Iterator[Run]:
        """Yield all objects in order, with successive plain solids together."""
        ends = [-1, *self._instances, len(self)]
        for before, end in pairwise(ends):
            if before + 1 < end:
                yield Run(self.nodes[self.starts[before + 1] : self.starts[end]], None)
            if end < len(self):
                yield Run(self.tree(end), self._instances[end])

    def counts(self) -> list[int]:
        """Return the number of solids of each object: 1, or the number of instances."""
        counts = [1] * len(self)
        for i, instances in self._instances.items():
            counts[i] = len(instances)
        return counts

    def spheres(self) -> tuple[Array, Array]:
        """Return the centres [N, 3] and radii [N] of all spheres, bit-identical to Scene.solids()."""
        return self.derive("spheres", None, self._spheres)

    def _spheres(self) -> tuple[Array, Array]:
        import numpy as np

        parts: list[tuple[Array, Array]] = []
        for run in self.runs():
            centers, radii = run.instances.spheres() if run.instances else sphere_arrays(run.spheres)
            parts.append((centers.reshape(-1, 3), radii.ravel()))
        centers, radii = zip(*parts, strict=True)
        return np.concatenate(centers), np.concatenate(radii)

    def derive(self, name: str, key: object, make: Callable[[], T]) -> T:
        """Return a cached value that depends on these objects.

        Args:
            name: the name of the value. The cache keeps one value per name.
            key: everything else that the value depends on. Another key than before computes the value again.
            make: a function that computes the value.
        """
        cached = self.derived.get(name)
        if cached is None or cached[0] != key:
            cached = self.derived[name] = key, make()
        return cached[1]


def _leaves(nodes: list[Solid]) -> list[Primitive]:
    # Comparing exact types takes a quarter of the time of isinstance(), and is correct because the primitives have no
    # subclasses.
    return [node for node in nodes if type(node) is Sphere or type(node) is Plane or type(node) is Placed]
