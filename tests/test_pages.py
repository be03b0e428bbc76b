"""A reader can paste every block of code of every page, in order, in an empty folder."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.pages import NOT_RUN, PAGES, Block, blocks
from tests.processes import finished
from tests.scenes import CHECKOUT

LANGUAGES = {"bash", "python", "toml", "text", "json", "glsl"}
# `make test` reads the first page; `make check` reads all pages.
FIRST = "README.md"
WITH_CODE = [page for page in PAGES if any(not block.not_run for block in blocks(page) if block.language != "text")]
NOTEBOOKS = sorted((CHECKOUT / "examples").glob("*.ipynb"))


def variables(folder: Path) -> dict[str, str]:
    """The environment of a reader who has activated the virtual environment, with an empty cache of references."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    own = {"PATH": path, "PYTHONPATH": str(CHECKOUT), "RAYTRACER_CACHE": str(folder / "cache"), "MPLBACKEND": "Agg"}
    return dict(os.environ) | own


def paste(block: Block, page: str, namespace: dict[str, Any], environment: dict[str, str]) -> None:
    """Do what a reader does with a block: save it, paste it into a shell, or paste it into Python."""
    if block.file:
        Path(block.file).write_text(block.text)
    elif block.language == "bash":
        done = finished("bash", "-euo", "pipefail", "-c", block.text, env=environment)
        assert done.returncode == 0, f"{page}:{block.line}: status {done.returncode}\n{done.stdout}{done.stderr}"
        assert "Traceback" not in done.stderr
    elif block.language == "python":
        # Empty lines before the code make the lines of an error the lines of the page.
        exec(compile("\n" * block.line + block.text, page, "exec"), namespace)
    else:
        assert block.language not in ("toml", "glsl"), f"{page}:{block.line}: no name of a file, and no fragment"


@pytest.mark.gl
@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=[] if page == FIRST else pytest.mark.slow) for page in WITH_CODE]
)
def test_every_block_runs_as_a_reader_pastes_it(
    page: str, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    environment = variables(tmp_path_factory.mktemp("cache"))
    for name in ("RAYTRACER_CACHE", "MPLBACKEND"):
        monkeypatch.setenv(name, environment[name])
    monkeypatch.chdir(tmp_path_factory.mktemp("reader"))
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(page):
        if not block.not_run:
            paste(block, page, namespace, environment)


@pytest.mark.parametrize("page", PAGES)
def test_every_block_has_a_language_and_a_known_reason_not_to_run(page: str) -> None:
    for block in blocks(page):
        assert block.language in LANGUAGES, f"{page}:{block.line}"
        assert not block.not_run or block.not_run in NOT_RUN, f"{page}:{block.line}"


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_every_cell_of_a_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in variables(tmp_path / "cache").items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(tmp_path)
    cells = json.loads(path.read_text())["cells"]
    namespace: dict[str, Any] = {"__name__": "__main__"}
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert code
    for number, text in enumerate(code, 1):
        exec(compile(text, f"{path.name}, cell {number}", "exec"), namespace)
