"""The pages of the documentation agree with the code: paths, links, packages, options, keys of the window."""

import itertools
import re
import tomllib
from typing import Any

import pytest

import raytracer as rt
from raytracer.scene.materials.models import MODELS
from raytracer.scene.settings import Settings
from tests.command_line import COMMANDS, PAGE_OF
from tests.pages import PAGES, anchors, links, page_text, pictures, target, tokens

from .scenes import CHECKOUT

FOLDERS = ("raytracer", "shaders", "tests", "docs", "assets", "benchmarks", "tools", "examples")
ARCHITECTURE, GLOSSARY = ((CHECKOUT / "docs" / name).read_text() for name in ("architecture.md", "glossary.md"))
# A row of the table of packages: name, purpose, imports.
PACKAGES = dict(re.findall(r"^\| `(\w+)` \| .* \| (.+) \|$", ARCHITECTURE, re.M))


def contracts() -> list[dict[str, Any]]:
    return tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]


def may_import(contracts: list[dict[str, Any]]) -> dict[str, set[str]]:
    """The packages that each package may import, by the contracts: all in lower layers that are not forbidden."""
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    allowed: dict[str, set[str]] = {}
    for layer in reversed(layers):
        allowed |= {package: {*allowed} for package in layer.split(" | ")}
    for contract in contracts:
        if contract["type"] == "forbidden":
            for source in contract["source_modules"]:
                allowed[source.removeprefix("raytracer.")] -= {
                    name.removeprefix("raytracer.") for name in contract["forbidden_modules"]
                }
    return allowed


@pytest.mark.parametrize("page", PAGES)
def test_each_path_in_backquotes_is_there(page: str) -> None:
    names = re.findall(r"`([\w./-]+)`", page_text(page))
    # MODEL stands for any model.
    paths = {
        name for name in names if name.startswith(tuple(f"{folder}/" for folder in FOLDERS)) and "MODEL" not in name
    }
    assert not {path for path in paths if not (CHECKOUT / path).exists()}


def test_the_architecture_names_modules_that_are_there() -> None:
    modules = {*re.findall(r"(?<![\w/])[a-z_]+(?:/[a-z_]+)*/[a-z_]+\.py", ARCHITECTURE)}
    assert len(modules) > 30
    folders = CHECKOUT, CHECKOUT / "raytracer"
    assert not {name for name in modules if not any((folder / name).is_file() for folder in folders)}


def test_the_architecture_has_each_package_with_the_imports_of_the_contract() -> None:
    folders = {path.parent.name for path in (CHECKOUT / "raytracer").glob("*/__init__.py")}
    assert {*PACKAGES} == folders
    drawing = ARCHITECTURE.partition("| package |")[0]
    assert all(re.search(rf"\b{package}\b", drawing) for package in PACKAGES)

    allowed = may_import(contracts())
    above: set[str] = set()
    for package, imports in PACKAGES.items():
        named = {"-": set(), "all above": {*above}}.get(imports, {*imports.split(", ")})
        assert named == allowed[package], package
        above.add(package)


def test_the_glossary_is_in_alphabetical_order_and_explains_each_term_once() -> None:
    tables = GLOSSARY.split("\n## ")[1:]
    terms = [[term.lower() for term in re.findall(r"^\| ([^|]+?) \|", table, re.M)][1:] for table in tables]
    assert len(terms) == 3 and all(len(words) > 20 and words == sorted(words) for words in terms)
    together = [*itertools.chain(*terms)]
    assert len(together) == len({*together})


def test_the_shaders_readme_prints_the_text_of_a_program(capsys: pytest.CaptureFixture[str]) -> None:
    (script,) = re.findall(r'python -c "(.+?)"', (CHECKOUT / "shaders/README.md").read_text(), re.S)
    exec(script, {})
    text = capsys.readouterr().out
    assert text.startswith("#version") and "#define MAX_HITS" in text and text.rstrip().endswith("}")


@pytest.mark.parametrize("page", PAGES)
def test_each_link_leads_to_a_file_and_a_heading_that_are_there(page: str) -> None:
    for link in links(page):
        if not link.startswith(("https://", "http://")):
            path, anchor = target(page, link)
            assert path.exists(), link
            if anchor:
                assert anchor in anchors(path.relative_to(CHECKOUT).as_posix()), link


@pytest.mark.parametrize("page", PAGES)
def test_each_picture_is_there_and_has_an_alternative_text(page: str) -> None:
    for source, alternative in pictures(page):
        assert target(page, source)[0].is_file(), source
        assert len(alternative.split()) > 1 and len(alternative) > 5, source
    assert "<img" not in page_text(page)


def test_each_picture_of_the_documentation_is_on_a_page() -> None:
    used = {target(page, source)[0] for page in PAGES for source, _ in pictures(page)}
    files = {path for folder in ("docs/pictures", "docs/choosing") for path in (CHECKOUT / folder).iterdir()}
    assert {path.name for path in files - used if path.suffix != ".csv"} == set()


def test_each_page_of_the_documentation_can_be_reached_from_the_readme() -> None:
    reached, queue = {"README.md"}, ["README.md"]
    while queue:
        page = queue.pop()
        linked = {target(page, link)[0] for link in links(page) if "://" not in link}
        new = {path.relative_to(CHECKOUT).as_posix() for path in linked if path.suffix == ".md"} & {*PAGES} - reached
        reached |= new
        queue += new
    assert reached == {*PAGES}


@pytest.mark.parametrize("page", PAGES)
def test_each_page_has_one_title_and_its_headings_skip_no_level(page: str) -> None:
    levels = [int(token.tag[1]) for token in tokens(page) if token.type == "heading_open"]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))


@pytest.mark.parametrize("command", COMMANDS)
def test_the_page_of_a_command_has_all_its_options(command: str) -> None:
    text = page_text(PAGE_OF.get(command.split()[0], "docs/command-line.md"))
    assert f"raytracer {command}" in text
    for action in COMMANDS[command]._actions:
        # The page of the command line has the two options that choose OpenGL once for all commands.
        page = page_text("docs/command-line.md") if action.dest in ("backend", "device") else text
        names = [rf"(?<![\w-]){name}\b" for name in action.option_strings]
        assert action.dest == "help" or not names or re.search("|".join(names), page), action.option_strings


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_has_an_example_and_a_page_to_read_on(command: str) -> None:
    text = COMMANDS[command].format_help()
    assert f"raytracer {command} " in text.partition("xamples:\n")[2] or command == "doctor"
    pages = re.findall(r"docs/[\w-]+\.md", text)
    assert pages and all((CHECKOUT / page).is_file() for page in pages)
    assert max(len(line) for line in text.splitlines()) <= 120


def test_the_page_of_python_has_every_public_name() -> None:
    text = page_text("docs/python.md")
    assert {name for name in rt.__all__ if not re.search(rf"\b{name}\b", text)} == set()


def test_the_page_of_the_scene_file_has_all_settings() -> None:
    text = page_text("docs/scene-file.md")
    # `geometry` is a choice of the caller in Python, not of a file.
    names = {*Settings.__struct_fields__} - {"geometry"}
    assert {name for name in names if not re.search(rf"`{name}`", text)} == set()


def test_the_page_of_the_models_has_all_models() -> None:
    assert {*MODELS} <= anchors("docs/models.md")
