"""The wheel that a user installs, in an environment of its own, away from the checkout."""

import os
import sys
import venv
import zipfile
from pathlib import Path

from PIL import Image

import raytracer

from .processes import run_for_output
from .scenes import CHECKOUT


def run(folder: Path, *command: str | Path) -> str:
    """Run `command` in `folder`, where no variable leads to the checkout; return standard output."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return run_for_output(*command, cwd=folder, env=environment)


def test_the_wheel_contains_all_its_files_and_renders_an_example_by_its_name(tmp_path: Path) -> None:
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(tmp_path, *pip, "wheel", "--no-deps", "--wheel-dir", tmp_path, CHECKOUT)
    (wheel,) = tmp_path.glob("*.whl")

    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    for original in (CHECKOUT / "shaders").rglob("*.*"):
        assert f"raytracer/shaders/{original.relative_to(CHECKOUT / 'shaders').as_posix()}" in names
    for original in (CHECKOUT / "assets/scenes").glob("*.*"):
        assert f"raytracer/scenes/{original.name}" in names
    for original in (CHECKOUT / "assets/materials").glob("*.toml"):
        assert f"raytracer/materials/{original.name}" in names
    assert {"raytracer/py.typed", "raytracer/scenes/assignment.toml", "raytracer/materials/lafortune.toml"} <= names
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)

    venv.create(tmp_path / "venv", with_pip=False)
    binaries = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
    run(tmp_path, *pip, "--python", binaries / "python", "install", wheel)

    run(tmp_path, binaries / "raytracer", "render", "assignment", "-o", "a.png", "--size", "64x36")
    with Image.open(tmp_path / "a.png") as image:
        assert image.size == (64, 36)
    assert raytracer.__version__ in run(tmp_path, binaries / "python", "-m", "raytracer", "--version")
