"""Bodies in POV-Ray's scene language: their shapes, and the matrices of affine maps."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import raytracer as rt
from raytracer.scene.solids.affine import Map
from raytracer.scene.solids.body import Body
from raytracer.scene.solids.forms import frame

# POV-Ray's space is left-handed, so z changes its sign.
_FLIP = (1.0, 1.0, -1.0)


def vector(values: Iterable[float]) -> str:
    """Return numbers as a vector of POV-Ray, exact in float64."""
    return f"<{', '.join(f'{value:.17g}' for value in values)}>"


def point(values: Sequence[float]) -> str:
    """Return a point or a direction of our space as a vector of POV-Ray."""
    x, y, z = values
    return vector((x, y, -z))


def matrix(rows: Map) -> str:
    """Return an affine map of our space as POV-Ray's `matrix`, whose lines are the columns of [A | t]."""
    return f"matrix {vector(_FLIP[i] * rows[i][j] * (*_FLIP, 1.0)[j] for j in range(4) for i in range(3))}"


def _box(box: rt.Box) -> str:
    (x, y, z), (right, upper, front) = box.min, box.max
    return f"box {{ {vector((x, y, -front))}, {vector((right, upper, -z))} %s }}"


def _cylinder(cylinder: rt.Cylinder) -> str:
    return f"cylinder {{ {point(cylinder.base)}, {point(cylinder.top)}, {cylinder.radius:.17g} %s }}"


def _cone(cone: rt.Cone) -> str:
    base, top = (f"{point(p)}, {r:.17g}" for p, r in ((cone.base, cone.base_radius), (cone.top, cone.top_radius)))
    return f"cone {{ {base}, {top} %s }}"


def _ellipsoid(ellipsoid: rt.Ellipsoid) -> str:
    return f"sphere {{ 0, 1 %s scale {vector(ellipsoid.radii)} translate {point(ellipsoid.center)} }}"


def _torus(torus: rt.Torus) -> str:
    # The axis of POV-Ray's torus is y.
    u, v, w = frame(torus.axis)
    place = matrix(tuple((v[i], w[i], u[i], torus.center[i]) for i in range(3)))  # pyright: ignore[reportArgumentType]
    return f"torus {{ {torus.major_radius:.17g}, {torus.minor_radius:.17g} %s {place} }}"


def _polyhedron(polyhedron: rt.Polyhedron) -> str:
    sides = [(slab.normal, slab.high) for slab in polyhedron.slabs()]
    sides += [([-n for n in slab.normal], -slab.low) for slab in polyhedron.slabs()]
    planes = (f"plane {{ {point(n)}, {h / sum(c * c for c in n) ** 0.5:.17g} }}" for n, h in sides if abs(h) < 1e300)
    # Without the box, POV-Ray takes the intersection as unbounded.
    low, high = polyhedron.bounds()
    box = vector((low[0], low[1], -high[2])), vector((high[0], high[1], -low[2]))
    return f"intersection {{ {' '.join(planes)} %s bounded_by {{ box {{ {', '.join(box)} }} }} }}"


# The text of each kind of body, with %s for the texture. A kind that is not here is not available.
SHAPES: dict[type[Body], Callable[[Any], str]] = {
    rt.Box: _box,
    rt.Cylinder: _cylinder,
    rt.Cone: _cone,
    rt.Ellipsoid: _ellipsoid,
    rt.Torus: _torus,
    rt.Polyhedron: _polyhedron,
}
