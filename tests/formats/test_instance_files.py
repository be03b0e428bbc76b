"""Files of instances: valid files load; invalid or hostile files are refused at once, by file and line."""

import io
import os
import pickle
import random
import shutil
import struct
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

import raytracer as rt
from raytracer.app.viewer.file_watcher import Files
from raytracer.formats import companion_files, instance_csv
from raytracer.formats.companion_files import copy_files, is_plain_name
from raytracer.formats.instance_files import READERS, read_instances

BALL = rt.Sphere((0, 0, 0), 1)


def load_csv(folder: Path, data: str | bytes) -> rt.Instances:
    (folder / "a.csv").write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_instances(BALL, folder, "a.csv")


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z,scale\n1,2,3,4\n-5e-1,0,6,0.25\n",
        "x,y,z,scale\r\n1,2,3,4\r\n\r\n-.5,0,6,.25",
        '\ufeff"x","y","z","scale"\n 1, 2, 3, 4\n"-0.5","0","6","0.25"\n',
    ],
)
def test_a_csv_file_gives_positions_and_scales(tmp_path: Path, text: str) -> None:
    assert load_csv(tmp_path, text) == rt.Instances(BALL, [[1, 2, 3], [-0.5, 0, 6]], [4, 0.25])


QUATERNIONS = [[1, 0, 0, 0], [0.5, -0.5, 0.5, 2]]


def test_a_csv_file_may_have_quaternions(tmp_path: Path) -> None:
    rows = ["1,2,3", "-0.5,0,6"]
    turns = [",".join(map(str, row)) for row in QUATERNIONS]
    text = "\n".join(f"{place},{turn}" for place, turn in zip(["x,y,z", *rows], ["qw,qx,qy,qz", *turns], strict=True))
    assert load_csv(tmp_path, text) == rt.Instances(BALL, [[1, 2, 3], [-0.5, 0, 6]], 1, QUATERNIONS)
    middle = text.replace("qw", "scale,qw").replace("3,", "3,4,").replace("6,", "6,0.25,")
    assert load_csv(tmp_path, middle) == rt.Instances(BALL, [[1, 2, 3], [-0.5, 0, 6]], [4, 0.25], QUATERNIONS)


def test_an_npz_file_may_have_quaternions_or_matrices(tmp_path: Path) -> None:
    places = np.zeros((2, 3))
    for rotations in (np.array(QUATERNIONS), np.array([np.eye(3), np.diag([1, -1, -1])])):
        np.savez(tmp_path / "a.npz", positions=places, rotations=rotations)
        assert read_instances(BALL, tmp_path, "a.npz") == rt.Instances(BALL, places, 1, rotations)


