"""An X server for tests that open windows, and `raytracer view` on it."""

import ctypes
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from subprocess import Popen
from typing import IO, Any

import numpy as np
from PIL import ImageGrab

from .processes import run_for_output, running_process
from .scenes import CHECKOUT

# The size of the window in pixels.
SIZE = (320, 180)
# Seconds, for actions that take a few seconds on two slow cores.
TIMEOUT = 120.0
# Variables that would lead to another window system than the test's own.
SESSION = ("DISPLAY", "WAYLAND_DISPLAY", "XDG_SESSION_TYPE")


@contextmanager
def x_server(width: int, height: int, scale: int = 1) -> Iterator[str]:
    """Start an X server with a display of this size in pixels and this display scale; yield the display's name.

    A missing Xvfb is a failure.
    """
    for program in ("Xvfb", "xdotool"):
        assert shutil.which(program), f"{program} is missing: apt-get install xvfb xdotool"
    read, write = os.pipe()
    command = ("Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24", "-noreset", "-nolisten", "tcp")
    with running_process(*command, pass_fds=[write]) as server:
        os.close(write)
        try:
            with open(read) as pipe:
                number = pipe.readline().strip()
            assert number, "Xvfb did not start"
            _set_resources(f":{number}", f"Xft.dpi:\t{96 * scale}\n".encode())
            yield f":{number}"
        finally:
            server.terminate()  # a killed server would leave files
            server.wait(60)


def _set_resources(display: str, text: bytes) -> None:
    """Set the X resources as xrdb does. Programs read the display scale there."""
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XDefaultRootWindow.restype = x11.XInternAtom.restype = ctypes.c_ulong
    connection = ctypes.c_void_p(x11.XOpenDisplay(display.encode()))
    root = ctypes.c_ulong(x11.XDefaultRootWindow(connection))
    atoms = [ctypes.c_ulong(x11.XInternAtom(connection, name, False)) for name in (b"RESOURCE_MANAGER", b"STRING")]
    x11.XChangeProperty(connection, root, *atoms, 8, 0, text, len(text))
    x11.XCloseDisplay(connection)


def environment(**variables: str) -> dict[str, str]:
    """Return this process's environment without its own window system, with `variables` added."""
    return {name: value for name, value in os.environ.items() if name not in SESSION} | variables


def grab_picture(display: str, size: tuple[int, int] = SIZE) -> np.ndarray:
    """Return the upper left part of a display as int [H, W, 3]."""
    picture = ImageGrab.grab((0, 0, *size), xdisplay=display)
    return np.asarray(picture.convert("RGB")).astype(int)


class Window:
    """A process of `raytracer view`, with the picture that it shows and the actions of a user."""

    def __init__(
        self, process: Popen[Any], display: str, variables: Mapping[str, str], output: IO[str], errors: IO[str]
    ) -> None:
        self.process, self.display, self.variables = process, display, variables
        self.output, self.errors = output, errors

    def act(self, actions: str) -> None:
        """Run xdotool with these words."""
        run_for_output("xdotool", *actions.split(), env=self.variables)

    def grab_picture(self, size: tuple[int, int] = SIZE) -> np.ndarray:
        """Return the upper left part of the display as int [H, W, 3]."""
        return grab_picture(self.display, size)

    def wait_until(self, is_met: Callable[[], bool], failure: str, seconds: float = TIMEOUT) -> float:
        """Wait until a condition holds, else fail with the message `failure`; return the seconds that it took."""
        begin = time.monotonic()
        while not is_met():
            assert self.process.poll() is None, self.read_output(self.errors)
            assert time.monotonic() < begin + seconds, f"{failure}\n{self.read_output(self.errors)}"
            time.sleep(0.02)
        return time.monotonic() - begin

    def wait_until_shown(self, wanted: np.ndarray, after: str) -> None:
        """Wait until the display shows a picture, to 1/255 at every pixel."""
        size = wanted.shape[1], wanted.shape[0]
        self.wait_until(
            lambda: bool(np.abs(self.grab_picture(size) - wanted).max() <= 1), f"not the picture due after {after}"
        )

    def read_output(self, file: IO[str]) -> str:
        """Return the text that the process has written to a file so far."""
        file.seek(0)
        return file.read()

    def close(self) -> str:
        """Press Escape; return standard output."""
        self.act("key Escape")
        assert self.process.wait(TIMEOUT) == 0, self.read_output(self.errors)
        return self.read_output(self.output)


@contextmanager
def window(
    folder: Path, *arguments: str, size: tuple[int, int] = SIZE, display: tuple[int, int] = SIZE, scale: int = 1
) -> Iterator[Window]:
    """Open a window on a display of its own, with the mouse in its middle.

    Without a window manager the window is at (0, 0).
    """
    command = (sys.executable, "-m", "raytracer", "view", *arguments, "--size", f"{size[0]}x{size[1]}")
    with (
        x_server(*display, scale) as name,
        # Files, not pipes: pipes would have to be read all the time.
        tempfile.TemporaryFile("w+") as output,
        tempfile.TemporaryFile("w+") as errors,
    ):
        variables = environment(DISPLAY=name, PYTHONPATH=str(CHECKOUT))
        with running_process(*command, cwd=folder, env=variables, stdout=output, stderr=errors) as process:
            opened = Window(process, name, variables, output, errors)
            opened.wait_until(lambda: opened.grab_picture(display).max() > 0, "nothing is shown")
            opened.act(f"mousemove {display[0] // 2} {display[1] // 2}")
            yield opened
