"""Generates the GLSL text of rayCSG() and blockedAt(): the first surface of CSG trees that a ray meets.

Trees are postfix lists with surface indices instead of leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from raytracer.scene.solids.solid import Complement, Difference, Intersection, Solid, Union

Tree = list[Solid | int]
# The most surfaces whose roots a walk computes by written-out code, which is fastest. For more it uses a loop, _AT_ONCE
# surfaces in each round. For 200 surfaces the loop compiles in a third of the time, and with 64 bits in an eighth.
FEW_SPANS, _AT_ONCE = 12, 8
NamedPlane = tuple[str, str]  # the expressions for a half-space, and for its index
LeafText = tuple[str, str]  # the expressions for the roots of a leaf, and for its surface's index + 1

RAY_CSG = [
    "// The first surface ahead of the ray's origin and before its end: its distance, point, unit normal (on either",
    "// side) and `mat` (surfaces.glsl). Without one: the ray's distance, the point there, 0 and 0.",
    "real rayCSG(Ray ray, out real3 P, out real3 N, out int mat) {",
]
POINT_AT = ["    Contact on;", "    bool isFlat;", "    pointAt(mat, ray, P, on, isFlat);", "    N = on.n;"]
BLOCKED_AT = [
    "// The distance to the first surface on a ray to a light, or to the ray's end.",
    "real blockedAt(Ray ray, int light) {",
]


class Ranges(NamedTuple):
    """The order of surfaces' indices: spheres first, then bodies, then planes."""

    spheres: int  # the number of spheres, which is the index of the first body
    bounded: int  # the index of the first plane
    size: int

    def kind(self, index: int) -> str:
        """Return the kind of a surface, as in the names of GLSL functions."""
        return "sphere" if index < self.spheres else "body" if index < self.bounded else "plane"


def _roots(index: int, ranges: Ranges, surface: str) -> str:
    """Return the call that computes both roots of a surface."""
    return f"{ranges.kind(index)}Roots(ray, {surface})"


_BODY_NORMAL = [
    "    if (mat != 0 && !isPlane(mat) && isBody(hitSurface(mat))) {",
    *(f"    {line}" for line in POINT_AT),
    "    }",
]


def roth_text(trees: list[Tree], ranges: Ranges, surfaces: Mapping[int, str]) -> list[str]:
    """Generate the evaluator `roth`: a function of the assignment's filters for each object, and the nearest first hit.

    `surfaces` has the GLSL expression for each surface.
    """
    lines = []
    for number, tree in enumerate(trees):
        lines += [f"Roth object{number}(Ray ray) {{"]
        stack: list[int] = []
        for k, node in enumerate(tree):
            if isinstance(node, int):
                s = surfaces[node]
                ends = f"sameAs({s}), {node + 1}"
                if ranges.kind(node) == "body":
                    value = f"rayBody(bodySpans[{node - ranges.spheres}], {node + 1})"
                elif ranges.kind(node) == "sphere":
                    value = f"raySphere(ray, {s}.shape, sphereTerms(ray, {s}), {ends})"
                else:
                    value = f"rayPlane(ray, {s}.shape, planeSlope(ray, {s}), {ends})"
            elif isinstance(node, Complement):
                value = f"complementCSG(r{stack.pop()})"
            else:
                b, a = stack.pop(), stack.pop()
                value = f"{type(node).__name__.lower()}CSG(r{a}, r{b})"
            lines.append(f"    Roth r{k} = {value};")
            stack.append(k)
        lines += [f"    return r{stack[0]};", "}", ""]
    count = ranges.bounded - ranges.spheres
    spans = [f"    for (int k = 0; k < {count}; k++) bodySpans[k] = bodyRoots(ray, surfaceOf({ranges.spheres} + k));"]
    return [
        *(
            [f"real2 bodySpans[{count}];  // the roots of all bodies, in one loop, because their code is long"]
            if count
            else []
        ),
        *lines,
        *RAY_CSG,
        *(spans if count else []),
        "    Hit nearest = Hit(ray.distance, real3(0.0), 0);",
        *(f"    firstHit(object{number}(ray), nearest);" for number in range(len(trees))),
        "    P = ray.ro + nearest.t * ray.rd;",
        "    N = nearest.normal;",
        "    mat = nearest.mat;",
        *(_BODY_NORMAL if count else []),
        "    return nearest.t;",
        "}",
        "",
        *BLOCKED_AT,
        "    real3 P, N;",
        "    int mat;",
        "    return rayCSG(ray, P, N, mat);",
        "}",
    ]


