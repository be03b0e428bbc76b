"""The pages about the code: each path that they name is there, and the table of packages is the contract of imports."""

import re
import tomllib
from typing import Any

import pytest

from .scenes import CHECKOUT

DOCS = ("architecture", "choosing", "glossary", "performance")
PAGES = ["README.md", "shaders/README.md", *(f"docs/{name}.md" for name in DOCS)]
FOLDERS = ("raytracer", "shaders", "tests", "docs", "assets", "benchmarks", "tools")
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
    names = re.findall(r"`([\w./-]+)`", (CHECKOUT / page).read_text())
    paths = {name for name in names if name.startswith(tuple(f"{folder}/" for folder in FOLDERS))}
    assert not {path for path in paths if not (CHECKOUT / path).exists()}


def test_the_architecture_names_modules_that_are_there() -> None:
    modules = {*re.findall(r"(?<![\w/])[a-z_]+(?:/[a-z_]+)*/[a-z_]+\.py", ARCHITECTURE)}
    assert len(modules) > 30
    assert not {name for name in modules if not (CHECKOUT / "raytracer" / name.removeprefix("raytracer/")).is_file()}


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
    terms = [term.lower() for term in re.findall(r"^\| \*?\*?([^|*]+?)\*?\*? \|", GLOSSARY, re.M)]
    terms = terms[terms.index("word") + 1 :]
    terms = [term for term in terms if set(term) != {"-"}]
    assert len(terms) > 20 and terms == sorted(set(terms))


def test_the_shaders_readme_prints_the_text_of_a_program(capsys: pytest.CaptureFixture[str]) -> None:
    (script,) = re.findall(r'python -c "(.+?)"', (CHECKOUT / "shaders/README.md").read_text(), re.S)
    exec(script, {})
    text = capsys.readouterr().out
    assert text.startswith("#version") and "#define MAX_HITS" in text and text.rstrip().endswith("}")
