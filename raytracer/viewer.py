"""The interactive window: a scene whose first light is dragged with the mouse."""

from __future__ import annotations

import math
from typing import Any

import glfw
import moderngl
import msgspec
import numpy as np

from raytracer.context import open_window
from raytracer.renderer import Renderer
from raytracer.scene import MAX_LENGTH, Scene
from raytracer.settings import Settings

# Dragging along the window's height turns the light by this angle.
_TURN = math.pi
# Short of the pole, where turning to the right would do nothing.
_STEEPEST = math.radians(89.0)
# Sine of the angle to the axis below which rounding decides on which side of it a light is.
_OFF_AXIS = 1e-9
_NEXT_SHADOWS = {"hard": "diluted", "diluted": "off", "off": "hard"}
# Python notices Ctrl+C only between two waits for events.
_WAIT_SECONDS = 0.5


def view(scene: Scene) -> None:
    """Show `scene` in a window until the user closes it.

    Raises ContextError if no window opens, InputError for a scene beyond this driver's limits.
    """
    context, window = open_window((1280, 720), f"{scene.name} - raytracer")
    try:
        _Viewer(context, window, scene).run()
    finally:
        context.release()


def dragged(scene: Scene, right: float, up: float) -> Scene:
    """`scene` with its first light moved on the sphere around `camera.look_at` by angles in radians.

    `right` turns it around the camera's up direction, so a light before the scene goes to the
    right; `up` raises it, as far as `_STEEPEST`.
    """
    if not scene.lights:
        return scene
    centre, axis = np.array(scene.camera.look_at), np.array(scene.camera.up) / math.hypot(*scene.camera.up)
    arm = np.array(scene.lights[0].position) - centre
    radius = math.hypot(*arm)
    if radius == 0.0:
        return scene
    height = float(arm @ axis)
    outward = arm - height * axis
    if math.hypot(*outward) < _OFF_AXIS * radius:  # straight above or below: it sets out towards the camera
        outward = np.cross(scene.camera.axes()[0], axis)
    outward /= math.hypot(*outward)
    elevation = math.asin(max(-1.0, min(1.0, height / radius)))
    elevation = max(min(elevation, -_STEEPEST), min(max(elevation, _STEEPEST), elevation + up))
    turned = math.cos(right) * outward + math.sin(right) * np.cross(axis, outward)
    position = centre + radius * (math.cos(elevation) * turned + math.sin(elevation) * axis)
    moved = msgspec.structs.replace(scene.lights[0], position=np.clip(position, -MAX_LENGTH, MAX_LENGTH))
    return msgspec.structs.replace(scene, lights=(moved, *scene.lights[1:]))


class _Viewer:
    """Draws when something has changed, and waits otherwise."""

    def __init__(self, context: moderngl.Context, window: Any, scene: Scene) -> None:
        self._context, self._window = context, window
        self._renderer = Renderer(context)
        self._cursor: tuple[float, float] = glfw.get_cursor_pos(window)
        self._grab: tuple[Scene, float, float] | None = None  # the scene and the cursor when a drag began
        self._set(scene, Settings())
        glfw.set_framebuffer_size_callback(window, lambda *_: self._set())
        glfw.set_window_refresh_callback(window, lambda *_: self._set())
        glfw.set_key_callback(window, self._on_key)
        glfw.set_mouse_button_callback(window, self._on_button)
        glfw.set_cursor_pos_callback(window, self._on_cursor)

    def _set(self, scene: Scene | None = None, settings: Settings | None = None) -> None:
        self._scene, self._settings = scene or self._scene, settings or self._settings
        self._changed = True

    def run(self) -> None:
        while not glfw.window_should_close(self._window):
            size = glfw.get_framebuffer_size(self._window)
            if self._changed and 0 not in size:  # a minimised window may have no pixels
                self._changed = False
                self._draw(size)
            glfw.wait_events_timeout(_WAIT_SECONDS)

    def _draw(self, size: tuple[int, int]) -> None:
        image = self._renderer.render(self._scene, size, self._settings, geometry=False)
        pixels = np.full((size[1], size[0], 4), 255, np.uint8)
        pixels[..., :3] = image.srgb8()[::-1]  # OpenGL's first row is the lowest
        texture = self._context.texture(size, 4, pixels)
        picture = self._context.framebuffer([texture])
        # OpenGL would encode sRGB again only if GL_FRAMEBUFFER_SRGB were enabled; nobody enables it.
        self._context.screen.use()
        self._context.copy_framebuffer(self._context.screen, picture)
        glfw.swap_buffers(self._window)
        picture.release()
        texture.release()

    def _on_key(self, window: Any, key: int, _scancode: int, action: int, _modifiers: int) -> None:
        now = self._settings
        model = now.shading or self._scene.materials[0].model
        changes: dict[int, dict[str, Any]] = {
            glfw.KEY_B: {"shading": "phong" if model == "blinn" else "blinn"},
            glfw.KEY_S: {"shadows": _NEXT_SHADOWS[now.shadows]},
            glfw.KEY_A: {"samples": 16 if now.samples == 1 else 1},
        }
        if action == glfw.PRESS and key in changes:
            self._set(settings=msgspec.structs.replace(now, **changes[key]))
        elif action == glfw.PRESS and key == glfw.KEY_ESCAPE:
            glfw.set_window_should_close(window, True)

    def _on_button(self, _window: Any, button: int, action: int, _modifiers: int) -> None:
        if button == glfw.MOUSE_BUTTON_LEFT:
            self._grab = (self._scene, *self._cursor) if action == glfw.PRESS else None

    def _on_cursor(self, window: Any, x: float, y: float) -> None:
        self._cursor = x, y
        if self._grab and self._scene.lights:
            scene, x0, y0 = self._grab
            angle = _TURN / max(1, glfw.get_window_size(window)[1])
            self._set(dragged(scene, (x - x0) * angle, (y0 - y) * angle))