_HOLDS: dict[type[Solid], str] = {Union: "max({}, {})", Intersection: "min({}, {})", Difference: "min({}, -({}))"}
_LOGIC: dict[type[Solid], str] = {Union: "{} || {}", Intersection: "{} && {}", Difference: "{} && !{}"}


def walk_text(trees: list[Tree], ranges: Ranges, surfaces: Mapping[int, str], *, with_owner: bool) -> list[str]:
    """Generate the evaluator `walk`: a walk over all objects, to the first root at which an object's value changes.

    `surfaces` has the GLSL expression for each surface. With `with_owner` the text is rayCSG(), else blockedAt().
    """
    holds: list[str] = []  # the lines that compute v0, v1, ..., the value of each object
    spans = _spans(ranges, surfaces)
    for k, tree in enumerate(trees):
        holds += _holds(tree, f"v{k}")
    objects = range(len(trees))
    # The loop sets `at` last: llvmpipe (Mesa 22.3) loses a value that a loop computes before its exit, for pixels that
    # leave the loop earlier than other pixels drawn with them.
    lines = [
        *spans,
        "    real at = 0.0;",
        *(f"    bool in{k} = false;" for k in objects),
        "    for (;;) {",
        *holds,
        f"        if (at > 0.0 && ({' || '.join(f'(v{k} > 0.0) != in{k}' for k in objects)})) break;",
        "        real next = abs(v0);",
        *(f"        next = min(next, abs(v{k}));" for k in objects[1:]),
        "        if (next >= ray.distance) return ray.distance;",
        *(f"        in{k} = v{k} > 0.0;" for k in objects),
        "        at = next;",
        "    }",
    ]
    return _walk_function(lines, [*owner_text(trees, _walk_leaf), *POINT_AT] if with_owner else None)


def _walk_leaf(index: int) -> LeafText:
    """Return the expressions for the roots of a surface, and for its index + 1."""
    return f"s{index}", str(index + 1)


def _walk_function(lines: list[str], owner_lines: list[str] | None) -> list[str]:
    """Wrap the lines that compute `at` in rayCSG(), or without lines for the owner in blockedAt()."""
    if owner_lines is None:
        return [*BLOCKED_AT, *lines, "    return at;", "}"]
    return [
        *RAY_CSG,
        "    P = ray.ro + ray.distance * ray.rd;",
        "    N = real3(0.0);",
        "    mat = 0;",
        *lines,
        *owner_lines,
        "    return at;",
        "}",
    ]


def _spans(ranges: Ranges, surfaces: Mapping[int, str]) -> list[str]:
    """Generate the lines that compute both roots of all surfaces, as s0, s1, ..."""
    lines = [f"    real2 spans[{ranges.size}];"] if ranges.size > FEW_SPANS or ranges.bounded > ranges.spheres else []
    names: list[str] = []
    for kind, first, end in (
        ("sphere", 0, ranges.spheres),
        ("body", ranges.spheres, ranges.bounded),
        ("plane", ranges.bounded, ranges.size),
    ):
        # The roots of a body are long code, so all bodies share it.
        at_once = 1 if kind == "body" else _AT_ONCE if ranges.size > FEW_SPANS else ranges.size + 1
        whole = first + (end - first) // at_once * at_once
        if whole > first:
            lines.append(f"    for (int k = {first}; k < {whole}; k += {at_once}) {{")
            lines += [f"        spans[k + {j}] = {kind}Roots(ray, surfaceOf(k + {j}));" for j in range(at_once)]
            lines.append("    }")
        names += [f"spans[{k}]" for k in range(first, whole)]
        names += [_roots(k, ranges, surfaces[k]) for k in range(whole, end)]
    return [*lines, *(f"    real2 s{k} = {name};" for k, name in enumerate(names))]


