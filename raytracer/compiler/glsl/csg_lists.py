"""Generates the GLSL text of rayCSG() and blockedAt() for scenes of many primitives, with candidate lists."""

from __future__ import annotations

from raytracer.compiler.glsl.csg import BLOCKED_AT, POINT_AT, RAY_CSG, NamedPlane, Tree, hold_expression, owner_text


def camera_query_text(depth: int, grids: bool, planes: list[NamedPlane]) -> list[str]:
    """Generate rayCSG() for camera rays against programs and single half-spaces, with the lists of lists.glsl.

    `depth` is the largest stack depth of a program that is no chain; 0 if all are chains. `grids`: whether there are
    long chains. `planes` are the single half-spaces.
    """
    return [
        '#include "csg/walk.glsl"',
        '#include "csg/lists.glsl"',
        "#define OWNERS",
        '#include "csg/chain.glsl"',
        *(['#include "csg/grid.glsl"'] if grids else []),
        *(_programs(depth, with_owner=True) if depth else []),
        *_meet_list_function(shapes=False, programs=True, trees=bool(depth), grids=grids, any_hit=False),
        "flat in ivec2 cellList;  // where the candidate list of this pixel's cell begins and ends",
        *RAY_CSG,
        *_nearest_plane(planes),
        "    meetList(ray, cellList.x, cellList.y, nearest);",
        *_AT_NEAREST,
    ]


_OTHERS_FROM_TEXTURE = [
    "uniform sampler2D others;",
    "Nearest otherAt(Ray ray) {",
    "    vec2 other = texelFetch(others, ivec2(gl_FragCoord.xy), 0).xy;",
    "    Nearest nearest = Nearest(other.x, 0, int(other.y));",
]


def shapes_query_text(shapes: list[Tree], planes: list[NamedPlane] | None, handed: int) -> list[str]:
    """Generate rayCSG() for camera rays against one object of a common shape, and otherAt() for all other objects.

    Args:
        shapes: The trees of the common shapes.
        planes: The single half-spaces, if there are no other objects; None if an earlier draw found the other objects.
        handed: The number of the object's surfaces that the vertex shader (shapes.vert) hands on.
    """
    spans = _spans(shapes)
    arguments = ", ".join(spans)
    return [
        '#include "csg/walk.glsl"',
        '#include "csg/lists.glsl"',
        "flat in int shape;",
        "flat in int first;  // index of its first surface",
        *(f"flat in Surface sphere{j};" for j in range(handed)),
        *_shape_holds(shapes),
        *_shape_owner(shapes),
        "// The first surface of the other objects.",
        *(_OTHERS_FROM_TEXTURE if planes is None else ["Nearest otherAt(Ray ray) {", *_nearest_plane(planes)]),
        "    return nearest;",
        "}",
        *RAY_CSG,
        "    P = N = real3(0.0);",
        "    mat = 0;",
        *(f"    Surface sphere{j} = surfaceOf(first + {j});" for j in range(handed, len(spans))),
        *(f"    real2 {span} = sphereRoots(ray, sphere{j});" for j, span in enumerate(spans)),
        *_walk_to_change(f"shapeHolds(shape, {arguments}, at)", "if (next >= ray.distance) return ray.distance;"),
        f"    mat = shapeOwner(shape, first, {arguments}, at);",
        *POINT_AT,
        "    return at;",
        "}",
    ]


def shadow_query_text(
    shapes: list[Tree],
    programs: bool,
    depth: int,
    grids: bool,
    planes: list[NamedPlane],
    *,
    any_hit: bool,
    with_owner: bool,
    has_area_lights: bool,
) -> list[str]:
    """Generate blockedAt() for rays to a light, with the lists of the cells around the light.

    A cell lists every object that a ray to the light may meet, up to the length for which the balls' ball_growth()
    holds; longer rays test the list of all objects.

    Args:
        shapes: The trees of the common shapes.
        programs: Whether there are programs.
        depth: The largest stack depth of a program that is no chain; 0 if all are chains.
        grids: Whether there are long chains.
        planes: The single half-spaces.
        any_hit: Whether any blocking surface serves, not only the nearest one.
        with_owner: Whether meetList() also finds the surface's owner, for mirror_query_text().
        has_area_lights: Whether rays may end beside a light's centre. The cell is then the one of the ray's origin, as
            seen from the centre.
    """
    direction, length = (
        ("vec3(ray.ro - lights[light].position)", "length(D)") if has_area_lights else ("vec3(-ray.rd)", "1.0")
    )
    return [
        '#include "csg/walk.glsl"',
        '#include "csg/lists.glsl"',
        *(_meet_shape(shapes, with_owner) if shapes else []),
        *(["#define OWNERS"] if with_owner else []),
        *(['#include "csg/chain.glsl"'] if programs else []),
        *(['#include "csg/grid.glsl"'] if grids else []),
        *(_programs(depth, with_owner=with_owner) if depth else []),
        *(
            _meet_list_function(bool(shapes), programs, bool(depth), grids, any_hit)
            if shapes or programs
            else ["#define meetList(a, b, c, d)"]
        ),
        "uniform ivec2 everything;  // where the candidate list of all objects begins and ends",
        *BLOCKED_AT,
        *_nearest_plane(planes),
        f"    vec3 D = {direction};",
        f"    int cell = LIGHTS + light * (2 * grid * grid) + hemisphereCell(D, {length});",
        "    ivec2 ofLight = endsAt(light);",
        "    bool isFar = ray.distance > intBitsToFloat(ofLight.x);",
        "    ivec2 cellList = isFar ? everything : endsAt(cell) + ofLight.y;",
        "    meetList(ray, cellList.x, cellList.y, nearest);",
        "    return nearest.t;",
        "}",
    ]


