"""Noticing that a scene file or a shader was saved."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from raytracer.glsl_source import shaders_folder

_SHADERS = (".glsl", ".frag", ".vert")


class Files:
    """The scene file and all shaders, as they were at the last look."""

    def __init__(self, scene: Path) -> None:
        self.scene = scene
        self.has_scene = scene.is_file()  # and not a pipe, which cannot be read twice
        self._seen: dict[Path, tuple[int, int]] = {}
        self.changed()

    def changed(self) -> bool:
        """Whether any was saved since the last look.

        Editors replace files, so one that is gone is taken to be as it was. Their hidden files,
        locks and copies, are no shaders.
        """
        shaders = (path for path in shaders_folder().rglob("[!.]*") if path.suffix in _SHADERS)
        before = self._seen.copy()
        for path in (*([self.scene] if self.has_scene else []), *shaders):
            with suppress(OSError):
                status = path.stat()
                self._seen[path] = status.st_mtime_ns, status.st_size
        return self._seen != before
