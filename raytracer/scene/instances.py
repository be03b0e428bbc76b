"""Instances: many moved, scaled and rotated copies of one solid, stored as arrays so that a million copies stay cheap.

NumPy is imported only when instances are created.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import (
    MAX_LENGTH,
    MIN_RADIUS,
    InputError,
    Key,
    Keys,
    is_number,
    number,
    point,
    set_fields,
)
from raytracer.scene.rotations import rotation_matrices
from raytracer.scene.solids.affine import Map
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.bounds import extent
from raytracer.scene.solids.flattening import leaves, with_leaves
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Primitive, Solid
from raytracer.scene.solids.sphere import Sphere

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]
else:
    Array = Any  # without NumPy; `inspect.signature` and `help` evaluate the annotations


_SCALE = "a number above 0"
# Copies are checked one by one, exactly but slowly, if their bounds are beyond this share of the largest length, or if
# their width is less than this many times the smallest. Bounds of rotated copies are coarse by less than these factors.
_NEAR_MAX, _NEAR_MIN = 0.5, 1e3


@public
class Instances(Record, frozen=True, eq=False):
    """N copies of a solid, as one object of a scene.

    Copy i maps a point p to positions[i] + R (scales[i] p), where R is the rotation rotations[i].

    Args:
        solid: the solid to copy.
        positions: where the copies put the solid's origin, at least one row. Any array-like; stored as a read-only
            float64 array [N, 3].
        scales: the sizes of the copies relative to the solid, above 0: one number for all, or one per copy. Stored as a
            read-only float64 array [N]. Default: 1.
        rotations: the rotations of the copies around the solid's origin, one per copy: quaternions w, x, y, z [N, 4] of
            any length but 0, or matrices [N, 3, 3] with the determinant 1, orthogonal within 1e-6. Any array-like;
            stored as matrices, a read-only float64 array [N, 3, 3]. A matrix that is orthogonal only to float32 is
            stored as the nearest rotation. Default: None, no rotations.

    Raises:
        InputError: a wrong value, or a copy that exceeds the limits of lengths. The message names the first
            wrong row, counted from 0: `positions[2]: expected ...`.
    """

    solid: Solid
    positions: Array
    scales: Array = 1.0  # pyright: ignore[reportAssignmentType]
    rotations: Array | None = None

    if TYPE_CHECKING:  # the arguments may have more types than the fields

        def __init__(
            self, solid: Solid, positions: ArrayLike, scales: ArrayLike = 1.0, rotations: ArrayLike | None = None
        ) -> None: ...

    def __post_init__(self) -> None:
        import numpy as np

        from raytracer.core.arrays import float_array, number_array

        if not isinstance(self.solid, Solid):
            raise InputError(f"expected a solid, got {format_value(self.solid)}", "solid")
        positions = float_array(number_array(self.positions, "positions", MAX_SURFACES, point))
        if positions.ndim != 2 or positions.shape[1] != 3 or len(positions) == 0:
            raise InputError(f"expected at least one point, as an array (N, 3), got {_shape(positions)}", "positions")
        wrong = ~(np.abs(positions) <= MAX_LENGTH).all(axis=1)
        if wrong.any():
            point(positions[wrong][0].tolist(), ("positions", int(wrong.argmax())))
        if is_number(self.scales):
            scales = np.full(len(positions), number(self.scales, "scales", expected=_SCALE))
        else:
            scales = float_array(number_array(self.scales, "scales", MAX_SURFACES, _scale))
        if scales.shape != positions.shape[:1]:
            expected = f"one number, or {len(positions)}, one per position"
            raise InputError(f"expected {expected}, got {_shape(scales)}", "scales")
        wrong = ~((scales > 0.0) & (scales < np.inf))
        if wrong.any():
            _scale(float(scales[wrong][0]), ("scales", int(wrong.argmax())))
        rotations = None if self.rotations is None else rotation_matrices(self.rotations, len(positions))
        for array in (positions, scales, rotations):
            if array is not None:
                array.setflags(write=False)
        set_fields(self, positions=positions, scales=scales, rotations=rotations)
        self._check_copies()

    def _check_copies(self) -> None:
        """Raise InputError unless all copies of all primitives are within the limits."""
        import numpy as np

        primitives = leaves(self.solid)
        if len(self) * len(primitives) > MAX_SURFACES:
            raise InputError(
                f"expected at most {MAX_SURFACES} primitives, got {len(self)} x {len(primitives)}", "positions"
            )
        with np.errstate(over="ignore"):  # an infinite number is out of bounds, too
            centers, radii = self.spheres()
            wrong = ~((radii >= MIN_RADIUS) & (radii <= MAX_LENGTH)).all(axis=1)
            if wrong.any():
                i = int(wrong.argmax())
                expected = f"radii times scale in [{MIN_RADIUS:g}, {MAX_LENGTH:g}]"
                raise InputError(f"expected {expected}, got the scale {self.scales[i]:g}", ("scales", i))
            wrong = (np.abs(centers) > MAX_LENGTH).any(axis=(1, 2))
        if wrong.any():
            raise self._beyond_limits(int(wrong.argmax()))
        self._check_near_limits([leaf for leaf in primitives if not isinstance(leaf, Sphere)])

    def _check_near_limits(self, primitives: list[Primitive]) -> None:
        """Raise InputError unless all copies of bodies and half-spaces are within the limits."""
        import numpy as np

        from raytracer.scene.solids import affine_arrays

        if not primitives:
            return
        maps = self.maps()
        near = np.zeros(len(self), bool)
        with np.errstate(all="ignore"):  # numbers that overflow, or are too small for their squares, count as near
            for leaf in primitives:
                if isinstance(leaf, Plane):
                    _, offsets = affine_arrays.map_planes(maps, np.array([leaf.normal]), np.array([leaf.offset]))
                    near |= ~(np.abs(offsets[:, 0]) <= _NEAR_MAX * MAX_LENGTH)
                    continue
                assert isinstance(leaf, Placed)
                corners = np.array(leaf.corners())
                center = corners.mean(axis=0)
                reach = np.abs(affine_arrays.apply(maps, center)).max(axis=1)
                reach += self.scales * np.linalg.norm(corners - center, axis=1).max()
                low, high = extent(leaf.support)
                narrow = self.scales * np.subtract(high, low).min()
                near |= ~((reach <= _NEAR_MAX * MAX_LENGTH) & (narrow >= _NEAR_MIN * MIN_RADIUS))
        for i in np.flatnonzero(near).tolist():
            for leaf in primitives:
                try:
                    leaf.place(_as_map(maps[i]))
                except InputError as error:
                    if isinstance(leaf, Plane):
                        raise self._beyond_limits(i) from None
                    raise InputError(f"{error.reason}, by the scale {self.scales[i]:g}", ("positions", i)) from None

    def _beyond_limits(self, i: int) -> InputError:
        """Return the error of the copy i."""
        got = f"{self.positions[i].tolist()} with the scale {self.scales[i]:g}"
        expected = f"placed centers and offsets within +-{MAX_LENGTH:g}"
        return InputError(f"expected {expected}, got {got}", ("positions", i))

    def replace(self, **changes: Any) -> Instances:
        """Return a copy with other values for some fields, which are checked as in the constructor.

        If all scales are equal, new `positions` may have another number of rows, unless there are rotations. Raises
        InputError.
        """
        if "positions" in changes and (self.scales == self.scales[0]).all():
            changes = {"scales": float(self.scales[0])} | changes
        return super().replace(**changes)

    __replace__ = replace

    def __len__(self) -> int:
        """Return N, the number of copies."""
        return len(self.positions)

    def __eq__(self, other: object) -> bool:
        import numpy as np

        return self is other or (
            isinstance(other, Instances)
            and self.solid == other.solid
            and np.array_equal(self.positions, other.positions)
            and np.array_equal(self.scales, other.scales)
            and _bytes(self.rotations) == _bytes(other.rotations)
        )

    def __hash__(self) -> int:
        return hash((self.solid, *map(_bytes, (self.positions, self.scales, self.rotations))))

    def __repr__(self) -> str:
        is_uniform = bool((self.scales == self.scales[0]).all())
        scales = float(self.scales[0]) if is_uniform else self.scales.tolist()
        suffix = "" if scales == 1.0 else f", scales={scales!r}"
        suffix += "" if self.rotations is None else f", rotations={self.rotations.tolist()!r}"
        return f"Instances(solid={self.solid!r}, positions={self.positions.tolist()!r}{suffix})"

    def maps(self) -> Array:
        """Return the maps of the copies, the rows of [R scale | position] (N, 3, 4), without negative zeros."""
        import numpy as np

        maps = np.empty((len(self), 3, 4))
        rotations = np.eye(3) if self.rotations is None else self.rotations
        maps[:, :, :3] = rotations * self.scales[:, None, None]
        maps[:, :, 3] = self.positions
        return maps

    def solids(self) -> Iterator[Solid]:
        """Yield the N copies as solids."""
        for matrix in map(_as_map, self.maps()):
            yield with_leaves(self.solid, lambda leaf, matrix=matrix: _place(leaf, matrix))

    def spheres(self) -> tuple[Array, Array]:
        """Return the centres [N, S, 3] and radii [N, S] of the S spheres of each copy, bit-identical to solids()."""
        centers, radii = sphere_arrays([leaf for leaf in leaves(self.solid) if isinstance(leaf, Sphere)])
        scales = self.scales[:, None]
        if self.rotations is None:
            return centers * scales[..., None] + self.positions[:, None], radii * scales
        from raytracer.scene.solids import affine_arrays

        maps = self.maps()
        return affine_arrays.apply(maps[:, None], centers), radii * affine_arrays.similarities(maps)[:, None]


def sphere_arrays(spheres: Sequence[Sphere]) -> tuple[Array, Array]:
    """Return the centres [N, 3] and radii [N] of spheres."""
    import numpy as np

    # This is twice as fast as converting a list of tuples.
    numbers = chain.from_iterable([sphere.center for sphere in spheres])
    return np.fromiter(numbers, np.float64).reshape(-1, 3), np.array([sphere.radius for sphere in spheres])


def _as_map(rows: Array) -> Map:
    x, y, z = map(tuple, rows.tolist())
    return x, y, z


def _place(leaf: Primitive, matrix: Map) -> Primitive:
    [moved] = leaf.place(matrix)
    assert isinstance(moved, Primitive)
    return moved


def _scale(value: Any, key: Key | Keys) -> float:
    return number(value, key, math.ulp(0.0), expected=_SCALE)


def _bytes(array: Array | None) -> bytes:
    return b"" if array is None else array.tobytes()


def _shape(array: Array) -> str:
    return f"an array of shape {array.shape}"
