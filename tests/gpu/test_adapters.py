"""The choice of the EGL device: by its index, by a part of its name, or hardware before software."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.gpu import adapters, context, context_report
from raytracer.gpu.adapters import choose_adapter, open_adapter
from raytracer.gpu.context import choose_backend
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import Renderer
from tests import scenes

LLVMPIPE = "llvmpipe (LLVM 15.0.6, 256 bits)", "Mesa/X.org"
NVIDIA = "NVIDIA H200/PCIe/SSE2", "NVIDIA Corporation"
RADEON = "AMD Radeon RX 6800 (radeonsi, navi21)", "AMD"
BROKEN = "eglInitialize failed (0x3001)"


class FakeContext:
    """A context on a device that this machine does not need to have."""

    current: FakeContext | None = None

    def __init__(self, name: tuple[str, str]) -> None:
        self.info = {"GL_RENDERER": name[0], "GL_VENDOR": name[1], "GL_VERSION": "4.6"}
        self.info |= {"GL_MAX_TEXTURE_SIZE": 16384, "GL_MAX_UNIFORM_BLOCK_SIZE": 65536}  # pyright: ignore
        self.released = False
        FakeContext.current = self

    def __enter__(self) -> None:
        FakeContext.current = self

    def __exit__(self, *_: object) -> None:
        FakeContext.current = None

    def release(self) -> None:
        assert FakeContext.current is not self, (
            "a context must not be current when it is released, or the next context does not open"
        )
        self.released = True


def machine(monkeypatch: pytest.MonkeyPatch, *names: Any) -> list[FakeContext]:
    """Replace the machine's devices by fakes, and return the list to which each opened context is added.

    `names` has a device each: (renderer, vendor), or for a device that does not open, the text of its error.
    """
    opened: list[FakeContext] = []

    def open_one(index: int) -> FakeContext:
        if index >= len(names):
            raise Exception(f"requested device index {index}, but found {len(names)} devices")
        if isinstance(names[index], str):
            raise Exception(names[index])
        opened.append(FakeContext(names[index]))
        return opened[-1]

    monkeypatch.setattr(adapters, "_open", open_one)
    return opened


@pytest.mark.parametrize(
    ("names", "device", "expected", "opens"),
    [
        ([LLVMPIPE], None, LLVMPIPE, 1),
        ([NVIDIA, LLVMPIPE], None, NVIDIA, 1),
        ([LLVMPIPE, NVIDIA, RADEON], None, NVIDIA, 2),
        ([("softpipe", "Mesa"), LLVMPIPE], None, ("softpipe", "Mesa"), 2),
        ([BROKEN, LLVMPIPE, BROKEN], None, LLVMPIPE, 1),
        ([LLVMPIPE, NVIDIA, RADEON], 0, LLVMPIPE, 1),
        ([LLVMPIPE, NVIDIA, RADEON], "2", RADEON, 1),
        ([LLVMPIPE, NVIDIA, RADEON], np.int64(1), NVIDIA, 1),
        ([LLVMPIPE, NVIDIA, RADEON], " radeon rx", RADEON, 3),
        ([NVIDIA, BROKEN, LLVMPIPE], "LLVMpipe", LLVMPIPE, 2),
        ([LLVMPIPE, NVIDIA], "corporation", NVIDIA, 2),
    ],
)
def test_the_requested_device_is_current_and_no_other_device_stays_open(
    monkeypatch: pytest.MonkeyPatch, names: list[Any], device: Any, expected: tuple[str, str], opens: int
) -> None:
    opened = machine(monkeypatch, *names)
    context: Any = open_adapter(choose_adapter(device))
    assert (context.info["GL_RENDERER"], context.info["GL_VENDOR"]) == expected
    assert FakeContext.current is context
    assert [other for other in opened if not other.released] == [context]
    assert len(opened) == opens, "no device is opened twice or without need"


@pytest.mark.parametrize("device", [2, "matrox", "-1"])
def test_the_error_about_a_missing_device_lists_the_existing_devices(
    monkeypatch: pytest.MonkeyPatch, device: int | str
) -> None:
    opened = machine(monkeypatch, LLVMPIPE, BROKEN)
    with pytest.raises(rt.InputError, match=r"^device: expected .* 0 \(llvmpipe .*\); 1 \(eglInit.*\); got ") as error:
        open_adapter(choose_adapter(device))
    assert str(error.value).endswith(repr(device)) and "\n" not in str(error.value)
    assert all(context.released for context in opened)


def test_the_error_about_a_missing_device_names_the_variable_or_the_parameter(monkeypatch: pytest.MonkeyPatch) -> None:
    machine(monkeypatch, LLVMPIPE)
    monkeypatch.delenv("RAYTRACER_BACKEND", raising=False)
    monkeypatch.setenv("RAYTRACER_DEVICE", "matrox")
    with pytest.raises(rt.InputError, match=r"^RAYTRACER_DEVICE: expected the index"):
        shared_device()
    with pytest.raises(rt.InputError, match=r"^device: expected the index"):
        shared_device(adapter="matrox")


def test_the_error_about_a_device_that_does_not_open_states_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    machine(monkeypatch, LLVMPIPE, BROKEN)
    with pytest.raises(RuntimeError, match=r"^device 1: eglInitialize failed \(0x3001\)$"):
        open_adapter(1)
    machine(monkeypatch)
    for device in (None, 0, "nvidia"):
        with pytest.raises(RuntimeError, match=r"^no EGL device$"):
            open_adapter(device)


@pytest.mark.parametrize("device", [-1, True, 1.5, "", "  ", [0], np.bool_(True)])
def test_a_value_that_names_no_device_is_refused(device: Any) -> None:
    with pytest.raises(rt.InputError, match=r"^device: expected the index of an EGL device, or a part of its name"):
        choose_adapter(device)


def test_the_argument_overrides_the_variable_and_both_apply_to_egl_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RAYTRACER_BACKEND", raising=False)
    monkeypatch.setenv("RAYTRACER_DEVICE", "NVIDIA")
    assert choose_backend() == choose_backend("egl") == ("egl", "nvidia")
    assert choose_backend(adapter=1) == ("egl", 1)
    assert choose_backend("osmesa") == ("osmesa", None)
    with pytest.raises(
        rt.InputError, match=r"^device: expected the backend egl, the only one with devices, got .* osmesa"
    ):
        choose_backend("osmesa", 1)
    monkeypatch.setenv("RAYTRACER_DEVICE", "")
    assert choose_backend() == ("auto", None)


def test_doctor_reports_the_error_of_a_backend_that_does_not_open(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> NoReturn:
        raise RuntimeError("window: no screen\nand no hope")

    monkeypatch.setitem(context._OPENERS, "window", fail)
    monkeypatch.setattr(context_report, "BACKENDS", ("window",))
    [report] = context_report.examine_contexts()
    assert not report.opens and report.problem == "window: no screen\nand no hope"
    with pytest.raises(rt.ContextError, match=r"^no OpenGL") as failed:
        context.open_context("window")
    assert failed.value.problems == {"window": report.problem}


def test_doctor_lists_every_device(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    opened = machine(monkeypatch, LLVMPIPE, BROKEN, NVIDIA)
    monkeypatch.setattr(context_report, "BACKENDS", ("egl",))
    assert main(["doctor", "--json"]) == 0
    assert all(context.released for context in opened)
    reports = json.loads(capsys.readouterr().out)
    assert [(r["backend"], r["device"], r["opens"]) for r in reports] == [
        ("egl", 0, True),
        ("egl", 1, False),
        ("egl", 2, True),
    ]
    assert [r["renderer"] for r in reports] == [LLVMPIPE[0], "", NVIDIA[0]] and reports[1]["problem"] == BROKEN
    assert main(["doctor"]) == 0
    table = capsys.readouterr().out
    assert all(word in table for word in ("egl 0", "egl 1", "egl 2", "H200")) and "apt-get" not in table


@pytest.mark.gl
def test_the_requested_device_draws_the_picture(renderer: Renderer) -> None:
    environment = os.environ | {"RAYTRACER_BACKEND": "egl"}
    own = [sys.executable, "-m", "raytracer"]
    done = subprocess.run([*own, "doctor", "--json"], cwd=scenes.CHECKOUT, env=environment, stdout=-1, check=True)
    usable = [r for r in json.loads(done.stdout) if r["backend"] == "egl" and r["opens"]]
    if not usable:
        pytest.skip("no EGL device")
    for device in (usable[-1]["device"], usable[-1]["renderer"].upper()):
        image = rt.render(scenes.lit_scene(rt.Sphere((0, 0, 0), 1)), (16, 9), backend="egl", device=device)
        assert image.radiance.any()
        assert shared_device("egl", device).limits.driver == usable[-1]["renderer"]
    with pytest.raises(rt.InputError, match=r"^device: expected .*; got 63$"):
        rt.render(scenes.lit_scene(rt.Sphere((0, 0, 0), 1)), (16, 9), backend="egl", device=63)


@pytest.mark.gl
def test_the_command_line_accepts_a_device(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.png"
    command = ["render", str(scenes.ASSIGNMENT), "-o", str(out), "--size", "8x8", "--device", "63"]
    assert main(command) == 2
    assert capsys.readouterr().err.startswith("raytracer: device: expected ") and not out.exists()