def mirror_query_text(planes: list[NamedPlane]) -> list[str]:
    """Generate rayCSG() for rays from any origin. It needs the text of shadow_query_text() `with_owner` before it."""
    return [
        *RAY_CSG,
        *_nearest_plane(planes),
        "    meetList(ray, everything.x, everything.y, nearest);",
        *_AT_NEAREST,
    ]


_AT_NEAREST = [
    "    P = ray.ro + nearest.t * ray.rd;",
    "    N = real3(0.0);",
    "    mat = nearest.mat;",
    "    if (mat == 0) return nearest.t;",
    *POINT_AT,
    "    return nearest.t;",
    "}",
]


def _nearest_plane(planes: list[NamedPlane]) -> list[str]:
    """Generate the lines that set `nearest` to the nearest of the single half-spaces, or to the ray's end."""
    lines = ["    Nearest nearest = Nearest(ray.distance, 0, -1), plane;"]
    for s, index in planes:
        plane = f"Nearest(planeRoot(ray, {s}), planeMat(ray, {s}, {index}), planeObject({s}))"
        lines += [
            f"    plane = {plane};",
            "    if (plane.t > 0.0 && nearer(plane.t, plane.object, nearest)) nearest = plane;",
        ]
    return lines


def _walk_to_change(holds: str, end: str) -> list[str]:
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


def _walk_object(holds: str, owner: str) -> list[str]:
    """Generate the walk along one object, which sets `nearest` if the object's first surface is nearer."""
    return [
        *_walk_to_change(holds, "if (!nearer(next, object, nearest)) return;"),
        f"    nearest = Nearest(at, {owner}, object);",
        "}",
    ]


def most_leaves(shapes: list[Tree]) -> int:
    """Return the number of leaves of the largest tree."""
    return max(sum(isinstance(node, int) for node in tree) for tree in shapes)


def _spans(shapes: list[Tree]) -> list[str]:
    """Return the names of the spans of a shape's leaves, s0, s1, ..."""
    return [f"s{j}" for j in range(most_leaves(shapes))]


def _shape_holds(shapes: list[Tree]) -> list[str]:
    """Generate shapeHolds(): the distance up to which a shape's value at `at` holds."""
    parameters = ", ".join(f"real2 {span}" for span in _spans(shapes))
    holds = [hold_expression(tree, "holds(s{}, at)") for tree in shapes]
    choice = "".join(f"shape == {k} ? {text} : " for k, text in enumerate(holds[:-1])) + holds[-1]
    return [f"real shapeHolds(int shape, {parameters}, real at) {{", f"    return {choice};", "}"]


def _shape_owner(shapes: list[Tree]) -> list[str]:
    """Generate shapeOwner(): the surface of a shape at `at`."""
    parameters = ", ".join(f"real2 {span}" for span in _spans(shapes))
    lines = [f"int shapeOwner(int shape, int first, {parameters}, real at) {{", "    int mat = 0;"]
    for k, tree in enumerate(shapes):
        lines += [f"    if (shape == {k}) {{", *(f"    {line}" for line in owner_text([tree], "first + ")), "    }"]
    return [*lines, "    return mat;", "}"]


