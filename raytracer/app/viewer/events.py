"""Events of the window, from mouse, keys and files: step() maps a state and an event to a new state and a `Redo`.

Pure functions: no window, no OpenGL. `CONTROLS` is the only table of keys; the overlay, `raytracer view --help` and the
table in the documentation show its texts.
"""

from __future__ import annotations

import enum
import math
import shlex
from collections.abc import Callable, Sequence
from typing import Literal, TypeVar, get_args

import msgspec
from msgspec import UNSET

from raytracer.app.viewer import orbit
from raytracer.compiler.glsl.shaders import Show
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError
from raytracer.formats.scene_file import SceneDocument
from raytracer.scene.materials.models import SHADINGS
from raytracer.scene.options import Shadows
from raytracer.scene.scene import Scene, used_models
from raytracer.scene.sequences import PROGRESSIVE
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch, changed_fields, flags, minimal_patch, patch_from_settings
from raytracer.scene.warnings import NO_RADIUS

T = TypeVar("T")

# The default limit of samples per pixel of a still picture.
DEFAULT_SAMPLES = 256
_DEFAULTS = SettingsPatch(samples=DEFAULT_SAMPLES)
# The angle in radians by which a drag over the window's height turns a light or the camera.
_TURN = math.pi
# The factor by which one step of the wheel changes a distance.
_STEP = 1.1
_ANTIALIASING = (1, 4, 16)


Button = Literal["left", "right"]


class State(msgspec.Struct, frozen=True):
    """The picture and the overlay of the window."""

    document: SceneDocument
    scene: Scene  # the document's scene, with lights and camera moved by the user
    settings: Settings  # `samples` is the limit of a still picture
    limit: int  # the first value of `settings.samples`, which A offers besides 1, 4 and 16
    show: Show = "picture"
    light: int = 0  # index of the selected light
    marker: bool = True
    help: bool = False
    notice: str = ""  # shown until the next key, button or turn of the wheel
    hint: str = ""  # shown like a notice, but for some seconds at most
    error: str = ""  # shown until the files are right again
    dragging: Button | None = None
    cursor: tuple[float, float] = (0.0, 0.0)


class Redo(enum.Flag):
    """The work that an event requires."""

    NOTHING = 0
    PRESENT = enum.auto()  # show the same picture under a new overlay
    SAMPLES = enum.auto()  # draw a new picture
    SCREENSHOT = enum.auto()
    EXPORT = enum.auto()
    CLOSE = enum.auto()


class Key(msgspec.Struct, frozen=True):
    """A key was pressed: a key of `CONTROLS`, or any other key."""

    name: str


class Press(msgspec.Struct, frozen=True):
    """A mouse button went down."""

    button: Button


class Release(msgspec.Struct, frozen=True):
    """A mouse button went up."""

    button: Button


class Cursor(msgspec.Struct, frozen=True):
    """The mouse is at (x, y), measured from the window's upper left corner in units of the window's height."""

    x: float
    y: float


class Wheel(msgspec.Struct, frozen=True):
    """The wheel was turned. Positive `steps`: away from the user."""

    steps: float
    shift: bool


class Loaded(msgspec.Struct, frozen=True):
    """The scene file was read without errors."""

    document: SceneDocument


class Failed(msgspec.Struct, frozen=True):
    """A file was saved with an error."""

    error: str


class NoticeShown(msgspec.Struct, frozen=True):
    """The window has a notice for the user."""

    notice: str


class HintShown(msgspec.Struct, frozen=True):
    """The window has a hint for the user, shown for some seconds. "" removes the hint."""

    hint: str


Event = Key | Press | Release | Cursor | Wheel | Loaded | Failed | NoticeShown | HintShown


def start(document: SceneDocument, chosen: SettingsPatch) -> State:
    """Return the state of a window that opens on a scene file.

    The settings `chosen` by the user override the file's settings. Raises InputError for settings that the window does
    not support.
    """
    # File and user are merged first, so that the window's default is valid again if the user cancels the file's limit.
    settings = _window_settings(_DEFAULTS | (document.section.settings | chosen))
    return State(document, document.scene, settings, settings.samples)


