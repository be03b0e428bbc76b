"""Shader text: what a scene needs and nothing else, and errors that lead to a file and line."""

import re

import pytest

import raytracer as rt
from raytracer.evaluators import max_hits
from raytracer.glsl_source import ShaderError, Source, assemble, shaders_folder
from raytracer.renderer import Renderer
from raytracer.scene_file import loads
from raytracer.settings import Settings
from raytracer.shader import roth_loops, shade_source, visibility_source

from . import scenes

A, B = rt.Sphere((0, 0, 0), 1), rt.Sphere((1, 0, 0), 1)
FLOOR = rt.Plane((0, 1, 0), 0)


def code(source: Source) -> str:
    """The text without comments, and without what it leaves out by `#if NAME > 0`."""
    text = re.sub(r"//.*", "", source.text)
    for name in re.findall(r"#define (\w+) 0\n", text):
        text = re.sub(rf"#if {name} > 0\n.*?#endif\n", "", text, flags=re.DOTALL)
    return text


@pytest.mark.parametrize(
    ("solid", "hits"),
    [
        (A, 2),
        (FLOOR, 2),
        (~A, 4),
        (~~A, 4),
        (A | B, 4),
        (A & B, 4),
        (A - B, 4),
        (FLOOR - A, 4),
        (FLOOR | ~FLOOR, 4),
        (scenes.assignment().objects[0], 8),
    ],
)
def test_max_hits_is_what_the_tree_can_need(solid: rt.Solid, hits: int) -> None:
    assert max_hits(solid) == hits


def test_roth_loops_counts_what_is_compiled_in_a_row() -> None:
    assert roth_loops(scenes.of((A | B) - ~A, FLOOR)) == 6


def test_what_a_scene_does_not_use_is_not_in_its_shader() -> None:
    plain = scenes.of(A)
    seen, shaded = visibility_source(plain, Settings()), shade_source(plain, Settings(shadows="off"))
    for word in ("planeSpan", "isInside", "Roth", "float shadow(", "blinn", "rayCSG"):
        assert word not in code(shaded), word
    for word in ("planeSpan", "Roth", "Material", "Light"):
        assert word not in code(seen), word
    assert "sphereSpan" in code(seen) and "float shadow(" in code(shade_source(plain, Settings()))
    assert "phong" not in code(shade_source(plain, Settings(shading="blinn")))
    assert "sphereSpan" not in code(visibility_source(scenes.of(FLOOR), Settings()))
    dark = rt.Scene([A], [], plain.camera)
    assert "struct Light" not in code(shade_source(dark, Settings()))


def test_no_name_or_number_of_a_scene_is_in_its_shader() -> None:
    scene = loads(scenes.ASSIGNMENT.read_text().replace("sphere1", "zanzibar").replace("2.7", "0.123456"))
    for evaluator in ("walk", "roth"):
        for source in (visibility_source, shade_source):
            text = source(scene, Settings(evaluator=evaluator)).text
            assert "zanzibar" not in text and "0.123456" not in text


def test_each_file_is_included_once_and_its_lines_are_numbered() -> None:
    source = visibility_source(scenes.assignment(), Settings(evaluator="roth"))
    assert source.text.count("struct Ray {") == 1 and len(set(source.files)) == len(source.files)
    number = source.files.index("roth.glsl")
    line = next(text for text in source.text.splitlines() if text.startswith(f"#line {number}0"))
    first = int(line.removeprefix("#line "))
    log = f"0:{first + 11}(5): error: boom; 0({first + 6}) : error; ERROR: 0:{first}: oh; 99:1"
    assert source.explain(log) == "roth.glsl:12: error: boom; roth.glsl:7 : error; ERROR: roth.glsl:1: oh; 99:1"


def test_a_missing_include_names_the_file_and_line_that_wants_it() -> None:
    with pytest.raises(ShaderError, match=r'top:2: no file "nowhere.glsl"'):
        assemble("top", generated={"top": '// one\n#include "nowhere.glsl"'})


# Mesa knows the file only of the first.
@pytest.mark.gl
@pytest.mark.parametrize("mistake", [" this is no GLSL", " int a = nothing;", " float b = vec2(1.0);"])
def test_a_compilers_error_names_the_file_and_line(renderer: Renderer, mistake: str) -> None:
    lines = (shaders_folder() / "camera.glsl").read_text().splitlines()
    where = next(i for i, line in enumerate(lines) if line.startswith("real2 halfPixels()")) + 1
    lines[where - 1] += mistake
    top = '#include "ray.glsl"\n#include "camera.glsl"\nvoid main() {}'
    broken = assemble("top", generated={"top": top, "camera.glsl": "\n".join(lines)})
    with pytest.raises(ShaderError, match=rf"camera\.glsl:{where}\b"), renderer.context:
        renderer.program(broken)


def test_every_shader_file_says_first_what_it_provides() -> None:
    for path in shaders_folder().rglob("*.glsl"):
        assert path.read_text().startswith("// Provides "), path
