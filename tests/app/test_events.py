"""Events of the window: the state after an event, and the parts that the window must redraw."""

from __future__ import annotations

import argparse
import itertools
import math
import shlex
from pathlib import Path
from typing import Any, Literal, get_args

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.app.commands.render_cli import add_arguments as render_arguments
from raytracer.app.options import chosen_settings
from raytracer.app.viewer.events import (
    CONTROLS,
    Control,
    Cursor,
    Event,
    Failed,
    HintShown,
    Key,
    Loaded,
    NoticeShown,
    Press,
    Redo,
    Release,
    State,
    Wheel,
    command_line,
    revert_picture,
    start,
    step,
)
from raytracer.app.viewer.orbit import turn_camera, turn_light
from raytracer.app.viewer.overlay import _draw_box, draw_panels
from raytracer.app.viewer.titles import compiling_notice, compiling_title, title
from raytracer.formats.estimate import FEW_PIXELS, Estimate
from raytracer.formats.scene_file import SceneDocument
from raytracer.formats.settings_section import SettingsSection
from raytracer.scene.materials.models import SHADINGS
from raytracer.scene.options import Shadows
from raytracer.scene.settings_patch import EMPTY_PATCH, SettingsPatch
from tests import scenes

TEXT = scenes.ASSIGNMENT.read_text()


def open_state(scene: rt.Scene | None = None, file_settings: SettingsPatch = EMPTY_PATCH, **chosen: Any) -> State:
    return start(make_document(TEXT, scene or scenes.assignment(), file_settings), SettingsPatch(**chosen))


def make_document(text: str, scene: rt.Scene, file_settings: SettingsPatch = EMPTY_PATCH) -> SceneDocument:
    return SceneDocument(Path("assignment.toml"), text, scene, SettingsSection(file_settings))


def make_loaded(text: str, scene: rt.Scene, file_settings: SettingsPatch = EMPTY_PATCH) -> Loaded:
    return Loaded(make_document(text, scene, file_settings))


def apply_events(state: State, *events: Event) -> State:
    for event in events:
        state, _ = step(state, event)
    return state


def required_work(state: State, event: Event) -> Redo:
    return step(state, event)[1]


def two_lights() -> rt.Scene:
    lights = [rt.PointLight((4, 7, 4)), rt.PointLight((-3, 5, 2))]
    return msgspec.structs.replace(scenes.assignment(), lights=lights)


def test_dragging_along_the_windows_height_turns_the_light_or_the_camera_by_half_a_circle() -> None:
    light = turn_light(scenes.assignment(), 0, math.pi / 4, math.pi / 8)
    camera = turn_camera(scenes.assignment(), math.pi / 4, math.pi / 8)
    cases: list[tuple[Literal["left", "right"], rt.Scene]] = [("left", light), ("right", camera)]
    for button, turned in cases:
        state = apply_events(open_state(), Cursor(0.5, 0.5), Press(button))
        for k in range(1, 6):
            assert required_work(state, Cursor(0.5 + 0.05 * k, 0.5 - 0.025 * k)) == Redo.SAMPLES
            state = apply_events(state, Cursor(0.5 + 0.05 * k, 0.5 - 0.025 * k))
        np.testing.assert_allclose(state.scene.lights[0].position, turned.lights[0].position, atol=1e-12)
        np.testing.assert_allclose(state.scene.camera.position, turned.camera.position, atol=1e-12)
        other: Literal["left", "right"] = "right" if button == "left" else "left"
        assert required_work(apply_events(state, Release(other)), Cursor(0.9, 0.9)) == Redo.SAMPLES
        assert required_work(apply_events(state, Release(button)), Cursor(0.9, 0.9)) == Redo.NOTHING
        assert state.document.scene == scenes.assignment(), "the scene of the file does not change"


