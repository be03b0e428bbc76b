"""An X server for tests that open windows."""

import ctypes
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

# What would lead to another window system than the one that the test gives.
SESSION = ("DISPLAY", "WAYLAND_DISPLAY", "XDG_SESSION_TYPE")


@contextmanager
def x_server(width: int, height: int, scale: int = 1) -> Iterator[str]:
    """The name of a display of that size in pixels, and of that display scale. A missing Xvfb is a failure."""
    for program in ("Xvfb", "xdotool"):
        assert shutil.which(program), f"{program} is missing: apt-get install xvfb xdotool"
    read, write = os.pipe()
    command = ("Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24", "-noreset", "-nolisten", "tcp")
    server = subprocess.Popen(command, pass_fds=[write])
    os.close(write)
    try:
        with open(read) as pipe:
            number = pipe.readline().strip()
        assert number, "Xvfb did not start"
        _set_resources(f":{number}", f"Xft.dpi:\t{96 * scale}\n".encode())
        yield f":{number}"
    finally:
        server.terminate()
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
