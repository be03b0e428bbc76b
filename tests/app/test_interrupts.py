"""Ctrl-C at any time: exit status 130, or 0 when all is done; at most one line, and no half-written file."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from raytracer.core.interrupts import defer_interrupts
from tests import scenes

SCENE = str(scenes.ASSIGNMENT)
LINE = "raytracer: interrupted, nothing written\n"
PRESS = """
import signal, sys
def press():
    signal.raise_signal(signal.SIGINT)
"""
# Presses Ctrl-C once, when the import of the module `name` begins.
AT_IMPORT = """
class Finder:
    def find_spec(self, name, *_):
        if name == {name!r}:
            sys.meta_path.remove(self)
            press()
sys.meta_path.insert(0, Finder())
"""
RUN = """
from raytracer.__main__ import main
sys.argv = ["raytracer", "render", "assignment", "-o", {out!r}, "--size", "64x36", "--backend", "egl"]
sys.exit(main())
"""


def run(script: str, out: Path, *, handler: str = "default_int_handler") -> tuple[int, str]:
    """Run `script`, then a rendering; return the exit status and standard error.

    `handler` is set for SIGINT before the script, as a parent of the tests may ignore the signal.
    """
    text = PRESS + f"signal.signal(signal.SIGINT, signal.{handler})\n" + script + RUN.format(out=str(out))
    # The process is killed after the timeout.
    done = subprocess.run(
        [sys.executable, "-c", text], cwd=scenes.CHECKOUT, capture_output=True, text=True, timeout=100
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    "module",
    [
        "signal",
        "argparse",
        "raytracer.app.cli",
        "msgspec",
        "numpy",
        "numpy.linalg",
        "raytracer.formats.image",
        "moderngl",
    ],
)
def test_ctrl_c_during_an_import_prints_one_line_without_a_traceback(module: str, tmp_path: Path) -> None:
    # The module `signal` is imported before the program has a handler, and so before the program can print a line.
    out = tmp_path / "a.npz"
    preload = "del sys.modules['signal']\n" if module == "signal" else ""
    status, errors = run(AT_IMPORT.format(name=module) + preload, out)
    assert (status, errors) == (130, "" if module == "signal" else LINE)
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_during_an_import_is_status_130_even_without_standard_error(tmp_path: Path) -> None:
    script = "import os; os.close(2)\n" + AT_IMPORT.format(name="msgspec")
    assert run(script, tmp_path / "a.npz") == (130, "")


def test_no_slow_module_is_imported_before_the_handler_is_installed() -> None:
    script = "import sys; before = set(sys.modules); import raytracer.__main__; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", script], cwd=scenes.CHECKOUT, capture_output=True, text=True)
    assert set(done.stdout.split()) <= {"raytracer", "raytracer.__main__", "__future__"}


@pytest.mark.gl
def test_ctrl_c_while_the_file_is_written_removes_the_file(tmp_path: Path) -> None:
    script = """
import numpy as np
def interrupted(file, **arrays):
    file.write(b"half")
    press()
np.savez = interrupted
"""
    assert run(script, tmp_path / "a.npz") == (130, LINE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.gl
def test_ctrl_c_as_the_file_is_created_removes_the_file(tmp_path: Path) -> None:
    script = """
import os
def interrupted(path, *arguments):
    number = opened(path, *arguments)
    if str(path).endswith(".part"):
        press()
    return number
opened, os.open = os.open, interrupted
"""
    assert run(script, tmp_path / "a.npz") == (130, LINE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.gl
@pytest.mark.parametrize("function", ["pathlib.Path.replace", "raytracer.app.commands.render_cli.print_lines"])
def test_ctrl_c_between_writing_and_the_message_still_reports_the_written_file(function: str, tmp_path: Path) -> None:
    module, _, name = function.rpartition(".")
    script = f"""
import pathlib, raytracer.app.commands.render_cli
def interrupted(*arguments):
    {"done = original(*arguments); press(); return done" if name == "replace" else "press()"}
original, {module}.{name} = {module}.{name}, interrupted
"""
    out = tmp_path / "a.npz"
    assert run(script, out) == (130, f"raytracer: interrupted, after writing {out}\n")
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.gl
@pytest.mark.parametrize(
    ("when", "status"), [("import atexit\natexit.register(press)\n", 0), ("class Late:\n    __del__ = press\n", 0)]
)
def test_ctrl_c_after_the_last_message_has_no_effect(when: str, status: int, tmp_path: Path) -> None:
    out = tmp_path / "a.npz"
    assert run(when, out) == (status, "")
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.gl
def test_ctrl_c_in_a_destructor_is_not_lost(tmp_path: Path) -> None:
    script = """
import raytracer.rendering.renderer as module
class Fragile:
    def __del__(self):
        press()
def render(*_, **__):
    import time
    fragile = Fragile()
    del fragile
    time.sleep(60)
module.Renderer.render = render
"""
    assert run(script, tmp_path / "a.npz") == (130, LINE)


@pytest.mark.gl
def test_ctrl_c_that_c_code_turns_into_another_error_is_still_an_interrupt(tmp_path: Path) -> None:
    script = """
import raytracer.rendering.renderer as module
def render(*_, **__):
    try:
        press()
    except KeyboardInterrupt:
        raise SystemError("returned a result with an exception set")
module.Renderer.render = render
"""
    status, errors = run(script, tmp_path / "a.npz")
    assert status == 130 and "Traceback" not in errors


@pytest.mark.gl
def test_a_second_ctrl_c_does_not_stop_the_clean_up(tmp_path: Path) -> None:
    script = """
import raytracer.rendering.renderer as module
def render(*_, **__):
    try:
        press()
    finally:
        press()
        print("cleaned up", file=sys.stderr)
module.Renderer.render = render
"""
    assert run(script, tmp_path / "a.npz") == (130, "cleaned up\n" + LINE)


@pytest.mark.gl
def test_ctrl_c_stays_ignored_if_the_parent_ignores_it(tmp_path: Path) -> None:
    out = tmp_path / "a.npz"
    assert run(AT_IMPORT.format(name="numpy"), out, handler="SIG_IGN") == (0, "")
    assert list(tmp_path.iterdir()) == [out]


def test_a_deferred_interrupt_is_raised_at_the_end_of_the_block() -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    reached = False
    try:
        with pytest.raises(KeyboardInterrupt), defer_interrupts():
            os.kill(os.getpid(), signal.SIGINT)
            reached = True
        assert reached and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with defer_interrupts():
            os.kill(os.getpid(), signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


def test_deferred_changes_no_error_in_other_threads_which_receive_no_interrupts() -> None:
    def fail() -> None:
        with defer_interrupts():
            raise OSError

    with ThreadPoolExecutor(1) as threads:
        error = threads.submit(fail).exception()
    assert isinstance(error, OSError) and error.__context__ is None


@pytest.mark.gl
def test_ctrl_c_waits_while_moderngl_makes_a_program_as_it_would_crash() -> None:
    script = """
import signal, sys
import raytracer as rt
signal.signal(signal.SIGINT, signal.default_int_handler)
def press(frame, event, _):  # during a call from C for each uniform
    if event == "call" and frame.f_code.co_name.startswith("make_uniform"):
        signal.raise_signal(signal.SIGINT)
sys.setprofile(press)
try:
    rt.render(rt.load("assignment"), (8, 8), backend="egl")
except KeyboardInterrupt:
    sys.setprofile(None)
    print("interrupted")
"""
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, text=True, timeout=100)
    assert (done.returncode, done.stdout) == (0, "interrupted\n"), done.stderr
