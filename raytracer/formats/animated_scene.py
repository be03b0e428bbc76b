"""Animated scenes: the scene of each frame of a scene file with a table [animation]."""

from __future__ import annotations

import os
from collections.abc import Iterator

from raytracer.core.record import Record, public
from raytracer.core.validation import InputError, integer
from raytracer.formats.scene_file import SceneDocument, find_scene, read_document
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.tracks import Animation, go_round


@public
class AnimatedScene(Record, frozen=True, eq=False):
    """The scenes of all frames of a scene file: `animation.scene(frame)`, or `for scene in animation`.

    `raytracer.animation()` reads one from a file. `len(animation)` is the number of frames. The scenes of frames share
    the objects that do not change.
    """

    _document: SceneDocument
    _animation: Animation

    @property
    def frames(self) -> int:
        """The number of frames."""
        return self._animation.frames

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self._animation.fps

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the pictures in pixels, from the table [settings]. Default: (1280, 720)."""
        return self._document.section.size or DEFAULT_SIZE

    @property
    def settings(self) -> Settings:
        """The settings in the table [settings]."""
        return self._document.section.settings.resolve()

    def scene(self, frame: int) -> Scene:
        """Return the scene of a frame.

        Args:
            frame: the number of the frame. Range: 0 to `frames` - 1.

        Raises:
            InputError: no such frame, or its values do not describe a scene. The message names the frame.
        """
        frame = integer(frame, "frame", 0, self.frames - 1)
        try:
            scene = self._document.change(self._animation.values(frame)).scene
            camera = go_round(scene.camera, self._animation.degrees(frame))
        except InputError as error:
            reason = f"{error.reason} (in frame {frame})"
            raise type(error)(reason, error.keys, file=error.file, line=error.line) from None
        return scene if camera is scene.camera else scene.replace(camera=camera)

    def __len__(self) -> int:
        return self.frames

    def __iter__(self) -> Iterator[Scene]:
        return map(self.scene, range(self.frames))

    def __repr__(self) -> str:
        return f"<AnimatedScene {self._document.scene.name}: {self.frames} frames>"


def animation(path: str | os.PathLike[str]) -> AnimatedScene:
    """Read an animation: a scene file with a table [animation].

    Args:
        path: the file, or the name of an example scene, as for `load`.

    Returns:
        The scenes of all frames. The first one is built, so that most mistakes are refused here.

    Raises:
        InputError: as `load`, or the file has no table [animation], or wrong values in it.

    Warns (UserWarning) of shapes and parts that no object uses.
    """
    return open_animation(read_document(find_scene(path)))


def open_animation(document: SceneDocument) -> AnimatedScene:
    """Return the animation in a scene file. Raises InputError as animation() does."""
    if document.animation is None:
        raise InputError("expected a table [animation]; `frames = 48` is all that it needs", file=str(document.path))
    animated = AnimatedScene(document, document.animation)
    animated.scene(0)
    return animated
