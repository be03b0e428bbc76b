"""The GLSL text that finds what of a scene's CSG trees a ray meets first: rayCSG() and blockedAt().

Trees are lists in postfix, with their leaves' surface indices instead of the leaves: spheres first, then planes.
"""

from __future__ import annotations

from raytracer.solids import Complement, Difference, Intersection, Solid, Sphere, Union, postfix

Tree = list[Solid | int]

_RAY_CSG = [
    "// The first surface ahead of the ray and nearer than its end: its distance, point, unit normal (on either",
    "// side) and number as in hit.glsl; or the ray's distance, that far point, 0 and 0.",
    "real rayCSG(Ray ray, out real3 P, out real3 N, out int mat) {",
]
_BLOCKED_AT = ["// How far a ray to a light gets: to the first surface, or to its end.", "real blockedAt(Ray ray, int light) {"]


def max_hits(solid: Solid) -> int:
    """The most hits that any Roth diagram of the tree and its subtrees can hold.

    A line crosses a sphere at most twice and a plane once; a solid that may be unbounded can have
    an end at each infinity besides; and hits come in pairs.
    """
    most = 0
    stack: list[tuple[int, bool]] = []  # crossings, unbounded?
    for node in postfix(solid):
        match node:
            case Complement():
                crossings, unbounded = stack.pop()
                stack.append((crossings, True))
            case Union():
                (m, u), (n, v) = stack.pop(), stack.pop()
                stack.append((m + n, u or v))
            case Intersection():
                (m, u), (n, v) = stack.pop(), stack.pop()
                stack.append((m + n, u and v))
            case Difference():
                (n, _), (m, u) = stack.pop(), stack.pop()
                most = max(most, n + 2)  # differenceCSG() takes the complement of its second operand
                stack.append((m + n, u))
            case _:
                stack.append((2, False) if isinstance(node, Sphere) else (1, True))
        crossings, unbounded = stack[-1]
        most = max(most, crossings + 2 * unbounded)
    return most // 2 * 2


def _roots(index: int, spheres: int) -> str:
    """The call that gives both roots of a surface."""
    return f"{'sphere' if index < spheres else 'plane'}Roots(ray, {index})"


def roth(trees: list[Tree], spheres: int) -> list[str]:
    """By the assignment's filters: a function for each object, and the nearest of their first hits."""
    lines = []
    for number, tree in enumerate(trees):
        lines += [f"Roth object{number}(Ray ray) {{"]
        stack: list[int] = []
        for k, node in enumerate(tree):
            if isinstance(node, int):
                ends = f"sameAs({node}), {node + 1}"
                if node < spheres:
                    value = f"raySphere(ray, shapeAt({node}), sphereTerms(ray, {node}), {ends})"
                else:
                    value = f"rayPlane(ray, shapeAt({node}), planeSlope(ray, {node}), {ends})"
            elif isinstance(node, Complement):
                value = f"complementCSG(r{stack.pop()})"
            else:
                b, a = stack.pop(), stack.pop()
                value = f"{type(node).__name__.lower()}CSG(r{a}, r{b})"
            lines.append(f"    Roth r{k} = {value};")
            stack.append(k)
        lines += [f"    return r{stack[0]};", "}", ""]
    return [
        *lines,
        *_RAY_CSG,
        "    Hit nearest = Hit(ray.distance, real3(0.0), 0);",
        *(f"    firstHit(object{number}(ray), nearest);" for number in range(len(trees))),
        "    P = ray.ro + nearest.t * ray.rd;",
        "    N = nearest.normal;",
        "    mat = nearest.mat;",
        "    return nearest.t;",
        "}",
        "",
        *_BLOCKED_AT,
        "    real3 P, N;",
        "    int mat;",
        "    return rayCSG(ray, P, N, mat);",
        "}",
    ]


_HOLDS: dict[type[Solid], str] = {Union: "max({}, {})", Intersection: "min({}, {})", Difference: "min({}, -{})"}
_LOGIC: dict[type[Solid], str] = {Union: "{} || {}", Intersection: "{} && {}", Difference: "{} && !{}"}


def walk(trees: list[Tree], spheres: int, *, what: bool) -> list[str]:
    """By one walk over all objects, to the first root at which one of them changes; `what`: also what is there."""
    spans: list[str] = []
    holds: list[str] = []  # of each object, an expression
    for tree in trees:
        spans += [f"    real2 s{node} = {_roots(node, spheres)};" for node in tree if isinstance(node, int)]
        holds.append(_holds(tree, "holds(s{}, at)"))
    objects = range(len(trees))
    least = "abs(v0)"
    for k in objects[1:]:
        least = f"min({least}, abs(v{k}))"
    # `at` is set last in the loop: a value that a loop computes before it is left is lost by llvmpipe
    # (Mesa 22.3) for those of the pixels drawn together that leave it earlier than others.
    lines = [
        *spans,
        "    real at = 0.0;",
        *(f"    bool in{k} = false;" for k in objects),
        "    for (;;) {",
        *(f"        real v{k} = {holds[k]};" for k in objects),
        f"        if (at > 0.0 && ({' || '.join(f'(v{k} > 0.0) != in{k}' for k in objects)})) break;",
        f"        real next = {least};",
        "        if (next >= ray.distance) return ray.distance;",
        *(f"        in{k} = v{k} > 0.0;" for k in objects),
        "        at = next;",
        "    }",
    ]
    if not what:
        return [*_BLOCKED_AT, *lines, "    return at;", "}"]
    return [
        *_RAY_CSG,
        "    P = ray.ro + ray.distance * ray.rd;",
        "    N = real3(0.0);",
        "    mat = 0;",
        *lines,
        *_owner(trees),
        "    surfaceAt(mat, ray, P, N);",
        "    return at;",
        "}",
    ]


