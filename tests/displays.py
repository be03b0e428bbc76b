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

from .processes import output_of, running
from .scenes import CHECKOUT

# Of the window, in pixels.
SIZE = (320, 180)
# For what takes a few seconds on two slow cores.
TIMEOUT = 120.0
# What would lead to another window system than the one that the test gives.
SESSION = ("DISPLAY", "WAYLAND_DISPLAY", "XDG_SESSION_TYPE")


@contextmanager
def x_server(width: int, height: int, scale: int = 1) -> Iterator[str]:
    """The name of a display of that size in pixels, and of that display scale. A missing Xvfb is a failure."""
    for program in ("Xvfb", "xdotool"):
        assert shutil.which(program), f"{program} is missing: apt-get install xvfb xdotool"
    read, write = os.pipe()
    command = ("Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24", "-noreset", "-nolisten", "tcp")
    with running(*command, pass_fds=[write]) as server:
        os.close(write)
        try:
            with open(read) as pipe:
                number = pipe.readline().strip()
            assert number, "Xvfb did not start"
            _set_resources(f":{number}", f"Xft.dpi:\t{96 * scale}\n".encode())
            yield f":{number}"
        finally:
            server.terminate()  # killed, it would leave files
            server.wait(60)


def _set_resources(display: str, text: bytes) -> None:
    """What xrdb does: programs find the display's scale there."""
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XDefaultRootWindow.restype = x11.XInternAtom.restype = ctypes.c_ulong
    connection = ctypes.c_void_p(x11.XOpenDisplay(display.encode()))
    root = ctypes.c_ulong(x11.XDefaultRootWindow(connection))
    atoms = [ctypes.c_ulong(x11.XInternAtom(connection, name, False)) for name in (b"RESOURCE_MANAGER", b"STRING")]
    x11.XChangeProperty(connection, root, *atoms, 8, 0, text, len(text))
    x11.XCloseDisplay(connection)


def environment(**variables: str) -> dict[str, str]:
    """This process's environment without its own window system, and `variables`."""
    return {name: value for name, value in os.environ.items() if name not in SESSION} | variables


def shown(display: str, size: tuple[int, int] = SIZE) -> np.ndarray:
    """(H, W, 3) int: the upper left part of a display."""
    picture = ImageGrab.grab((0, 0, *size), xdisplay=display)
    return np.asarray(picture.convert("RGB")).astype(int)


class Window:
    """A process of `raytracer view`: its pictures, and what a user does to it."""

    def __init__(
        self, process: Popen[Any], display: str, variables: Mapping[str, str], output: IO[str], errors: IO[str]
    ) -> None:
        self.process, self.display, self.variables = process, display, variables
        self.output, self.errors = output, errors

    def act(self, actions: str) -> None:
        """Do what xdotool does for these words."""
        output_of("xdotool", *actions.split(), env=self.variables)

    def shown(self, size: tuple[int, int] = SIZE) -> np.ndarray:
        """(H, W, 3) int: the upper left part of the display."""
        return shown(self.display, size)

    def until(self, what: Callable[[], bool], says: str, seconds: float = TIMEOUT) -> float:
        """Wait until something holds; the seconds that it took."""
        begin = time.monotonic()
        while not what():
            assert self.process.poll() is None, self.said(self.errors)
            assert time.monotonic() < begin + seconds, f"{says}\n{self.said(self.errors)}"
            time.sleep(0.02)
        return time.monotonic() - begin

    def until_shown(self, wanted: np.ndarray, after: str) -> None:
        """Wait for a picture, to 1/255 at every pixel."""
        size = wanted.shape[1], wanted.shape[0]
        self.until(lambda: bool(np.abs(self.shown(size) - wanted).max() <= 1), f"not the picture due after {after}")

    def said(self, file: IO[str]) -> str:
        """What the process has written so far."""
        file.seek(0)
        return file.read()

    def close(self) -> str:
        """Press Escape; standard output."""
        self.act("key Escape")
        assert self.process.wait(TIMEOUT) == 0, self.said(self.errors)
        return self.said(self.output)


@contextmanager
def window(
    folder: Path, *arguments: str, size: tuple[int, int] = SIZE, display: tuple[int, int] = SIZE, scale: int = 1
) -> Iterator[Window]:
    """A window on a display of its own, with the mouse in its middle. Without a window manager it is at (0, 0)."""
    command = (sys.executable, "-m", "raytracer", "view", *arguments, "--size", f"{size[0]}x{size[1]}")
    with (
        x_server(*display, scale) as name,
        # Not pipes: who reads those would have to read both at all times.
        tempfile.TemporaryFile("w+") as output,
        tempfile.TemporaryFile("w+") as errors,
    ):
        variables = environment(DISPLAY=name, PYTHONPATH=str(CHECKOUT))
        with running(*command, cwd=folder, env=variables, stdout=output, stderr=errors) as process:
            opened = Window(process, name, variables, output, errors)
            opened.until(lambda: opened.shown(display).max() > 0, "nothing is shown")
            opened.act(f"mousemove {display[0] // 2} {display[1] // 2}")
            yield opened