def test_the_wheel_scales_the_distance_of_the_light_and_with_shift_of_the_camera() -> None:
    centre = scenes.assignment().camera.look_at

    def distances(state: State) -> tuple[float, float]:
        scene = state.scene
        return math.dist(scene.lights[0].position, centre), math.dist(scene.camera.position, centre)

    light, camera = distances(open_state())
    assert distances(apply_events(open_state(), Wheel(2.0, False))) == pytest.approx((light / 1.21, camera))
    assert distances(apply_events(open_state(), Wheel(-2.0, True))) == pytest.approx((light, camera * 1.21))
    assert distances(apply_events(open_state(), Wheel(3.0, True), Wheel(-3.0, True))) == pytest.approx((light, camera))


def test_tab_selects_a_light_home_resets_the_camera_and_r_resets_the_scene() -> None:
    state = apply_events(open_state(two_lights()), Key("Tab"), Wheel(1.0, False), Wheel(1.0, True))
    assert state.light == 1 and required_work(state, Key("Tab")) == Redo.PRESENT
    assert (
        state.scene.lights[0] == state.document.scene.lights[0]
        and state.scene.lights[1] != state.document.scene.lights[1]
    )
    assert apply_events(state, Key("Tab")).light == 0
    home = apply_events(state, Key("Home"))
    assert home.scene.camera == state.document.scene.camera and home.scene.lights == state.scene.lights
    assert apply_events(home, Key("R")).scene == state.document.scene
    dark = msgspec.structs.replace(scenes.assignment(), lights=())
    assert apply_events(open_state(dark), Key("Tab"), Key("R"), Wheel(1.0, False)).scene == dark


@pytest.mark.parametrize(
    ("key", "presses"),
    [("B", len(SHADINGS)), ("S", len(get_args(Shadows))), ("A", 4), ("N", 2), ("Z", 2), ("M", 2)],
)
def test_a_toggle_draws_a_new_picture_at_each_press_and_returns_to_the_first(key: str, presses: int) -> None:
    state, states = open_state(), []
    for _ in range(presses):
        assert required_work(state, Key(key)) == Redo.SAMPLES
        states.append(state)
        state = apply_events(state, Key(key))
    assert state == states[0] and len(set(map(repr, states))) == presses


@pytest.mark.parametrize("key", ["L", "H"])
def test_an_overlay_appears_and_disappears_without_a_new_picture(key: str) -> None:
    state = apply_events(open_state(), Key(key))
    assert state != open_state() and required_work(open_state(), Key(key)) == Redo.PRESENT
    assert apply_events(state, Key(key)) == open_state()


def test_the_keys_b_and_s_reach_every_shading_and_every_kind_of_shadow() -> None:
    lamp = msgspec.structs.replace(scenes.assignment(), lights=[rt.PointLight((4, 7, 4), radius=0.5)])
    state, reached = open_state(lamp), set()
    for _ in range(80):
        state = apply_events(state, Key("S"), Key("B"))
        reached |= {state.settings.shadows, state.settings.shading}
    # None stands for the scene's own shading, which is phong here.
    assert reached == {*get_args(Shadows), None, *SHADINGS} - {"phong"}

    mixed = rt.Sphere((0, 0, 0), 1, rt.Material()) | rt.Sphere((1, 0, 0), 1, rt.Material(model="blinn"))
    state, order = open_state(scenes.lit_scene(mixed)), []
    for key in "BBVVVB":
        state = apply_events(state, Key(key))
        order.append(state.settings.shading)
    assert order == ["phong", "blinn", "phong", None, SHADINGS[-1], None]
    chosen = open_state(shading="phong")
    assert apply_events(chosen, Key("B")).settings.shading == "blinn", "every key press has an effect"


