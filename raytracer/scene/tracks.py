"""Animations: values of a scene that change from frame to frame, and turns of the camera."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from typing import Literal

from raytracer.core.record import Record
from raytracer.core.vectors import add, dot, sub
from raytracer.scene.camera import Camera
from raytracer.scene.solids.affine import rotation

# How a track goes from one key to the next one: in equal steps; with a slow start and end at each key, by the
# polynomial 3 t^2 - 2 t^3 (smoothstep) of the share t of the way; not at all before the next key.
Interpolation = Literal["linear", "smooth", "step"]

# A number, or a vector of numbers.
TrackValue = float | tuple[float, ...]


class Track(Record, frozen=True):
    """One value of a scene in all frames.

    Attributes:
        path: the path of the value in the scene file, such as "lights.0.position".
        keys: (frame, value), in the order of the frames, at least one. All values are numbers, or vectors of equal
            length. Before the first key and after the last one, the value is that of the nearest key.
        interpolation: how the value goes from key to key.
    """

    path: str
    keys: tuple[tuple[int, TrackValue], ...]
    interpolation: Interpolation = "linear"

    def value(self, frame: int) -> TrackValue:
        """Return the value in a frame. At a key, it is the key's value exactly."""
        after = bisect_right(self.keys, frame, key=lambda key: key[0])
        if after == 0:
            return self.keys[0][1]
        first, start = self.keys[after - 1]
        if after == len(self.keys) or first == frame or self.interpolation == "step":
            return start
        last, end = self.keys[after]
        t = (frame - first) / (last - first)
        share = t * t * (3.0 - 2.0 * t) if self.interpolation == "smooth" else t
        if isinstance(start, tuple) and isinstance(end, tuple):
            return tuple(_mix(a, b, share) for a, b in zip(start, end, strict=True))
        assert not isinstance(start, tuple) and not isinstance(end, tuple)
        return _mix(start, end, share)


class Animation(Record, frozen=True):
    """The table [animation] of a scene file: the frames of a movie.

    Attributes:
        frames: the number of frames.
        fps: frames per second.
        turntable: the degrees by which the camera goes round in all frames together. Default: 0.
        tracks: the values that change, each with another path. Default: none.
    """

    frames: int
    fps: float = 24.0
    turntable: float = 0.0
    tracks: tuple[Track, ...] = ()

    def values(self, frame: int) -> Mapping[str, TrackValue]:
        """Return the values of all tracks in a frame, by path."""
        return {track.path: track.value(frame) for track in self.tracks}

    def degrees(self, frame: int) -> float:
        """Return the degrees by which the camera has gone round in a frame.

        Frame k of n is turned by turntable * k / n: after a turn by 360 degrees, the frame after the last one would
        equal the first one, and a movie in a loop goes on without a pause.
        """
        return self.turntable * frame / self.frames


def go_round(camera: Camera, degrees: float) -> Camera:
    """Return a camera that has gone round the point that it looks at, about its direction `up`, counterclockwise.

    The point stays in the centre of the picture, and the distance stays the same. A turn by 0 degrees returns the same
    camera.

    Args:
        camera: the camera.
        degrees: the angle, seen from the tip of `up`.

    Raises:
        InputError: a position beyond the limits of lengths.
    """
    if degrees == 0.0:
        return camera
    arm = sub(camera.position, camera.look_at)
    x, y, z = (dot(row[:3], arm) for row in rotation(camera.up, degrees))
    return camera.replace(position=add(camera.look_at, (x, y, z)))


def _mix(start: float, end: float, share: float) -> float:
    """Return the number at a share of the way from `start` to `end`. Equal ends give exactly their number."""
    return start if start == end else start * (1.0 - share) + end * share
