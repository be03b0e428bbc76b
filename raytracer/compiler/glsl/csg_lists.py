"""The GLSL text of rayCSG() and blockedAt() where there are many primitives: by lists of what rays may meet."""

from __future__ import annotations

from raytracer.compiler.glsl.csg import BLOCKED_AT, RAY_CSG, NamedPlane, Tree, holds_of, owner


def seen(depth: int, planes: list[NamedPlane]) -> list[str]:
    """What of the objects that are no kinds the camera's rays meet first: by lists, see lists.glsl.

    `depth` is that of the deepest program that may be no chain (0: all are chains), `planes` are the objects that
    are one half-space.
    """
    return [
        '#include "csg/walk.glsl"',
        '#include "csg/lists.glsl"',
        "#define OWNERS",
        '#include "csg/chain.glsl"',
        *(_programs(depth, with_owner=True) if depth else []),
        *_meet(kinds=False, programs=True, trees=bool(depth), any_hit=False),
        "flat in ivec2 listed;  // where the list of this pixel's cell begins and ends",
        *RAY_CSG,
        *_nearest_plane(planes),
        "    meetListed(ray, listed.x, listed.y, nearest);",
        *_AT_NEAREST,
    ]


_OTHER_DRAWN = [
    "uniform sampler2D others;",
    "Nearest otherAt(Ray ray) {",
    "    vec2 other = texelFetch(others, ivec2(gl_FragCoord.xy), 0).xy;",
    "    Nearest nearest = Nearest(other.x, 0, int(other.y));",
]


def seen_kinds(kinds: list[Tree], planes: list[NamedPlane] | None, handed: int) -> list[str]:
    """Where the camera's rays meet the object of a kind that the vertex shader (kinds.vert) hands on, with the first
    `handed` of its surfaces.

    All others are `planes`; or, for None, what they are was drawn before.
    """
    spans = _spans(kinds)
    arguments = ", ".join(spans)
    return [
        '#include "csg/walk.glsl"',
        '#include "csg/lists.glsl"',
        "flat in int kind;",
        "flat in int first;  // index of its first surface",
        *(f"flat in Surface sphere{j};" for j in range(handed)),
        *_kind_holds(kinds),
        *_kind_owner(kinds),
        "// What else the ray meets.",
        *(_OTHER_DRAWN if planes is None else ["Nearest otherAt(Ray ray) {", *_nearest_plane(planes)]),
        "    return nearest;",
        "}",
        *RAY_CSG,
        "    P = N = real3(0.0);",
        "    mat = 0;",
        *(f"    Surface sphere{j} = surfaceOf(first + {j});" for j in range(handed, len(spans))),
        *(f"    real2 {span} = sphereRoots(ray, sphere{j});" for j, span in enumerate(spans)),
        *_to_change(f"kindHolds(kind, {arguments}, at)", "if (next >= ray.distance) return ray.distance;"),
        f"    mat = kindOwner(kind, first, {arguments}, at);",
        "    pointAt(mat, ray, P, N);",
        "    return at;",
        "}",
    ]


def blocked(
    kinds: list[Tree],
    programs: bool,
    depth: int,
    planes: list[NamedPlane],
    *,
    any_hit: bool,
    with_owner: bool,
    has_area_lights: bool,
) -> list[str]:
    """How far rays to a light get, by lists. With `any_hit`, whatever blocks them will do, not the nearest; with
    `with_owner` meetListed() says what it is, for anywhere(). Cells list what a ray to a light may meet as far as
    rays are known to within the balls' widening(); longer ones look at everything.

    `kinds` are trees over their own leaves, `programs` is whether there are any, and else as seen(). With
    `has_area_lights`, rays may end beside a light's centre, and the cell is the one in which their origin is seen from
    there.
    """
    origin = "ray.ro - lights[light].position" if has_area_lights else "-ray.rd"
    return [
        '#include "csg/walk.glsl"',
        '#include "csg/lists.glsl"',
        *(_kinds(kinds, with_owner) if kinds else []),
        *(["#define OWNERS"] if with_owner else []),
        *(['#include "csg/chain.glsl"'] if programs else []),
        *(_programs(depth, with_owner=with_owner) if depth else []),
        *(
            _meet(bool(kinds), programs, bool(depth), any_hit)
            if kinds or programs
            else ["#define meetListed(a, b, c, d)"]
        ),
        "uniform ivec2 everything;  // where the list of all objects begins and ends",
        *BLOCKED_AT,
        *_nearest_plane(planes),
        f"    int cell = light * (6 * grid * grid) + cubeCell(vec3({origin}));",
        "    float reach = intBitsToFloat(endsAt(LIGHTS * (6 * grid * grid) + light).x);",
        "    ivec2 listed = ray.distance > reach ? everything : endsAt(cell);",
        "    meetListed(ray, listed.x, listed.y, nearest);",
        "    return nearest.t;",
        "}",
    ]


def anywhere(planes: list[NamedPlane]) -> list[str]:
    """What a ray from anywhere meets first: it may be anything. After blocked()."""
    return [
        *RAY_CSG,
        *_nearest_plane(planes),
        "    meetListed(ray, everything.x, everything.y, nearest);",
        *_AT_NEAREST,
    ]


_AT_NEAREST = [
    "    P = ray.ro + nearest.t * ray.rd;",
    "    N = real3(0.0);",
    "    mat = nearest.mat;",
    "    if (mat != 0) pointAt(mat, ray, P, N);",
    "    return nearest.t;",
    "}",
]


