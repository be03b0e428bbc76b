"""The side of a worker: its identity, and a call of a function with one job."""

from __future__ import annotations

import hashlib
import pickle
import time
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from raytracer.core.files import find_data_folder
from raytracer.core.validation import InputError
from raytracer.version import __version__

# Hexadecimal digits of a hash of the code: enough to tell builds apart, few enough for a message.
_DIGITS = 12


class Identity(NamedTuple):
    """Everything that decides on the bits of a worker's pictures.

    Attributes:
        code: the version of this project, with a hash of its Python files and shaders.
        driver: the name of the OpenGL driver, GL_RENDERER.
        opengl: the version of the driver, GL_VERSION.
    """

    code: str
    driver: str
    opengl: str


class Answer(NamedTuple):
    """The answer of a worker to one call.

    Attributes:
        value: the value of the function. None if the job was refused, or if the worker has other code.
        refusal: the message of an InputError, or None.
        code: the code of the worker.
        seconds: the time of the call.
    """

    value: Any
    refusal: str | None
    code: str
    seconds: float


@cache
def own_code() -> str:
    """Return the version of this project in this process, and a hash of its Python files and shaders."""
    package = Path(__file__).parent.parent
    shaders = find_data_folder("shaders", "shaders")
    files = {f"code/{path.relative_to(package).as_posix()}": path for path in package.rglob("*.py")}
    for suffix in ("glsl", "vert", "frag"):
        files |= {f"shaders/{path.relative_to(shaders).as_posix()}": path for path in shaders.rglob(f"*.{suffix}")}
    digest = hashlib.sha256()
    for name, path in sorted(files.items()):
        data = path.read_bytes()
        digest.update(f"{name}\0{len(data)}\0".encode() + data)
    return f"{__version__} ({digest.hexdigest()[:_DIGITS]})"


def identify() -> Identity:
    """Open this process's OpenGL device, and return the identity. Raises ContextError if no context opens."""
    from raytracer.gpu.device import shared_device

    device = shared_device()
    return Identity(own_code(), device.limits.driver, device.context.info["GL_VERSION"])


def call(payload: bytes, code: str | None) -> Answer:
    """Call a function with a job.

    Args:
        payload: a pickle of (function, job).
        code: the code that this process must have to call the function. None accepts any code.
    """
    own = own_code()
    if code is not None and own != code:
        return Answer(None, None, own, 0.0)
    start = time.monotonic()
    value, refusal = None, None
    try:
        function, job = pickle.loads(payload)
        value = function(job)
    except InputError as error:
        refusal = str(error)
    return Answer(value, refusal, own, time.monotonic() - start)
