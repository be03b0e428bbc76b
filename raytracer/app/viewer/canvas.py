"""Canvas of the window: draws the picture, and over the picture a light's marker, its label, and panels of text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import BLOCK
from raytracer.compiler.draws import Draw, Screen
from raytracer.compiler.glsl.preprocessor import assemble
from raytracer.compiler.meshes import Rectangle
from raytracer.compiler.view_space import project_point
from raytracer.gpu.device import Device
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.gpu.gl import Framebuffer, set_uniforms
from raytracer.rendering.progressive import ProgressivePicture
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight

# A picture of text, (h, w, 4) uint8 with the top row first, and the position of its lower left pixel in the window.
Panel = tuple[NDArray[np.uint8], tuple[int, int]]

# The fragment shader and the defines of each program. Most frames show plain pictures, for which "present" takes two
# thirds of the time of "present_refined", which could draw all pictures (llvmpipe, 2 cores: 13 and 20 ms).
_SOURCES: dict[str, tuple[str, dict[str, int]]] = {
    "present": ("present", {}),
    "present_enlarged": ("present", {"ENLARGED": 1}),
    "present_refined": ("present", {"ENLARGED": 1, "REFINED": 1, "BLOCK": BLOCK}),
    "marker": ("marker", {}),
    "panel": ("panel", {}),
}
# Initial values of all uniforms, of the right types.
_UNIFORMS: dict[str, dict[str, object]] = {
    "present": {"samples": 1.0, "enlarged": 1, "hasBefore": False, "hasStopped": False},
    "marker": {"center": (0.0, 0.0), "radius": 1.0, "fill": (0.0, 0.0, 0.0), "inView": True},
    "panel": {"corner": (0, 0)},
}
# Pixels at display scale 1. The marker is about as large as a mouse cursor, so that users see it.
MARKER_RADIUS = 14.0
_LABEL_GAP = 4.0
_LABEL = "label"


class Canvas:
    """Draws a picture and its overlay into the window. The device's context must be current in all calls."""

    def __init__(self, device: Device) -> None:
        """Compile the programs. Raises ShaderError as load_programs() does."""
        self._device = device
        self._player = DrawPlayer(device)
        self._panels: list[Rectangle] = []
        self._label: tuple[int, int] | None = None  # size of the label
        self.load_programs()

    def load_programs(self) -> None:
        """Read the shader files again and compile them. After a ShaderError, the previous programs stay in use."""
        programs = {
            name: self._device.program(assemble(f"window/{shader}.frag", defines))
            for name, (shader, defines) in _SOURCES.items()
        }
        for name, (shader, _) in _SOURCES.items():
            set_uniforms(programs[name], **_UNIFORMS[shader])
        self._player.use(programs)

    def set_panels(self, panels: Sequence[Panel]) -> None:
        """Replace the panels of text."""
        for k in range(len(self._panels)):
            self._player.remove_texture(f"panel{k}")
        self._panels = [(*corner, *self._add_texture(f"panel{k}", pixels)) for k, (pixels, corner) in enumerate(panels)]

    def set_label(self, label: NDArray[np.uint8] | None) -> None:
        """Replace the label beside the marker. None removes the label."""
        self._player.remove_texture(_LABEL)
        self._label = None if label is None else self._add_texture(_LABEL, label)

    def _add_texture(self, name: str, pixels: NDArray[np.uint8]) -> tuple[int, int]:
        """Upload (h, w, 4) pixels as a texture, and return their width and height."""
        size = pixels.shape[1], pixels.shape[0]
        self._player.add_texture(name, size, 4, "f1")
        self._player.write(name, pixels[::-1])
        return size

    def present(
        self,
        screen: Framebuffer,
        picture: ProgressivePicture,
        marked: PointLight | None,
        camera: Camera,
        scale: float,
    ) -> None:
        """Draw a picture into `screen`, with a marker and its label at the light `marked`, and the panels on top.

        `scale` is the display's scale, by which the marker is enlarged.
        """
        size, textures = picture.size, picture.textures()
        screen_area = 0, 0, size[0], size[1]
        uniforms = {
            "samples": float(picture.samples),
            "lightScale": picture.light_scale,
            "enlarged": picture.enlarged,
            "hasBefore": "summedBefore" in textures,
            "hasStopped": "blockSamples" in textures,
        }
        inputs = {sampler: sampler for sampler in textures}
        is_refined = uniforms["hasBefore"] or uniforms["hasStopped"]
        program = "present_refined" if is_refined else "present_enlarged" if picture.enlarged > 1 else "present"
        draws = [Draw(program, Screen(), ("screen",), screen_area, screen_area, uniforms, inputs)]
        if marked:
            radius = MARKER_RADIUS * scale
            x, y, in_view = project_point(camera, marked.position, size, radius)
            fill = np.array(marked.color) / max(1.0, *marked.color)
            uniforms = {"center": (x, y), "radius": radius, "fill": tuple(fill), "inView": in_view}
            around = int(x - radius) - 1, int(y - radius) - 1, int(2 * radius) + 3, int(2 * radius) + 3
            draws.append(Draw("marker", Screen(), ("screen",), screen_area, around, uniforms))
            if self._label:
                corner = _place_beside((x, y), radius + _LABEL_GAP * scale, self._label, size)
                draws.append(_panel_draw(_LABEL, (*corner, *self._label), screen_area))
        draws += [_panel_draw(f"panel{k}", panel, screen_area) for k, panel in enumerate(self._panels)]
        self._player.play(draws, screen=screen, textures=textures)

    def close(self) -> None:
        """Release all GPU resources except the device's programs."""
        self._player.close()


def _panel_draw(texture: str, panel: Rectangle, area: Rectangle) -> Draw:
    """Return the draw of a texture at its place in the window."""
    return Draw("panel", Screen(), ("screen",), area, panel, {"corner": panel[:2]}, {"panel": texture}, "over")


def _place_beside(
    place: tuple[float, float], distance: float, panel: tuple[int, int], window: tuple[int, int]
) -> tuple[int, int]:
    """Return the lower left pixel of a panel to the right of a place, or to its left if the window ends there."""
    x, y = place
    right = x + distance
    left = right if right + panel[0] <= window[0] else x - distance - panel[0]
    lower = min(max(0.0, y - panel[1] / 2.0), max(0.0, float(window[1] - panel[1])))
    return int(max(0.0, left)), int(lower)