def test_scales_are_optional_in_both_formats(tmp_path: Path) -> None:
    assert load_csv(tmp_path, "x,y,z\n1,2,3\n") == rt.Instances(BALL, [[1, 2, 3]])
    np.savez(tmp_path / "a.npz", positions=np.array([[1, 2, 3]]))
    assert read_instances(BALL, tmp_path, "a.npz") == rt.Instances(BALL, [[1, 2, 3]])


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_an_npz_file_gives_the_arrays_that_numpy_saved(tmp_path: Path, save) -> None:
    rng = np.random.default_rng(1)
    positions, scales = rng.normal(size=(1000, 3)), rng.uniform(0.1, 1, 1000)
    for saved in (positions, np.asfortranarray(positions.astype(">f4"))):
        save(tmp_path / "a.npz", positions=saved, scales=scales)
        assert read_instances(BALL, tmp_path, "a.npz") == rt.Instances(BALL, saved, scales)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("", r"a.csv:1: expected the header x,y,z, then scale or not, then qw,qx,qy,qz or not, got ''"),
        ("1,2,3\n", r"a.csv:1: expected the header .*, got '1,2,3'"),
        ("x;y;z\n1;2;3\n", r"a.csv:1: expected the header .*, got 'x;y;z'"),
        ("x,y,z\n", r"a.csv: positions: expected at least one point"),
        ("x,y,z\n\n1,2,3\n1,2\n", r"a.csv:4: expected 3 numbers: x,y,z, got '1,2'"),
        ("x,y,z\n1,2,3\n1_0,0,0\n", r"a.csv:3: expected 3 numbers: x,y,z, got '1_0,0,0'"),
        ("x,y,z\n1,2,3\n1,\u0661\u0662,0\n", r"a.csv:3: expected 3 numbers: x,y,z, got '1,"),
        ("x,y,z,scale\n1,2,3,4\n1,two,3,4\n", r"a.csv:3: expected 4 numbers: x,y,z,scale, got '1,two,3,4'"),
        ("x,y,z\n\n1,2,3\n1,nan,3\n", r"a.csv:4: x,y,z: expected 3 numbers within .*, got nan"),
        ("x,y,z\n1,2,3e12\n", r"a.csv:2: x,y,z: expected 3 numbers within"),
        ("x,y,z,scale\n1,2,3,1\n1,2,3,0\n", r"a.csv:3: scale: expected a number above 0, got 0"),
        ("x,y,z,scale\n1,2,3,1\n1,2,3,1e-13\n", r"a.csv:3: scale: expected radii times scale in"),
        ("x,y,z,qw\n1,2,3,1\n", r"a.csv:1: expected the header .*, got 'x,y,z,qw'"),
        ("x,y,z,qw,qx,qy,qz,scale\n", r"a.csv:1: expected the header .*, got 'x,y,z,qw,qx,qy,qz,scale'"),
        ("x,y,z,qw,qx,qy,qz\n1,2,3,1,0,0\n", r"a.csv:2: expected 7 numbers: x,y,z,qw,qx,qy,qz, got '1,2,3,1,0,0'"),
        (
            "x,y,z,qw,qx,qy,qz\n\n1,2,3,0,0,0,0\n",
            r"a.csv:3: qw,qx,qy,qz: expected a quaternion w, x, y, z of any length",
        ),
        ("x,y,z,qw,qx,qy,qz\n1,2,3,1,0,inf,0\n", r"a.csv:2: qw,qx,qy,qz: expected finite numbers: .*, got inf"),
        ("x,y,z\n" + "1" * 200_000, r"a.csv:\d: expected CSV: field larger"),
        (b"x,y,z\n\xff\n", r"a.csv: expected UTF-8 text: invalid start byte at byte 6"),
    ],
    ids=range(19),
)
def test_an_invalid_csv_file_is_refused_with_its_line(tmp_path: Path, data: str | bytes, message: str) -> None:
    with pytest.raises(rt.InputError, match=f"^{message}"):
        load_csv(tmp_path, data)


@pytest.mark.parametrize(
    "name",
    ["/etc/a.csv", "../a.csv", "b/a.csv", "b\\a.csv", "c:a.csv", "a.csv:b.csv", "..", "", ".csv", "a.txt", "a\0.csv"],
)
def test_only_a_plain_file_name_is_accepted(tmp_path: Path, name: str) -> None:
    assert not is_plain_name(name, READERS)
    with pytest.raises(rt.InputError, match=r"^expected the plain name of a .csv or .npz file"):
        read_instances(BALL, tmp_path, name)


def test_only_a_regular_file_of_bounded_size_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "folder.csv").mkdir()
    names = ["folder.csv"]
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.csv")
        (tmp_path / "zero.npz").symlink_to("/dev/zero")
        names += ["pipe.csv", "zero.npz"]
    for name in names:
        with pytest.raises(rt.InputError, match=f"^{name}: expected a file beside the scene file: it is a folder"):
            read_instances(BALL, tmp_path, name)
    monkeypatch.setattr(companion_files, "MAX_BYTES", 1000)
    with pytest.raises(rt.InputError, match=r"^a.csv: expected a file of at most 1000 bytes"):
        load_csv(tmp_path, "x,y,z\n" + "0,0,0\n" * 1000)
    monkeypatch.setattr(instance_csv, "MAX_SURFACES", 100)
    with pytest.raises(rt.InputError, match=r"^a.csv:102: expected at most 100 rows"):
        load_csv(tmp_path, "x,y,z\n" + "0,0,0\n" * 101)


class Evil:
    """An object that runs code when it is unpickled."""

    def __reduce__(self):
        return os._exit, (3,)


def test_a_pickle_in_an_npz_file_is_not_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", positions=np.array([[Evil()] * 3], object))
    with pytest.raises(rt.InputError, match=r"^a.npz: positions: expected numbers, got an array of 'object'"):
        read_instances(BALL, tmp_path, "a.npz")
    (tmp_path / "a.npz").write_bytes(pickle.dumps(Evil()))
    with pytest.raises(rt.InputError, match=r"^a.npz: expected an .npz file: File is not a zip file"):
        read_instances(BALL, tmp_path, "a.npz")


