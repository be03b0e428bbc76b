"""Pipes, endless files, links to other folders and damaged files are refused at once, by every reader."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import raytracer as rt
from raytracer.app.viewer.orbit import turn_camera, turn_light
from raytracer.core.files import open_regular, read_bounded
from raytracer.core.npz import read_arrays
from raytracer.formats.instance_files import read_instances
from raytracer.formats.scene_file import edit_positions, load, loads
from tests import scenes
from tests.scenes import GOOD

BALL = rt.Sphere((0, 0, 0), 1)
SECRET = "root:$6$secret:19000:0:99999:7:::\n"


def test_a_link_out_of_the_scenes_folder_is_refused_and_a_link_within_is_followed(tmp_path: Path) -> None:
    scene, other = tmp_path / "scene", tmp_path / "other"
    scene.mkdir()
    other.mkdir()
    (other / "secret").write_text(SECRET)
    (other / "right.csv").write_text("x,y,z\n1,2,3\n")
    for name in ("a.csv", "a.npz", "a.binary"):
        (scene / name).symlink_to(other / "secret")
    (scene / "far.csv").symlink_to(other / "right.csv")
    (scene / "up.csv").symlink_to("../other/right.csv")
    (scene / "folder").symlink_to(other)
    (scene / "by_folder.csv").symlink_to("folder/right.csv")
    (scene / "round.csv").symlink_to("round.csv")
    instances = "".join(f'[instances.one]\nfile = "{name}"\n|' for name in ("a.csv", "a.npz", "far.csv", "up.csv"))
    measured = 'model = "merl"\nfile = "a.binary"'
    texts = [GOOD + table for table in instances.split("|")[:-1]]
    texts += [f'{GOOD}[instances.one]\nfile = "{name}.csv"\n' for name in ("by_folder", "round")]
    texts += [GOOD.replace("kd = [0.64, 0.08, 0.08]", measured)]
    for text in texts:
        (scene / "scene.toml").write_text(text)
        with pytest.raises(rt.InputError, match=r"it leads out of the folder|Too many levels") as error:
            load(scene / "scene.toml")
        assert "$6$" not in str(error.value)
    (scene / "near").mkdir()
    (scene / "near" / "right.csv").write_text("x,y,z\n1,2,3\n")
    (scene / "near.csv").symlink_to("near/right.csv")
    assert read_instances(BALL, scene, "near.csv") == rt.Instances(BALL, [[1, 2, 3]])
    # The folder itself may be a link.
    (tmp_path / "link").symlink_to(scene)
    assert read_instances(BALL, tmp_path / "link", "near.csv") == rt.Instances(BALL, [[1, 2, 3]])


def test_pipes_devices_and_folders_are_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "terminal").symlink_to("/dev/tty")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "zero", "terminal", "folder"):
        with pytest.raises(OSError, match=r"it is a folder, a pipe or a device|No such device"):
            open_regular(tmp_path / name)
        with pytest.raises(OSError):
            read_bounded(tmp_path / name, 10, tmp_path)
    # The system states no size for this file, so only reading shows its length.
    assert len(read_bounded(Path("/proc/self/maps"), 100)) == 101


COMMANDS = """
import os, resource, sys
from pathlib import Path
from raytracer.app.cli import main
resource.setrlimit(resource.RLIMIT_AS, (2 << 30,) * 2)
folder = Path(sys.argv[1])
os.mkfifo(folder / "pipe.toml")
os.mkfifo(folder / "pipe.npz")
for suffix in (".toml", ".png", ".npz"):
    (folder / f"zero{suffix}").symlink_to("/dev/zero")
names = ["pipe.toml", "zero.toml"]
statuses = [main(["render", str(folder / name), "-o", str(folder / "a.png")]) for name in names]
pairs = [("pipe.npz", "zero.png"), ("zero.png", "zero.npz"), ("zero.npz", "pipe.npz")]
statuses += [main(["compare", str(folder / a), str(folder / b)]) for a, b in pairs]
print(*statuses)
"""


def test_no_command_waits_for_a_pipe_or_reads_a_device(tmp_path: Path) -> None:
    command = [sys.executable, "-c", COMMANDS, str(tmp_path)]
    ended = subprocess.run(command, cwd=scenes.CHECKOUT, capture_output=True, text=True, timeout=60)
    assert ended.stdout == "2 2 2 2 2\n", ended.stderr
    assert ended.stderr.count("it is a folder, a pipe or a device") == 5 == ended.stderr.count("\n")


def test_a_scene_may_come_from_a_pipe_to_standard_input() -> None:
    command = [sys.executable, "-c", "import raytracer as rt; print(len(rt.load('/dev/stdin').objects))"]
    text = scenes.ASSIGNMENT.read_bytes()
    ended = subprocess.run(command, cwd=scenes.CHECKOUT, input=text, capture_output=True, check=True, timeout=60)
    assert int(ended.stdout) == len(load(scenes.ASSIGNMENT).objects)


def test_a_byte_order_mark_at_the_start_of_a_scene_file_is_ignored(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(GOOD, encoding="utf-8-sig")
    assert load(path) == loads(GOOD, "scene") == loads(f"\ufeff{GOOD}")
    assert rt.load_settings(path) == rt.Settings()
    path.write_text(f"ambient = -1\n{GOOD}", encoding="utf-8-sig")
    with pytest.raises(rt.InputError, match=rf"^{path}:1: ambient: "):
        load(path)
    path.write_text("ambient = = 1\n", encoding="utf-8-sig")
    with pytest.raises(rt.InputError, match=rf"^{path}:1: expected TOML: .*line 1, column 11"):
        load(path)
    text = GOOD[GOOD.index("[camera]") :]
    path.write_text(text.replace("\n", "\r\n"), encoding="utf-8-sig", newline="")
    scene = turn_light(turn_camera(load(path), 0.3, 0.1), 0, 1.0, -0.2)
    assert load(path) != scene == loads(edit_positions(f"\ufeff{text}", scene))


def test_the_total_size_of_all_files_of_instances_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from raytracer.formats import companion_files

    monkeypatch.setattr(companion_files, "MAX_BYTES", 10_000)
    (tmp_path / "a.csv").write_text("x,y,z\n1,2,3\n")
    names = [f"o{i}" for i in range(4)]
    objects = "".join(f"{name} = 'a'\n" for name in names)
    instances = "".join(f"[instances.{name}]\nfile = 'a.csv'\n" for name in names)
    (tmp_path / "scene.toml").write_text(f"{GOOD}{objects}{instances}")
    with pytest.raises(rt.InputError, match=r"instances.o3.file: a.csv: expected a file of at most 10000 bytes, with"):
        load(tmp_path / "scene.toml")


def test_too_many_instances_in_all_are_refused_before_the_last_object_is_read() -> None:
    many = ", ".join(["[0, 0, 0]"] * 600)
    objects = "".join(f"o{i} = '{' | '.join('a' * 1000)}'\n" for i in range(10))
    instances = "".join(f"[instances.o{i}]\npositions = [{many}]\n" for i in range(9)) + "[instances.o9]\nsize = 1\n"
    with pytest.raises(rt.InputError, match=r"^instances.o1: expected at most 1048576 primitives in all, got 1200000"):
        loads(f"{GOOD}{objects}{instances}")


def test_a_lack_of_memory_is_not_reported_as_a_fault_of_the_file() -> None:
    file = io.BytesIO()
    np.savez(file, radiance=np.zeros((1, 1, 3)))

    def check(*_: object) -> None:
        raise MemoryError

    with pytest.raises(MemoryError):
        read_arrays(file, lambda names: names, check, 1 << 20)