def _owner(trees: list[Tree], offset: str = "") -> list[str]:
    """Whose surface it is at `at`: the first object's that changes, and in it, of an operator's operands the
    first that does."""
    lines, objects = [], []
    k = 0
    for tree in trees:
        stack: list[int] = []
        for node in tree:
            if isinstance(node, int):
                lines.append(f"    bool b{k} = isBefore(s{node}, at), a{k} = isInside(s{node}, at);")
                lines.append(f"    int o{k} = a{k} ? {offset}{node + 1} : -({offset}{node + 1});")
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
    return [*lines, *(f"    {'else ' if k != objects[0] else ''}if (b{k} != a{k}) mat = o{k};" for k in objects)]


def nearest_plane(planes: list[int], spheres: int, *, what: bool) -> list[str]:
    """The walk where every object is one half-space: to the nearest root ahead."""
    lines = ["    real at = ray.distance, root;"]
    for number in planes:
        index = f"firstPlane + {number - spheres}"
        lines += [
            f"    root = planeRoot(ray, {index});",
            "    if (root > 0.0 && root < at) {",
            "        at = root;",
            *([f"        mat = planeMat(ray, {index});"] if what else []),
            "    }",
        ]
    if not what:
        return [*_BLOCKED_AT, *lines, "    return at;", "}"]
    return [
        *_RAY_CSG,
        "    P = ray.ro + ray.distance * ray.rd;",
        "    N = real3(0.0);",
        "    mat = 0;",
        *lines,
        "    if (mat != 0) surfaceAt(mat, ray, P, N);",
        "    return at;",
        "}",
    ]


def _holds(tree: Tree, leaf: str) -> str:
    """The expression for how long a tree's value at `at` holds; `leaf` is that of leaf {}."""
    terms: list[str] = []
    for node in tree:
        if isinstance(node, int):
            terms.append(leaf.format(node))
        elif isinstance(node, Complement):
            terms.append(f"(-{terms.pop()})")  # in brackets: -- is another operator
        else:
            b, a = terms.pop(), terms.pop()
            terms.append(_HOLDS[type(node)].format(a, b))
    return terms[0]


def listed(kinds: list[Tree], depth: int, planes: list[int], spheres: int, *, what: bool, first: bool) -> list[str]:
    """By lists of what the rays of a cell may meet: see lists.glsl.

    `kinds` are trees over their own leaves, `depth` is that of the deepest program (0 if there is none), `planes`
    are the objects that are one half-space. With `what`, for the camera's rays; else for rays to a light, and
    with `first` whatever blocks them, not the nearest.
    """
    meet = _meet(bool(kinds), bool(depth), first)
    lines = ['#include "lists.glsl"', *(_kinds(kinds, what) if kinds else []), *(_programs(depth, what) if depth else []), *meet]
    own = []
    for number in planes:
        index = f"firstPlane + {number - spheres}"
        found = f"Nearest(planeRoot(ray, {index}), planeMat(ray, {index}), planeObject({index}))"
        own += [f"    found = {found};", "    if (found.t > 0.0 && nearer(found.t, found.object, nearest)) nearest = found;"]
    start = ["    Nearest nearest = Nearest(ray.distance, 0, -1), found;", *own]
    if not what:
        return [
            *lines,
            *_BLOCKED_AT,
            *start,
            "    int begin = light * (6 * GRID * GRID + 1) + cubeCell(vec3(-ray.rd));",
            "    meetListed(ray, listAt(begin), listAt(begin + 1), nearest);",
            "    return nearest.t;",
            "}",
        ]
    return [
        *lines,
        "flat in ivec2 listed;  // where the list of this pixel's cell begins and ends",
        *_RAY_CSG,
        *start,
        "    meetListed(ray, listed.x, listed.y, nearest);",
        "    P = ray.ro + nearest.t * ray.rd;",
        "    N = real3(0.0);",
        "    mat = nearest.mat;",
        "    if (mat != 0) surfaceAt(mat, ray, P, N);",
        "    return nearest.t;",
        "}",
    ]