def _holds(tree: Tree, name: str) -> list[str]:
    """Generate the lines that compute the distance up to which a tree's value at `at` holds.

    Each node has a line of its own, because compilers refuse deep expressions.
    """
    lines: list[str] = []
    stack: list[str] = []
    for node in tree:
        if isinstance(node, int):
            stack.append(f"holds(s{node}, at)")
        elif isinstance(node, Complement):
            stack.append(f"-{stack.pop()}")
        else:
            b, a = stack.pop(), stack.pop()
            lines.append(f"        real {name}_{len(lines)} = {_HOLDS[type(node)].format(a, b)};")
            stack.append(f"{name}_{len(lines) - 1}")
    return [*lines, f"        real {name} = {stack[0]};"]


def owner_text(trees: list[Tree], leaf: Callable[[int], LeafText]) -> list[str]:
    """Generate the lines that find the owner of the surface at `at`.

    The owner is in the first object that changes there, and below an operator in the first operand that changes.
    `leaf` returns the expressions for a leaf by its number.
    """
    lines, objects = [], []
    k = 0
    for tree in trees:
        stack: list[int] = []
        for node in tree:
            if isinstance(node, int):
                span, mat = leaf(node)
                lines.append(f"    bool b{k} = isBefore({span}, at), a{k} = isInside({span}, at);")
                lines.append(f"    int o{k} = a{k} ? {mat} : -({mat});")
            elif isinstance(node, Complement):
                a = stack.pop()
                lines.append(f"    bool b{k} = !b{a}, a{k} = !a{a};")
                lines.append(f"    int o{k} = o{a};")
            else:
                b, a = stack.pop(), stack.pop()
                logic = _LOGIC[type(node)]
                before, after = logic.format(f"b{a}", f"b{b}"), logic.format(f"a{a}", f"a{b}")
                lines.append(f"    bool b{k} = {before}, a{k} = {after};")
                lines.append(f"    int o{k} = b{a} != a{a} ? o{a} : o{b};")
            stack.append(k)
            k += 1
        objects.append(stack[0])
    # The last assignment counts, so the first object comes last. The lines use no `else`: beyond 80 levels of it
    # llvmpipe runs branches for pixels that are in other branches.
    return [*lines, *(f"    if (b{k} != a{k}) mat = o{k};" for k in reversed(objects))]


def nearest_plane_text(planes: list[NamedPlane], *, with_owner: bool) -> list[str]:
    """Generate the walk for objects that are single half-spaces: to the nearest root ahead."""
    lines = ["    real at = ray.distance, root;"]
    for s, index in planes:
        lines += [
            f"    root = planeRoot(ray, {s});",
            "    if (root > 0.0 && root < at) {",
            "        at = root;",
            *([f"        mat = planeMat(ray, {s}, {index});"] if with_owner else []),
            "    }",
        ]
    return _walk_function(lines, ["    if (mat == 0) return at;", *POINT_AT] if with_owner else None)


def hold_expression(tree: Tree, leaf: Callable[[int], str]) -> str:
    """Return the expression for the distance up to which a tree's value at `at` holds.

    `leaf` returns the expression for a leaf by its number.
    """
    terms: list[str] = []
    for node in tree:
        if isinstance(node, int):
            terms.append(leaf(node))
        elif isinstance(node, Complement):
            terms.append(f"(-{terms.pop()})")  # in brackets: -- is another operator
        else:
            b, a = terms.pop(), terms.pop()
            terms.append(_HOLDS[type(node)].format(a, b))
    return terms[0]
