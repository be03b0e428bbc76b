"""Shader texts: each has what its scene needs and nothing else, and compiler errors name a file and line."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import pytest

import raytracer as rt
from raytracer.compiler.draws import SAMPLES_AT_ONCE
from raytracer.compiler.glsl.preprocessor import ShaderError, Source, assemble, shaders_folder
from raytracer.compiler.roth_bounds import max_hits, roth_loops
from raytracer.formats.scene_file import loads
from raytracer.rendering.renderer import Renderer
from raytracer.scene.options import Evaluator, Shadows
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import sources
from tests.shader_text import code

A, B = rt.Sphere((0, 0, 0), 1), rt.Sphere((1, 0, 0), 1)
FLOOR = rt.Plane((0, 1, 0), 0)


def called_functions(source: Source, function: str) -> set[str]:
    """Return the functions of the source that `function` calls, directly or indirectly."""
    bodies: dict[str, str] = {}
    for name, body in re.findall(r"^\w+ (\w+)\([^()]*\) \{$(.*?)^\}", code(source), re.MULTILINE | re.DOTALL):
        bodies[name] = bodies.get(name, "") + body
    reached: set[str] = set()
    pending = [function]
    while pending:
        words = re.findall(r"\b(\w+)\(", bodies[pending.pop()])
        new = {word for word in words if word in bodies} - reached
        reached |= new
        pending += new
    return reached


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
def test_max_hits_is_the_largest_number_of_hits_of_the_tree(solid: rt.Solid, hits: int) -> None:
    assert max_hits(solid) == hits


def test_roth_loops_counts_the_loops_of_all_filters() -> None:
    assert roth_loops(scenes.lit_scene((A | B) - ~A, FLOOR)) == 6


# For each case: the objects, number of lights and settings of a scene, and words that no program of the scene may have.
_SPHERE_WORDS = ("sphereSpan", "sphereRoots", "sphereNormal", "sphereEnds", "HAS_SPHERES")
_PLANE_WORDS = ("planeSpan", "planeRoots", "planeEnds", "HAS_PLANES")
_SHADOW_WORDS = ("shadow", "blockedAt", "SHADOWS")
_LIGHT_WORDS = (*_SHADOW_WORDS, "struct Light", "reflected(", "phong", "blinn", "reflectedOf", "pointAt(mat, view")
SHINY = rt.Sphere((0, 1, 0), 1, rt.Material(model="blinn"))
CROWD = [rt.Sphere((i, 5, 0), 0.4) for i in range(12)]
UNUSED: dict[str, tuple[list[rt.Solid], int, Settings, tuple[str, ...]]] = {
    "no half-spaces": ([A - B], 2, Settings(), _PLANE_WORDS),
    "no spheres": ([FLOOR], 2, Settings(), _SPHERE_WORDS),
    "no shadows": ([A, FLOOR], 2, Settings(shadows="off"), _SHADOW_WORDS),
    "no lights": ([A, FLOOR], 0, Settings(), _LIGHT_WORDS),
    "all Phong": (
        [A, FLOOR],
        1,
        Settings(),
        ("blinn", "m.model ==", "ggx", "fresnel", "masking", "vec3 le;", "struct Lobe"),
    ),
    "all made Phong": ([SHINY, FLOOR], 1, Settings(shading="phong"), ("blinn", "m.model ==")),
    "all Blinn": ([SHINY], 1, Settings(), ("phong", "m.model ==")),
    "all made Blinn": ([A, FLOOR], 1, Settings(shading="blinn"), ("phong", "m.model ==")),
    "no hit lists": ([A, FLOOR], 1, Settings(), ("Roth", "Hit", "MAX_HITS")),
    "no walk": ([A, FLOOR], 1, Settings(evaluator="roth"), ("holds(", "isInside", "isBefore")),
    "no doubles": ([A, FLOOR], 1, Settings(), ("double", "dvec")),
}


def make_programs(objects: Sequence[rt.Solid], lights: int, settings: Settings) -> dict[str, Source]:
    """Return all fragment sources that draw pictures of a scene with these objects."""
    scene = rt.Scene(objects, [rt.PointLight((i, 7, 4)) for i in range(lights)], rt.Camera((0, 3, 6), (0, 1, 0)))
    texts = {name: source.fragment for name, source in sources(scene, settings).items() if name != "empty"}
    return texts | {"geometry": sources(scene, settings, None)["see"].fragment}


@pytest.mark.parametrize("name", UNUSED)
def test_no_program_has_words_of_a_feature_that_the_scene_does_not_use(name: str) -> None:
    objects, lights, settings, words = UNUSED[name]
    for program, source in make_programs(objects, lights, settings).items():
        for word in words:
            assert word not in code(source), f"{word} in {program}"


def test_programs_have_the_words_of_the_features_that_a_scene_uses() -> None:
    # This test ensures that the words above are not misspelt.
    programs = make_programs([A, SHINY, FLOOR], 1, Settings())
    all_text = "\n".join(source.text for source in programs.values())
    all_text += make_programs([A], 1, Settings(evaluator="roth", precision=64))["shade"].text
    shining = [rt.Sphere((0, 1, 0), 1, rt.Material(model, le=1)) for model in ("ggx", "lafortune")]
    all_text += make_programs(shining, 1, Settings())["picture"].text
    for *_, words in UNUSED.values():
        for word in words:
            assert word in all_text, word
    assert set(programs) == {"geometry", "picture", "plane_only"}


def test_each_program_has_the_code_of_its_purpose_and_no_more() -> None:
    # With this many primitives, one program finds the surfaces and another computes their light.
    walked = make_programs([A, SHINY, FLOOR, *CROWD], 2, Settings(evaluator="walk"))
    texts = {name: code(source) for name, source in walked.items()}
    texts["plane_only"] = code(make_programs([A, SHINY, FLOOR], 2, Settings())["plane_only"])
    for word in ("Material", "Light", "shadow", "blockedAt"):
        assert word not in texts["see"] and word not in texts["geometry"], word
    assert "normalDepth" in texts["geometry"] and "normalDepth" not in texts["see"]
    assert "rayCSG" not in texts["shade"], "the visible surface is already known"
    for word in ("sphereSpan", "sphereRoots", "sphereTerms", "sphereNormal", "shadow", "blockedAt"):
        assert word not in texts["plane_only"], f"{word}: a single half-space casts no shadow on itself"
    two = make_programs([A, FLOOR, rt.Plane((1, 0, 0), -9)], 1, Settings())["plane_only"]
    assert "blockedAt" in code(two) and "sphereRoots" not in code(two)


def test_the_program_for_several_samples_has_one_copy_per_sample() -> None:
    several = sources(scenes.assignment(), several=True)["several"]
    places = [f"samplePlace{i}" for i in range(SAMPLES_AT_ONCE)]
    for text in (several.vertex.text, several.fragment.text):
        assert sorted(set(re.findall(r"samplePlace\d", text))) == places
    assert code(several.fragment).partition("void main()")[2].count("sampled()") == SAMPLES_AT_ONCE


@pytest.mark.parametrize("shadows", ["hard", "diluted"])
def test_a_shadow_ray_computes_no_normal_and_no_material(shadows: Shadows) -> None:
    for objects in ([A - B, FLOOR, *CROWD], [FLOOR, rt.Plane((1, 0, 0), 2), *CROWD]):
        shade = make_programs(objects, 2, Settings(shadows=shadows, evaluator="walk"))["shade"]
        reached = called_functions(shade, "blockedAt")
        assert reached & {"sphereRoots", "planeRoots", "planeRoot"}
        assert not reached & {"pointAt", "sphereNormal", "indexOf", "reflected", "rayCSG", "isBefore"}
        assert "pointAt" in called_functions(shade, "main") and "normal" not in "".join(reached).lower()
        body = code(shade).partition("real blockedAt(Ray ray) {")[2].partition("\n}")[0]
        assert "mat" not in body and "N" not in re.findall(r"\w+", body)


def test_no_name_or_number_of_a_scene_is_in_its_shader() -> None:
    scene = loads(scenes.ASSIGNMENT.read_text().replace("sphere1", "zanzibar").replace("2.7", "0.123456"))
    for evaluator in get_args(Evaluator):
        for vertex, fragment in sources(scene, Settings(evaluator=evaluator)).values():
            for text in (vertex.text, fragment.text):
                assert "zanzibar" not in text and "0.123456" not in text


def test_each_file_is_included_once_with_line_numbers_that_errors_refer_to() -> None:
    source = sources(scenes.assignment(), Settings(evaluator="roth"))["see"].fragment
    assert source.text.count("struct Ray {") == 1 and len(set(source.files)) == len(source.files)
    number = source.files.index("csg/roth.glsl")
    first = number * 1_000_000 + 1
    assert source.text.splitlines().count(f"#line {first}") == 1
    log = f"0:{first + 11}(5): error: boom; 0({first + 6}) : error; ERROR: 0:{first}: oh; 99:1"
    assert (
        source.explain(log)
        == "csg/roth.glsl:12: error: boom; csg/roth.glsl:7 : error; ERROR: csg/roth.glsl:1: oh; 99:1"
    )


def test_the_error_of_a_missing_include_names_the_including_file_and_line() -> None:
    with pytest.raises(ShaderError, match=r'top:2: no file "nowhere.glsl"'):
        assemble("top", generated={"top": '// one\n#include "nowhere.glsl"'})


def test_a_changed_file_is_read_again(shaders: Path) -> None:
    file = shaders / "passes/empty.frag"
    before = assemble("passes/empty.frag")
    assert assemble("passes/empty.frag") == before
    file.write_text(f"{file.read_text()}// more\n")
    assert assemble("passes/empty.frag").text == f"{before.text}// more\n"
    file.unlink()
    with pytest.raises(ShaderError, match=r'no file "passes/empty.frag"'):
        assemble("passes/empty.frag")


# Mesa reports the file number only for the first of these mistakes.
@pytest.mark.gl
@pytest.mark.parametrize("mistake", [" this is no GLSL", " int a = nothing;", " float b = vec2(1.0);"])
def test_a_compiler_error_names_the_file_and_line(renderer: Renderer, mistake: str) -> None:
    lines = (shaders_folder() / "geometry/camera.glsl").read_text().splitlines()
    number = next(i for i, line in enumerate(lines) if line.startswith("real2 halfPixels()")) + 1
    lines[number - 1] += mistake
    top = '#include "geometry/ray.glsl"\n#include "geometry/camera.glsl"\nvoid main() {}'
    broken = assemble("top", generated={"top": top, "geometry/camera.glsl": "\n".join(lines)})
    with pytest.raises(ShaderError, match=rf"geometry/camera\.glsl:{number}\b"), renderer.device.context:
        renderer.device.program(broken)


SHADERS = sorted(path for path in shaders_folder().rglob("*") if path.suffix in (".glsl", ".frag", ".vert"))


def test_every_shader_file_starts_with_its_purpose_and_what_it_provides() -> None:
    for path in SHADERS:
        first, second = path.read_text().splitlines()[:2]
        assert re.match(r"// [A-Z].*\.$", first) and len(first) <= 120, path
        assert second.startswith("// Provides ") or path.suffix != ".glsl", path


def test_the_shaders_readme_lists_exactly_the_shader_files_with_their_first_lines() -> None:
    table = (shaders_folder() / "README.md").read_text().partition("## The files")[2]
    rows = re.findall(r"^\| `([\w/.]+)` \| (.+) \|$", table, re.MULTILINE)
    folder, marks = shaders_folder(), "// ."
    files = [(p.relative_to(folder).as_posix(), p.read_text().splitlines()[0].strip(marks)) for p in SHADERS]
    assert sorted(rows) == sorted(files)


def test_no_two_shader_files_have_the_same_name() -> None:
    """Comments name a file without its folder, so its name must be unique."""
    assert len({path.name for path in SHADERS}) == len(SHADERS)
