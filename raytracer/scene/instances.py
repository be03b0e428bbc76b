"""Instances: many moved and scaled copies of one solid, stored as arrays so that a million copies stay cheap.

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
    Vec3,
    is_number,
    number,
    point,
    set_fields,
)
from raytracer.core.vectors import add, dot, scale_by
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


@public
class Instances(Record, frozen=True, eq=False):
    """N copies of a solid, as one object of a scene. Copy i maps a point p to positions[i] + scales[i] p.

    Args:
        solid: the solid to copy.
        positions: where the copies put the solid's origin, at least one row. Any array-like; stored as a read-only
            float64 array [N, 3].
        scales: the sizes of the copies relative to the solid, above 0: one number for all, or one per copy. Stored as a
            read-only float64 array [N]. Default: 1.

    Raises:
        InputError: a wrong value, or a copy that exceeds the limits of Sphere and Plane. The message names the first
            wrong row, counted from 0: `positions[2]: expected ...`.
    """

    solid: Solid
    positions: Array
    scales: Array = 1.0  # pyright: ignore[reportAssignmentType]

    if TYPE_CHECKING:  # the arguments may have more types than the fields

        def __init__(self, solid: Solid, positions: ArrayLike, scales: ArrayLike = 1.0) -> None: ...

    def __post_init__(self) -> None:
        import numpy as np

        from raytracer.core.arrays import number_array

        if not isinstance(self.solid, Solid):
            raise InputError(f"expected a solid, got {format_value(self.solid)}", "solid")
        positions = _float_array(number_array(self.positions, "positions", MAX_SURFACES, point))
        if positions.ndim != 2 or positions.shape[1] != 3 or len(positions) == 0:
            raise InputError(f"expected at least one point, as an array (N, 3), got {_shape(positions)}", "positions")
        wrong = ~(np.abs(positions) <= MAX_LENGTH).all(axis=1)
        if wrong.any():
            point(positions[wrong][0].tolist(), ("positions", int(wrong.argmax())))
        if is_number(self.scales):
            scales = np.full(len(positions), number(self.scales, "scales", expected=_SCALE))
        else:
            scales = _float_array(number_array(self.scales, "scales", MAX_SURFACES, _scale))
        if scales.shape != positions.shape[:1]:
            expected = f"one number, or {len(positions)}, one per position"
            raise InputError(f"expected {expected}, got {_shape(scales)}", "scales")
        wrong = ~((scales > 0.0) & (scales < np.inf))
        if wrong.any():
            _scale(float(scales[wrong][0]), ("scales", int(wrong.argmax())))
        for array in (positions, scales):
            array.setflags(write=False)
        set_fields(self, positions=positions, scales=scales)
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
            for plane in (leaf for leaf in primitives if isinstance(leaf, Plane)):
                x, y, z = (n * p for n, p in zip(plane.normal, self.positions.T, strict=True))
                offsets = plane.offset * self.scales + (x + y + z)
                length = min(1.0, float(np.linalg.norm(plane.normal)))
                wrong |= np.abs(offsets) > MAX_LENGTH * length
        if wrong.any():
            i = int(wrong.argmax())
            expected = f"placed centers and offsets within +-{MAX_LENGTH:g}"
            got = f"{self.positions[i].tolist()} with the scale {self.scales[i]:g}"
            raise InputError(f"expected {expected}, got {got}", ("positions", i))

    def replace(self, **changes: Any) -> Instances:
        """Return a copy with other values for some fields, which are checked as in the constructor.

        If all scales are equal, new `positions` may have another number of rows. Raises InputError.
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
        )

    def __hash__(self) -> int:
        return hash((self.solid, self.positions.tobytes(), self.scales.tobytes()))

    def __repr__(self) -> str:
        is_uniform = bool((self.scales == self.scales[0]).all())
        scales = float(self.scales[0]) if is_uniform else self.scales.tolist()
        suffix = "" if scales == 1.0 else f", scales={scales!r}"
        return f"Instances(solid={self.solid!r}, positions={self.positions.tolist()!r}{suffix})"

    def solids(self) -> Iterator[Solid]:
        """Yield the N copies as solids."""
        for position, scale in zip(self.positions.tolist(), self.scales.tolist(), strict=True):
            yield with_leaves(self.solid, lambda leaf, p=position, s=scale: _place(leaf, p, s))

    def spheres(self) -> tuple[Array, Array]:
        """Return the centres [N, S, 3] and radii [N, S] of the S spheres of each copy, bit-identical to solids()."""
        centers, radii = sphere_arrays([leaf for leaf in leaves(self.solid) if isinstance(leaf, Sphere)])
        scales = self.scales[:, None]
        return centers * scales[..., None] + self.positions[:, None], radii * scales


def sphere_arrays(spheres: Sequence[Sphere]) -> tuple[Array, Array]:
    """Return the centres [N, 3] and radii [N] of spheres."""
    import numpy as np

    # This is twice as fast as converting a list of tuples.
    numbers = chain.from_iterable([sphere.center for sphere in spheres])
    return np.fromiter(numbers, np.float64).reshape(-1, 3), np.array([sphere.radius for sphere in spheres])


def _place(leaf: Primitive, position: Vec3, scale: float) -> Primitive:
    if isinstance(leaf, Sphere):
        return Sphere(add(scale_by(leaf.center, scale), position), leaf.radius * scale, leaf.material)
    if isinstance(leaf, Plane):
        return Plane(leaf.normal, leaf.offset * scale + dot(leaf.normal, position), leaf.material)
    x, y, z = position
    [moved] = leaf.place(((scale, 0.0, 0.0, x), (0.0, scale, 0.0, y), (0.0, 0.0, scale, z)))
    assert isinstance(moved, Primitive)
    return moved


def _scale(value: Any, key: Key | Keys) -> float:
    return number(value, key, math.ulp(0.0), expected=_SCALE)


def _float_array(array: NDArray[Any]) -> Array:
    """Copy an array to float64, with -0 replaced by 0, so that equal arrays have equal bytes and equal hashes."""
    import numpy as np

    with np.errstate(over="ignore"):  # numbers beyond float64 become infinite, which is out of bounds
        return np.asarray(array, np.float64, order="C") + 0.0


def _shape(array: Array) -> str:
    return f"an array of shape {array.shape}"
