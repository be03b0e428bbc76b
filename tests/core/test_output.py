"""Writing files: whole or not at all, with the permissions of the file before, and not at unsuitable places."""

import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

import raytracer as rt
from raytracer.app.cli import main
from raytracer.core.output import (
    check_folder,
    check_output,
    replace_atomically,
    write_atomically,
    write_new,
    write_numbered,
)
from tests import scenes

SCENE = str(scenes.ASSIGNMENT)


def permissions(path: Path) -> int:
    return stat.S_IMODE(path.lstat().st_mode)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    out.write_bytes(b"before")
    with pytest.raises(RuntimeError), write_atomically(out) as file:
        file.write(b"half")
        raise RuntimeError
    assert out.read_bytes() == b"before" and list(tmp_path.iterdir()) == [out]
    with write_atomically(out) as file:
        file.write(b"all of it")
    assert out.read_bytes() == b"all of it" and list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o755, 0o222])
def test_an_overwritten_file_keeps_its_permissions_at_all_times(tmp_path: Path, mode: int) -> None:
    out = tmp_path / "a.png"
    out.touch()
    out.chmod(mode)
    with write_atomically(out) as file:
        file.write(b"new")
        (part,) = {*tmp_path.iterdir()} - {out}
        assert permissions(part) & ~mode == 0, "users who may not read the file may not read its part"
    assert permissions(out) == mode and out.stat().st_size == 3


def test_a_new_file_has_the_permissions_of_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        with write_atomically(tmp_path / "a") as file:
            file.write(b"new")
        write_new(tmp_path / "b", lambda file: file.write(b"new"))
    finally:
        os.umask(before)
    assert permissions(tmp_path / "a") == permissions(tmp_path / "b") == 0o640


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can change the owner of a file")
def test_an_overwritten_file_keeps_its_owner(tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    out.touch()
    os.chown(out, 12, 34)
    out.chmod(0o660)
    with write_atomically(out):
        pass
    status = out.stat()
    assert (status.st_uid, status.st_gid, permissions(out)) == (12, 34, 0o660)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="other users belong to few groups")
def test_an_overwritten_file_of_another_user_keeps_its_group_and_is_private_until_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chown = os.chown

    def chown_as_member(path: Path, user: int, group: int) -> None:
        if user != -1:
            raise PermissionError
        chown(path, user, group)

    out = tmp_path / "a.png"
    out.touch()
    os.chown(out, 12, 34)
    out.chmod(0o640)
    monkeypatch.setattr(os, "chown", chown_as_member)
    with write_atomically(out):
        (part,) = {*tmp_path.iterdir()} - {out}
        assert permissions(part) == 0o600
    status = out.stat()
    assert (status.st_uid, status.st_gid, permissions(out)) == (os.geteuid(), 34, 0o640)


def test_writing_to_a_link_writes_its_target_and_keeps_the_link(tmp_path: Path) -> None:
    target_folder, link_folder = tmp_path / "there", tmp_path / "here"
    target_folder.mkdir()
    link_folder.mkdir()
    target, link, second = target_folder / "b.png", link_folder / "a.png", link_folder / "link.png"
    target.write_bytes(b"before")
    target.chmod(0o640)
    link.symlink_to(Path("..", "there", "b.png"))
    second.symlink_to("a.png")
    for out in (link, second):
        with pytest.raises(KeyboardInterrupt), write_atomically(out) as file:
            file.write(b"half")
            assert len(names(target_folder)) == 2, "the part is beside the target, on the target's file system"
            raise KeyboardInterrupt
        assert target.read_bytes() == b"before"
        rt.render(rt.load(SCENE), (8, 8)).save(out)
        assert target.read_bytes().startswith(b"\x89PNG") and permissions(target) == 0o640
        target.write_bytes(b"before")
    assert link.is_symlink() and second.is_symlink() and names(target_folder) == ["b.png"]
    with replace_atomically(link) as file:
        file.write(b"new")
    assert not link.is_symlink() and link.read_bytes() == b"new" and target.read_bytes() == b"before"


def read_only(out: Path) -> None:
    out.touch()
    out.chmod(0o444)


def link_to_read_only(out: Path) -> None:
    read_only(out.parent / "locked")
    out.symlink_to("locked")


def link_to_folder(out: Path) -> None:
    (out.parent / "folder").mkdir()
    out.symlink_to("folder")


def link_to_pipe(out: Path) -> None:
    os.mkfifo(out.parent / "pipe")
    out.symlink_to("pipe")


