"""Scene + Settings -> GLSL text.

A scene's structure goes into the text: its CSG trees, its kinds of primitive, its reflectance
models, how many lights, which shadows. Its numbers do not: they are uniforms. So scenes of one
structure share a program, and what a scene does not use is not in its shader. No OpenGL here,
and no text of a user's: names in the generated code are made of numbers only.
"""

from __future__ import annotations

from raytracer.glsl_source import Source, assemble
from raytracer.scene import (
    MODELS,
    Complement,
    Difference,
    Intersection,
    Primitive,
    Scene,
    Solid,
    Sphere,
    Union,
    leaves,
    postfix,
)
from raytracer.settings import Settings


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
    generated = _trees(scene, settings) + _ray_csg(scene, settings)
    return assemble("visibility.frag", _counts(scene), {"scene.glsl": "\n".join(generated)})


def shade_source(scene: Scene, settings: Settings) -> Source:
    """The fragment shader that computes the light from what each pixel sees."""
    generated = ['#include "surfaces.glsl"', *_specular(scene, settings)]
    defines = {**_counts(scene), "LIGHTS": len(scene.lights)}
    if settings.shadows != "off" and scene.lights:
        defines["SHADOWS"] = 1
        generated += _trees(scene, settings) + _first_blocker(scene, settings)
        generated.append(f'#include "shadow_{settings.shadows}.glsl"')
    return assemble("shade.frag", defines, {"scene.glsl": "\n".join(generated)})


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


def _trees(scene: Scene, settings: Settings) -> list[str]:
    """A function object0(), object1(), ... for each of the scene's trees."""
    spheres = planes = 0
    total_spheres = _counts(scene)["SPHERES"]
    write = _roth_object if settings.evaluator == "roth" else _walk_object
    lines = ['#include "surfaces.glsl"']
    if settings.evaluator == "roth":
        lines += [f"#define MAX_HITS {max(map(max_hits, scene.objects))}", '#include "roth.glsl"']
    else:
        lines += ['#include "sphere.glsl"'] if total_spheres else []
        lines += ['#include "plane.glsl"'] if total_spheres < _counts(scene)["SURFACES"] else []
        lines += ['#include "walk.glsl"']
    for number, solid in enumerate(scene.objects):
        nodes: list[Solid | int] = []  # leaves as their surface's index
        for node in postfix(solid):
            if isinstance(node, Sphere):
                nodes.append(spheres)
                spheres += 1
            elif isinstance(node, Primitive):
                nodes.append(total_spheres + planes)
                planes += 1
            else:
                nodes.append(node)
        lines += ["", *write(number, nodes, total_spheres)]
    return lines


def _leaf(index: int, spheres: int) -> tuple[str, str]:
    """("Sphere" or "Plane", the arguments of its functions)."""
    if index < spheres:
        return "Sphere", f"ray, spheres[{index}].xyz, spheres[{index}].w"
    return "Plane", f"ray, planes[{index - spheres}].xyz, planes[{index - spheres}].w"


def _roth_object(number: int, nodes: list[Solid | int], spheres: int) -> list[str]:
    lines = [f"void object{number}(Ray ray, inout Hit nearest) {{"]
    stack: list[int] = []
    for k, node in enumerate(nodes):
        if isinstance(node, int):
            kind, arguments = _leaf(node, spheres)
            value = f"ray{kind}({arguments}, {node})"
        elif isinstance(node, Complement):
            value = f"complementCSG(r{stack.pop()})"
        else:
            b, a = stack.pop(), stack.pop()
            value = f"{type(node).__name__.lower()}CSG(r{a}, r{b})"
        lines.append(f"    Roth r{k} = {value};")
        stack.append(k)
    return [*lines, f"    firstHit(r{stack[0]}, nearest);", "}"]


