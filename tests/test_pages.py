"""A reader can paste every block of code of every page, in order, in an empty folder."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from tests.pages import NOT_RUN, PAGES, blocks
from tests.processes import run_to_end
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


def run(place: str, folder: Path, environment: dict[str, str], *command: str) -> None:
    """Run a command in the reader's folder; it must end with status 0 and without a traceback."""
    done = run_to_end(*command, cwd=folder, env=environment)
    assert done.returncode == 0, f"{place}: status {done.returncode}\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr, place


def read(page: str, folder: Path, environment: dict[str, str]) -> None:
    """Use the blocks of a page in order, as a reader does: save a block, or paste it into a shell or a script.

    The reader has one script for all Python of the page, and runs it before the next command and at the end. Empty
    lines give the code in the script the line numbers of the page.
    """
    script: list[str] = []
    is_new = False
    to_do = [block for block in blocks(page) if not block.not_run]
    for block, following in zip(to_do, [*to_do[1:], None], strict=True):
        place = f"{page}:{block.line}"
        if block.file:
            (folder / block.file).write_text(block.text)
        elif block.language == "bash":
            run(place, folder, environment, "bash", "-euo", "pipefail", "-c", block.text)
        elif block.language == "python":
            script += [""] * (block.line - len(script)) + block.text.splitlines()
            is_new = True
        else:
            assert block.language in ("text", "json"), f"{place}: neither a file nor a fragment"
        if is_new and (following is None or following.language != "python"):
            (folder / "page.py").write_text("\n".join(script) + "\n")
            run(place, folder, environment, sys.executable, "-W", "error", "page.py")
            is_new = False


@pytest.mark.gl
@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=[] if page == FIRST else pytest.mark.slow) for page in WITH_CODE]
)
def test_every_block_runs_as_a_reader_pastes_it(page: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    read(page, tmp_path_factory.mktemp("reader"), variables(tmp_path_factory.mktemp("cache")))


@pytest.mark.parametrize("page", PAGES)
def test_every_block_has_a_language_and_a_known_reason_not_to_run(page: str) -> None:
    for block in blocks(page):
        assert block.language in LANGUAGES, f"{page}:{block.line}"
        assert not block.not_run or block.not_run in NOT_RUN, f"{page}:{block.line}"


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_every_cell_of_a_notebook_runs(path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    cells = json.loads(path.read_text())["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert code
    folder = tmp_path_factory.mktemp("reader")
    (folder / "cells.py").write_text("\n\n".join(code) + "\n")
    run(path.name, folder, variables(tmp_path_factory.mktemp("cache")), sys.executable, "-W", "error", "cells.py")