def archive(path: Path, members: dict[str, bytes], compression: int = zipfile.ZIP_DEFLATED) -> None:
    with zipfile.ZipFile(path, "w", compression) as file:
        for name, data in members.items():
            file.writestr(name, data)


def header(shape: object, dtype: str = "<f8") -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": dtype, "fortran_order": False, "shape": shape})
    return file.getvalue()


BIG = bytes(100_000_000)  # deflated to 100 kB


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"positions.npy": header((10**12, 3))}, r"positions: expected an array \(N, 3\) with N at most 1048576"),
        ({"positions.npy": header((-1, 3))}, r"positions: expected an array \(N, 3\)"),
        ({"positions.npy": header((4,))}, r"positions: expected an array \(N, 3\) .*, got \(4,\)"),
        ({"positions.npy": header((1000, 3))}, r"expected an .npz file: EOF"),
        ({"positions.npy": header((1, 3), "<U5")}, r"positions: expected numbers, got an array of '<U5'"),
        ({"positions.npy": header((1, 3)) + BIG}, r"positions: expected at most 67108864 bytes, got 1000"),
        # The header claims a length of 4 GB, and would be inflated to it.
        ({"positions.npy": b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + BIG}, r"positions: expected at most 67108864 bytes"),
        ({"positions.npy": header((1, 3)) + bytes(24), "more.npy": b""}, r"expected the arrays positions and"),
        (
            {"scales.npy": header((1,)) + bytes(8)},
            r"expected the arrays positions and, optionally, scales and rotations, got 'scales'",
        ),
        (
            {"positions.npy": header((1, 3)) + bytes(24), "rotations.npy": header((1, 3, 4)) + bytes(96)},
            r"rotations: expected an array \(N, 4\) or \(N, 3, 3\) with N at most 1048576, got \(1, 3, 4\)",
        ),
        (
            {"positions.npy": header((1, 3)) + bytes(24), "rotations.npy": header((1, 4)) + bytes(32)},
            r"rotations\[0\]: expected a quaternion w, x, y, z of any length but 0",
        ),
        ({f"{i}.npy": b"" for i in range(10_000)}, r"expected an .npz file: it has too many members"),
    ],
    ids=range(12),
)
def test_a_hostile_npz_file_is_refused_at_once(tmp_path: Path, members: dict[str, bytes], message: str) -> None:
    archive(tmp_path / "a.npz", members)
    begin = time.process_time()
    with pytest.raises(rt.InputError, match=f"^a.npz: {message}"):
        read_instances(BALL, tmp_path, "a.npz")
    assert time.process_time() - begin < 0.1


def test_an_archive_that_hides_the_length_of_its_directory_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    archive(path, {f"{i}.npy": b"" for i in range(10_000)})
    data = path.read_bytes()
    end = 22
    comment = data[:-2] + b"\xff\xff" + bytes(0xFFFF)
    # The end record of archives beyond 4 GB comes before the usual end record, which claims an empty archive.
    large = struct.pack("<4sQ2H2L4Q", b"PK\x06\x06", 44, 45, 45, 0, 0, 10_000, 10_000, 460_000, 0)
    locator = struct.pack("<4sLQL", b"PK\x06\x07", 0, len(data) - end, 1)
    empty = struct.pack("<4s4H2LH", b"PK\x05\x06", 0, 0, 0, 0, 0, 0, 0)
    for hostile in (comment, data[:-end] + large + locator + empty, data[:5]):
        path.write_bytes(hostile)
        with pytest.raises(
            rt.InputError, match=r"^a.npz: expected an .npz file: File is not a zip file as numpy\.savez"
        ):
            read_instances(BALL, tmp_path, "a.npz")


def test_a_compression_that_may_take_any_memory_is_refused(tmp_path: Path) -> None:
    archive(tmp_path / "a.npz", {"positions.npy": header((1, 3)) + bytes(24)}, zipfile.ZIP_LZMA)
    with pytest.raises(rt.InputError, match=r"^a.npz: positions: .* got another compression"):
        read_instances(BALL, tmp_path, "a.npz")


