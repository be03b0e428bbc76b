"""The table [animation] of scene files: wrong tables are refused in one line, and frames have the stated values."""

import re
from pathlib import Path

import pytest

import raytracer as rt
from raytracer.formats.animated_scene import open_animation
from raytracer.formats.scene_file import loads, parse_document
from tests.scenes import GOOD


def animated(table: str) -> rt.AnimatedScene:
    return open_animation(parse_document(Path("good.toml"), f"{GOOD}\n[animation]\n{table}"))


def track(path: str, keys: str = "{ 0 = 1 }", rest: str = "") -> str:
    return f'frames = 48\n[[animation.tracks]]\npath = "{path}"\nkeys = {keys}\n{rest}'


RADIUS = "shapes.a.sphere.radius"
# Wrong tables, and a part of the error line.
BAD = [
    ("", "animation: missing key `frames`"),
    ("frames = 0", "animation.frames: expected a whole number in [1, 1000000], got 0"),
    ("frames = -3", "animation.frames"),
    ("frames = 1000001", "animation.frames"),
    ("frames = 2.0", "animation.frames: expected a whole number"),
    ("frames = true", "animation.frames: expected a whole number"),
    ('frames = "48"', "animation.frames: expected a whole number"),
    ("frames = [48]", "animation.frames: expected a whole number"),
    ("frames = 48\nfps = 0", "animation.fps: expected a number in [0.001, 1000], got 0"),
    ("frames = 48\nfps = -24", "animation.fps"),
    ("frames = 48\nfps = 1001", "animation.fps"),
    ("frames = 48\nfps = nan", "animation.fps"),
    ("frames = 48\nfps = inf", "animation.fps"),
    ("frames = 48\nturntable = inf", "animation.turntable: expected degrees in [-360000, 360000], got inf"),
    ("frames = 48\nturntable = [360]", "animation.turntable"),
    ("frames = 48\nturntables = 360", 'unknown key `turntables` .*; did you mean "turntable"?'),
    ("frames = 48\ntracks = 3", "animation.tracks: expected a list, got a number"),
    ("frames = 48\ntracks = [3]", "animation.tracks[0]: expected a table, got a number"),
    ("frames = 48\ntracks = [{}]", "animation.tracks[0]: missing key `path`"),
    ('frames = 48\ntracks = [{path = "lights.0.radius"}]', "animation.tracks[0]: missing key `keys`"),
    (track(RADIUS, rest="loop = true"), "animation.tracks[0]: unknown key `loop`"),
    (track(RADIUS, rest='interpolation = "cubic"'), "animation.tracks[0].interpolation: expected one of linear"),
    (track(RADIUS, rest='interpolation = "linaer"'), 'did you mean "linear"?'),
    (track(RADIUS, "[1, 2]"), "animation.tracks[0].keys: expected a table, got a list"),
    (track(RADIUS, "{}"), "animation.tracks[0].keys: expected at least one key"),
    (track(RADIUS, "{ 48 = 1 }"), "animation.tracks[0].keys.48: expected a frame in [0, 47] as the name"),
    (track(RADIUS, "{ -1 = 1 }"), "expected a frame in [0, 47]"),
    (track(RADIUS, "{ 007 = 1 }"), "expected a frame in [0, 47]"),
    (track(RADIUS, '{ "1.5" = 1 }'), "expected a frame in [0, 47]"),
    (track(RADIUS, "{ first = 1 }"), "expected a frame in [0, 47]"),
    (track(RADIUS, "{ 0 = nan }"), "animation.tracks[0].keys.0: expected a finite number"),
    (track(RADIUS, '{ 0 = "1" }'), "animation.tracks[0].keys.0: expected a finite number"),
    (track("camera.position", "{ 0 = [1, 2, 3], 9 = [1, 2] }"), "keys.9: expected a vector of 3 numbers, as the first"),
    (track("camera.position", "{ 0 = [1, 2, 3], 9 = 1 }"), "keys.9: expected a vector of 3 numbers, as the first"),
    (track("camera.position", "{ 0 = [] }"), "expected a finite number, or a vector of 1 to 16"),
    (track("camera.position", "{ 0 = [1, 2] }"), "camera.position: expected 3 numbers within +-1e+12, got [1.0, 2.0]"),
    (track("camera.positoin"), 'camera: unknown key `positoin` .*; did you mean "position"?'),
    (track(""), "animation.tracks[0].path: expected a path such as"),
    (track("lights"), "animation.tracks[0].path: expected the path of a number, a vector or a text"),
    (track("lights.7.radius"), "animation.tracks[0].path: expected an index in [0, 0] after lights, got 7"),
    (
        track("shapes.d.sphere.radius"),
        "animation.tracks[0].path: expected a path of the scene, but in shapes is no 'd'",
    ),
    (track("animation.frames"), "animation.tracks[0].path: expected a path that begins with a table of the scene"),
    (track("settings.samples"), "animation.tracks[0].path: expected a path of the scene: the settings"),
    (track("objects.one"), "animation.tracks[0].path: expected a text for objects.one, got 1"),
    (track("shapes.a.material"), "animation.tracks[0].path: expected a text for shapes.a.material"),
    (track(RADIUS) + track(RADIUS)[11:], "animation.tracks[1].path: expected one track for each value"),
    (track("lights.0.position", "{ 0 = [1, 2, 3] }") + track("lights.0.position.1")[11:], "animation.tracks[1].path"),
    (track(RADIUS, "{ 0 = -1 }"), f"{RADIUS}: expected a number above 0, in [1e-12, 1e+12], got -1.0 (in frame 0)"),
]


