"""File watcher for the files that define the picture: the scene file, its companion files and the shaders."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from raytracer.compiler.glsl.preprocessor import shaders_folder
from raytracer.core.validation import InputError
from raytracer.formats.scene_file import companion_paths, read_text

_SHADERS = (".glsl", ".frag", ".vert")


class Files:
    """The scene file, its companion files and all shaders, with their times and sizes at the last check."""

    def __init__(self, scene: Path) -> None:
        self.scene = scene
        self.has_scene = scene.is_file()  # False for a pipe, which cannot be read twice
        self._instances: list[Path] = []
        self._seen: dict[Path, tuple[int, int]] = {}
        self.check_for_changes()

    def check_for_changes(self) -> bool:
        """Check all files, and return whether any file was saved since the last check.

        A file that has disappeared counts as unchanged, because editors replace files. Hidden files are skipped: they
        are locks and backups of editors.
        """
        before = self._seen.copy()
        if self.has_scene:
            self._record_version(self.scene)
            if self._seen.get(self.scene) != before.get(self.scene):
                with suppress(InputError):  # a scene file with errors keeps its previous companion files
                    self._instances = companion_paths(self.scene, read_text(self.scene))
        shaders = (path for path in shaders_folder().rglob("[!.]*") if path.suffix in _SHADERS)
        for path in (*self._instances, *shaders):
            self._record_version(path)
        return self._seen != before

    def _record_version(self, path: Path) -> None:
        with suppress(OSError):
            status = path.stat()
            self._seen[path] = status.st_mtime_ns, status.st_size