def test_a_thousand_damaged_npz_files_load_or_are_refused(tmp_path: Path) -> None:
    rng = random.Random(4)
    np.savez_compressed(tmp_path / "a.npz", positions=np.zeros((5, 3)), scales=np.ones(5), rotations=np.ones((5, 4)))
    good = (tmp_path / "a.npz").read_bytes()
    refused = 0
    for _ in range(1000):
        data = bytearray(good)
        for _ in range(rng.choice((1, 1, 2, 8))):
            data[rng.randrange(len(data))] = rng.randrange(256)
        (tmp_path / "a.npz").write_bytes(data[: rng.choice((len(data), len(data), rng.randrange(len(data))))])
        try:
            read_instances(BALL, tmp_path, "a.npz")
        except rt.InputError as error:
            refused += 1
            assert str(error).startswith("a.npz: ") and len(str(error)) < 300
    assert 300 < refused < 1000


def test_files_are_copied_all_or_none_and_never_over_other_files(tmp_path: Path) -> None:
    load_csv(tmp_path, "x,y,z\n1,2,3\n")
    (tmp_path / "b.csv").write_text("x,y,z\n4,5,6\n")
    files = [tmp_path / "b.csv", tmp_path / "a.csv"]
    target = tmp_path / "there"
    target.mkdir()
    for folder in (target, target, tmp_path):
        with copy_files(files, folder):
            pass
    assert all((target / file.name).read_bytes() == file.read_bytes() for file in files)
    with copy_files(files, target), pytest.raises(KeyboardInterrupt):
        (target / "b.csv").unlink()
        with copy_files(files, target):
            raise KeyboardInterrupt
    assert [file.name for file in target.iterdir()] == ["a.csv"], "a file that existed before stays"

    (tmp_path / "secret").write_text("x,y,z\n")
    (target / "of_scene").mkdir()
    (target / "of_scene" / "c.csv").symlink_to(tmp_path / "secret")
    (target / "of_scene" / "d.csv").symlink_to("e.csv")
    (target / "of_scene" / "e.csv").write_text("x,y,z\n7,8,9\n")
    with copy_files([target / "of_scene" / "d.csv"], target):
        assert not (target / "d.csv").is_symlink() and "7,8,9" in (target / "d.csv").read_text()
    with (
        pytest.raises(RuntimeError, match="leads out of the folder"),
        copy_files([target / "of_scene" / "c.csv"], target),
    ):
        raise AssertionError
    assert not (target / "c.csv").exists()

    outside = tmp_path / "outside"
    for make_obstacle in (
        lambda: (target / "a.csv").write_text("x,y,z\n"),
        lambda: (target / "a.csv").symlink_to(outside),  # a link to a file that does not exist
        lambda: (target / "a.csv").symlink_to(tmp_path / "a.csv"),  # the same content, but no scene there may read it
        lambda: os.mkfifo(target / "a.csv"),
        lambda: (target / "a.csv").mkdir(),
    ):
        shutil.rmtree(target)
        target.mkdir()
        make_obstacle()
        with pytest.raises(RuntimeError, match=r"a.csv: expected to be copied to "), copy_files(files, target):
            raise AssertionError
        assert [file.name for file in target.iterdir()] == ["a.csv"] and not outside.exists()


def test_a_change_of_a_file_of_instances_is_noticed(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('[instances.a]\nfile = "a.csv"\n[instances.b]\nfile = ["no name"]\n')
    files = Files(scene)
    assert not files.check_for_changes()
    load_csv(tmp_path, "x,y,z\n1,2,3\n")
    assert files.check_for_changes() and not files.check_for_changes()
    scene.write_text("[instances.a\n")  # half written
    assert files.check_for_changes() and not files.check_for_changes()
    load_csv(tmp_path, "x,y,z\n1,2,3\n4,5,6\n")
    assert files.check_for_changes() and not files.check_for_changes()


def test_an_entry_in_the_table_adds_a_format_of_instances(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(solid: rt.Solid, data: bytes) -> rt.Instances:
        return rt.Instances(solid, np.frombuffer(data).reshape(-1, 3))

    monkeypatch.setitem(READERS, ".raw", read)
    (tmp_path / "a.raw").write_bytes(np.arange(6.0).tobytes())
    assert read_instances(BALL, tmp_path, "a.raw") == rt.Instances(BALL, [[0, 1, 2], [3, 4, 5]])
    with pytest.raises(rt.InputError, match=r"^expected the plain name of a .csv or .npz or .raw file"):
        read_instances(BALL, tmp_path, "a.txt")
