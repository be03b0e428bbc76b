"""Events of the window, from mouse, keys and files: event in, new state and what must be redone out.

Pure: no window, no OpenGL. `CONTROLS` is the one table of keys; the overlay, `raytracer view --help`
and the README's table are made from it.
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
from raytracer.core.shown import shown
from raytracer.core.validation import InputError
from raytracer.formats.scene_file import SceneDocument
from raytracer.scene.materials.models import SHADINGS
from raytracer.scene.options import Shadows
from raytracer.scene.scene import Scene, used_models
from raytracer.scene.sequences import PROGRESSIVE
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch, changes, checked_patch, fewest, flags
from raytracer.scene.warnings import NO_RADIUS

T = TypeVar("T")

# Samples a pixel to which a still picture is refined unless the user names another number.
DEFAULT_SAMPLES = 256
_DEFAULTS = SettingsPatch(samples=DEFAULT_SAMPLES)
# Dragging along the window's height turns by this angle.
_TURN = math.pi
# One step of the wheel changes a distance by this factor.
_STEP = 1.1
_ANTIALIASING = (1, 4, 16)


Button = Literal["left", "right"]


class State(msgspec.Struct, frozen=True):
    """The picture and the overlay of the window. `scene` is the document's with lights and camera moved."""

    document: SceneDocument
    scene: Scene
    settings: Settings  # its samples are those to which a still picture is refined
    limit: int  # those at first, which A offers besides 1, 4 and 16
    show: Show = "picture"
    light: int = 0  # the selected one
    marker: bool = True
    help: bool = False
    notice: str = ""  # until the next key, button or turn of the wheel
    hint: str = ""  # until then, or for some seconds
    error: str = ""  # until the files are right again
    dragging: Button | None = None
    cursor: tuple[float, float] = (0.0, 0.0)


class Redo(enum.Flag):
    """The work that an event makes necessary."""

    NOTHING = 0
    PRESENT = enum.auto()  # the same picture, under another overlay
    SAMPLES = enum.auto()  # another picture
    SCREENSHOT = enum.auto()
    EXPORT = enum.auto()
    CLOSE = enum.auto()


class Key(msgspec.Struct, frozen=True):
    """A key was pressed, one of `CONTROLS` or another."""

    name: str


class Press(msgspec.Struct, frozen=True):
    """A mouse button went down."""

    button: Button


class Release(msgspec.Struct, frozen=True):
    """A mouse button went up."""

    button: Button


class Cursor(msgspec.Struct, frozen=True):
    """The mouse is at (x, y), in heights of the window from its upper left corner."""

    x: float
    y: float


class Wheel(msgspec.Struct, frozen=True):
    """The wheel was turned, away from the user for positive `steps`."""

    steps: float
    shift: bool


class Loaded(msgspec.Struct, frozen=True):
    """The scene file was read, and is right."""

    document: SceneDocument


class Failed(msgspec.Struct, frozen=True):
    """A file was saved, and is wrong."""

    error: str


class Told(msgspec.Struct, frozen=True):
    """A notice for the user has come up."""

    notice: str


class Hinted(msgspec.Struct, frozen=True):
    """A hint for the user has come up, for some seconds; "" ends it."""

    hint: str


Event = Key | Press | Release | Cursor | Wheel | Loaded | Failed | Told | Hinted


def start(document: SceneDocument, chosen: SettingsPatch) -> State:
    """The state of a window that opens on a scene file.

    The settings `chosen` by the user are in place of the file's. Raises InputError for those that no window can have.
    """
    settings = _window_settings(_DEFAULTS | document.section.settings | chosen)
    return State(document, document.scene, settings, settings.samples)


def step(state: State, event: Event) -> tuple[State, Redo]:
    """The state after `event`, and what must be redone to show it. Raises InputError as start()."""
    new, redo = msgspec.structs.replace(state, notice="", hint=""), Redo.NOTHING
    match event:
        case Key(name):
            act = _ACTS.get(name)
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
            new = _set(_resettled(_reloaded(new, document.scene), document), document=document, error="")
        case Failed(error):
            new = _set(new, error=error)
        case Told(notice):
            new = _set(new, notice=notice)
        case Hinted(hint):
            new = _set(state, hint=hint)
    return new, redo | _changes(state, new)


def reverted(state: State, good: State) -> State:
    """`state` with the picture of `good`, because its own cannot be drawn."""
    light = min(state.light, max(0, len(good.scene.lights) - 1))
    picture = {name: getattr(good, name) for name in ("document", "scene", "settings", "limit", "show")}
    return _set(state, **picture, light=light)


def _set(state: State, **fields: object) -> State:
    return msgspec.structs.replace(state, **fields)


def _changes(old: State, new: State) -> Redo:
    if (old.scene, old.settings, old.show) != (new.scene, new.settings, new.show):
        return Redo.SAMPLES
    seen = [(s.light, s.marker, s.help, s.notice, s.hint, s.error) for s in (old, new)]
    return Redo.PRESENT if seen[0] != seen[1] else Redo.NOTHING


