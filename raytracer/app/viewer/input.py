"""Input of the window: converts GLFW's keys, buttons, cursor and wheel to events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import glfw

from raytracer.app.viewer.events import Button, Cursor, Event, Key, Press, Release, Wheel

_BUTTONS: dict[int, Button] = {glfw.MOUSE_BUTTON_LEFT: "left", glfw.MOUSE_BUTTON_RIGHT: "right"}
_NAMES = {glfw.KEY_TAB: "Tab", glfw.KEY_HOME: "Home", glfw.KEY_ESCAPE: "Escape"}
_OTHER_MODIFIERS = glfw.MOD_CONTROL | glfw.MOD_ALT | glfw.MOD_SUPER


def connect(window: Any, handle: Callable[[Event], None]) -> None:
    """Call `handle` with each event of a window from now on, and at once with the position of the cursor."""

    def on_key(_window: Any, key: int, scancode: int, action: int, modifiers: int) -> None:
        if action == glfw.PRESS and not modifiers & _OTHER_MODIFIERS:
            handle(Key(_NAMES.get(key) or _letter(key, scancode)))

    def on_button(_window: Any, button: int, action: int, _modifiers: int) -> None:
        if name := _BUTTONS.get(button):
            handle(Press(name) if action == glfw.PRESS else Release(name))

    def on_cursor(window: Any, x: float, y: float) -> None:
        height = max(1, glfw.get_window_size(window)[1])
        handle(Cursor(x / height, y / height))

    def on_scroll(window: Any, dx: float, dy: float) -> None:
        shift = glfw.PRESS in (glfw.get_key(window, key) for key in (glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT))
        handle(Wheel(dy or (dx if shift else 0.0), shift))  # with shift, macOS scrolls sideways

    on_cursor(window, *glfw.get_cursor_pos(window))
    glfw.set_key_callback(window, on_key)
    glfw.set_mouse_button_callback(window, on_button)
    glfw.set_cursor_pos_callback(window, on_cursor)
    glfw.set_scroll_callback(window, on_scroll)


def _letter(key: int, scancode: int) -> str:
    """Return the letter of a key in the keyboard's layout, or in the English layout if the letter is not Latin."""
    if key == glfw.KEY_UNKNOWN:  # get_key_name() does not accept these keys
        return ""
    letter = glfw.get_key_name(key, scancode) or ""
    if letter.isascii():
        return letter.upper()
    return chr(key) if glfw.KEY_A <= key <= glfw.KEY_Z else ""