@pytest.mark.parametrize(("table", "message"), BAD, ids=[f"{i}: {message[:40]}" for i, (_, message) in enumerate(BAD)])
def test_a_wrong_animation_is_refused_in_one_line_with_its_place(table: str, message: str) -> None:
    with pytest.raises(rt.InputError) as caught:
        animated(table)
    pattern = re.escape(message).replace(r"\.\*", ".*")
    assert re.match(rf"good\.toml:\d+: .*{pattern}", str(caught.value)), caught.value
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("count", "message"), [(1025, "expected at most 1024 tracks"), (2, "expected at most 100000 keys")]
)
def test_many_tracks_and_keys_are_refused(count: int, message: str) -> None:
    keys = "{ 0 = 1 }" if count > 2 else "{ " + ", ".join(f"{i} = 1" for i in range(60_000)) + " }"
    tracks = "\n".join(f'[[animation.tracks]]\npath = "materials.m{i}.h"\nkeys = {keys}' for i in range(count))
    materials = "\n".join(f"[materials.m{i}]\nh = 2" for i in range(count))
    with pytest.raises(rt.InputError, match=message):
        loads(f"{GOOD}\n{materials}\n[animation]\nframes = 60000\n{tracks}")


def test_a_wrong_table_is_refused_also_where_a_single_picture_is_rendered() -> None:
    with pytest.raises(rt.InputError, match=r"animation\.fps"):
        loads(GOOD + "\n[animation]\nframes = 3\nfps = 0")


def test_the_scene_of_a_file_is_the_one_that_is_written_in_it() -> None:
    assert loads(f"{GOOD}\n[animation]\nturntable = 90\n{track(RADIUS)}") == loads(GOOD)


def test_a_frame_has_the_scene_of_a_file_with_its_values() -> None:
    animation = animated(track(RADIUS, "{ 0 = 1.5, 8 = 2.5 }") + track("camera.position", "{ 0 = [0, 3, 5] }")[11:])
    text = GOOD.replace("radius = 1.5", "radius = 1.75", 1).replace("position = [0, 3, 6]", "position = [0, 3, 5]", 1)
    expected = parse_document(Path("good.toml"), text).scene
    assert animation.scene(2) == expected != animation.scene(1)
    assert animation.scene(47).camera == expected.camera and animation.scene(8) == animation.scene(47)


def test_an_animation_has_a_length_and_yields_its_scenes() -> None:
    animation = animated("frames = 3\nfps = 12.5\nturntable = 90")
    assert len(animation) == animation.frames == 3 and animation.fps == 12.5
    assert list(animation) == [animation.scene(k) for k in range(3)]
    with pytest.raises(rt.InputError, match=r"frame: expected a whole number in \[0, 2\], got 3"):
        animation.scene(3)


def test_a_refused_frame_is_named_with_the_place_of_its_value() -> None:
    animation = animated(track(RADIUS, "{ 0 = 1, 10 = -1 }"))
    with pytest.raises(rt.InputError) as caught:
        animation.scene(7)
    assert re.fullmatch(rf"good\.toml:\d+: {RADIUS}: .* got -0\.3\d* \(in frame 7\)", str(caught.value))


def test_a_file_without_the_table_is_no_animation() -> None:
    with pytest.raises(rt.InputError, match=r"assignment\.toml: expected a table \[animation\]"):
        rt.animation("assignment")