def test_reloading_the_file_keeps_the_users_moves_unless_the_file_moves_the_same_object() -> None:
    state = apply_events(open_state(two_lights()), Key("Tab"), Wheel(1.0, False), Wheel(1.0, True), Failed("oh"))
    brighter = msgspec.structs.replace(two_lights(), ambient=(2, 2, 2))
    kept = apply_events(state, make_loaded("new", brighter))
    assert (kept.scene.camera, kept.scene.lights) == (state.scene.camera, state.scene.lights)
    assert (
        kept.scene.ambient == (2, 2, 2)
        and kept.document.scene == brighter
        and kept.document.text == "new"
        and kept.error == ""
    )
    wider = msgspec.structs.replace(scenes.assignment().camera, vertical_fov=70)
    other = (rt.PointLight((4, 7, 4), (1, 0, 0)), rt.PointLight((9, 9, 9)), rt.PointLight((1, 1, 1)))
    partly = apply_events(
        state, make_loaded("new", msgspec.structs.replace(two_lights(), camera=wider, lights=other))
    ).scene
    assert partly.camera == msgspec.structs.replace(wider, position=state.scene.camera.position)
    assert partly.lights == (other[0], other[1], other[2]), "the file, too, has moved the light that the user moved"
    colored = (two_lights().lights[0], rt.PointLight((-3, 5, 2), (1, 0, 0)))
    kept = apply_events(state, make_loaded("new", msgspec.structs.replace(two_lights(), lights=colored))).scene
    assert kept.lights == (colored[0], rt.PointLight(state.scene.lights[1].position, (1, 0, 0)))
    moved = msgspec.structs.replace(scenes.assignment(), camera=rt.Camera((0, 9, 9), (0, 0, 0)))
    taken = apply_events(state, make_loaded("new", moved))
    assert taken.scene == moved and taken.light == 0


def test_reverting_restores_the_document_the_scene_and_the_settings_and_nothing_else() -> None:
    good = open_state(two_lights())
    state = apply_events(
        good, Key("L"), Key("Tab"), Cursor(0.3, 0.3), Key("B"), make_loaded("new", scenes.assignment())
    )
    back = revert_picture(state, good)
    assert (back.document.text, back.document.scene, back.scene, back.settings) == (
        TEXT,
        good.document.scene,
        good.scene,
        good.settings,
    )
    assert not back.marker and back.cursor == (0.3, 0.3)


def test_an_error_stays_until_the_file_is_valid_and_a_notice_until_the_next_key() -> None:
    state = apply_events(open_state(), Failed("line 3"), NoticeShown("wrote it"), Cursor(0.3, 0.3))
    assert (state.error, state.notice) == ("line 3", "wrote it")
    state = apply_events(state, Key("H"), Wheel(1.0, False))
    assert (state.error, state.notice) == ("line 3", "")
    assert apply_events(state, make_loaded(TEXT, scenes.assignment())).error == ""


def test_other_keys_do_nothing() -> None:
    for name in ("", "X", "left drag", "\u0438"):
        assert step(open_state(), Key(name)) == (open_state(), Redo.NOTHING)


def test_the_keys_p_e_and_escape_request_actions_of_the_window() -> None:
    for key, request in (("P", Redo.SCREENSHOT), ("E", Redo.EXPORT), ("Escape", Redo.CLOSE)):
        assert step(open_state(), Key(key)) == (open_state(), request)


def test_the_help_and_the_page_of_the_window_show_the_table_of_controls(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["view", "--help"])
    shown = " ".join(capsys.readouterr().out.split())

    def row(control: Control) -> str:
        return f"| {control.key} | {control.effect} |"

    table = "\n".join(["| key | action |", "|---|---|", *map(row, CONTROLS)])
    assert table in (scenes.CHECKOUT / "docs/window.md").read_text(), f"docs/window.md needs the table:\n{table}"
    for control in CONTROLS:
        assert f"{control.key} {control.effect}" in shown
    assert len({control.key for control in CONTROLS}) == len(CONTROLS)