def _meet_shape(shapes: list[Tree], with_owner: bool) -> list[str]:
    """Generate meetShape(): set `nearest` if an object of a common shape is nearer."""
    spans = _spans(shapes)
    return [
        *_shape_holds(shapes),
        *(_shape_owner(shapes) if with_owner else []),
        "void meetShape(Ray ray, int item, inout Nearest nearest) {",
        "    Item i = itemAt(item);",
        "    int object = i.object;",
        *(f"    real2 {span} = sphereRoots(ray, surfaceOf(i, {j}));" for j, span in enumerate(spans)),
        *_walk_object(
            f"shapeHolds(i.shape, {', '.join(spans)}, at)",
            f"shapeOwner(i.shape, i.first, {', '.join(spans)}, at)" if with_owner else "1",
        ),
    ]


def _programs(depth: int, with_owner: bool) -> list[str]:
    """Generate meetProgram() and its stack machines. The stack is variables, depth - 1 of them (at least one)."""
    return [
        '#include "csg/program.glsl"',
        *_machine("real", "Holds", max(depth - 1, 1)),
        *(_machine("int", "Owner", max(depth - 1, 1)) if with_owner else []),
        "void meetProgram(Ray ray, int begin, int end, int object, inout Nearest nearest) {",
        *_walk_object(
            "programHolds(ray, begin, end, at)", "programOwner(ray, begin, end, at) >> 2" if with_owner else "1"
        ),
    ]


def _machine(kind: str, name: str, slots: int) -> list[str]:
    """Generate a stack machine for values of the type `kind`, with `slots` variables as its stack."""
    zero = "0.0" if kind == "real" else "0"
    push = [f"v{j} = v{j - 1};" for j in range(slots - 1, 0, -1)]
    pop = [f"v{j} = v{j + 1};" for j in range(1, slots - 1)]
    return [
        f"{kind} program{name}(Ray ray, int begin, int end, real at) {{",
        f"    {kind} {', '.join(f'v{j} = {zero}' for j in range(slots))};",
        "    for (int k = begin; k < end; k++) {",
        "        int code = listAt(k), operation = code & 7;",
        "        bool pushes = operation == PUSH, pops = operation == AND || operation == OR;",
        f"        {kind} leaf = leaf{name}(ray, code, at);",
        f"        {kind} a = pops ? v{min(1, slots - 1)} : v0, b = pops ? v0 : leaf;",
        f"        {kind} joined = joined{name}(code, a, b);",
        *([f"        if (pushes) {{ {' '.join(push)} }}"] if push else []),
        *([f"        if (pops) {{ {' '.join(pop)} }}"] if pop else []),
        "        v0 = pushes ? leaf : joined;",
        "    }",
        "    return v0;",
        "}",
    ]


def _meet_list_function(shapes: bool, programs: bool, trees: bool, grids: bool, any_hit: bool) -> list[str]:
    """Generate meetList(): the walk through a candidate list.

    An inner loop searches for the next ball that the ray meets. So pixels that are drawn together search together, and
    then evaluate their objects together.
    """
    candidate = (
        "entry < 0 || meets(ray, ballAt(entry), nearest.t)" if programs else "meets(ray, ballAt(entry), nearest.t)"
    )
    search = [
        "        int candidate = NOTHING;",
        "        while (k < end) {",
        "            int entry = listAt(k);",
        "            k++;",
        f"            if ({candidate}) {{",
        "                candidate = entry;",
        "                break;",
        "            }",
        "        }",
        "        if (candidate == NOTHING) break;",
    ]
    if not shapes:
        search = ["        if (k >= end) break;", "        int candidate = listAt(k);", "        k++;"]
    call = "meet{}(ray, k + 1, k - candidate, listAt(k), nearest);"
    grid = "meetGrid(ray, listAt(k + 1) >> 5, listAt(k), nearest);"
    program = [
        *([f"if ((listAt(k + 1) & 7) == PUSH) {call.format('Program')}", "else"] if trees else []),
        *([f"if ((listAt(k + 1) & 7) == GRID) {grid}", "else"] if grids else []),
        call.format("Chain"),
        "k -= candidate;",
    ]
    if not (shapes or programs):  # only half-spaces
        return ["void meetList(Ray ray, int begin, int end, inout Nearest nearest) {}"]
    if shapes and programs:
        body = [
            "if (candidate >= 0) {",
            "    meetShape(ray, candidate, nearest);",
            "} else {",
            *(f"    {line}" for line in program),
            "}",
        ]
    else:
        body = ["meetShape(ray, candidate, nearest);"] if shapes else program
    return [
        "void meetList(Ray ray, int begin, int end, inout Nearest nearest) {",
        "    const int NOTHING = 0x7fffffff;",
        "    int k = begin;",
        "    for (;;) {",
        *(["        if (nearest.mat != 0) break;"] if any_hit else []),
        *search,
        *(f"        {line}" for line in body),
        "    }",
        "}",
    ]
