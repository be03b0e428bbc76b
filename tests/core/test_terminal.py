"""Printed text: no name breaks it or controls the terminal, and slow work reports its progress."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from raytracer.analysis.numerics import ledger, views
from raytracer.app.cli import main
from raytracer.core import progress
from raytracer.core.progress import progress_bar, step_bar
from raytracer.rendering.renderer import Renderer
from tests import scenes

# Red text, the terminal's title, a line that looks like the program's own, a byte that is not UTF-8, text from right to
# left, an é, and a code that clears the line before.
NAME = "\x1b[31m\x1b]0;x\x07\nraytracer: \udce9\u202e\u00e9\x7f\x9b2K"
ENCODINGS = [
    {},
    {"PYTHONIOENCODING": "ascii"},
    {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    {"LC_ALL": "C", "PYTHONUTF8": "1"},
]


def run(*arguments: str | bytes, folder: Path, **environment: str) -> tuple[int, bytes]:
    """Run a command; return its exit status and its output."""
    command = [sys.executable, "-m", "raytracer", *arguments]
    variables = {**os.environ, "PYTHONPATH": str(scenes.CHECKOUT), "RAYTRACER_BACKEND": "egl", **environment}
    done = subprocess.run(
        command, cwd=folder, env=variables, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=100
    )
    return done.returncode, done.stdout


def is_plain(printed: bytes) -> bool:
    """Return whether `printed` consists of lines of printable text."""
    return all(line.isprintable() for line in printed.decode().split("\n"))


@pytest.mark.gl
@pytest.mark.parametrize("environment", ENCODINGS)
@pytest.mark.parametrize("name", [b"caf\xe9.png", "caf\u00e9.png".encode(), os.fsencode(NAME + ".png")])
def test_a_file_of_any_name_is_written_and_reported(name: bytes, environment: dict[str, str], tmp_path: Path) -> None:
    status, printed = run("render", "assignment", "-o", name, "--size", "8x8", folder=tmp_path, **environment)
    assert status == 0 and printed.startswith(b"wrote ") and printed.count(b"\n") == 2, printed
    assert is_plain(printed)
    assert os.listdir(os.fsencode(tmp_path)) == [name]


@pytest.mark.gl
def test_a_scene_file_of_any_name_is_rendered_and_its_mistakes_are_reported(tmp_path: Path) -> None:
    text = scenes.ASSIGNMENT.read_text()
    scene = tmp_path / os.fsdecode(os.fsencode(NAME.replace("/", "") + ".toml"))
    scene.write_text(text.replace("kd = [0.64", "kd = [64").replace("red", '"\\u001b[31m\\u009b"').replace('""', '"'))
    status, printed = run("render", scene.name, "-o", "a.png", "--size", "8x8", folder=tmp_path)
    assert status == 0 and b"kd = 64" in printed and is_plain(printed) and printed.count(b"\n") == 3
    scene.write_text(text.replace("[lights]", '["\\u001b[31m"]'))
    status, printed = run("render", scene.name, "-o", "a.png", folder=tmp_path)
    assert status == 2 and is_plain(printed) and printed.count(b"\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        [NAME],
        ["render", NAME, "-o", "a.png"],
        ["render", "assignment", "-o", NAME],
        ["render", "assignment", "-o", NAME + "/a.png"],
        ["render", "assignment", "-o", "a.png", NAME],
        ["render", "assignment", "-o", "a.png", "--" + NAME],
        ["render", "assignment", "-o", "a.png", "--size", NAME],
        ["render", "assignment", "-o", "a.png", "--shading", NAME],
        ["render", "assignment", "-o", "a.png", "--samples", NAME],
        ["render", "assignment", "-o", "a.png", "--time", NAME],
        ["render", "assignment", "-o", "a.png", "--backend", NAME],
        ["view", NAME],
        ["reference", NAME, "-o", "a.npz"],
        ["reference", "assignment", "-o", NAME],
        ["compare", NAME, NAME],
        ["compare", NAME + ".png", NAME + ".npz"],
        ["trade", NAME, "-o", "."],
        ["trade", "assignment", "-o", NAME + "/a"],
        ["tune", NAME, "--time", "1"],
        ["extremes", "-o", NAME],
        ["brdf", NAME],
        ["brdf", "list", NAME],
        ["brdf", "check", NAME],
        ["brdf", "check", "ggx", "--set", NAME],
        ["brdf", "check", "ggx", "--set", f"alpha={NAME}"],
        ["brdf", "check", "ggx", "--set", f"fresnel={NAME}"],
        ["brdf", "check", "merl", "--set", f"file={NAME}"],
        ["brdf", "plot", NAME, "-o", "a.png"],
        ["brdf", "plot", f"ggx:{NAME}", "-o", "a.png"],
        ["brdf", "plot", "ggx", "-o", NAME],
        ["brdf", "gallery", "-o", NAME],
        ["brdf", "gallery", "-o", "a.png", "--merl", NAME],
        ["brdf", "bake", NAME, "-o", "a.binary"],
        ["brdf", "bake", "ggx", "-o", NAME],
        ["doctor", NAME],
    ],
    ids=lambda arguments: " ".join(arguments).replace(NAME, "NAME"),
)
def test_every_command_reports_a_wrong_name_in_one_printable_line(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert not printed.out and printed.err.startswith("raytracer: ") and is_plain(printed.err.encode())
    assert printed.err.count("\n") == 1 and not list(tmp_path.iterdir())


@pytest.mark.gl
def test_json_output_with_any_name_is_valid_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    name = NAME + ".png"
    assert main(["render", "assignment", "-o", name, "--size", "8x8"]) == 0
    capsys.readouterr()
    assert main(["compare", name, name, "--json"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed)["a"] == name and is_plain(printed.encode())
    assert main(["compare", name, name, "-o", name]) == 0
    assert is_plain(capsys.readouterr().out.encode())


def test_output_to_a_full_disk_is_status_1_with_one_line() -> None:
    command = [sys.executable, "-m", "raytracer", "brdf", "list", "--markdown"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, cwd=scenes.CHECKOUT, stdout=full, stderr=subprocess.PIPE, timeout=100, text=True)
    assert (done.returncode, done.stderr) == (1, "raytracer: [Errno 28] No space left on device\n")


def run_closed(arguments: str, stream: str) -> subprocess.CompletedProcess[str]:
    """Run a command with one standard stream closed."""
    command = ["sh", "-c", f"exec '{sys.executable}' -m raytracer {arguments} {stream}"]
    return subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, timeout=100, text=True)


def test_errors_never_go_to_standard_output_if_standard_error_is_closed() -> None:
    done = run_closed("compare nowhere.png nowhere.png", "2>&-")
    assert (done.returncode, done.stdout) == (2, "")


@pytest.mark.gl
def test_a_table_is_dropped_if_standard_output_is_closed() -> None:
    done = run_closed("doctor", ">&-")
    assert (done.returncode, done.stderr) == (0, "")


def test_without_a_terminal_only_slow_work_reports_progress_in_a_few_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    steps = ((0, 400), (1, 400), (3, 400), (100, 400), (100, 400), (400, 400))
    with progress_bar("tracing") as report:
        for done, total in steps:
            report(done, total)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(progress, "_SECONDS_WITHOUT_LINE", 0.0)
    with step_bar("tracing\x1b[31m") as report:
        for done, total in steps:
            report(done, total)
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["tracing\\x1b[31m", "tracing\\x1b[31m: 0 %", "tracing\\x1b[31m: 25 %, 0 s left"]


@pytest.mark.gl
def test_extremes_names_each_measurement_before_it_starts(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[str] = []
    monkeypatch.setattr(ledger, "ROWS", (views.far_sphere,))
    ledger.measure_ledger(renderer, short=True, scenes=2, step=steps.append)
    assert steps == ["measuring far sphere", "measuring 2 random scenes"]