def test_the_title_states_the_progress_the_error_and_the_settings() -> None:
    state = apply_events(open_state(two_lights()), Key("B"), Key("S"), Key("Tab"))
    assert title(state, 12, 31.4) == (
        "assignment - 31 ms, 12 of 256 samples, blinn, diluted shadows, light 2 of 2, H for help"
    )
    for unknown, qualifier in (("", "about"), (FEW_PIXELS, "at least")):
        estimate = Estimate(64, 1.0, 0.00128, 0.01, (3, 4), unknown)
        title_text = title(open_state(max_error=0.001), 64, 9.0, estimate)
        assert f"64 of 4096 samples, error {qualifier} 0.0013, " in title_text
    assert "phong" in title(open_state(), 1, 1.0) and "showing depth" in title(
        apply_events(open_state(), Key("Z")), 1, 1.0
    )


def test_the_title_and_the_overlay_name_the_settings_that_are_being_compiled() -> None:
    state = apply_events(open_state(), Key("B"), Key("S"))
    assert compiling_notice(state) == "compiling blinn, diluted shadows ..."
    assert compiling_title(state) == "assignment - compiling blinn, diluted shadows ..., H for help"
    assert "compiling showing normal ..." in compiling_title(apply_events(state, Key("N")))


def test_a_hint_is_visible_until_the_next_key_or_until_it_is_withdrawn() -> None:
    state = apply_events(open_state(), HintShown("H: help"), Cursor(0.3, 0.3))
    assert state.hint == "H: help" and len(draw_panels(state, (640, 360), 1.0)) == 1
    assert required_work(state, HintShown("")) == Redo.PRESENT and apply_events(state, HintShown("")).hint == ""
    assert apply_events(state, Key("L")).hint == "" and apply_events(state, NoticeShown("wrote it")).hint == ""
    kept = apply_events(open_state(), NoticeShown("wrote it"), HintShown("H: help"), HintShown(""))
    assert kept.notice == "wrote it", "withdrawing a hint does not remove a notice"


def test_the_key_s_explains_why_there_are_no_soft_shadows() -> None:
    points = [rt.PointLight((4, 7, 4)), rt.PointLight((-4, 7, 4))]
    why = "no soft shadows: no light has a radius"
    expected = [("diluted", ""), ("off", why), ("hard", "")]
    for lights in (points, points[:1], []):
        state = open_state(msgspec.structs.replace(scenes.assignment(), lights=lights))
        for shadows, hint in expected:
            state = apply_events(state, Key("S"))
            assert (state.settings.shadows, state.hint) == (shadows, hint)
    lamp = open_state(
        msgspec.structs.replace(scenes.assignment(), lights=[points[0], rt.PointLight((4, 7, 4), radius=1)])
    )
    assert apply_events(lamp, Key("S"), Key("S")).settings.shadows == "soft"
    assert apply_events(lamp, Key("S"), Key("S"), Key("S")).hint == ""


@pytest.mark.parametrize("letter", [6.0, 9.0, 12.0, 16.0, 24.0, 32.0])
def test_the_overlay_shows_two_dashes_as_two(letter: float) -> None:
    for text in ("--", "--samples"):
        ink = _draw_box([text], letter, (0, 0, 0, 255))[..., 0].astype(int)
        dashes = ink[ink[:, : 2 * round(0.6 * letter)].sum(axis=1).argmax()]
        starts = np.flatnonzero(np.diff((dashes > 64).astype(int)) == 1)
        assert len(starts) >= 2 and starts[1] - starts[0] < letter, "side by side, with a gap"


def test_the_exported_command_renders_the_picture_of_the_window() -> None:
    state = apply_events(open_state(), Key("B"), Key("S"), Key("A"))
    arguments = shlex.split(command_line(state, (640, 360), "a b-1.toml"))
    assert arguments == shlex.split(
        "raytracer render 'a b-1.toml' -o 'a b-1-rendered.png' --size 640x360 --shading blinn --shadows diluted"
    )