def step(state: State, event: Event) -> tuple[State, Redo]:
    """Return the state after `event`, and the work that shows the state. Raises InputError as start() does."""
    new, redo = msgspec.structs.replace(state, notice="", hint=""), Redo.NOTHING
    match event:
        case Key(name):
            act = _ACTIONS.get(name)
            if isinstance(act, Redo):
                redo = act
            elif act:
                new = act(new)
        case Press(button):
            new = _set(new, dragging=button)
        case Release(button) if button == state.dragging:
            new = _set(new, dragging=None)
        case Cursor(x, y):
            right, up = _TURN * (x - state.cursor[0]), _TURN * (state.cursor[1] - y)
            new = _set(state, cursor=(x, y))
            if state.dragging == "left":
                new = _set(new, scene=orbit.turn_light(state.scene, state.light, right, up))
            elif state.dragging == "right":
                new = _set(new, scene=orbit.turn_camera(state.scene, right, up))
        case Wheel(steps, shift):
            factor = _STEP**-steps
            if shift:
                new = _set(new, scene=orbit.scale_camera(state.scene, factor))
            else:
                new = _set(new, scene=orbit.scale_light(state.scene, state.light, factor))
        case Loaded(document):
            new = _set(_apply_settings(_replace_scene(new, document.scene), document), document=document, error="")
        case Failed(error):
            new = _set(new, error=error)
        case NoticeShown(notice):
            new = _set(new, notice=notice)
        case HintShown(hint):
            new = _set(state, hint=hint)
    return new, redo | _required_work(state, new)


def revert_picture(state: State, good: State) -> State:
    """Return `state` with the picture of `good`, because the picture of `state` cannot be drawn."""
    light = min(state.light, max(0, len(good.scene.lights) - 1))
    picture = {name: getattr(good, name) for name in ("document", "scene", "settings", "limit", "show")}
    return _set(state, **picture, light=light)


def _set(state: State, **fields: object) -> State:
    return msgspec.structs.replace(state, **fields)


def _required_work(old: State, new: State) -> Redo:
    if (old.scene, old.settings, old.show) != (new.scene, new.settings, new.show):
        return Redo.SAMPLES
    seen = [(s.light, s.marker, s.help, s.notice, s.hint, s.error) for s in (old, new)]
    return Redo.PRESENT if seen[0] != seen[1] else Redo.NOTHING


def _replace_scene(state: State, scene: Scene) -> State:
    """Replace the scene. Lights and a camera that the user moved stay, unless the file has moved them, too."""
    camera, before = scene.camera, state.document.scene.camera
    if (camera.position, camera.look_at, camera.up) == (before.position, before.look_at, before.up):
        camera = msgspec.structs.replace(camera, position=state.scene.camera.position)
    if (camera.projection, camera.height) == (before.projection, before.height):
        camera = msgspec.structs.replace(camera, height=state.scene.camera.height)
    lights = list(scene.lights)
    for i, (old, moved) in enumerate(zip(state.document.scene.lights[: len(lights)], state.scene.lights, strict=False)):
        if lights[i].position == old.position:
            lights[i] = msgspec.structs.replace(lights[i], position=moved.position)
    light = min(state.light, max(0, len(lights) - 1))
    return _set(state, scene=msgspec.structs.replace(scene, camera=camera, lights=lights), light=light)


def _window_settings(patch: SettingsPatch) -> Settings:
    settings = patch.resolve()
    if settings.sequence not in PROGRESSIVE:
        raise InputError(
            f"expected one of {', '.join(PROGRESSIVE)} in the window, which draws one sample after another, "
            f"got {format_value(settings.sequence)} (try --sequence sobol)",
            ("settings", "sequence"),
        )
    return settings


def _apply_settings(state: State, document: SceneDocument) -> State:
    """Apply the settings that have changed between the previous file and `document`. All other settings stay."""
    before, now = ((_DEFAULTS | version.section.settings).resolve() for version in (state.document, document))
    changed = changed_fields(before, now)
    keeps_samples = changed.samples is UNSET
    if keeps_samples:
        changed = changed.replace(samples=state.settings.samples)
    settings = _window_settings(patch_from_settings(state.settings) | changed)
    limit = state.limit if keeps_samples else settings.samples
    return _set(state, settings=settings, limit=limit)


def _next_choice(choices: Sequence[T], now: T, by: int = 1) -> T:
    return choices[(choices.index(now) + by if now in choices else 1) % len(choices)]


