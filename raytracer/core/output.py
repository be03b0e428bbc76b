"""Writing files for the user: checks before the work starts, and atomic writes (a complete file or none)."""

from __future__ import annotations

import itertools
import os
import stat
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import IO, Any

from raytracer.core.interrupts import defer_interrupts
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, check_path

_ANY_MAY_WRITE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH
# The permissions of a new file, before the umask removes some of them.
_NEW_FILE = 0o666
# A function that opens a file for writing, such as write_atomically().
Writer = Callable[[Path], AbstractContextManager[IO[Any]]]


def check_output(path: str | os.PathLike[str], suffixes: Collection[str]) -> Path:
    """Return `path` if a file with one of the `suffixes` can be written there. Raises InputError otherwise."""
    path = check_path(path, "path")
    if path.suffix.lower() not in suffixes:
        raise InputError(f"expected an output that ends in {' or '.join(suffixes)}", file=str(path))
    check_place(path)
    return path


def make_folder(folder: Path) -> None:
    """Make a folder, and the folders around it, unless it exists. Raises InputError if that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"expected a place for a folder: {error.strerror or error}", file=str(folder)) from None


def check_folder(folder: Path, *names: str) -> None:
    """Raise InputError unless `folder` is writable and no file in it blocks one of the `names`."""
    _check_folder(folder, folder)
    for name in names:
        check_place(folder / name)


def check_place(path: Path) -> None:
    """Raise InputError unless a file can be written to `path`, or a folder made there if there is nothing yet."""
    try:
        _check_folder(_target(path).parent, path)
    except OSError as error:
        raise InputError(f"expected a place that can be written to: {error.strerror}", file=str(path)) from None


def _check_folder(folder: Path, path: Path) -> None:
    """Raise InputError, with `path` as the file, unless files can be written into `folder`."""
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
    """Return the file that a write to `path` would change: `path` itself, or the target of its symbolic link.

    Raises:
        InputError: the target exists and is not a writable regular file, or the link leads nowhere.
        OSError: the file system does not accept the name.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if path.is_symlink():
            got = f"a link to {format_value(os.readlink(path))}, which is not there"
            raise InputError(f"expected a file, got {got}; remove the link", file=str(path)) from None
        return path
    if not stat.S_ISREG(mode):
        raise InputError(
            f"expected a file, got a {'folder' if stat.S_ISDIR(mode) else 'device or a pipe'}", file=str(path)
        )
    try:
        if not mode & _ANY_MAY_WRITE:  # checked apart from open(), because root can open a read-only file
            raise PermissionError
        os.close(os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0)))  # no blocking if it became a pipe meanwhile
    except PermissionError:
        raise InputError("expected a file that can be written to, got a read-only one", file=str(path)) from None
    return path.resolve() if path.is_symlink() else path


@contextmanager
def write_atomically(path: Path, finish: Callable[[Path], object] | None = None) -> Iterator[IO[Any]]:
    """Write a binary file atomically: it appears as `path` if the block succeeds, and is removed if the block raises.

    A replaced file keeps its permissions and, where possible, its owner. A symbolic link is kept, and its target is
    replaced.

    Args:
        path: the file.
        finish: a function of the path that is called once the file is in place. Ctrl-C cannot come in between.

    Raises:
        InputError: as check_output().
        OSError: the file cannot be written.
    """
    with replace_atomically(_target(path), finish and partial(finish, path)) as file:
        yield file


@contextmanager
def replace_atomically(path: Path, finish: Callable[[], object] | None = None) -> Iterator[IO[Any]]:
    """Write a file as write_atomically() does, but replace a symbolic link instead of following it.

    It is for folders in which other users could create a link: they cannot redirect the write to another file.
    """
    kept = None
    with suppress(FileNotFoundError):
        status = path.lstat()
        kept = status if stat.S_ISREG(status.st_mode) else None
    temporary = _temporary(path)
    mode = stat.S_IMODE(kept.st_mode) & 0o777 if kept else _NEW_FILE
    # The new file gets the old file's group at the end only. Until then only its owner may read it, so that at no time
    # more users can read it than the old file.
    initial_mode = mode & stat.S_IRWXU if kept else mode
    try:
        with open(temporary, "xb", opener=lambda name, flags: os.open(name, flags, initial_mode)) as file:
            yield file
        if kept:
            if hasattr(os, "chown"):
                for owner in ((-1, kept.st_gid), (kept.st_uid, -1)):
                    with suppress(
                        OSError
                    ):  # only root may change the owner, only members of a group may set that group
                        os.chown(temporary, *owner)
            temporary.chmod(mode)
        with defer_interrupts():
            temporary.replace(path)
            if finish:
                finish()
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _temporary(path: Path) -> Path:
    """Return an unused name in the folder of `path`. The module tempfile offers the same but takes long to import."""
    return path.with_name(f".{path.stem[:40]}-{os.urandom(8).hex()}.part")


def write_new(path: Path, write: Callable[[IO[Any]], object]) -> None:
    """Write a new file atomically.

    Args:
        path: the file.
        write: a function that writes the content to an open binary file.

    Raises:
        FileExistsError: `path` exists already.
    """
    if os.path.lexists(path):
        raise FileExistsError(f"{path} exists already")
    temporary = _temporary(path)
    try:
        with temporary.open("xb") as file:
            write(file)
        _rename_new(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _rename_new(old: Path, new: Path) -> None:
    """Rename a file. Raises FileExistsError if `new` exists."""
    try:
        os.link(old, new)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        new.touch(exist_ok=False)
        old.replace(new)


def write_numbered(stem: str, suffix: str, write: Callable[[IO[Any]], object]) -> Path:
    """Write a new file under the first unused name of `stem`-1, `stem`-2, ... and return its path.

    Args:
        stem: the path without number and suffix.
        suffix: the file's suffix, with its dot.
        write: a function that writes the content to an open binary file.
    """
    for number in itertools.count(1):
        path = Path(f"{stem}-{number}{suffix}")
        if not os.path.lexists(path):
            with suppress(FileExistsError):  # another process has just created it: try the next number
                write_new(path, write)
                return path
    raise AssertionError