def test_the_exported_command_has_the_windows_settings_whatever_the_file_has() -> None:
    files = [
        EMPTY_PATCH,
        SettingsPatch(samples=16, shading="ggx"),
        SettingsPatch(max_error=0.01),
        SettingsPatch(time=2.0, samples=8),
        SettingsPatch(adaptive=0.1, samples=16),
        SettingsPatch(quality="high", shadows="off"),
    ]
    flags = [{}, {"max_error": 0.001}, {"time": 1.0, "max_error": None}, {"quality": "draft"}]
    for file_settings, chosen, keys in itertools.product(files, flags, ("", "A", "BS", "V")):
        state = apply_events(open_state(file_settings=file_settings, **chosen), *map(Key, keys))
        words = shlex.split(command_line(state, (640, 360), "a.toml"))
        options = argparse.ArgumentParser()
        render_arguments(options)
        chosen_again = chosen_settings(options.parse_args(["a.toml", *words[3:]]))
        assert (file_settings | chosen_again).resolve() == state.settings
    assert "--max-error 0.001 " in command_line(open_state(max_error=0.001), (8, 8), "a.toml") + " "


def test_reloading_applies_only_the_settings_that_changed_in_the_file() -> None:
    state = apply_events(open_state(file_settings=SettingsPatch(samples=16, shadows="soft"), bounces=3), Key("B"))
    assert (state.settings.samples, state.limit) == (16, 16)
    same = apply_events(state, make_loaded(TEXT, scenes.assignment(), SettingsPatch(shadows="soft", samples=16)))
    assert same.settings == state.settings
    other = apply_events(
        state, make_loaded(TEXT, scenes.assignment(), SettingsPatch(samples=16, max_error=0.01, bounces=8))
    )
    assert other.settings == msgspec.structs.replace(state.settings, shadows="hard", max_error=0.01)
    assert other.settings.bounces == 3 and other.settings.shading == "blinn"
    gone = apply_events(other, make_loaded(TEXT, scenes.assignment()))
    assert (gone.settings.samples, gone.limit, gone.settings.max_error) == (256, 256, None)
    cancelled = open_state(file_settings=SettingsPatch(max_error=0.01), max_error=None)
    assert (cancelled.settings.samples, cancelled.limit) == (256, 256)
    with pytest.raises(rt.InputError, match=r"^settings.sequence: expected one of sobol, r2, random in the window"):
        apply_events(state, make_loaded(TEXT, scenes.assignment(), SettingsPatch(sequence="grid")))
    assert open_state(file_settings=SettingsPatch(sequence="grid"), sequence="r2").settings.sequence == "r2"


def test_the_overlay_is_twice_as_large_at_display_scale_2_and_fits_into_any_window() -> None:
    helped = apply_events(open_state(), Key("H"))
    (once, corner), *_ = draw_panels(helped, (1280, 720), 1.0)
    (twice, _), *_ = draw_panels(helped, (2560, 1440), 2.0)
    np.testing.assert_allclose(twice.shape, np.multiply(once.shape, (2, 2, 1)), rtol=0.05)
    assert corner == (0, 720 - once.shape[0]) and 300 < once.shape[1] < 1280 / 3, "the middle third is free"
    assert draw_panels(open_state(), (1280, 720), 1.0) == []
    failed = apply_events(
        helped, Failed("shaders/geometry/sphere.glsl:12: error: " + "word " * 300 + "\n" + "x" * 5000)
    )
    failed = apply_events(failed, NoticeShown("wrote a file"))
    assert len(draw_panels(failed, (1280, 720), 1.0)) == 3, "a notice does not hide behind an error"
    for size in ((1280, 720), (320, 180), (40, 30), (1, 1)):
        boxes = draw_panels(failed, size, 1.0)
        assert len(boxes) >= 2
        for pixels, (x, y) in boxes:
            assert 0 <= x <= x + pixels.shape[1] <= size[0] and 0 <= y <= y + pixels.shape[0] <= size[1]