def _with_settings(state: State, **fields: object) -> State:
    return _set(state, settings=msgspec.structs.replace(state.settings, **fields))


def _next_shading(state: State, by: int = 1) -> State:
    """Switch to the next shading that draws another picture: "phong" is skipped if all materials are phong."""
    own = used_models(state.document.scene)
    choices = [None, *(shading for shading in SHADINGS if own != [shading])]
    return _with_settings(state, shading=_next_choice(choices, state.settings.shading, by))


def _next_shadows(state: State) -> State:
    """Switch to the next shadows that draw another picture: soft shadows are skipped if all lights are points."""
    shadows = _next_choice(get_args(Shadows), state.settings.shadows)
    if shadows == "soft" and not any(light.radius for light in state.document.scene.lights):
        state = _set(state, hint=f"no soft shadows: {NO_RADIUS}")
        shadows = _next_choice(get_args(Shadows), shadows)
    return _with_settings(state, shadows=shadows)


def _next_antialiasing(state: State) -> State:
    choices = list(dict.fromkeys((state.limit, *_ANTIALIASING)))
    return _with_settings(state, samples=_next_choice(choices, state.settings.samples))


def _toggle_show(show: Show) -> Callable[[State], State]:
    return lambda state: _set(state, show="picture" if state.show == show else show)


def _next_light(state: State) -> State:
    return _set(state, light=(state.light + 1) % max(1, len(state.scene.lights)))


def _reset_lights(state: State) -> State:
    return _set(state, scene=msgspec.structs.replace(state.scene, lights=state.document.scene.lights))


def _reset_camera(state: State) -> State:
    return _set(state, scene=msgspec.structs.replace(state.scene, camera=state.document.scene.camera))


class Control(msgspec.Struct, frozen=True):
    """A key or a movement of the mouse: its effect in words, and as a function or a `Redo`."""

    key: str
    effect: str
    action: Callable[[State], State] | Redo | None = None  # None: a mouse event, which step() handles


CONTROLS = (
    Control("Left drag", "move the selected light around the point that the camera looks at"),
    Control("Wheel", "move the selected light nearer to that point (up) or farther (down)"),
    Control("Tab", "select the next light", _next_light),
    Control("L", "show or hide the light's marker", lambda state: _set(state, marker=not state.marker)),
    Control("R", "move the lights back to their places in the scene file", _reset_lights),
    Control("Right drag", "turn the camera around the point that it looks at, also from below"),
    Control("Shift+wheel", "move the camera nearer to that point (up) or farther (down)"),
    Control("Home", "move the camera back to its place in the scene file", _reset_camera),
    Control("B", "next shading model: the scene's own, phong, blinn, then all others", _next_shading),
    Control("V", "previous shading model", lambda state: _next_shading(state, -1)),
    Control("S", f"shadows: {', '.join(get_args(Shadows))} (soft only if a light has a radius)", _next_shadows),
    Control(
        "A",
        f"antialiasing: off, {', '.join(map(str, _ANTIALIASING[1:]))}, or all samples (--samples)",
        _next_antialiasing,
    ),
    Control("N", "show normals or the picture", _toggle_show("normal")),
    Control("Z", "show depth or the picture", _toggle_show("depth")),
    Control("M", "show materials or the picture", _toggle_show("material")),
    Control("P", "save a screenshot when the picture is finished, or just before it changes", Redo.SCREENSHOT),
    Control("E", "save the scene, with moved lights and camera, to a TOML file", Redo.EXPORT),
    Control("H", "show or hide this table", lambda state: _set(state, help=not state.help)),
    Control("Escape", "close the window", Redo.CLOSE),
)
_ACTIONS = {control.key: control.action for control in CONTROLS}


def command_line(state: State, size: tuple[int, int], path: str) -> str:
    """Return the command line that renders the scene file `path`, exported from `state`, to the window's picture."""
    output = path.removesuffix(".toml") + "-rendered.png"  # screenshots by P never have this name
    parts = "raytracer render", shlex.quote(path), "-o", shlex.quote(output), f"--size {size[0]}x{size[1]}"
    return " ".join(filter(None, (*parts, flags(minimal_patch(state.settings, state.document.section.settings)))))
