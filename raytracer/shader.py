"""Scene + Settings -> GLSL text.

A scene's structure goes into the text: its CSG trees, its kinds of primitive, its reflectance
models, how many lights, which shadows. Its numbers do not: they are uniforms. So scenes of one
structure share a program, and what a scene does not use is not in its shader. No OpenGL here,
and no text of a user's: names in the generated code are made of numbers only.
"""

from __future__ import annotations

import itertools
from typing import Literal

from raytracer.glsl_source import Source, assemble
from raytracer.scene import Scene
from raytracer.settings import Settings
from raytracer.solids import (
    MODELS,
    Complement,
    Difference,
    Intersection,
    Plane,
    Primitive,
    Solid,
    Sphere,
    Union,
    leaves,
    postfix,
)

# What the second pass makes of what a pixel sees; all but the picture for looking into it.
Show = Literal["picture", "normal", "depth", "material"]


def surfaces(scene: Scene) -> list[Primitive]:
    """Every leaf of every tree in the order of the shader's surface index: spheres, then planes."""
    found = [leaf for solid in scene.objects for leaf in leaves(solid)]
    return sorted(found, key=lambda leaf: not isinstance(leaf, Sphere))  # stable


def models(scene: Scene, settings: Settings) -> list[str]:
    """The specular models in use, in the order of `Material.model`."""
    used = {settings.shaded(surface.material).model for surface in surfaces(scene)}
    return [model for model in MODELS if model in used]


def visibility_source(scene: Scene, settings: Settings) -> Source:
    """The fragment shader that finds what each pixel sees."""
    generated = "\n".join(_csg(scene, settings))
    return _assemble("visibility.frag", _counts(scene), settings, {"scene.glsl": generated})


def shade_source(scene: Scene, settings: Settings) -> Source:
    """The fragment shader that computes the light from what each pixel sees."""
    defines = {**_counts(scene), "LIGHTS": len(scene.lights)}
    generated: list[str] = []
    if scene.lights:
        generated += ['#include "light.glsl"', *_specular(scene, settings), *_primitives(scene), '#include "hit.glsl"']
    if settings.shadows != "off" and scene.lights:
        defines["SHADOWS"] = 1
        generated += [*_csg(scene, settings), f'#include "shadow_{settings.shadows}.glsl"']
    return _assemble("shade.frag", defines, settings, {"scene.glsl": "\n".join(generated)})


def show_source(scene: Scene, settings: Settings, show: Show) -> Source:
    """The fragment shader of the second pass."""
    return shade_source(scene, settings) if show == "picture" else assemble(f"show_{show}.frag", _counts(scene))


def _assemble(top: str, defines: dict[str, int], settings: Settings, generated: dict[str, str]) -> Source:
    return assemble(top, defines | {"DOUBLES": 1} if settings.precision == 64 else defines, generated)


def roth_loops(scene: Scene) -> int:
    """How many loops in a row the Roth filters of a scene are: what bounds their compilation."""
    cost = {Union: 1, Intersection: 1, Difference: 2, Complement: 1}
    return sum(1 + sum(cost.get(type(node), 0) for node in postfix(solid)) for solid in scene.objects)


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


def _counts(scene: Scene) -> dict[str, int]:
    found = surfaces(scene)
    spheres = sum(isinstance(surface, Sphere) for surface in found)
    return {"SPHERES": spheres, "PLANES": len(found) - spheres, "SURFACES": len(found)}


def _csg(scene: Scene, settings: Settings) -> list[str]:
    """rayCSG(): what of the scene's trees a ray meets first, by the chosen evaluator."""
    roth = settings.evaluator == "roth"
    return [
        *([f"#define MAX_HITS {max(map(max_hits, scene.objects))}", '#include "roth.glsl"'] if roth else []),
        *_primitives(scene),
        '#include "hit.glsl"',
        *([] if roth else ['#include "walk.glsl"']),
        "",
        *(_roth if roth else _walk)(_numbered(scene), _counts(scene)["SPHERES"]),
        "",
    ]


def _primitives(scene: Scene) -> list[str]:
    counts = _counts(scene)
    return [f'#include "{kind.lower()}.glsl"' for kind in ("Sphere", "Plane") if counts[f"{kind.upper()}S"]]


_Tree = list[Solid | int]  # a postfix tree with its leaves' surface indices instead of the leaves


def _numbered(scene: Scene) -> list[_Tree]:
    spheres, planes = itertools.count(), itertools.count(_counts(scene)["SPHERES"])

    def numbered(node: Solid) -> Solid | int:
        return next(spheres) if isinstance(node, Sphere) else next(planes) if isinstance(node, Plane) else node

    return [[numbered(node) for node in postfix(solid)] for solid in scene.objects]


