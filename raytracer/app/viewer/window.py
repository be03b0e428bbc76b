"""Interactive window: passes GLFW's events to events.py, and draws the picture and the overlay of the new state."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import glfw
import msgspec

from raytracer.app.viewer.canvas import Canvas
from raytracer.app.viewer.events import (
    Event,
    Failed,
    HintShown,
    Key,
    Loaded,
    NoticeShown,
    Redo,
    State,
    command_line,
    revert_picture,
    start,
    step,
)
from raytracer.app.viewer.file_watcher import Files
from raytracer.app.viewer.input import connect
from raytracer.app.viewer.overlay import draw_label, draw_panels
from raytracer.app.viewer.titles import HELP, compiling_notice, compiling_title, title
from raytracer.compiler.glsl.preprocessor import ShaderError
from raytracer.core.output import write_numbered
from raytracer.core.terminal import print_error, print_lines
from raytracer.core.validation import InputError, locate_errors
from raytracer.formats.companion_files import copy_files
from raytracer.formats.scene_file import companion_paths, edit_positions, find_scene, parse_document, read_document
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.gpu.context import open_window
from raytracer.gpu.device import Device
from raytracer.gpu.gl import Context
from raytracer.rendering.progressive import ProgressivePicture
from raytracer.rendering.renderer import metadata
from raytracer.scene.settings_patch import SettingsPatch

# Durations in seconds.
# Interval between two checks of the files, and longest wait for events: Python notices Ctrl+C only between two waits.
_CHECK_SECONDS = 0.05
# A picture counts as still after this time without a movement. Two events of a slowly moved mouse are closer together.
_STILL = 0.15
# Shortest interval between two updates of the title.
_RETITLE = 0.25
# Keys that follow each other within this time count as one: only the programs for the last key are compiled.
_TOGETHER = 0.3
# A hint disappears after this time.
_HINT = 6.0


def view(scene: str, chosen: SettingsPatch, size: tuple[int, int] | None, budget: float) -> None:
    """Show a scene until the user closes the window. Arguments and errors: see open_viewer()."""
    with open_viewer(scene, chosen, size, budget) as viewer:
        while not glfw.window_should_close(viewer.window):
            wait = viewer.frame()
            if wait > 0.0:
                glfw.wait_events_timeout(wait)
            else:
                glfw.poll_events()
            viewer.reload_changed_files()


@contextmanager
def open_viewer(
    scene: str | os.PathLike[str], chosen: SettingsPatch, size: tuple[int, int] | None, budget: float
) -> Iterator[Viewer]:
    """Open a window with a scene, and close it after the block.

    Args:
        scene: path of a scene file, or name of an example scene
        chosen: settings by the user, which override the file's settings; `samples` limits a still picture
        size: width and height in screen coordinates; None: the file's size
        budget: time limit in seconds for a sample of a moving picture, whose pixels are enlarged to keep the limit

    Raises ContextError if no window opens, InputError for an error in the scene file. Drawing raises InputError for a
    scene beyond the driver's limits.
    """
    path = find_scene(scene)
    files = Files(path)
    document = read_document(path)
    with locate_errors(path):
        state = start(document, chosen)
    context, window = open_window(size or document.section.size or DEFAULT_SIZE, compiling_title(state))
    try:
        viewer = Viewer(context, window, files, state, budget)
        yield viewer
        viewer.close()
    finally:
        context.release()


class Viewer:
    """The state of an open window, and the drawing of its picture and overlay."""

    def __init__(self, context: Context, window: Any, files: Files, state: State, budget: float) -> None:
        self.state = state
        device = Device(context)
        context.__enter__()  # makes the window's context current while the window is open
        self.picture = ProgressivePicture(device, budget)
        self.canvas = Canvas(device)
        self.context, self.window = context, window
        self._files, self._budget = files, budget
        self._redo = Redo.SAMPLES
        self._drawn: State | None = None  # the last state whose picture could be drawn
        self._reloaded = False
        self._screenshot_due = False
        self._moved_at = self._titled_at = self._checked_at = 0.0
        self._panels: object = None  # key of the panels on the GPU
        self._pressed_at = 0.0
        self._hinted: tuple[str, float] = "", 0.0  # the current hint, and the time when it appeared
        connect(window, self.handle)
        glfw.set_window_refresh_callback(window, self._on_refresh)
        self.handle(HintShown(HELP))

    def close(self) -> None:
        """Write a screenshot that is due, and release all GPU resources."""
        self._take_screenshot()
        self.picture.close()
        self.canvas.close()

    def handle(self, event: Event) -> None:
        """Update the state by `event`, and do at once whatever needs no drawing."""
        if isinstance(event, Key):
            self._pressed_at = time.perf_counter()
        self.state, redo = step(self.state, event)
        self._redo |= redo & (Redo.PRESENT | Redo.SAMPLES)
        if Redo.CLOSE in redo:
            glfw.set_window_should_close(self.window, True)
        if Redo.SCREENSHOT in redo:
            self._screenshot_due = True
            settings = self.state.settings
            samples = f"{'up to ' if settings.sampling.is_adaptive else ''}{settings.samples} samples per pixel"
            self.handle(NoticeShown(f"the screenshot will be written when the picture has {samples}"))
        if Redo.EXPORT in redo:
            self._write(self._export)

    def frame(self) -> float:
        """Draw if necessary, and return the seconds until the next call, unless an event comes before."""
        size = glfw.get_framebuffer_size(self.window)
        if 0 in size or glfw.get_window_attrib(self.window, glfw.ICONIFIED):
            return _CHECK_SECONDS
        picture, begin = self.picture, time.perf_counter()
        still_in = self._moved_at + _STILL - begin
        hint, since = self._hinted
        if hint and begin > since + _HINT:
            self.handle(HintShown(""))
        if Redo.SAMPLES in self._redo or size != picture.size:
            if self._drawn and not self._is_compiled():
                self._announce()
                if begin < self._pressed_at + _TOGETHER:
                    return _CHECK_SECONDS
            self._moved_at = begin
            self._begin(size, moving=True)
        elif picture.is_moving and still_in <= 0.0:
            self._begin(size, moving=False)
        elif picture.is_moving:
            if Redo.PRESENT not in self._redo:
                return still_in
        elif not picture.is_done:
            self._refine(begin)
        elif self._screenshot_due:
            self._take_screenshot()
        elif Redo.PRESENT not in self._redo:
            return _CHECK_SECONDS
        self._present()
        now = time.perf_counter()
        if now > self._titled_at + _RETITLE or picture.is_done:
            self._titled_at = now
            text = title(self.state, picture.samples, 1000.0 * (now - begin), picture.estimate())
            glfw.set_window_title(self.window, text)
        return 0.0

    def _is_compiled(self) -> bool:
        """Whether the programs of the state's picture are compiled, or cannot be compiled at all."""
        picture, state = self.picture, self.state
        key = state.scene, state.settings, state.show
        try:
            return (not self._reloaded and picture.has_structure(*key)) or picture.is_compiled(*key)
        except (InputError, ShaderError):
            return True

    def _announce(self) -> None:
        """Announce a compilation in the window's title, and over the previous picture."""
        self._titled_at = 0.0
        glfw.set_window_title(self.window, compiling_title(self.state))
        self._present(compiling_notice(self.state))

    def _refine(self, begin: float) -> None:
        """Draw at least one more sample, and further samples within the budget since `begin`."""
        self._sample()
        while not self.picture.is_done and time.perf_counter() < begin + self._budget:
            self._sample()

    def _sample(self) -> None:
        try:
            self.picture.step()
        except ShaderError as error:  # in the programs of the error estimate, without which the picture continues
            print_error(*str(error).splitlines())
            self.handle(Failed(str(error)))

    def _begin(self, size: tuple[int, int], *, moving: bool) -> None:
        """Start the picture and draw its first sample. After an error, do so for the last state that was drawn."""
        if moving:
            self._take_screenshot()
        self._redo &= ~Redo.SAMPLES
        try:
            if self._reloaded:  # only now, because a screenshot that is due shows the previous files
                self.canvas.load_programs()
                self.picture.reread()
            self._start(self.state, size, moving)
        except (InputError, ShaderError) as error:
            if isinstance(error, InputError):
                error = error.at(self._files.scene)
            if not self._drawn:
                raise error from None
            message = str(error)
            print_error(*message.splitlines())
            self.state = revert_picture(self.state, self._drawn)
            self._start(self.state, size, moving)
            self.handle(Failed(message) if self._reloaded else NoticeShown(message))
        self._drawn, self._reloaded = self.state, False

    def _start(self, state: State, size: tuple[int, int], moving: bool) -> None:
        """Start a picture and draw its first sample, which raises ShaderError if a shader does not terminate."""
        self.picture.start(state.scene, state.settings, state.show, size, moving=moving)
        self._sample()

    def _present(self, note: str = "") -> None:
        """Show the picture under the overlay. `note` replaces the state's notice."""
        state, size = self.state, self.picture.size
        if note:
            state = msgspec.structs.replace(state, notice=note)
        scale = glfw.get_window_content_scale(self.window)[1]
        key = (state.help, state.notice, state.hint, state.error, state.light, len(state.scene.lights), size, scale)
        if key != self._panels:
            self.canvas.set_panels(draw_panels(state, size, scale))
            self.canvas.set_label(draw_label(state, scale))
            self._panels = key
        if state.hint != self._hinted[0]:
            self._hinted = state.hint, time.perf_counter()
        marked = state.scene.lights[state.light] if state.marker and state.scene.lights else None
        self.canvas.present(self.context.screen, self.picture, marked, state.scene.camera, scale)
        glfw.swap_buffers(self.window)
        self._redo &= ~Redo.PRESENT

    def reload_changed_files(self) -> None:
        """Reload the scene file and the shaders if they were saved since the last check."""
        now = time.perf_counter()
        if now < self._checked_at + _CHECK_SECONDS:
            return
        self._checked_at = now
        if not self._files.check_for_changes():
            return
        path = self._files.scene
        try:
            # A pipe cannot be read twice.
            is_file = self._files.has_scene
            document = read_document(path) if is_file else parse_document(path, self.state.document.text)
            with locate_errors(path):
                self.handle(Loaded(document))
        except InputError as error:
            print_error(*str(error).splitlines())
            self.handle(Failed(str(error)))
        self._reloaded = True
        self._redo |= Redo.SAMPLES

    def _write(self, write: Callable[[], str]) -> None:
        try:
            notice = write()
        except (OSError, RuntimeError) as error:
            reason = error.strerror if isinstance(error, OSError) else ""
            notice = f"{Path.cwd()}: expected a folder that can be written to: {reason}" if reason else str(error)
            print_error(*notice.splitlines())
        else:
            with suppress(OSError):  # the terminal may be closed
                print_lines(notice)
        self.handle(NoticeShown(notice))

    def _take_screenshot(self) -> None:
        """Write a screenshot of the last picture, if a screenshot is due.

        If the picture has a single sample, it is drawn again as a picture of one sample: a moving picture may have
        enlarged pixels, and the first of many samples is not at the pixel's centre.
        """
        picture, drawn = self.picture, self._drawn
        if not self._screenshot_due or not drawn:
            return
        self._screenshot_due = False
        if picture.samples == 1:
            settings = msgspec.structs.replace(drawn.settings, samples=1)
            self._start(msgspec.structs.replace(drawn, settings=settings), picture.size, moving=False)
        self._write(self._screenshot)

    def _screenshot(self) -> str:
        state, picture = self._drawn or self.state, self.picture
        settings = state.settings.replace(samples=picture.samples)
        text = metadata(state.scene, picture.size, settings, picture.estimate())
        text["Description"] += f", showing {state.show}" if state.show != "picture" else ""
        path = write_numbered(state.scene.name, ".png", picture.image(text).write_png)
        return (
            f"wrote {path}: {picture.size[0]}x{picture.size[1]}, {picture.samples} of {state.settings.samples} samples"
        )

    def _export(self) -> str:
        try:
            text = edit_positions(self.state.document.text, self.state.scene, self._files.scene.parent)
        except RuntimeError as error:
            raise RuntimeError(f"{self._files.scene}: {error}") from None
        with copy_files(companion_paths(self._files.scene, text), Path()):
            path = write_numbered(self.state.scene.name, ".toml", lambda file: file.write(text.encode()))
        return f"wrote {path}; to render its picture: {command_line(self.state, self.picture.size, str(path))}"

    def _on_refresh(self, _window: Any) -> None:
        # Draw at once: while the user resizes the window, macOS and Windows return from no other call.
        self._redo |= Redo.PRESENT
        self.frame()
