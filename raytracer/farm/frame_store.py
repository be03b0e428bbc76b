"""The files of frames: where they are, and whether they are whole and as a job would draw them now."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from raytracer.core.output import write_atomically
from raytracer.core.validation import InputError
from raytracer.farm.frame_jobs import DRIVER, KEY
from raytracer.formats.image_files import read_metadata, read_size


class FrameStore(NamedTuple):
    """The files of frames, in one folder.

    Attributes:
        folder: the folder, which exists.
        pattern: the name of a file, with the number of the frame in printf's notation, such as "%04d.png".
    """

    folder: Path
    pattern: str

    def path(self, frame: int) -> Path:
        """Return the file of a frame."""
        return self.folder / (self.pattern % frame)

    def write(self, frame: int, data: bytes) -> None:
        """Write the file of a frame, whole or not at all. Raises OSError and InputError if it cannot be written."""
        with write_atomically(self.path(frame)) as file:
            file.write(data)

    def read_current(
        self, frame: int, key: str, size: tuple[int, int], drivers: Collection[str]
    ) -> Mapping[str, str] | None:
        """Return the texts in a frame's file if it is whole and current; None if the frame has to be drawn.

        Args:
            frame: the number of the frame.
            key: the key of the frame's job.
            size: the (width, height) of the frame.
            drivers: the names of the drivers that could draw the frame now.
        """
        path = self.path(frame)
        if not os.path.lexists(path):  # reading a missing file looks for similar names
            return None
        try:
            texts = read_metadata(path)
            is_current = texts.get(KEY) == key and texts.get(DRIVER) in drivers and read_size(path) == size
        except InputError:
            return None
        return texts if is_current else None

    def remove(self, frames: Iterable[int]) -> None:
        """Remove the files of frames, and the folder if nothing else is in it."""
        for frame in frames:
            self.path(frame).unlink(missing_ok=True)
        with suppress(OSError):  # it has other files
            self.folder.rmdir()