def _leaf(index: int, spheres: int) -> tuple[str, str]:
    """("Sphere" or "Plane", the arguments of its functions)."""
    if index < spheres:
        return "Sphere", f"ray, spheres[{index}], sphereTerms(ray, {index})"
    plane = index - spheres
    return "Plane", f"ray, planes[{plane}], planeSlope(ray, {plane})"


_RAY_CSG = [
    "// The first surface ahead of the ray and nearer than its end: its distance, point, unit normal (on either",
    "// side) and number as in hit.glsl; or the ray's distance, that far point, 0 and 0.",
    "real rayCSG(Ray ray, out real3 P, out real3 N, out int mat) {",
]


def _roth(trees: list[_Tree], spheres: int) -> list[str]:
    """By the assignment's filters: a function for each object, and the nearest of their first hits."""
    lines = []
    for number, tree in enumerate(trees):
        lines += [f"Roth object{number}(Ray ray) {{"]
        stack: list[int] = []
        for k, node in enumerate(tree):
            if isinstance(node, int):
                kind, arguments = _leaf(node, spheres)
                value = f"ray{kind}({arguments}, {node + 1})"
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
    ]


_LOGIC: dict[type[Solid], str] = {Union: "{} || {}", Intersection: "{} && {}", Difference: "{} && !{}"}


def _walk(trees: list[_Tree], spheres: int) -> list[str]:
    """By one walk over the roots of all primitives: the first at which an object's tree changes."""
    spans, next_root, inside, owner = [], [], [], []
    objects: list[int] = []  # the root nodes
    k = 0
    for tree in trees:
        stack: list[int] = []
        for node in tree:
            if isinstance(node, int):
                kind, arguments = _leaf(node, spheres)
                spans.append(f"    real2 s{k} = {kind.lower()}Span({arguments});")
                next_root.append(f"        next = nextRoot(s{k}, at, next);")
                inside.append(f"        bool in{k} = isInside(s{k}, at);")
                owner.append(f"    bool b{k} = isBefore(s{k}, at), a{k} = isInside(s{k}, at);")
                owner.append(f"    int o{k} = a{k} ? {node + 1} : {-node - 1};")
            elif isinstance(node, Complement):
                a = stack.pop()
                inside.append(f"        bool in{k} = !in{a};")
                owner.append(f"    bool b{k} = !b{a}, a{k} = !a{a};")
                owner.append(f"    int o{k} = o{a};")
            else:
                b, a = stack.pop(), stack.pop()
                logic = _LOGIC[type(node)]
                inside.append(f"        bool in{k} = {logic.format(f'in{a}', f'in{b}')};")
                before, after = logic.format(f"b{a}", f"b{b}"), logic.format(f"a{a}", f"a{b}")
                owner.append(f"    bool b{k} = {before}, a{k} = {after};")
                owner.append(f"    int o{k} = b{a} != a{a} ? o{a} : o{b};")
            stack.append(k)
            k += 1
        objects.append(stack[0])
    return [
        *_RAY_CSG,
        "    P = ray.ro + ray.distance * ray.rd;",
        "    N = real3(0.0);",
        "    mat = 0;",
        *spans,
        "    real at = 0.0;",
        *(f"    bool was{k} = false;" for k in objects),
        "    for (;;) {",
        *inside,
        f"        if (at > 0.0 && ({' || '.join(f'in{k} != was{k}' for k in objects)})) break;",
        *(f"        was{k} = in{k};" for k in objects),
        "        real next = ray.distance;",
        *next_root,
        "        if (next >= ray.distance) return ray.distance;",
        "        at = next;",
        "    }",
        "    // Whose surface: the first object's that changes, and in it, an operator's first operand's that does.",
        *owner,
        *(f"    {'else ' if k != objects[0] else ''}if (b{k} != a{k}) mat = o{k};" for k in objects),
        "    surfaceAt(mat, ray, P, N);",
        "    return at;",
        "}",
    ]


def _specular(scene: Scene, settings: Settings) -> list[str]:
    """specular(): the material's specular factor, with just the models in use."""
    used = models(scene, settings)
    calls = [f"{model}(N, L, V, m.h)" for model in used]
    choice = " : ".join(f"m.model == {MODELS.index(m)} ? {call}" for m, call in zip(used[:-1], calls, strict=False))
    return [
        *(f'#include "brdf/{model}.glsl"' for model in used),
        "float specular(Material m, vec3 N, vec3 L, vec3 V) {",
        f"    return {choice + ' : ' if choice else ''}{calls[-1]};",
        "}",
    ]