def _reloaded(state: State, scene: Scene) -> State:
    """The state with `scene` in place of the scene before. Moves by the user stay, unless the file moves the same."""
    camera, before = scene.camera, state.document.scene.camera
    if (camera.position, camera.look_at, camera.up) == (before.position, before.look_at, before.up):
        camera = msgspec.structs.replace(camera, position=state.scene.camera.position)
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
            f"expected one of {', '.join(PROGRESSIVE)} for a window, which adds one sample after "
            f"another (or try --sequence sobol), got {shown(settings.sequence)}",
            ("settings", "sequence"),
        )
    return settings


def _resettled(state: State, document: SceneDocument) -> State:
    """The state with the settings that differ between the file and the file before; all others stay."""
    before, now = ((_DEFAULTS | each.section.settings).resolve() for each in (state.document, document))
    changed = changes(before, now)
    keeps_samples = changed.samples is UNSET
    if keeps_samples:
        changed = changed.replace(samples=state.settings.samples)
    settings = _window_settings(checked_patch(state.settings) | changed)
    limit = state.limit if keeps_samples else settings.samples
    return _set(state, settings=settings, limit=limit)


def _next(choices: Sequence[T], now: T, by: int = 1) -> T:
    return choices[(choices.index(now) + by if now in choices else 1) % len(choices)]


def _with_settings(state: State, **fields: object) -> State:
    return _set(state, settings=msgspec.structs.replace(state.settings, **fields))


def _shading(state: State, by: int = 1) -> State:
    """Go to the next shading that differs: None is like "phong" where all materials are phong."""
    own = used_models(state.document.scene)
    choices = [None, *(shading for shading in SHADINGS if own != [shading])]
    return _with_settings(state, shading=_next(choices, state.settings.shading, by))


def _shadows(state: State) -> State:
    """Go to the next shadows that differ: soft ones are hard where all lights are points."""
    shadows = _next(get_args(Shadows), state.settings.shadows)
    if shadows == "soft" and not any(light.radius for light in state.document.scene.lights):
        state = _set(state, hint=f"no soft shadows: {NO_RADIUS}")
        shadows = _next(get_args(Shadows), shadows)
    return _with_settings(state, shadows=shadows)


def _antialiasing(state: State) -> State:
    choices = list(dict.fromkeys((state.limit, *_ANTIALIASING)))
    return _with_settings(state, samples=_next(choices, state.settings.samples))


def _showing(show: Show) -> Callable[[State], State]:
    return lambda state: _set(state, show="picture" if state.show == show else show)


def _next_light(state: State) -> State:
    return _set(state, light=(state.light + 1) % max(1, len(state.scene.lights)))


def _lights_back(state: State) -> State:
    return _set(state, scene=msgspec.structs.replace(state.scene, lights=state.document.scene.lights))


def _camera_back(state: State) -> State:
    return _set(state, scene=msgspec.structs.replace(state.scene, camera=state.document.scene.camera))


class Control(msgspec.Struct, frozen=True):
    """A key or a movement of the mouse: what it does, in words and as a function or a `Redo`."""

    key: str
    does: str
    act: Callable[[State], State] | Redo | None = None  # None: see step()


CONTROLS = (
    Control("Left drag", "move the selected light around what the camera looks at"),
    Control("Wheel", "the light's distance from there: up for nearer, down for farther"),
    Control("Tab", "select the next light", _next_light),
    Control("L", "the light's marker: shown, hidden", lambda state: _set(state, marker=not state.marker)),
    Control("R", "put the lights back where the scene file has them", _lights_back),
    Control("Right drag", "turn the camera around what it looks at, also from below"),
    Control("Shift+wheel", "the camera's distance from there: up for nearer, down for farther"),
    Control("Home", "put the camera back where the scene file has it", _camera_back),
    Control("B", "shading: as the scene says, phong, blinn, and all other models for all materials", _shading),
    Control("V", "the shading before", lambda state: _shading(state, -1)),
    Control("S", f"shadows: {', '.join(get_args(Shadows))}", _shadows),
    Control(
        "A", f"antialiasing: off, {', '.join(map(str, _ANTIALIASING[1:]))}, or all samples (--samples)", _antialiasing
    ),
    Control("N", "show normals, or the picture", _showing("normal")),
    Control("Z", "show depth, or the picture", _showing("depth")),
    Control("M", "show materials, or the picture", _showing("material")),
    Control("P", "write a screenshot: as soon as all samples are in it, or before it changes", Redo.SCREENSHOT),
    Control("E", "write the scene, with what was moved, to a TOML file", Redo.EXPORT),
    Control("H", "show or hide this table", lambda state: _set(state, help=not state.help)),
    Control("Escape", "close the window", Redo.CLOSE),
)
_ACTS = {control.key: control.act for control in CONTROLS}


def command(state: State, size: tuple[int, int], path: str) -> str:
    """The command line that renders a file of the state's scene to its picture in the window."""
    output = path.removesuffix(".toml") + "-rendered.png"  # not a name of P's
    parts = "raytracer render", shlex.quote(path), "-o", shlex.quote(output), f"--size {size[0]}x{size[1]}"
    return " ".join(filter(None, (*parts, flags(fewest(state.settings, state.document.section.settings)))))
