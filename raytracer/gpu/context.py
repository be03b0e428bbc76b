"""OpenGL contexts by three backends: EGL, a hidden window, OSMesa; and contexts on a visible window.

`open_context()` returns a `moderngl.Context` of OpenGL 3.3 core or later, current in the calling thread. The caller
chooses the backend; otherwise the variable RAYTRACER_BACKEND does. Default: "auto", the first backend that opens.
`open_window()` returns such a context on a new window, and the window.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from typing import Any, Literal, NoReturn, get_args

import moderngl

from raytracer.core.validation import InputError, check_choice
from raytracer.gpu.adapters import REQUIRED, Adapter, choose_adapter, open_adapter
from raytracer.gpu.adapters import VARIABLE as ADAPTER_VARIABLE
from raytracer.gpu.turns import ContextError, record_use

Backend = Literal["auto", "egl", "window", "osmesa"]
VARIABLE = "RAYTRACER_BACKEND"

# The Debian and Ubuntu packages that each backend needs.
PACKAGES = {
    "egl": "libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri",
    "window": "xvfb xauth libgl1 libglx-mesa0 libgl1-mesa-dri",
    "osmesa": "libosmesa6",
}


def backend_name(backend: str | None = None) -> str:
    """Return the name of a backend: `backend`, or if None the value of RAYTRACER_BACKEND, or "auto".

    Raises InputError for a name other than auto, egl, window and osmesa.
    """
    name = os.environ.get(VARIABLE) or "auto" if backend is None else backend
    return check_choice(name, VARIABLE if backend is None else "backend", get_args(Backend))


def choose_backend(backend: str | None = None, adapter: Adapter | None = None) -> tuple[str, Adapter | None]:
    """Return the backend's name and the adapter, from the arguments or else from the environment variables.

    The adapter None stands for the best one. Only EGL has adapters: if one is chosen, "auto" becomes "egl". The
    variable RAYTRACER_DEVICE is for EGL alone. Raises InputError as `backend_name` and `choose_adapter` do, and for the
    argument `adapter` with a backend other than EGL.
    """
    name = backend_name(backend)
    if name in ("auto", "egl"):
        adapter = choose_adapter(adapter)
        return "egl" if adapter is not None else name, adapter
    if adapter is not None:
        raise InputError(f"expected the backend egl, the only one with devices, got the backend {name}", "device")
    return name, None


def open_context(backend: str | None = None, adapter: Adapter | None = None) -> moderngl.Context:
    """Open a context by the backend and adapter of `chosen(backend, adapter)`; "auto" is the first backend that opens.

    Raises InputError as `chosen` does, and for an adapter that does not exist. Raises ContextError if no context opens,
    or if this process was forked after its parent had used OpenGL (turns.py).
    """
    where = ADAPTER_VARIABLE if adapter is None else "device"
    name, adapter = choose_backend(backend, adapter)
    record_use()
    names = list(_OPENERS) if name == "auto" else [name]
    problems: dict[str, str] = {}
    for name in names:
        try:
            return open_adapter(adapter, where) if name == "egl" else _OPENERS[name]()
        except InputError:
            raise
        except Exception as error:  # every driver and binding fails in its own way
            problems[name] = str(error) or type(error).__name__
    packages = " ".join(dict.fromkeys(" ".join(PACKAGES[name] for name in names if name != "window").split()))
    remedy = f"\nOn Debian or Ubuntu this may help: apt-get install {packages or PACKAGES['window']}"
    remedy = remedy if sys.platform == "linux" else ""
    tried = "\n".join(f"  {name}: {problem}" for name, problem in problems.items())
    raise ContextError(f"no OpenGL 3.3 context opens on this machine; tried\n{tried}{remedy}", problems)


def open_window(size: tuple[int, int], title: str) -> tuple[moderngl.Context, Any]:
    """Open a visible window, and return a context on it and GLFW's handle of the window.

    `size` is (width, height) in screen coordinates.

    Releasing the context closes the window. Raises ContextError if no window opens.
    """
    record_use()
    try:
        return _open_glfw("any", size, title, visible=True)
    except Exception as error:
        reason = error or type(error).__name__
        remedy = "`raytracer render SCENE -o OUT.png` renders the picture without a window"
        raise ContextError(f"no window opens on this machine: {reason}\n{remedy}") from None


class _GlfwLoader:
    """A GLFW context with the interface that moderngl expects: it loads functions, becomes current, and is released."""

    def __init__(self, glfw: Any, window: Any, platform: str) -> None:
        self._glfw, self._window, self.platform = glfw, window, platform

    def load_opengl_function(self, name: str) -> int:
        return self._glfw.get_proc_address(name) or 0

    def __enter__(self) -> None:
        self._glfw.make_context_current(self._window)

    def __exit__(self, *_: object) -> None:
        self._glfw.make_context_current(None)

    def release(self) -> None:
        if self in _loaders:
            _loaders.remove(self)
            _close(self._glfw, self._window)


# The loaders of all open GLFW windows. GLFW has one platform in a process at a time.
_loaders: list[_GlfwLoader] = []


def _close(glfw: Any, window: Any) -> None:
    """Close a window, if there is one. After the last window GLFW terminates, so that another platform can begin."""
    if window:
        glfw.destroy_window(window)
    if not _loaders:
        glfw.terminate()


def _open_glfw(
    platform: str, size: tuple[int, int] = (16, 16), title: str = "raytracer", *, visible: bool = False
) -> tuple[moderngl.Context, Any]:
    # Imported here, because importing glfw starts a process that compares library versions.
    import glfw

    if sys.platform == "darwin" and threading.current_thread() is not threading.main_thread():
        raise RuntimeError("macOS opens windows in the main thread only: render a picture there first")
    if any(loader.platform != platform for loader in _loaders):
        raise RuntimeError("GLFW has an open context of another kind, and can have only one kind at a time")
    glfw.set_error_callback(_raise_glfw_error)
    if platform == "null":
        glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_NULL)
    else:
        glfw.init_hint(glfw.PLATFORM, glfw.ANY_PLATFORM)
    window = None
    try:
        glfw.init()
        glfw.default_window_hints()
        glfw.window_hint(glfw.VISIBLE, visible)
        glfw.window_hint(glfw.SCALE_TO_MONITOR, visible)
        glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, REQUIRED // 100)
        glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, REQUIRED // 10 % 10)
        glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
        if platform == "null":
            glfw.window_hint(glfw.CONTEXT_CREATION_API, glfw.OSMESA_CONTEXT_API)
        else:  # macOS needs this flag for a core profile, and OSMesa opens no core profile with it
            glfw.window_hint(glfw.OPENGL_FORWARD_COMPAT, glfw.TRUE)
        window = glfw.create_window(*size, title, None, None)
        glfw.make_context_current(window)
        loader: Any = _GlfwLoader(glfw, window, platform)
        context = moderngl.create_context(require=REQUIRED, context=loader)
        context.extra = loader  # the loader of OpenGL's functions, for those that moderngl does not call (gl.py)
    except Exception:
        _close(glfw, window)
        raise
    _loaders.append(loader)
    return context, window


def _raise_glfw_error(_code: int, message: Any) -> NoReturn:
    # The binding's own GLFWError would show the code and the bytes: (65550) b'...'.
    raise RuntimeError(message.decode(errors="replace"))


_OPENERS: dict[str, Callable[[], moderngl.Context]] = {
    "egl": open_adapter,
    "window": lambda: _open_glfw("any")[0],
    "osmesa": lambda: _open_glfw("null")[0],
}
BACKENDS = tuple(_OPENERS)
