"""Generates the GLSL text of rayCSG() and blockedAt() for scenes of many primitives, with candidate lists."""

from __future__ import annotations

from collections.abc import Sequence

from raytracer.compiler.batches import ShapeBatch
from raytracer.compiler.glsl.body_slots import Slot
from raytracer.compiler.glsl.csg import BLOCKED_AT, POINT_AT, RAY_CSG, NamedPlane
from raytracer.compiler.glsl.csg_shapes import meet_shape_text
from raytracer.compiler.glsl.list_walks import nearest_plane_lines, walk_object


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
        *nearest_plane_lines(planes),
        "    meetList(ray, cellList.x, cellList.y, nearest);",
        *_AT_NEAREST,
    ]


def shadow_query_text(
    shapes: Sequence[ShapeBatch],
    slots: Sequence[Slot],
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
        shapes: The common shapes.
        slots: The structure of their bodies.
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
        *(meet_shape_text(shapes, slots, with_owner) if shapes else []),
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
        *nearest_plane_lines(planes),
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
        *nearest_plane_lines(planes),
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


def _programs(depth: int, with_owner: bool) -> list[str]:
    """Generate meetProgram() and its stack machines. The stack is variables, depth - 1 of them (at least one)."""
    return [
        '#include "csg/program.glsl"',
        *_machine("real", "Holds", max(depth - 1, 1)),
        *(_machine("int", "Owner", max(depth - 1, 1)) if with_owner else []),
        "void meetProgram(Ray ray, int begin, int end, int object, inout Nearest nearest) {",
        *walk_object(
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

    nextEntry() searches for the next ball that the ray meets. So pixels that are drawn together search together, and
    then evaluate their objects together. The loop tests for the end last, because llvmpipe computes one more round of a
    loop that tests for it first.
    """
    if not (shapes or programs):  # only half-spaces
        return ["void meetList(Ray ray, int begin, int end, inout Nearest nearest) {}"]
    meets = "entry < 0 || meets(ray, ballAt(entry), before)" if programs else "meets(ray, ballAt(entry), before)"
    call = "meet{}(ray, k + 1, k - candidate, listAt(k), nearest);"
    grid = "meetGrid(ray, listAt(k + 1) >> 5, listAt(k), nearest);"
    program = [
        *([f"if ((listAt(k + 1) & 7) == PUSH) {call.format('Program')}", "else"] if trees else []),
        *([f"if ((listAt(k + 1) & 7) == GRID) {grid}", "else"] if grids else []),
        call.format("Chain"),
        "k -= candidate;",
    ]
    search = "nextEntry(ray, k, end, nearest.t)"
    search = f"nearest.mat != 0 ? NOTHING : {search}" if any_hit else search
    return [
        "const int NOTHING = 0x7fffffff;",
        "// The next entry of a list that the ray may meet before a distance, from the entry k on.",
        "int nextEntry(Ray ray, inout int k, int end, real before) {",
        "    while (k < end) {",
        "        int entry = listAt(k);",
        "        k++;",
        f"        if ({meets if shapes else 'true'}) return entry;",
        "    }",
        "    return NOTHING;",
        "}",
        "void meetList(Ray ray, int begin, int end, inout Nearest nearest) {",
        "    int k = begin;",
        f"    int candidate = {search};",
        "    do {",
        *(
            ["        if (candidate >= 0 && candidate != NOTHING) meetShape(ray, candidate, nearest);"]
            if shapes
            else []
        ),
        *(
            ["        if (candidate < 0) {", *(f"            {line}" for line in program), "        }"]
            if programs
            else []
        ),
        f"        candidate = {search};",
        "    } while (candidate != NOTHING);",
        "}",
    ]