def _nearest_plane(planes: list[NamedPlane]) -> list[str]:
    lines = ["    Nearest nearest = Nearest(ray.distance, 0, -1), found;"]
    for s, index in planes:
        found = f"Nearest(planeRoot(ray, {s}), planeMat(ray, {s}, {index}), planeObject({s}))"
        lines += [
            f"    found = {found};",
            "    if (found.t > 0.0 && nearer(found.t, found.object, nearest)) nearest = found;",
        ]
    return lines


def _to_change(holds: str, end: str) -> list[str]:
    """The walk along one object to `at`, where it changes; `end` leaves it where `next` is too far."""
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


def _walk_one(holds: str, owner: str) -> list[str]:
    """The walk along one object, to where it changes, if that is nearer than `nearest`."""
    return [
        *_to_change(holds, "if (!nearer(next, object, nearest)) return;"),
        f"    nearest = Nearest(at, {owner}, object);",
        "}",
    ]


def most_leaves(kinds: list[Tree]) -> int:
    """How many leaves the largest of these trees has."""
    return max(sum(isinstance(node, int) for node in tree) for tree in kinds)


def _spans(kinds: list[Tree]) -> list[str]:
    return [f"s{j}" for j in range(most_leaves(kinds))]


def _kind_holds(kinds: list[Tree]) -> list[str]:
    parameters = ", ".join(f"real2 {span}" for span in _spans(kinds))
    holds = [holds_of(tree, "holds(s{}, at)") for tree in kinds]
    choice = "".join(f"kind == {k} ? {text} : " for k, text in enumerate(holds[:-1])) + holds[-1]
    return [f"real kindHolds(int kind, {parameters}, real at) {{", f"    return {choice};", "}"]


def _kind_owner(kinds: list[Tree]) -> list[str]:
    parameters = ", ".join(f"real2 {span}" for span in _spans(kinds))
    lines = [f"int kindOwner(int kind, int first, {parameters}, real at) {{", "    int mat = 0;"]
    for k, tree in enumerate(kinds):
        lines += [f"    if (kind == {k}) {{", *(f"    {line}" for line in owner([tree], "first + ")), "    }"]
    return [*lines, "    return mat;", "}"]


def _kinds(kinds: list[Tree], with_owner: bool) -> list[str]:
    spans = _spans(kinds)
    return [
        *_kind_holds(kinds),
        *(_kind_owner(kinds) if with_owner else []),
        "void meetKind(Ray ray, int item, inout Nearest nearest) {",
        "    Item i = itemAt(item);",
        "    int object = i.object;",
        *(f"    real2 {span} = sphereRoots(ray, surfaceOf(i, {j}));" for j, span in enumerate(spans)),
        *_walk_one(
            f"kindHolds(i.kind, {', '.join(spans)}, at)",
            f"kindOwner(i.kind, i.first, {', '.join(spans)}, at)" if with_owner else "1",
        ),
    ]


def _programs(depth: int, with_owner: bool) -> list[str]:
    """The machine's stack is as many variables as the deepest program needs: one more is on its way to the top."""
    return [
        '#include "csg/program.glsl"',
        *_machine("real", "Holds", max(depth - 1, 1)),
        *(_machine("int", "Owner", max(depth - 1, 1)) if with_owner else []),
        "void meetProgram(Ray ray, int begin, int end, int object, inout Nearest nearest) {",
        *_walk_one(
            "programHolds(ray, begin, end, at)", "programOwner(ray, begin, end, at) >> 2" if with_owner else "1"
        ),
    ]


def _machine(kind: str, name: str, slots: int) -> list[str]:
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


def _meet(kinds: bool, programs: bool, trees: bool, any_hit: bool) -> list[str]:
    """The walk through a list. The nearest ball is looked for in a loop of its own: pixels that are drawn
    together look for theirs at once, and then evaluate what they found at once."""
    candidate = (
        "entry < 0 || meets(ray, ballAt(entry), nearest.t)" if programs else "meets(ray, ballAt(entry), nearest.t)"
    )
    search = [
        "        int found = NOTHING;",
        "        while (k < end) {",
        "            int entry = listAt(k);",
        "            k++;",
        f"            if ({candidate}) {{",
        "                found = entry;",
        "                break;",
        "            }",
        "        }",
        "        if (found == NOTHING) break;",
    ]
    if not kinds:
        search = ["        if (k >= end) break;", "        int found = listAt(k);", "        k++;"]
    call = "meet{}(ray, k + 1, k - found, listAt(k), nearest);"
    program = [
        *([f"if ((listAt(k + 1) & 7) == PUSH) {call.format('Program')}", "else"] if trees else []),
        call.format("Chain"),
        "k -= found;",
    ]
    if not (kinds or programs):  # half-spaces alone
        return ["void meetListed(Ray ray, int begin, int end, inout Nearest nearest) {}"]
    if kinds and programs:
        body = [
            "if (found >= 0) {",
            "    meetKind(ray, found, nearest);",
            "} else {",
            *(f"    {line}" for line in program),
            "}",
        ]
    else:
        body = ["meetKind(ray, found, nearest);"] if kinds else program
    return [
        "void meetListed(Ray ray, int begin, int end, inout Nearest nearest) {",
        "    const int NOTHING = 0x7fffffff;",
        "    int k = begin;",
        "    for (;;) {",
        *(["        if (nearest.mat != 0) break;"] if any_hit else []),
        *search,
        *(f"        {line}" for line in body),
        "    }",
        "}",
    ]
