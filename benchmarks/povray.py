"""POV-Ray as a peer: scenes in its scene language, and runs that measure its trace time."""

import math
import re
import shutil
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

import raytracer as rt
from benchmarks.povray_shapes import SHAPES, matrix, point, vector
from raytracer.scene.solids.affine import IDENTITY
from raytracer.scene.solids.body import Placed
from raytracer.scene.solids.solid import postfix
from tests.processes import run_to_end

# The side of POV-Ray's grid of rays in a pixel, by our number of samples. With antialiasing method 1, a threshold of 0
# and more than one level, POV-Ray shoots this grid antialiasing every pixel, and one more ray antialiasing the centre.
_GRID = {4: 2, 16: 4}
# The timeout of a run in seconds. The slowest scenes take minutes.
_LONGEST = 1800.0
_TRACE_TIME = re.compile(r"Trace Time:.*\(([0-9.]+) seconds\)")


class UnavailableError(Exception):
    """A measurement is not available, for example because POV-Ray is not installed."""


def version() -> str | None:
    """Return the version of the installed POV-Ray, or None."""
    if not shutil.which("povray"):
        return None
    done = run_to_end("povray", "--version")
    match = re.search(r"POV-Ray (3\S*)", done.stdout + done.stderr)
    return match[1] if match else "of an unknown version"


def run(text: str, size: tuple[int, int], samples: int) -> tuple[NDArray[np.uint8], float]:
    """Render a scene in POV-Ray's language by two threads.

    Return the sRGB picture (H, W, 3) and the trace time in seconds. The trace time excludes the start, the parsing, and
    writing the file. Raises UnavailableError.
    """
    if not shutil.which("povray"):
        raise UnavailableError("povray is not installed")
    antialiasing = ("-A",) if samples == 1 else ("+AM1", "+A0.0", f"+R{_GRID[samples]}", "-J")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "picture.png")
        Path(folder, "scene.pov").write_text(text)
        options = ("+Iscene.pov", f"+O{output.name}", f"+W{size[0]}", f"+H{size[1]}", "+WT2", "+FN", "-D", "-V")
        done = run_to_end("povray", *options, *antialiasing, cwd=folder, timeout=_LONGEST)
        seconds = _TRACE_TIME.search(done.stderr)
        if done.returncode or not seconds:
            raise UnavailableError(f"povray failed: {done.stderr.strip()[-200:]}")
        with Pillow.open(output) as image:
            return np.asarray(image.convert("RGB")), float(seconds[1])


def source(scene: rt.Scene, size: tuple[int, int], settings: rt.Settings) -> str:
    """Translate a scene into POV-Ray's scene language.

    POV-Ray's space is left-handed, so z changes its sign. Raises UnavailableError for features that POV-Ray lacks.
    """
    if settings.shadows not in ("off", "hard") or any(light.falloff != "none" for light in scene.lights):
        raise UnavailableError("POV-Ray has no diluted shadows, no sphere lights and no inverse-square falloff")
    camera = scene.camera
    tangent = math.tan(math.radians(camera.vertical_fov) / 2.0) * size[0] / size[1]
    names = {material: f"T{i}" for i, material in enumerate(scene.materials)}
    shadowless = "" if settings.shadows == "hard" else " shadowless"
    lines = [
        "#version 3.7;",
        f"global_settings {{ assumed_gamma 1 ambient_light rgb {vector(scene.ambient)} max_trace_level 1 }}",
        f"background {{ rgb {vector(scene.background)} }}",
        # The order matters: `angle` and `look_at` change the parameters before them.
        f"camera {{ location {point(camera.position)} sky {point(camera.up)} up y right x*{size[0]}/{size[1]} "
        f"angle {math.degrees(2.0 * math.atan(tangent)):.17g} look_at {point(camera.look_at)} }}",
        *(f"light_source {{ {point(l.position)} rgb {vector(l.color)}{shadowless} }}" for l in scene.lights),
        *(f"#declare {name} = {_texture(settings.shaded(material))}" for material, name in names.items()),
        *(_solid(solid, names) for solid in scene.solids()),
    ]
    return "\n".join(lines) + "\n"


def _texture(material: rt.Material) -> str:
    """Translate a material. POV-Ray tints ambient and diffuse light by the pigment, and its highlights are white."""
    if material.model != "phong":
        raise UnavailableError("POV-Ray has only the highlights of the model phong")
    ks = material.ks[0]
    if material.ks != (ks, ks, ks) or any(a > 0.0 and d == 0.0 for a, d in zip(material.ka, material.kd, strict=True)):
        raise UnavailableError(
            "POV-Ray has neither coloured highlights nor ambient light in a channel without diffuse reflection"
        )
    ambient = tuple(a / d if d else 0.0 for a, d in zip(material.ka, material.kd, strict=True))
    return (
        f"texture {{ pigment {{ rgb {vector(material.kd)} }} "
        f"finish {{ ambient rgb {vector(ambient)} diffuse 1 phong {ks:.17g} phong_size {material.h:.17g} }} }}"
    )


def _solid(solid: rt.Solid, textures: dict[rt.Material, str]) -> str:
    """Translate a CSG tree. A chain of one operator becomes one list.

    Both a - b - c and a - (b | c) become difference { a b c }. A nested chain would be slow to trace, and too deep for
    POV-Ray's parser.
    """
    stack: list[tuple[str, list[str]]] = []  # an operator and its operands, or "" and one solid

    def operands(operator: str, node: tuple[str, list[str]]) -> list[str]:
        return node[1] if node[0] == operator else [_text(*node)]

    for node in postfix(solid):
        match node:
            case rt.Sphere(center, radius, material):
                stack.append(("", [f"sphere {{ {point(center)}, {radius:.17g} texture {{ {textures[material]} }} }}"]))
            case rt.Plane(material=material):
                normal, offset = node.unit()
                text = f"plane {{ {point(normal)}, {offset:.17g} texture {{ {textures[material]} }} }}"
                stack.append(("", [text]))
            case Placed(part=0):
                stack.append(("", [_placed(node, textures[node.material])]))
            case Placed() | rt.Union(b=Placed(part=1)):
                pass  # the second interval of a torus, which POV-Ray's torus has as well
            case rt.Complement():
                stack.append(("", [_text(*stack.pop()).removesuffix("}") + "inverse }"]))
            case _:
                b, a = stack.pop(), stack.pop()
                operator = type(node).__name__.lower()
                others = "union" if operator == "difference" else operator
                # In place, so that a chain of a thousand operands is not copied a thousand times.
                first = operands(operator, a)
                first += operands(others, b)
                stack.append((operator, first))
    return _text(*stack[0])


def _placed(leaf: Placed, texture: str) -> str:
    """Translate a primitive under an affine map."""
    if type(leaf.shape) not in SHAPES:
        raise UnavailableError(f"the export to POV-Ray has no {type(leaf.shape).__name__}")
    place = "" if leaf.matrix is IDENTITY else f" {matrix(leaf.matrix)}"
    text = SHAPES[type(leaf.shape)](leaf.shape) % f"texture {{ {texture} }}"
    return text.removesuffix(" }") + f"{place} }}"


def _text(operator: str, parts: list[str]) -> str:
    return f"{operator} {{ {' '.join(parts)} }}" if operator else parts[0]
