"""An X server for tests that open windows."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

# What would lead to another window system than the one that the test gives.
SESSION = ("DISPLAY", "WAYLAND_DISPLAY", "XDG_SESSION_TYPE")


@contextmanager
def x_server(width: int, height: int) -> Iterator[str]:
    """The name of a display of that size. A missing Xvfb is a failure."""
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
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(60)


def environment(**variables: str) -> dict[str, str]:
    """This process's environment without its own window system, and `variables`."""
    return {name: value for name, value in os.environ.items() if name not in SESSION} | variables
