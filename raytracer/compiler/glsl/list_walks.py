"""Lines of GLSL that the texts for candidate lists share: the nearest half-space, and the walk along one object."""

from __future__ import annotations

from raytracer.compiler.glsl.csg import NamedPlane


def nearest_plane_lines(planes: list[NamedPlane]) -> list[str]:
    """Generate the lines that set `nearest` to the nearest of the single half-spaces, or to the ray's end."""
    lines = ["    Nearest nearest = Nearest(ray.distance, 0, -1), plane;"]
    for s, index in planes:
        plane = f"Nearest(planeRoot(ray, {s}), planeMat(ray, {s}, {index}), planeObject({s}))"
        lines += [
            f"    plane = {plane};",
            "    if (plane.t > 0.0 && nearer(plane.t, plane.object, nearest)) nearest = plane;",
        ]
    return lines


def walk_to_change(holds: str, end: str) -> list[str]:
    """Generate the walk along one object to `at`, where its value changes. `end` leaves the walk if `next` is too
    far."""
    return [
        "    real at = 0.0;",
        "    bool inside = false;",
        "    for (;;) {",
        f"        real holding = {holds};",
        "        if (at > 0.0 && (holding > 0.0) != inside) break;",
        "        real next = abs(holding);",
        f"        {end}",
        "        inside = holding > 0.0;",
        "        at = next;",
        "    }",
    ]


def walk_object(holds: str, owner: str) -> list[str]:
    """Generate the walk along one object, which sets `nearest` if the object's first surface is nearer."""
    return [
        *walk_to_change(holds, "if (!nearer(next, object, nearest)) return;"),
        f"    nearest = Nearest(at, {owner}, object);",
        "}",
    ]
