"""The same scene for POV-Ray: a Scene as its scene language, and a run of it that says how long it traced."""

import math
import re
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

import raytracer as rt
from raytracer.scene.solids import postfix
from tests.processes import finished

# The side of the grid of rays that POV-Ray shoots through a pixel, by samples. Method 1 with a threshold of 0
# and more than one level shoots them through every pixel, besides one through its centre.
_GRID = {4: 2, 16: 4}
# Seconds. Its slowest scenes take minutes.
_LONGEST = 1800.0
_TRACE_TIME = re.compile(r"Trace Time:.*\(([0-9.]+) seconds\)")


class UnavailableError(Exception):
    """What is to be measured cannot be, here or yet."""


def version() -> str | None:
    """The version of the POV-Ray that is installed, or None."""
    if not shutil.which("povray"):
        return None
    done = finished("povray", "--version")
    match = re.search(r"POV-Ray (3\S*)", done.stdout + done.stderr)
    return match[1] if match else "of an unknown version"


def run(text: str, size: tuple[int, int], samples: int) -> tuple[NDArray[np.uint8], float]:
    """The picture (H, W, 3) of a scene in its language, in sRGB, and the seconds that two threads traced it.

    What it takes to start, to parse and to write the file is not counted. Raises UnavailableError.
    """
    if not shutil.which("povray"):
        raise UnavailableError("povray is not installed")
    through = ("-A",) if samples == 1 else ("+AM1", "+A0.0", f"+R{_GRID[samples]}", "-J")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "picture.png")
        Path(folder, "scene.pov").write_text(text)
        options = ("+Iscene.pov", f"+O{output.name}", f"+W{size[0]}", f"+H{size[1]}", "+WT2", "+FN", "-D", "-V")
        done = finished("povray", *options, *through, cwd=folder, timeout=_LONGEST)
        seconds = _TRACE_TIME.search(done.stderr)
        if done.returncode or not seconds:
            raise UnavailableError(f"povray failed: {done.stderr.strip()[-200:]}")
        with Pillow.open(output) as image:
            return np.asarray(image.convert("RGB")), float(seconds[1])


def source(scene: rt.Scene, size: tuple[int, int], settings: rt.Settings) -> str:
    """`scene` in POV-Ray's scene language.

    Its space is left-handed, so z changes its sign. Raises UnavailableError for what it cannot say.
    """
    if settings.shadows not in ("off", "hard") or any(light.falloff != "none" for light in scene.lights):
        raise UnavailableError("POV-Ray has no diluted shadows, no sphere lights and no inverse-square falloff")
    camera = scene.camera
    tangent = math.tan(math.radians(camera.vertical_fov) / 2.0) * size[0] / size[1]
    names = {material: f"T{i}" for i, material in enumerate(scene.materials)}
    shadowless = "" if settings.shadows == "hard" else " shadowless"
    lines = [
        "#version 3.7;",
        f"global_settings {{ assumed_gamma 1 ambient_light rgb {_vector(scene.ambient)} max_trace_level 1 }}",
        f"background {{ rgb {_vector(scene.background)} }}",
        # In this order: `angle` and `look_at` change what comes before them.
        f"camera {{ location {_point(camera.position)} sky {_point(camera.up)} up y right x*{size[0]}/{size[1]} "
        f"angle {math.degrees(2.0 * math.atan(tangent)):.17g} look_at {_point(camera.look_at)} }}",
        *(f"light_source {{ {_point(l.position)} rgb {_vector(l.color)}{shadowless} }}" for l in scene.lights),
        *(f"#declare {name} = {_texture(settings.shaded(material))}" for material, name in names.items()),
        *(_solid(solid, names) for solid in scene.solids()),
    ]
    return "\n".join(lines) + "\n"


def _texture(material: rt.Material) -> str:
    """Ambient and diffuse light are both tinted by the pigment there, and highlights are white."""
    ks = material.ks[0]
    if material.model != "phong":
        raise UnavailableError("of the highlights, only Phong's are POV-Ray's too")
    if material.ks != (ks, ks, ks) or any(a > 0.0 and d == 0.0 for a, d in zip(material.ka, material.kd, strict=True)):
        raise UnavailableError(
            "POV-Ray has no coloured highlights, and no ambient light of a colour that is not diffuse"
        )
    ambient = tuple(a / d if d else 0.0 for a, d in zip(material.ka, material.kd, strict=True))
    return (
        f"texture {{ pigment {{ rgb {_vector(material.kd)} }} "
        f"finish {{ ambient rgb {_vector(ambient)} diffuse 1 phong {ks:.17g} phong_size {material.h:.17g} }} }}"
    )


def _solid(solid: rt.Solid, textures: dict[rt.Material, str]) -> str:
    """A tree, with chains of one operator as one list: a - b - c and a - (b | c) are both difference { a b c }.

    Nested as deep as it is written, a chain would be slow to trace, and too deep to parse.
    """
    stack: list[tuple[str, list[str]]] = []  # an operator and its operands; no operator and one solid

    def operands(operator: str, node: tuple[str, list[str]]) -> list[str]:
        return node[1] if node[0] == operator else [_text(*node)]

    for node in postfix(solid):
        match node:
            case rt.Sphere(center, radius, material):
                stack.append(("", [f"sphere {{ {_point(center)}, {radius:.17g} texture {{ {textures[material]} }} }}"]))
            case rt.Plane(material=material):
                normal, offset = node.unit()
                text = f"plane {{ {_point(normal)}, {offset:.17g} texture {{ {textures[material]} }} }}"
                stack.append(("", [text]))
            case rt.Complement():
                stack.append(("", [_text(*stack.pop()).removesuffix("}") + "inverse }"]))
            case _:
                b, a = stack.pop(), stack.pop()
                operator = type(node).__name__.lower()
                others = "union" if operator == "difference" else operator
                # In place: a chain of a thousand is not copied a thousand times.
                first = operands(operator, a)
                first += operands(others, b)
                stack.append((operator, first))
    return _text(*stack[0])


def _text(operator: str, parts: list[str]) -> str:
    return f"{operator} {{ {' '.join(parts)} }}" if operator else parts[0]


def _vector(values: Sequence[float]) -> str:
    return f"<{', '.join(f'{value:.17g}' for value in values)}>"


def _point(values: Sequence[float]) -> str:
    x, y, z = values
    return _vector((x, y, -z))