PLACES: list[tuple[Callable[[Path], object], str]] = [
    (read_only, "expected a file that can be written to, got a read-only one"),
    (link_to_read_only, "expected a file that can be written to, got a read-only one"),
    (Path.mkdir, "expected a file, got a folder"),
    (link_to_folder, "expected a file, got a folder"),
    (os.mkfifo, "got a device or a pipe"),
    (link_to_pipe, "got a device or a pipe"),
    (lambda out: out.symlink_to("/dev/null"), "got a device or a pipe"),
    (lambda out: out.symlink_to("nowhere"), "got a link to 'nowhere', which is not there; remove the link"),
    (lambda out: out.symlink_to(out.name), "Too many levels of symbolic links"),
]
# Commands, and the file that each writes. With a valid file, the rendering commands would take longer than this test.
COMMANDS = [
    (["render", SCENE, "-o", "a.png", "--samples", "60000"], "a.png"),
    (["render", SCENE, "-o", "a.npz", "--samples", "60000"], "a.npz"),
    (["reference", SCENE, "-o", "a.npz", "--samples", "60000", "--size", "1920x1080"], "a.npz"),
    (["compare", "nowhere.png", "nowhere.png", "-o", "a.png"], "a.png"),
    (["trade", SCENE, "-o", "."], "trade.html"),
    (["extremes", "-o", "."], "extremes.csv"),
    (["brdf", "plot", "ggx", "-o", "a.png"], "a.png"),
    (["brdf", "gallery", "-o", "a.png"], "a.png"),
    (["brdf", "bake", "ggx", "-o", "a.binary"], "a.binary"),
]


def read_state(folder: Path) -> dict[Path, tuple[int, ...]]:
    """Return the entries of a folder with their states, without the times of reading."""
    states = ((path, path.lstat()) for path in folder.iterdir())
    return {path: (s.st_ino, s.st_mode, s.st_size, s.st_mtime_ns, s.st_ctime_ns) for path, s in states}


@pytest.mark.parametrize(("make", "message"), PLACES)
def test_a_place_that_cannot_be_written_to_is_refused_before_rendering(
    make: Callable[[Path], object], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    out = Path("a.png")
    make(out)
    before = read_state(tmp_path)
    for refused_call in (
        lambda: check_output(out, [".png"]),
        lambda: check_folder(tmp_path, "a.png"),
        lambda: rt.render(rt.load(SCENE), (8, 8)).save(out),
        lambda: write_atomically(out).__enter__(),
    ):
        with pytest.raises((rt.InputError, OSError)) as error:
            refused_call()
        assert message in str(error.value)
    assert read_state(tmp_path) == before


@pytest.mark.parametrize(("command", "name"), COMMANDS, ids=lambda value: value if isinstance(value, str) else value[0])
def test_each_command_refuses_a_read_only_file_at_once(
    command: list[str],
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RAYTRACER_CACHE", str(tmp_path / "cache"))
    read_only(Path(name))
    assert main(command) == 2
    errors = capsys.readouterr().err
    assert f"{name}: expected a file that can be written to, got a read-only one" in errors and errors.count("\n") == 1
    assert names(tmp_path) == [name] and Path(name).stat().st_size == 0


def test_the_place_of_a_new_folder_is_named_and_not_the_folder_around_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "touch", refuse)
    assert main(["trade", SCENE, "-o", "t"]) == 2
    assert capsys.readouterr().err == "raytracer: t: expected a place that can be written to: Permission denied\n"


def test_a_new_file_appears_when_it_is_whole_and_never_overwrites_another(tmp_path: Path) -> None:
    def write(file) -> None:
        assert not [name for name in names(tmp_path) if name.startswith("a-2")], "a half-written file is not visible"
        file.write(b"whole")

    (tmp_path / "a-1.png").write_bytes(b"mine")
    (tmp_path / "a-3.png").symlink_to("outside")
    path = write_numbered(str(tmp_path / "a"), ".png", write)
    assert path == tmp_path / "a-2.png" and path.read_bytes() == b"whole"
    path = write_numbered(str(tmp_path / "a"), ".png", write_nothing)
    assert path == tmp_path / "a-4.png" and not (tmp_path / "outside").exists()

    before = names(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        write_numbered(str(tmp_path / "a"), ".png", interrupted)
    with pytest.raises(FileExistsError):
        write_new(tmp_path / "a-1.png", write_nothing)
    with pytest.raises(FileExistsError):  # the file appears while its content is written
        write_new(tmp_path / "b.png", lambda file: (tmp_path / "b.png").write_bytes(b"another's"))
    assert names(tmp_path) == [*before, "b.png"] and (tmp_path / "b.png").read_bytes() == b"another's"


def test_a_new_file_never_overwrites_another_on_a_file_system_without_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def link(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "link", link)
    test_a_new_file_appears_when_it_is_whole_and_never_overwrites_another(tmp_path)


def write_nothing(file: object) -> None:
    pass


def interrupted(file: object) -> None:
    raise KeyboardInterrupt