def _walk_one(holds: str, owner: str) -> list[str]:
    """The walk along one object, to where it changes, if that is nearer than `nearest`."""
    return [
        "    real at = 0.0;",
        "    bool inside = false;",
        "    for (;;) {",
        f"        real holding = {holds};",
        "        if (at > 0.0 && (holding > 0.0) != inside) break;",
        "        real next = abs(holding);",
        "        if (!nearer(next, object, nearest)) return;",
        "        inside = holding > 0.0;",
        "        at = next;",
        "    }",
        f"    nearest = Nearest(at, {owner}, object);",
        "}",
    ]


def _kinds(kinds: list[Tree], what: bool) -> list[str]:
    most = max(sum(isinstance(node, int) for node in tree) for tree in kinds)
    spans = [f"s{j}" for j in range(most)]
    parameters = ", ".join(f"real2 {span}" for span in spans)
    holds = [_holds(tree, "holds(s{}, at)") for tree in kinds]
    choice = "".join(f"kind == {k} ? {text} : " for k, text in enumerate(holds[:-1])) + holds[-1]
    lines = [f"real kindHolds(int kind, {parameters}, real at) {{", f"    return {choice};", "}"]
    if what:
        lines += [f"int kindOwner(int kind, int first, {parameters}, real at) {{", "    int mat = 0;"]
        for k, tree in enumerate(kinds):
            lines += [f"    if (kind == {k}) {{", *(f"    {line}" for line in _owner([tree], "first + ")), "    }"]
        lines += ["    return mat;", "}"]
    return [
        *lines,
        "void meetKind(Ray ray, int item, inout Nearest nearest) {",
        "    vec4 numbers = itemAt(2 * item + 1);",
        "    int kind = int(numbers.x), first = int(numbers.y), object = int(numbers.z);",
        *(f"    real2 {span} = sphereRoots(ray, first + {j});" for j, span in enumerate(spans)),
        *_walk_one(
            f"kindHolds(kind, {', '.join(spans)}, at)",
            f"kindOwner(kind, first, {', '.join(spans)}, at)" if what else "1",
        ),
    ]


def _programs(depth: int, what: bool) -> list[str]:
    slots = max(depth - 1, 1)
    machine = []
    for kind, name in (("real", "v"), ("int", "o"))[: 2 if what else 1]:
        push = "".join(f" {name}{j} = {name}{j - 1};" for j in range(slots - 1, 0, -1))
        pop = "".join(f" {name}{j} = {name}{j + 1};" for j in range(1, slots - 1))
        start = ", ".join(f"{name}{j} = 0{'.0' if kind == 'real' else ''}" for j in range(slots))
        below = f"{name}1" if slots > 1 else f"{name}0"
        machine += [
            *(
                ["real programHolds(Ray ray, int begin, int end, real at) {"]
                if kind == "real"
                else ["int programOwner(Ray ray, int begin, int end, real at) {"]
            ),
            f"    {kind} {start};",
            "    for (int k = begin; k < end; k++) {",
            "        int code = listAt(k), operation = code & 7;",
            f"        bool pushes = operation == PUSH || operation == TRUE, pops = operation == AND || operation == OR;",
            f"        {kind} leaf = {'leafHolds' if kind == 'real' else 'leafOwner'}(ray, code, at);",
            f"        {kind} a = pops ? {below} : {name}0, b = pops ? {name}0 : leaf;",
            f"        {kind} joined = {'joinedHolds' if kind == 'real' else 'joinedOwner'}(code, a, b);",
            *([f"        if (pushes) {{{push} }}"] if push else []),
            *([f"        if (pops) {{{pop} }}"] if pop else []),
            f"        {name}0 = pushes ? leaf : joined;",
            "    }",
            f"    return {name}0;",
            "}",
        ]
    return [
        '#include "program.glsl"',
        *machine,
        "void meetProgram(Ray ray, int begin, int end, int object, inout Nearest nearest) {",
        *_walk_one(
            "programHolds(ray, begin, end, at)", "programOwner(ray, begin, end, at) >> 2" if what else "1"
        ),
    ]


def _meet(kinds: bool, programs: bool, first: bool) -> list[str]:
    """The walk through a list. The nearest ball is looked for in a loop of its own: pixels that are drawn
    together look for theirs at once, and then evaluate what they found at once."""
    candidate = "entry < 0 || meets(ray, itemAt(2 * entry), nearest.t)" if programs else "meets(ray, itemAt(2 * entry), nearest.t)"
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
    program = [
        "meetProgram(ray, k + 1, k - found, listAt(k), nearest);",
        "k -= found;",
    ]
    if kinds and programs:
        body = ["if (found >= 0) {", "    meetKind(ray, found, nearest);", "} else {", *(f"    {line}" for line in program), "}"]
    else:
        body = ["meetKind(ray, found, nearest);"] if kinds else program
    return [
        "void meetListed(Ray ray, int begin, int end, inout Nearest nearest) {",
        "    const int NOTHING = 0x7fffffff;",
        "    int k = begin;",
        "    for (;;) {",
        *(["        if (nearest.mat != 0) break;"] if first else []),
        *search,
        *(f"        {line}" for line in body),
        "    }",
        "}",
    ]
