"""Files: those that come with the package, and those of a user, which may be anything."""

from __future__ import annotations

from pathlib import Path


def packaged(installed: str, checkout: str) -> Path:
    """A folder that comes with the package: inside it where it is installed from a wheel, beside it in a checkout."""
    package = Path(__file__).parent
    folder = package / installed
    return folder if folder.is_dir() else package.parent / checkout


def read_bounded(path: Path, most: int, *, stdin: bool = False) -> bytes:
    """The first `most` + 1 bytes of a file: more than `most` are too many.

    Raises OSError if it cannot be read, or is a folder, a pipe or a device, which may never end; with `stdin` a
    piped /dev/stdin may be read.
    """
    if path.exists() and not path.is_file() and not (stdin and path == Path("/dev/stdin")):
        raise OSError(0, "it is a folder, a pipe or a device")
    with path.open("rb") as file:
        return file.read(most + 1)
