"""The command line: exit statuses, messages, and files that are written whole or not at all."""

import json
import os
import select
import signal
import subprocess
import sys
import time
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

import raytracer
from raytracer.app.cli import main
from tests import scenes
from tests.displays import environment, x_server
from tests.processes import TIMEOUT, run_for_output, run_to_end, running_process

SCENE = str(scenes.ASSIGNMENT)
# `make test` names fewer backends on a system without OSMesa (Mesa 25.1 and later has none). Otherwise, all must open.
BACKENDS = os.environ.get("RAYTRACER_TEST_BACKENDS", "egl window osmesa").split()
needs_osmesa = pytest.mark.skipif("osmesa" not in BACKENDS, reason="this system has no OSMesa")


def test_render_writes_a_png_with_the_scene_the_settings_and_the_version(tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    assert main(["render", SCENE, "-o", str(out), "--size", "32x18", "--samples", "2", "--shading", "blinn"]) == 0
    with Pillow.open(out) as picture:
        assert picture.size == (32, 18) and picture.mode == "RGB"
        text = {key: str(value) for key, value in picture.info.items()}
    assert text["Title"] == "assignment" and text["Software"] == f"raytracer {raytracer.__version__}"
    assert "32x18" in text["Description"] and "samples=2" in text["Description"] and "blinn" in text["Description"]
    assert text["Samples"] == "2" and float(text["Seconds"]) > 0.0 and text["Error"].startswith("error ")
    assert list(tmp_path.iterdir()) == [out]


def test_render_writes_arrays_of_the_stated_shapes_and_types(tmp_path: Path) -> None:
    out = tmp_path / "a.npz"
    assert main(["render", SCENE, "-o", str(out), "--size", "32x18"]) == 0
    with np.load(out) as arrays:
        shapes = {name: (array.shape, array.dtype.str) for name, array in arrays.items()}
        sky, ground = arrays["depth"][0, 0], arrays["depth"][-1, 0]
        materials = arrays["material"]
        metadata = json.loads(str(arrays["metadata"]))
    metadata_layout = shapes.pop("metadata")
    assert metadata_layout[0] == () and metadata_layout[1].startswith("<U") and metadata["Title"] == "assignment"
    assert shapes == {
        "radiance": ((18, 32, 3), "<f4"),
        "depth": ((18, 32), "<f4"),
        "normal": ((18, 32, 3), "<f4"),
        "material": ((18, 32), "<i4"),
        "error": ((18, 32), "<f4"),
    }
    assert np.isinf(sky) and np.isfinite(ground), "the top row comes first"
    assert materials[0, 0] == -1 and materials[-1, 0] == 3, "materials are numbered in the order of the file"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--foo"], "unknown option '--foo' (see"),
        (["--versoin"], """unknown option '--versoin'; did you mean "--version"?"""),
        (["-x", "render"], "unknown option '-x'"),
        (["brdf", "--foo"], "unknown option '--foo' (see raytracer brdf"),
        (["paint"], "paint"),
        (["render"], "SCENE"),
        (["render", SCENE], "-o"),
        (["render", "nowhere.toml", "-o", "{tmp}/a.png"], "nowhere.toml"),
        (["render", "a" * 300, "-o", "{tmp}/a.png"], "expected a readable scene file"),
        (["render", "", "-o", "{tmp}/a.png"], "expected the path of a file, got ''"),
        (["render", SCENE, "-o", ""], "expected the path of a file, got ''"),
        (["compare", "", "a.png"], "expected the path of a file, got ''"),
        (["compare", "a.png", "a.png", "-o", ""], "expected the path of a file, got ''"),
        (["render", "/", "-o", "{tmp}/a.png"], "folder"),
        (["render", "/dev/zero", "-o", "{tmp}/a.png"], "device"),
        (["render", SCENE, "-o", "{tmp}/a.jpg"], "ends in .png or .npz"),
        (["render", SCENE, "-o", "{tmp}/a"], "ends in .png or .npz"),
        (["render", SCENE, "-o", "{tmp}/nowhere/a.png"], "a folder that exists"),
        (["render", SCENE, "-o", "{tmp}/" + "a" * 300 + ".png"], "too long"),
        (["render", SCENE, "-o", "/proc/a.png"], "a place that can be written to"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--size", "12"], "WIDTHxHEIGHT"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--size", "0x5"], "size"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--size", "-1x5"], "size"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--size", "99999999999x1"], "got (99999999999, 1)"),
        (["render", SCENE, "-o", "{tmp}/a.npz", "--size", "65536x65536"], "GiB"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--samples", "0"], "samples"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--samples", "many"], "samples"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--shading", "gouraud"], "gouraud"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--shadows", "long"], "long"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--backend", "vulkan"], "egl, window, osmesa"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--max-error", "0"], "max_error: expected a finite number above 0"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--max-error", "little"], "--max-error: invalid number value"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--time=-1"], "time: expected a finite number above 0 (seconds)"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--quality", "best"], "best"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--sequence", "grid", "--samples", "5"], "a square number"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--time", "1", "--adaptive", "0.1"], "adaptive: cannot be combined"),
        (["view", SCENE, "--sequence", "grid"], "sobol"),
        (["rendr"], 'did you mean "render"?'),
        (["render", SCENE, "-o", "{tmp}/a.png", "--sampels", "4"], 'did you mean "--samples"? (see raytracer render '),
        (["render", SCENE, "-o", "{tmp}/a.png", "--sampels=4"], 'did you mean "--samples"?'),
        (["render", SCENE, "-o=--"], "expected a value, got '--'"),
        (["trade", SCENE, "-o", "{tmp}/" + "a" * 300], "too long"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--size", "9" * 100_000], " ... "),
        (["render", SCENE, "-o", "{tmp}/a.png", "more"], "expected no more arguments, got 'more'"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--shading", "ggz"], 'did you mean "ggx"?'),
        (["render", SCENE, "-o", "{tmp}/a.png", "--shading", "merl"], "needs a file, which only a material can name"),
        (["tune", SCENE, "--time", "1", "--shading", "merl"], "needs a file, which only a material can name"),
        (["render", SCENE, "-o", "{tmp}/a.png", "--shadows", "sotf"], 'did you mean "soft"?'),
        (["brdf", "chek"], 'did you mean "check"?'),
        (["brdf", "list", "--jsno"], 'did you mean "--json"? (see raytracer brdf list --help)'),
        (["brdf", "check", "lambrt"], 'did you mean "lambert"?'),
        (["brdf", "check", "ggx", "--set", "aplha=1"], 'did you mean "alpha"?'),
        (["view", SCENE, "--size", "0x5"], "size"),
    ],
)
def test_wrong_input_is_status_2_and_one_line(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([argument.replace("{tmp}", str(tmp_path)) for argument in arguments]) == 2
    errors = capsys.readouterr().err
    assert message in errors and errors.count("\n") == 1 and errors.startswith("raytracer: ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", [[], ["render"], ["doctor"], ["view"]])
def test_help_shows_examples(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main([*command, "--help"])
    assert end.value.code == 0
    assert "examples:\n  raytracer " in capsys.readouterr().out


@pytest.mark.parametrize("command", [[], ["brdf"]])
def test_a_missing_command_prints_the_help_with_status_2(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main(command)
    said = capsys.readouterr()
    assert end.value.code == 2 and said.out.startswith("usage: ") and said.err == ""
    with pytest.raises(SystemExit):
        main([*command, "--help"])
    assert capsys.readouterr().out == said.out


@pytest.mark.parametrize(("command", "opens"), [("render", True), ("reference", False), ("compare", False)])
def test_the_help_mentions_opengl_only_for_commands_that_use_it(
    command: str, opens: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert ("OpenGL" in capsys.readouterr().out) == opens


SMALL = "--size", "64x36"


def test_a_missed_error_target_is_status_1_with_the_picture_and_a_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def run(*options: str) -> tuple[int, str, str]:
        out = tmp_path / "a.png"
        out.unlink(missing_ok=True)
        status = main(["render", SCENE, "-o", str(out), *SMALL, *options])
        assert out.exists()
        text = capsys.readouterr()
        return status, text.out, text.err

    status, says, errors = run("--max-error", "0.01")
    line = says.splitlines()[1]
    assert status == 0 and errors == "" and float(line.split()[2]) <= 0.01 and "(RMSE, linear radiance)" in line
    for options, says in (
        (("--max-error", "1e-6", "--samples", "8"), "8 samples were not enough: try more --samples"),
        (("--max-error", "1e-6", "--time", "0.05"), "0.05 s were not enough: try more --time"),
        (("--max-error", "0.01", "--samples", "1"), "unknown (1 sample per pixel)"),
    ):
        status, _, errors = run(*options)
        assert status == 1 and says in errors and errors.count("\n") == 1
    unfit = "--max-error", "0.01", "--sequence", "r2"
    assert main(["render", SCENE, "-o", str(tmp_path / "b.png"), *SMALL, *unfit]) == 2
    assert "sequence: expected sobol with max_error, got 'r2'" in capsys.readouterr().err
    assert not (tmp_path / "b.png").exists()
    status, says, errors = run("--quality", "high", "--samples", "4")
    assert status == 0 and "at most 0.0005 was requested" in says and not errors, "the quality limits the samples"


@pytest.mark.parametrize("in_file", [False, True])
def test_an_uncertain_error_estimate_never_reaches_the_target(
    in_file: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "glint.toml", tmp_path / "a.png"
    file.write_text(scenes.GLINT + ("[settings]\nmax_error = 0.5\nsamples = 8\n" if in_file else ""))
    options = [] if in_file else ["--max-error", "0.5", "--samples", "8"]
    assert main(["render", str(file), "-o", str(out), "--size", "160x90", *options]) == 1
    says, errors = capsys.readouterr()
    error = says.splitlines()[1]
    assert error.startswith("error at least ") and ", perhaps far more: " in error and "up to" not in error
    assert "the error is at least " in errors and "8 samples were not enough: try more --samples" in errors
    assert errors.count("\n") == 1
    with Pillow.open(out) as picture:
        assert picture.info["Error"] == error


def test_options_override_the_quality_which_overrides_the_files_settings(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"

    def drawn(settings: str, *options: str) -> str:
        file.write_text(scenes.ASSIGNMENT.read_text() + f"\n[settings]\n{settings}\n")
        out = tmp_path / "a.png"
        main(["render", str(file), "-o", str(out), "--shadows", "off", *options])
        with Pillow.open(out) as picture:
            return str(picture.info["Description"])

    for settings, options, description in (
        ("size = [9, 8]\nsamples = 2", (), "9x8, Settings(samples=2, "),
        ("size = [9, 8]\nsamples = 2", ("--size", "8x9", "--samples", "3"), "8x9, Settings(samples=3, "),
        ("size = [9, 8]\nquality = 'normal'", (), "samples=256, "),
        ("size = [9, 8]\nquality = 'normal'\nsamples = 4", (), "samples=4, "),
        ("size = [9, 8]\nmax_error = 0.1", (), "samples=4096, "),
        ("size = [9, 8]\nmax_error = 0.1", ("--quality", "draft"), "samples=1, "),
        ("size = [9, 8]\nmax_error = 0.1", ("--max-error", "none"), "max_error=None"),
        ("size = [9, 8]\nmax_error = 0.1", ("--adaptive", "0.2"), "adaptive=0.2"),
        ("size = [9, 8]\nadaptive = 0.1", (), "samples=4096, "),
        ("size = [9, 8]\nsamples = 2", ("--adaptive", "0.2"), "samples=4096, "),
        ("size = [9, 8]\nsamples = 5\nadaptive = 0.1", ("--adaptive", "0.2"), "samples=5, "),
        ("size = [9, 8]\nsamples = 2\nadaptive = 0.1", ("--max-error", "0.3"), "samples=4096, "),
        ("size = [9, 8]\nshading = 'ggx'\nshadows = 'soft'", ("--shading", "none"), "shading=None, shadows='off'"),
        ("size = [9, 8]\nsequence = 'grid'\nsamples = 4", ("--samples", "9"), "sequence='grid'"),
    ):
        assert description in drawn(settings, *options), (settings, options)


def test_a_conflict_of_the_files_settings_with_an_option_names_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(scenes.ASSIGNMENT.read_text() + "\n[settings]\nsequence = 'r2'\n")
    assert main(["render", str(file), "-o", str(tmp_path / "a.png"), "--max-error", "0.1"]) == 2
    says = capsys.readouterr().err
    assert f"{file}: [settings] and the options given: sequence: expected sobol with max_error, got 'r2'" in says


def start(*arguments: str, errors: int = subprocess.PIPE) -> AbstractContextManager[subprocess.Popen[bytes]]:
    return running_process(sys.executable, "-m", "raytracer", *arguments, cwd=scenes.CHECKOUT, stderr=errors)


def list_imports(*arguments: str) -> set[str]:
    """Return the names of all modules that are loaded when `raytracer *arguments` is done."""
    script = "import sys; from raytracer.app.cli import main; main(); print(*sys.modules)"
    return set(run_for_output(sys.executable, "-c", script, *arguments, cwd=scenes.CHECKOUT).splitlines()[-1].split())


def test_render_imports_only_the_modules_that_it_needs(tmp_path: Path) -> None:
    out = str(tmp_path / "a.png")
    modules = list_imports("render", SCENE, "-o", out, "--size", "8x8", "--backend", "egl")
    ours = {name.removeprefix("raytracer.") for name in modules if name.startswith("raytracer.")}
    assert {"numpy", "moderngl"} <= modules and {"formats.image", "rendering.renderer"} <= ours, (
        "this test sees the imported modules"
    )
    assert not modules & {"rich", "glfw", "tomlkit", "PIL", "asyncio", "logging", "tempfile", "ctypes.util", "numpy.ma"}
    assert not ours & {
        "analysis",
        "app.commands.doctor_cli",
        "gpu.context_report",
        "app.viewer.events",
        "app.viewer.overlay",
        "app.viewer.window",
        "formats.toml_lines",
        "gpu.glsl_call",
        "ground_truth",
        "rendering.progressive",
    }


def test_wrong_input_is_refused_before_numpy_and_opengl_are_imported(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[camera")
    assert not list_imports("render", str(wrong), "-o", str(tmp_path / "a.png")) & {"numpy", "moderngl", "glcontext"}


def test_ctrl_c_stops_cleanly_and_writes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    with start("render", SCENE, "-o", str(out), "--samples", "60000") as process:
        time.sleep(4)
        assert process.poll() is None, "still rendering"
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and errors == b"raytracer: interrupted, nothing written\n"
    assert list(tmp_path.iterdir()) == []


def test_progress_is_shown_on_a_terminal(tmp_path: Path) -> None:
    leader, terminal = os.openpty()
    with start("render", SCENE, "-o", str(tmp_path / "a.png"), "--samples", "600", errors=terminal) as process:
        os.close(terminal)
        shown = b""
        while select.select([leader], [], [], TIMEOUT)[0]:
            try:
                data = os.read(leader, 4096)
            except OSError:  # Linux raises it when the other end is closed
                break
            if not data:
                break
            shown += data
        os.close(leader)
        assert process.wait(timeout=120) == 0
    assert b"rendering a.png" in shown and b"%" in shown


def test_a_missing_opengl_context_is_status_1_with_the_attempts_and_a_remedy(tmp_path: Path) -> None:
    environment = {**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere", "RAYTRACER_BACKEND": "egl"}
    command = [sys.executable, "-m", "raytracer", "render", SCENE, "-o", str(tmp_path / "a.png"), "--size", "8x8"]
    done = run_to_end(*command, env=environment, cwd=scenes.CHECKOUT)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert "egl: " in done.stderr and "apt-get install" in done.stderr and "libegl1" in done.stderr


@pytest.mark.window
def test_every_backend_opens_here_and_renders_the_same_picture(tmp_path: Path) -> None:
    pictures = []
    with x_server(640, 480) as display:
        command = [sys.executable, "-m", "raytracer"]
        for backend in BACKENDS:
            out = tmp_path / f"{backend}.npz"
            options = ["render", SCENE, "-o", str(out), "--size", "160x90", "--backend", backend]
            run_for_output(*command, *options, env=environment(DISPLAY=display), cwd=scenes.CHECKOUT)
            pictures.append(np.load(out)["radiance"])
        options = ["doctor", "--json"]
        done = run_to_end(*command, *options, env=environment(DISPLAY=display), cwd=scenes.CHECKOUT)
    assert set(BACKENDS) <= {report["backend"] for report in json.loads(done.stdout) if report["opens"]}
    for picture in pictures[1:]:
        np.testing.assert_allclose(picture, pictures[0], atol=1e-5)


def test_doctor_names_each_backend_and_the_driver() -> None:
    command = [sys.executable, "-m", "raytracer", "doctor"]
    done = run_for_output(*command, cwd=scenes.CHECKOUT)
    for word in ("egl", "window", "osmesa", "Mesa", "16384"):
        assert word in done


@pytest.mark.window
@needs_osmesa
def test_opening_a_context_does_not_end_the_other_contexts_of_a_process() -> None:
    script = """
import raytracer as rt
scene = rt.Scene([rt.Sphere((0, 0, 0), 1)], [], rt.Camera((0, 0, 5), (0, 0, 0)))
first = rt.render(scene, (8, 8), backend="window").radiance
for backend in ("egl", "osmesa", "window"):
    try:
        assert (rt.render(scene, (8, 8), backend=backend).radiance == first).all()
    except rt.ContextError as error:
        assert backend == "osmesa" and "only one kind at a time" in str(error), error
"""
    with x_server(640, 480) as display:
        run_for_output(sys.executable, "-c", script, env=environment(DISPLAY=display), cwd=scenes.CHECKOUT)


@pytest.mark.window
@needs_osmesa
def test_a_window_that_fails_after_opening_does_not_block_the_next_context() -> None:
    script = """
from unittest import mock
import moderngl
from raytracer.gpu.context import ContextError, open_context
with mock.patch.object(moderngl, "create_context", side_effect=RuntimeError("OpenGL is too old")):
    try:
        open_context("window")
    except ContextError as error:
        assert "too old" in str(error)
open_context("osmesa")
"""
    with x_server(640, 480) as display:
        run_for_output(sys.executable, "-c", script, env=environment(DISPLAY=display), cwd=scenes.CHECKOUT)
