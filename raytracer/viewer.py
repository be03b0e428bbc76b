"""The interactive window: GLFW's events into `interaction`, and what that wants redone onto the screen."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import glfw
import moderngl

from raytracer.checks import InputError, printable
from raytracer.context import open_window
from raytracer.film import written_new
from raytracer.glsl_source import ShaderError, shaders_folder
from raytracer.interaction import (
    CONTROLS,
    Cursor,
    Event,
    Failed,
    Key,
    Loaded,
    Press,
    Redo,
    Release,
    State,
    Told,
    Wheel,
    command,
    reverted,
    start,
    step,
    title,
)
from raytracer.live import Live, Pace
from raytracer.overlay import panels
from raytracer.renderer import Renderer, metadata
from raytracer.scene import Scene
from raytracer.scene_file import moved, parse, read
from raytracer.settings import Settings

# Seconds. How often files are looked at; also, Python notices Ctrl+C only between two waits for events.
_LOOK = 0.05
# Without a movement for so long, a picture is still: longer than between two events of a slow mouse.
_STILL = 0.15
_RETITLE = 0.25
_BUTTONS = {glfw.MOUSE_BUTTON_LEFT: "left", glfw.MOUSE_BUTTON_RIGHT: "right"}
_NAMES = {glfw.KEY_TAB: "Tab", glfw.KEY_HOME: "Home", glfw.KEY_ESCAPE: "Escape"}
_OTHER_MODIFIERS = glfw.MOD_CONTROL | glfw.MOD_ALT | glfw.MOD_SUPER


def view(
    path: Path, text: str, scene: Scene, settings: Settings, size: tuple[int, int] = (1280, 720), budget: float = 0.033
) -> None:
    """Show `scene`, of which `path` is the file and `text` its text, in a window until the user closes it.

    `settings.samples` are those to which a still picture is refined; `budget` is the seconds that a
    sample of a moving one may take before its pixels are enlarged. Raises ContextError if no window
    opens, InputError for a scene beyond this driver's limits.
    """
    context, window = open_window(size, f"{scene.name} - compiling")
    try:
        viewer = Viewer(context, window, path, start(text, scene, settings), budget)
        while not glfw.window_should_close(window):
            wait = viewer.frame()
            if wait > 0.0:
                glfw.wait_events_timeout(wait)
            else:
                glfw.poll_events()
            viewer.look_at_files()
    finally:
        context.release()


class Viewer:
    """Draws what is due into a window, and waits otherwise."""

    def __init__(self, context: moderngl.Context, window: Any, path: Path, state: State, budget: float) -> None:
        self.state = state
        self.live = Live(Renderer(context))
        self._context, self._window, self._path, self._budget = context, window, path, budget
        self._pace = Pace(budget)
        self._redo = Redo.SAMPLES
        self._good: State | None = None  # the last that could be drawn
        self._reloaded = False
        self._screenshot_due = False
        self._moved_at = self._titled_at = self._looked_at = 0.0
        self._watched = [path] if path.is_file() else []  # not a pipe, which cannot be read twice
        self._stamps = self._files()
        self._panels: object = None  # what is on the GPU of them
        x, y = glfw.get_cursor_pos(window)
        self._on_cursor(window, x, y)
        glfw.set_window_refresh_callback(window, self._on_refresh)
        glfw.set_key_callback(window, self._on_key)
        glfw.set_mouse_button_callback(window, self._on_button)
        glfw.set_cursor_pos_callback(window, self._on_cursor)
        glfw.set_scroll_callback(window, self._on_scroll)

    def handle(self, event: Event) -> None:
        """Take the state after `event`, and do what it wants done at once."""
        self.state, redo = step(self.state, event)
        self._redo |= redo & (Redo.PRESENT | Redo.SAMPLES)
        if Redo.CLOSE in redo:
            glfw.set_window_should_close(self._window, True)
        if Redo.SCREENSHOT in redo:
            self._screenshot_due = True
        if Redo.EXPORT in redo:
            self._write(self._export)

    def frame(self) -> float:
        """Draw what is due; the seconds until something more may be, if no event comes before."""
        size = glfw.get_framebuffer_size(self._window)
        if 0 in size or glfw.get_window_attrib(self._window, glfw.ICONIFIED):
            return _LOOK
        live, begin = self.live, time.perf_counter()
        if Redo.SAMPLES in self._redo or size != live.size:
            self._moved_at = begin
            self._begin(size, self._pace.enlarged(size[0] * size[1]))
        elif live.enlarged > 1 and begin < self._moved_at + _STILL:
            if Redo.PRESENT not in self._redo:
                return self._moved_at + _STILL - begin
        elif live.enlarged > 1:
            self._begin(size, 1)
        elif live.samples < self.state.settings.samples:
            self._pace.add(live.sample())
            while live.samples < self.state.settings.samples and time.perf_counter() < begin + self._budget:
                self._pace.add(live.sample())
        elif self._screenshot_due:
            self._screenshot_due = False
            self._write(self._screenshot)
        elif Redo.PRESENT not in self._redo:
            return _LOOK
        self._present()
        now = time.perf_counter()
        done = live.samples >= self.state.settings.samples and live.enlarged == 1
        if now > self._titled_at + _RETITLE or done:
            self._titled_at = now
            glfw.set_window_title(self._window, title(self.state, live.samples, 1000 * (now - begin)))
        return 0.0

    def _begin(self, size: tuple[int, int], enlarged: int) -> None:
        """Start the picture and draw its first sample; go back to the last good state if that is impossible."""
        state, self._redo = self.state, self._redo & ~Redo.SAMPLES
        try:
            self.live.start(state.scene, state.settings, state.show, size, enlarged)
        except (InputError, ShaderError) as error:
            if not self._good:
                raise
            self._tell_terminal(str(error))
            back = reverted(state, self._good)
            self.live.start(back.scene, back.settings, back.show, size, enlarged)
            self.state, _ = step(back, Failed(str(error)) if self._reloaded else Told(str(error)))
        self._good, self._reloaded = self.state, False
        self._pace.add(self.live.sample())

    def _present(self) -> None:
        state, size = self.state, self.live.size
        scale = glfw.get_window_content_scale(self._window)[1]
        wanted = (state.help, state.notice, state.error, size, scale)
        if wanted != self._panels:
            self.live.set_panels(panels(state, size, scale))
            self._panels = wanted
        marked = state.scene.lights[state.light] if state.marker and state.scene.lights else None
        self.live.present(self._context.screen, marked, state.scene.camera, scale)
        glfw.swap_buffers(self._window)
        self._redo &= ~Redo.PRESENT

    def look_at_files(self) -> None:
        """Take up what was saved of the scene file and the shaders since the last look."""
        now = time.perf_counter()
        if now < self._looked_at + _LOOK:
            return
        self._looked_at = now
        stamps = self._files()
        # Editors replace files: one that is missing is about to come back.
        if stamps == self._stamps or None in stamps.values():
            return
        self._stamps = stamps
        self.live.reread()
        try:
            text = read(self._path)[1] if self._watched else self.state.text
            self.handle(Loaded(text, parse(self._path, text)))
        except InputError as error:
            self._tell_terminal(str(error))
            self.handle(Failed(str(error)))
        self._reloaded = True
        self._redo |= Redo.SAMPLES

    def _files(self) -> dict[Path, tuple[int, int] | None]:
        return {path: _stamp(path) for path in (*self._watched, *shaders_folder().rglob("*.*"))}

    def _write(self, write: Callable[[], str]) -> None:
        try:
            self.handle(Told(write()))
            print(printable(self.state.notice), flush=True)
        except (OSError, RuntimeError) as error:
            self._tell_terminal(str(error))
            self.handle(Told(str(error)))

    def _screenshot(self) -> str:
        state, size = self.state, self.live.size
        with written_new(state.scene.name, ".png") as (path, file):
            self.live.image(metadata(state.scene, size, state.settings)).write_png(file)
        return f"wrote {path}: {size[0]}x{size[1]}, {state.settings.samples} samples a pixel"

    def _export(self) -> str:
        text = moved(self.state.text, self.state.scene)
        with written_new(self.state.scene.name, ".toml") as (path, file):
            file.write(text.encode())
        return f"wrote {path}; to render it as shown: {command(self.state, self.live.size, str(path))}"

    def _tell_terminal(self, error: str) -> None:
        print("raytracer:", "\n".join(map(printable, error.splitlines())), file=sys.stderr, flush=True)

    def _on_refresh(self, _window: Any) -> None:
        self._redo |= Redo.PRESENT

    def _on_key(self, _window: Any, key: int, scancode: int, action: int, modifiers: int) -> None:
        # Letters are where the keyboard's layout has them.
        name = _NAMES.get(key) or (glfw.get_key_name(key, scancode) or "").upper()
        known = any(control.key == name for control in CONTROLS)
        if action == glfw.PRESS and known and not modifiers & _OTHER_MODIFIERS:
            self.handle(Key(name))

    def _on_button(self, _window: Any, button: int, action: int, _modifiers: int) -> None:
        if name := _BUTTONS.get(button):
            self.handle(Press(name) if action == glfw.PRESS else Release(name))  # pyright: ignore[reportArgumentType]

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        height = max(1, glfw.get_window_size(window)[1])
        self.handle(Cursor(x / height, y / height))

    def _on_scroll(self, window: Any, dx: float, dy: float) -> None:
        shift = glfw.PRESS in (glfw.get_key(window, key) for key in (glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT))
        self.handle(Wheel(dy or dx, shift))  # macOS turns a shifted wheel sideways


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