def _walk_object(number: int, nodes: list[Solid | int], spheres: int) -> list[str]:
    """Spans of the primitives; the walk; then whose surface it is where the walk stopped."""
    spans, next_root, inside, owner = [], [], [], []
    stack: list[int] = []
    for k, node in enumerate(nodes):
        if isinstance(node, int):
            kind, arguments = _leaf(node, spheres)
            span = f"s{k}"
            spans.append(f"    vec2 {span} = {kind.lower()}Span({arguments});")
            next_root.append(f"        next = nextRoot({span}, at, next);")
            inside.append(f"        bool in{k} = isInside({span}, at);")
            owner.append(f"    bool b{k} = isBefore({span}, at), a{k} = isInside({span}, at);")
            owner.append(f"    int o{k} = {node};")
        elif isinstance(node, Complement):
            a = stack.pop()
            inside.append(f"        bool in{k} = !in{a};")
            owner.append(f"    bool b{k} = !b{a}, a{k} = !a{a};")
            owner.append(f"    int o{k} = o{a};")
        else:
            b, a = stack.pop(), stack.pop()
            logic = {Union: "{} || {}", Intersection: "{} && {}", Difference: "{} && !{}"}[type(node)]  # pyright: ignore[reportArgumentType]
            inside.append(f"        bool in{k} = {logic.format(f'in{a}', f'in{b}')};")
            before, after = logic.format(f"b{a}", f"b{b}"), logic.format(f"a{a}", f"a{b}")
            owner.append(f"    bool b{k} = {before}, a{k} = {after};")
            owner.append(f"    int o{k} = b{a} != a{a} ? o{a} : o{b};")
        stack.append(k)
    root = stack[0]
    return [
        "// Walk to the object's first surface nearer than t; if there is one, t and index become its.",
        f"void object{number}(Ray ray, inout float t, inout int index) {{",
        *spans,
        "    float at = 0.0;",
        "    bool was = false;",
        "    for (;;) {",
        *inside,
        f"        if (at > 0.0 && in{root} != was) break;",
        f"        was = in{root};",
        "        float next = t;",
        *next_root,
        "        if (next >= t) return;",
        "        at = next;",
        "    }",
        "    t = at;",
        "    // Before and after t; where an operator's result changes, its first operand that changes owns the surface.",
        *owner,
        f"    index = o{root};",
        "}",
    ]


def _ray_csg(scene: Scene, settings: Settings) -> list[str]:
    head = [
        "",
        "// The first surface ahead of the ray: its distance or INF, point, outward normal and index (-1: none).",
        "float rayCSG(Ray ray, out vec3 P, out vec3 N, out int mat) {",
    ]
    if settings.evaluator == "roth":
        return [
            *head,
            "    Hit nearest = Hit(INF, vec3(0.0), -1);",
            *(f"    object{i}(ray, nearest);" for i in range(len(scene.objects))),
            "    P = ray.ro + nearest.t * ray.rd;",
            "    N = nearest.normal;",
            "    mat = nearest.mat;",
            "    return nearest.t;",
            "}",
        ]
    return [
        *head,
        "    float t = INF;",
        "    mat = -1;",
        *(f"    object{i}(ray, t, mat);" for i in range(len(scene.objects))),
        "    P = ray.ro + t * ray.rd;",
        "    N = vec3(0.0);",
        "    if (mat >= 0) surfaceAt(mat, P, N);",
        "    return t;",
        "}",
    ]


def _first_blocker(scene: Scene, settings: Settings) -> list[str]:
    roth = settings.evaluator == "roth"
    state = "Hit nearest = Hit(end, vec3(0.0), -1);" if roth else "float t = end; int index = -1;"
    arguments = "ray, nearest" if roth else "ray, t, index"
    return [
        "",
        "// The distance of the first surface ahead of the ray if it is nearer than `end`, or else `end`.",
        "float firstBlocker(Ray ray, float end) {",
        f"    {state}",
        *(f"    object{i}({arguments});" for i in range(len(scene.objects))),
        f"    return {'nearest.t' if roth else 't'};",
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
