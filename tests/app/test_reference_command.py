"""`raytracer reference`: its output, the input that it refuses, and its reaction to Ctrl-C."""

from __future__ import annotations

import functools
import json
import operator
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.core import memory
from raytracer.ground_truth import cost, picture
from raytracer.ground_truth.converged import trace_converged
from raytracer.ground_truth.job import Job
from raytracer.scene.settings import Settings
from tests import scenes
from tests.processes import list_processes, running_process

SIZE = (48, 32)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the cache during a test."""
    monkeypatch.setenv("RAYTRACER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_reference_writes_the_arrays_and_prints_a_summary(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "ref.npz"
    command = ["reference", "assignment", "-o", str(out), "--size", "32x18", "--samples", "32", "--tolerance", "0.01"]
    assert main([*command, "--no-cache"]) == 0
    assert not folder.exists() and "from the cache" not in capsys.readouterr().out
    assert main(command) == 0
    said = capsys.readouterr().out
    assert re.fullmatch(r"wrote .*: 32x18, 16 to 32 samples per pixel, .* RMSE about 0\.00\d+, \d+\.\d s\n", said)
    assert main(command) == 0
    assert capsys.readouterr().out.endswith("from the cache\n")
    with np.load(out) as arrays:
        assert arrays["radiance"].shape == (18, 32, 3) and arrays["radiance"].dtype == np.float64
        assert {*arrays} == {"radiance", "depth", "normal", "material", "samples", "error", "metadata"}
        texts, mean = json.loads(str(arrays["metadata"])), arrays["samples"].mean()
    reference = "float64 reference(samples=32, tolerance=0.01, shading=None, shadows='hard', bounces=8)"
    assert (texts["Title"], texts["Description"]) == ("assignment", f"32x18, {reference}")
    assert texts["Samples"] == f"{mean:.6g}" and texts["Error"].startswith("error about 0.00")
    assert "Seconds" not in texts, "reading the cache takes another time than tracing"
    for arguments, message in (
        (["-o", str(tmp_path / "a.png")], "ends in .npz"),
        (["-o", str(out), "--samples", "3"], "samples"),
        (["-o", str(out), "--tolerance", "-1"], "tolerance"),
        (["-o", str(out), "--size", "0x1"], "size"),
    ):
        assert main(["reference", "assignment", *arguments]) == 2
        errors = capsys.readouterr().err
        assert message in errors and errors.count("\n") == 1


def test_an_error_that_few_pixels_hold_is_reported_as_a_lower_bound(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "glint.toml"
    file.write_text(scenes.GLINT)
    command = ["reference", str(file), "-o", str(tmp_path / "ref.npz"), "--size", "40x24", "--samples", "64"]
    for _ in range(2):  # once traced, once read from the cache
        assert main(command) == 0
        assert re.search(r", RMSE at least \d\S* \(few pixels hold most of it\), ", capsys.readouterr().out)


def test_reference_takes_settings_without_an_option_from_the_file(tmp_path: Path, folder: Path) -> None:
    file, out = tmp_path / "scene.toml", str(tmp_path / "ref.npz")
    file_settings = 'samples = 4\nsize = [640, 360]\nshading = "blinn"\nshadows = "diluted"\nbounces = 1\n'
    file.write_text(f"{scenes.ASSIGNMENT.read_text()}\n[settings]\n{file_settings}")
    command = ["reference", str(file), "-o", out, "--size", "16x9", "--samples", "16"]
    assert main(command) == 0 and main([*command, "--shading", "none", "--shadows", "off"]) == 0
    expected_settings = ({"shading": "blinn", "shadows": "diluted", "bounces": 1}, {"shadows": "off", "bounces": 1})
    cached = {*folder.iterdir()}
    for settings in expected_settings:
        trace_converged(rt.load(file), (16, 9), Settings(**settings), samples=16)
    assert len(cached) == 2 and {*folder.iterdir()} == cached, "both pictures were read from the cache"


def test_a_picture_too_large_for_the_memory_is_refused_before_tracing_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["reference", "assignment", "-o", str(tmp_path / "ref.npz")]
    monkeypatch.setattr(memory, "physical_memory", lambda: 2**34)
    assert main([*command, "--size", "65536x65536"]) == 2
    assert re.search(r"size: expected a picture that fits .* got 65536x65536, which needs", capsys.readouterr().err)
    monkeypatch.setattr(cost, "physical_memory", lambda: 20)
    with pytest.raises(rt.InputError, match=r"expected at most 4 primitives for the .* memory, got 5"):
        cost.check_cost(scenes.assignment(), SIZE, workers=1)


def test_the_expected_time_is_printed_before_tracing_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    job = Job(scenes.assignment(), (320, 180), Settings())
    tried = cost.estimate_cost(job, workers=1)
    assert tried.is_measured and 1.0 < tried.seconds < 600.0
    assert cost.estimate_cost(msgspec.structs.replace(job, samples=4096), workers=1).seconds > 1.5 * tried.seconds
    row = functools.reduce(operator.or_, [rt.Sphere((x, 0, 0), 1) for x in range(2000)])
    many = rt.Scene([row], [], rt.Camera((0, 0, 5), (0, 0, 0)))
    guessed = cost.estimate_cost(Job(many, (320, 180), Settings()), workers=1)
    assert re.fullmatch("at least [0-9]+ (hours|days): each ray is tested against all 2000 primitives", str(guessed))
    monkeypatch.setattr(picture, "WARN_SECONDS", 0.0)
    command = ["reference", "assignment", "-o", str(tmp_path / "a.npz"), "--size", "16x9", "--samples", "16"]
    for says in (1, 0):  # the second picture is read from the cache, without a message
        assert main(command) == 0
        assert capsys.readouterr().err.count("raytracer: this takes about 0 seconds: each ray is tested") == says


def test_ctrl_c_ends_all_its_processes_and_writes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "ref.npz"
    command = [sys.executable, "-m", "raytracer", "reference", "materials", "--shadows", "soft", "-o", str(out)]
    with running_process(*command, cwd=scenes.CHECKOUT, stderr=subprocess.PIPE) as process:
        deadline = time.monotonic() + 60
        # The command itself, multiprocessing's resource tracker, and one worker.
        while len(list_processes(process.pid)) < 3 and time.monotonic() < deadline:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        deadline = time.monotonic() + 10
        while (remaining := list_processes(process.pid)) and time.monotonic() < deadline:
            time.sleep(0.1)
    assert process.returncode == 130 and errors.endswith(b"raytracer: interrupted, nothing written\n")
    assert b"Traceback" not in errors
    assert not out.exists() and not (tmp_path / "cache").exists()
    assert not remaining
