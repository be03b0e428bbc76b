"""Files that a user wants written: whether they can be, and written whole or not at all."""

from __future__ import annotations

import itertools
import os
import stat
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import IO, Any

from raytracer.core.interrupts import deferred
from raytracer.core.shown import shown
from raytracer.core.validation import InputError, check_path

_ANY_MAY_WRITE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH
# The permissions of a new file, from which the umask takes some away.
_NEW_FILE = 0o666
# Opens a file to be written, as written_whole() does.
Writer = Callable[[Path], AbstractContextManager[IO[Any]]]


def check_output(path: str | os.PathLike[str], suffixes: Collection[str]) -> Path:
    """`path` if a file that ends in one of `suffixes` can be written there; InputError otherwise."""
    path = check_path(path, "path")
    if path.suffix.lower() not in suffixes:
        raise InputError(f"expected an output that ends in {' or '.join(suffixes)}", file=str(path))
    _check(path)
    return path


def check_folder(folder: Path, *names: str) -> None:
    """Raise InputError unless files can be written into `folder`, also files of these `names`."""
    _check_folder(folder, folder)
    for name in names:
        _check(folder / name)


def _check(path: Path) -> None:
    try:
        _check_folder(_target(path).parent, path)
    except OSError as error:
        raise InputError(f"expected a place that can be written to: {error.strerror}", file=str(path)) from None


def _check_folder(folder: Path, path: Path) -> None:
    """Raise InputError about `path` unless files can be written into `folder`."""
    try:
        if not folder.is_dir():
            raise InputError(f"expected a folder that exists, got {folder}", file=str(path))
        probe = _temporary(folder / "probe")
        try:
            probe.touch(exist_ok=False)
        finally:
            probe.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"expected a place that can be written to: {error.strerror}", file=str(path)) from None


def _target(path: Path) -> Path:
    """The file that has the content of `path`: `path`, or where its symbolic link leads.

    Raises InputError unless it is a regular file that can be written to, or no file at all; OSError for a name that
    the file system does not take.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if path.is_symlink():
            got = f"a link to {shown(os.readlink(path))}, which is not there"
            raise InputError(f"expected a file, got {got}; remove the link", file=str(path)) from None
        return path
    if not stat.S_ISREG(mode):
        raise InputError(
            f"expected a file, got a {'folder' if stat.S_ISDIR(mode) else 'device or a pipe'}", file=str(path)
        )
    try:
        if not mode & _ANY_MAY_WRITE:  # root may open it all the same
            raise PermissionError
        os.close(os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0)))  # not for long, if it became a pipe
    except PermissionError:
        raise InputError("expected a file that can be written to, got a read-only one", file=str(path)) from None
    return path.resolve() if path.is_symlink() else path


@contextmanager
def written_whole(path: Path, finish: Callable[[Path], object] | None = None) -> Iterator[IO[Any]]:
    """A binary file that becomes `path` when the block ends well, and vanishes when the block does not.

    A file that is there keeps its permissions and, where possible, its owner; a link stays, and its target is written.
    `finish(path)` is called once the file is there, and no interrupt comes between. Raises InputError as check_output()
    does, and OSError.
    """
    with replaced_whole(_target(path), finish and partial(finish, path)) as file:
        yield file


@contextmanager
def replaced_whole(path: Path, finish: Callable[[], object] | None = None) -> Iterator[IO[Any]]:
    """Do as written_whole(), but replace a link: who could have made the link does not choose the target."""
    kept = None
    with suppress(FileNotFoundError):
        status = path.lstat()
        kept = status if stat.S_ISREG(status.st_mode) else None
    temporary = _temporary(path)
    mode = stat.S_IMODE(kept.st_mode) & 0o777 if kept else _NEW_FILE
    # At no time may more users read it than the file before, whose group it gets in the end.
    first = mode & stat.S_IRWXU if kept else mode
    try:
        with open(temporary, "xb", opener=lambda name, flags: os.open(name, flags, first)) as file:
            yield file
        if kept:
            if hasattr(os, "chown"):
                for owner in ((-1, kept.st_gid), (kept.st_uid, -1)):
                    with suppress(OSError):  # only root gives files away, and to other groups members alone
                        os.chown(temporary, *owner)
            temporary.chmod(mode)
        with deferred():
            temporary.replace(path)
            if finish:
                finish()
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _temporary(path: Path) -> Path:
    """A name beside `path` that nobody has. The module tempfile would do, and takes long to import."""
    return path.with_name(f".{path.stem[:40]}-{os.urandom(8).hex()}.part")


def write_new(path: Path, write: Callable[[IO[Any]], object]) -> None:
    """Let `write` fill a new file, which is there when it is whole. Raises FileExistsError if `path` is there."""
    if os.path.lexists(path):
        raise FileExistsError(f"{path} is there")
    temporary = _temporary(path)
    try:
        with temporary.open("xb") as file:
            write(file)
        _rename_new(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _rename_new(old: Path, new: Path) -> None:
    """Rename a file. Raises FileExistsError if `new` is there."""
    try:
        os.link(old, new)
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        new.touch(exist_ok=False)
        old.replace(new)


def write_numbered(stem: str, suffix: str, write: Callable[[IO[Any]], object]) -> Path:
    """The first path of stem-1, stem-2, ... that is not there yet, with what `write` puts into it, as write_new()."""
    for number in itertools.count(1):
        path = Path(f"{stem}-{number}{suffix}")
        if not os.path.lexists(path):
            with suppress(FileExistsError):  # since a moment ago
                write_new(path, write)
                return path
    raise AssertionError
