"""The objects of a scene, and the values that follow from the objects alone: trees, materials, spheres.

`scene.py` describes the whole. Only the functions that make arrays import NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from raytracer.core.validation import InputError
from raytracer.scene.instances import Instances, sphere_arrays
from raytracer.scene.materials.material import Material
from raytracer.scene.solids import MAX_SURFACES, Plane, Primitive, Solid, Sphere, simplified

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

T = TypeVar("T")

# Nodes of a tree without complements of complements, to each leaf: the leaf, an operator, and a complement of either.
_NODES_PER_LEAF = 4


class Run(NamedTuple):
    """The nodes of the trees of plain solids that follow each other, or of the one solid of `instances`."""

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
    """The objects of a scene: a tuple that knows the trees of its solids, and the materials of all their primitives.

    Scenes that differ in lights or camera share it, so that a window with very many objects looks at them once. Raises
    InputError for no objects, and for more than MAX_SURFACES primitives.
    """

    # The trees of all objects one after another, as simplified() lists each: nodes[starts[i] : starts[i + 1]].
    nodes: list[Solid]
    starts: list[int]
    # Once each, in the order in which the primitives have them.
    materials: tuple[Material, ...]
    # The values that derive() made last, by name, each with its key. The values live as long as the objects.
    derived: dict[str, tuple[object, Any]]

    def __init__(self, objects: tuple[Solid | Instances, ...]) -> None:
        if not objects:
            raise InputError("expected at least one", "objects")
        self.nodes, self.starts, self.derived = [], [0], {}
        self._instances: dict[int, Instances] = {}  # by their place among the objects
        for i, item in enumerate(objects):
            if isinstance(item, Instances):
                self._instances[i] = item
                item = item.solid
            self.nodes += simplified(item)
            self.starts.append(len(self.nodes))
            # At once: of solids that objects share there may be more than fit the memory.
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
        """Become a plain tuple in a pickle: the scene that holds it finds all else again."""
        return tuple, (list(self),)

    def tree(self, i: int) -> list[Solid]:
        """The tree of object i."""
        return self.nodes[self.starts[i] : self.starts[i + 1]]

    def runs(self) -> Iterator[Run]:
        """All objects in order."""
        ends = [-1, *self._instances, len(self)]
        for before, end in pairwise(ends):
            if before + 1 < end:
                yield Run(self.nodes[self.starts[before + 1] : self.starts[end]], None)
            if end < len(self):
                yield Run(self.tree(end), self._instances[end])

    def counts(self) -> list[int]:
        """Count the solids of each object: 1, or the number of instances."""
        counts = [1] * len(self)
        for i, instances in self._instances.items():
            counts[i] = len(instances)
        return counts

    def spheres(self) -> tuple[Array, Array]:
        """Centers (N, 3) and radii (N,) of all spheres, to the bit as in Scene.solids()."""
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
        """The value that `make` makes of these objects and of `key`, kept by its name until there is another key."""
        kept = self.derived.get(name)
        if kept is None or kept[0] != key:
            kept = self.derived[name] = key, make()
        return kept[1]


def _leaves(nodes: list[Solid]) -> list[Primitive]:
    # The exact types, which take a quarter of the time of isinstance(): no class is derived from a primitive's.
    return [node for node in nodes if type(node) is Sphere or type(node) is Plane]
