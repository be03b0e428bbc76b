"""The table [animation] of a scene file: the number of frames, and the values that change from frame to frame."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, get_args

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, Keys, check_choice, integer, items, number, within
from raytracer.formats.scene_paths import parse_path, replace_value
from raytracer.formats.toml_tables import as_list, as_table, check_table
from raytracer.scene.tracks import Animation, Interpolation, Track, TrackValue

# The most frames: a movie of 11 hours at 24 frames per second.
MAX_FRAMES = 1_000_000
# The fewest and the most frames per second: a frame lasts a whole number of milliseconds in the lossless formats, and
# at most a quarter of an hour.
MIN_FPS, MAX_FPS = 0.001, 1000.0
# The largest turn of the camera in all frames: 1000 rounds.
MAX_TURN = 360_000.0
# The most tracks. Each one copies the tables around its value, for each frame.
MAX_TRACKS = 1024
# The most keys of all tracks together. A longer list comes from a program, which can write several scene files.
MAX_KEYS = 100_000
# The most numbers of a vector: a row of a matrix has 4.
MAX_LENGTH = 16
# A frame number as the name of a key. Leading zeros would allow two names of one frame.
_FRAME = re.compile(r"0|[1-9][0-9]{0,8}", re.ASCII)


def parse_animation(value: Any, tables: Mapping[str, Any]) -> Animation:
    """Check and convert the table [animation].

    Args:
        value: the table.
        tables: all tables of the scene file, to which the paths of the tracks lead.

    Raises:
        InputError: a wrong value, with the path of keys.
    """
    with within("animation"):
        table = check_table(value, ("frames", "fps", "turntable", "tracks"), ("frames",))
        frames = integer(table["frames"], "frames", 1, MAX_FRAMES)
        fps = number(table.get("fps", 24.0), "fps", MIN_FPS, MAX_FPS, f"a number in [{MIN_FPS:g}, {MAX_FPS:g}]")
        expected = f"degrees in [{-MAX_TURN:g}, {MAX_TURN:g}]"
        turntable = number(table.get("turntable", 0.0), "turntable", -MAX_TURN, MAX_TURN, expected)
        with within("tracks"):
            return Animation(frames, fps, turntable, _tracks(table.get("tracks", []), frames, tables))


def _tracks(value: Any, frames: int, tables: Mapping[str, Any]) -> tuple[Track, ...]:
    """Convert the list of tracks. Raises InputError, also for two tracks of one value."""
    values = as_list(value)
    if len(values) > MAX_TRACKS:
        raise InputError(f"expected at most {MAX_TRACKS} tracks, got {len(values)}")
    tracks: list[Track] = []
    ends: set[tuple[str, ...]] = set()
    inner: set[tuple[str, ...]] = set()
    keys = 0
    for i, item in enumerate(values):
        with within(i):
            table = check_table(item, ("path", "keys", "interpolation"), ("path", "keys"))
            with within("path"):
                path = parse_path(table["path"])
                parts = tuple(map(str, path))
                before = {parts[:end] for end in range(1, len(parts))}
                if parts in ends or parts in inner or before & ends:
                    raise InputError(f"expected one track for each value, got a second one for {table['path']}")
                if path[0] == "settings":
                    raise InputError("expected a path of the scene: the settings of all frames are the same")
            ends.add(parts)
            inner |= before
            with within("keys"):
                keys += len(as_table(table["keys"]))
                if keys > MAX_KEYS:
                    raise InputError(f"expected at most {MAX_KEYS} keys in all tracks, got {keys} or more")
                frame_values = _keys(table["keys"], frames)
            _check_path(tables, path, frame_values[0][1])
            choices = get_args(Interpolation)
            interpolation: Any = check_choice(table.get("interpolation", "linear"), "interpolation", choices)
            tracks.append(Track(table["path"], frame_values, interpolation))
    return tuple(tracks)


def _check_path(tables: Mapping[str, Any], path: Keys, value: TrackValue) -> None:
    """Raise InputError unless the path leads to a value that a track can change."""
    with within("path"):
        replace_value(tables, path, value)


def _keys(table: dict[str, Any], frames: int) -> tuple[tuple[int, TrackValue], ...]:
    """Return the keys of a track, in the order of the frames. Raises InputError."""
    if not table:
        raise InputError("expected at least one key, such as { 0 = 1.5 }, got none")
    keys: dict[int, TrackValue] = {}
    length: int | None = None
    for name, value in table.items():
        with within(name):
            if not _FRAME.fullmatch(name) or int(name) >= frames:
                raise InputError(f"expected a frame in [0, {frames - 1}] as the name of the key")
            converted = _value(value)
            own = len(converted) if isinstance(converted, tuple) else 0
            if length is not None and own != length:
                expected = f"a vector of {length} numbers" if length else "a number"
                raise InputError(f"expected {expected}, as the first key has, got {format_value(value)}")
        length = own
        keys[int(name)] = converted
    return tuple(sorted(keys.items()))


def _value(value: Any) -> TrackValue:
    """Return a number or a vector of numbers. Raises InputError."""
    expected = f"a finite number, or a vector of 1 to {MAX_LENGTH} of them"
    if not isinstance(value, list):
        return number(value, (), expected=expected)
    parts = items(value, MAX_LENGTH) or []
    if not 1 <= len(parts) <= MAX_LENGTH:
        raise InputError(f"expected {expected}, got {format_value(value)}")
    return tuple(number(part, (), expected=expected) for part in parts)
