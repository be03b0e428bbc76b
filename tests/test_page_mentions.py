"""Commands, options, defaults, Python names, files and settings that pages mention exist."""

import ast
import inspect
import re
import subprocess
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import raytracer as rt
from tests.command_line import COMMANDS, PAGE_OF
from tests.pages import PAGES, blocks, broken_links, inline_code, links, page_text, target, tokens
from tests.scenes import CHECKOUT

# Words after `raytracer` that stand for any command.
PLACEHOLDERS = {"COMMAND", "brdf"}
OPTION = re.compile(r"(?<![\w-])--?[a-z][\w-]*")
# The pattern that a block which is not run must match, by its reason. The other reasons fit any block.
REQUIRED_TEXT = {"not run: installation": r"\b(pip install|make) ", "not run: opens a window": r"^raytracer view "}
SUFFIXES = {"toml": ".toml", "python": ".py", "text": ".csv"}


def command_options(command: str) -> set[str]:
    return {name for action in COMMANDS[command]._actions for name in action.option_strings}


ALL_OPTIONS = {"--help", "--version"}.union(*map(command_options, COMMANDS))

# Commands of other programs, which have options of their own.
OTHER_PROGRAMS = ("pip ", "python -m pytest", "dask ", "docker ")


@cache
def other_options() -> set[str]:
    """Return the options in the sources of the tools, examples and benchmarks."""
    paths = [path for folder in ("tools", "benchmarks", "examples") for path in (CHECKOUT / folder).glob("*")]
    return {name for path in paths if path.is_file() for name in OPTION.findall(path.read_text())}


def parse_commands(line: str) -> Iterator[tuple[str, set[str]]]:
    """Yield each command of the command line in a line of code, with its options. A synopsis has brackets."""
    for part in re.split(r"[|>;]\s|&&|#", line):
        words = part.replace("[", " ").replace("]", " ").split()
        if "raytracer" in words:
            words = words[words.index("raytracer") + 1 :]
            command = next((name for n in (2, 1) if (name := " ".join(words[:n])) in COMMANDS), words[0])
            yield command, {*OPTION.findall(" ".join(words))}


@pytest.mark.parametrize("page", PAGES)
def test_every_command_on_a_page_is_there_with_its_options(page: str) -> None:
    block_lines = [
        line for block in blocks(page) if block.language in ("bash", "text") for line in command_lines(block.text)
    ]
    inline_lines = [
        " ".join(["raytracer", *words])
        for code in inline_code(page)
        if (words := code.removeprefix("raytracer ").split()) and is_command(words, code.startswith("raytracer "))
    ]
    for line in block_lines + inline_lines:
        for command, options in parse_commands(line):
            if command in COMMANDS:
                assert options <= {*command_options(command), "--help"}, line
            else:
                assert command in PLACEHOLDERS or command in ("--help", "--version"), line


def command_lines(text: str) -> list[str]:
    """Return the lines of commands, with their continuations by a backslash or by an indent."""
    joined = re.sub(r"\\?\n +", " ", text)
    return [line for line in joined.splitlines() if line.startswith("raytracer ")]


def is_command(words: list[str], is_whole: bool) -> bool:
    """Return whether words in backquotes are a command: after `raytracer` always, else a name with an option."""
    is_named = any(" ".join(words[:n]) in COMMANDS for n in (1, 2))
    return is_whole or (is_named and len(words) > 1)


@pytest.mark.parametrize("page", PAGES)
def test_every_option_in_backquotes_is_one_of_a_program(page: str) -> None:
    program_codes = [code for code in inline_code(page) if not code.startswith(OTHER_PROGRAMS)]
    options = {name for code in program_codes for name in OPTION.findall(code) if name.startswith("--")}
    assert options - ALL_OPTIONS - other_options() == set()


def option_rows(page: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the rows of a page's tables that describe an option: the heading above and the cells."""
    heading, has_options = "", False
    for line in page_text(page).splitlines():
        if line.startswith("## "):
            heading = line[3:]
        elif not line.startswith("|"):
            has_options = False
        elif line.startswith("| option | default |"):
            has_options = True
        elif has_options and re.match(r"\| `-", line):
            yield heading, [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


@pytest.mark.parametrize("command", ["render", "view", "reference", "compare", "tune", "trade", "extremes"])
def test_the_table_of_a_command_has_only_its_options_with_their_defaults(command: str) -> None:
    page = PAGE_OF.get(command, "docs/command-line.md")
    table = [cells for heading, cells in option_rows(page) if heading in (command, "Options")]
    assert len(table) > 2
    for name, default, *_ in table:
        options = {*OPTION.findall(name)}
        assert options <= command_options(command), name
        action = next(action for action in COMMANDS[command]._actions if {*action.option_strings} & options)
        stated = re.search(r"Default: ([\w.]+?)(?=\.?(?:[\s,;]|$))", action.help or "")
        if stated and re.fullmatch(r"[\d.x]+", stated[1]):
            assert default.replace(",", "").startswith(stated[1]), (name, default, stated[1])


@pytest.mark.parametrize("page", PAGES)
def test_every_name_of_python_on_a_page_is_there_with_its_parameters(page: str) -> None:
    texts = [block.text for block in blocks(page) if block.language == "text"]
    for code in (*inline_code(page), *texts):
        for match in re.finditer(r"(?<![\w.])rt\.(\w+(?:\.\w+)*)", code):
            value = rt
            for part in match[1].split("."):
                assert hasattr(value, part), code
                value = getattr(value, part)
            check_parameters(value, code[match.end() :])


def check_parameters(function: object, call: str) -> None:
    """Compare parameters as on a page, `(scene, size=(1280, 720), *, samples)`, with a function's signature."""
    try:
        # A page writes a whole signature, or a call with values for some parameters, which is no signature.
        (definition,) = ast.parse(f"def f{call.partition(' -> ')[0].strip()}: ...").body
    except SyntaxError:
        return
    assert isinstance(definition, ast.FunctionDef)
    arguments = definition.args
    assert callable(function)
    parameters = inspect.signature(function).parameters
    takes_all = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values())
    names = [argument.arg for argument in (*arguments.args, *arguments.kwonlyargs)]
    assert takes_all or {*names} <= {*parameters}, call
    if len(names) > 1:
        defaults = dict(zip(reversed(arguments.args), reversed(arguments.defaults), strict=False))
        for argument, default in (*defaults.items(), *zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)):
            if isinstance(default, (ast.Constant, ast.Tuple)) and argument.arg in parameters:
                assert ast.literal_eval(default) == parameters[argument.arg].default, (call, argument.arg)


@pytest.mark.parametrize("page", PAGES)
def test_no_link_is_broken_and_each_leads_to_a_file_of_the_repository(page: str) -> None:
    assert broken_links(page) == []
    local = [link for link in links(page) if "://" not in link]
    assert "" not in local and "#" not in local
    paths = {target(page, link)[0] for link in local}
    assert {path for path in paths if not path.is_relative_to(CHECKOUT)} == set()
    if (CHECKOUT / ".git").exists():
        assert {path for path in paths if path not in repository_files()} == set()


@cache
def repository_files() -> set[Path]:
    """Return the files of the repository, committed or not but not ignored, and their folders."""
    command = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    names = subprocess.run(command, cwd=CHECKOUT, capture_output=True, check=True).stdout.decode().split("\0")
    files = {CHECKOUT / name for name in names if name}
    return files | {folder for file in files for folder in file.parents}


def test_every_page_of_the_repository_is_tested() -> None:
    if not (CHECKOUT / ".git").exists():
        pytest.skip("not a clone")
    pages = {path.relative_to(CHECKOUT).as_posix() for path in repository_files() if path.suffix == ".md"}
    assert {page for page in pages if not page.startswith("benchmarks/results/")} == {*PAGES}


@pytest.mark.parametrize("page", PAGES)
def test_a_page_has_no_html_but_comments(page: str) -> None:
    html = [
        part.content
        for token in tokens(page)
        for part in (token, *(token.children or ()))
        if part.type in ("html_block", "html_inline")
    ]
    assert [text for text in html if not re.fullmatch(r"<!--.*-->\s*", text)] == []


@pytest.mark.parametrize("page", PAGES)
def test_a_block_that_does_not_run_has_the_reason_that_it_states(page: str) -> None:
    for block in blocks(page):
        place = f"{page}:{block.line}"
        assert not block.not_run or re.search(REQUIRED_TEXT.get(block.not_run, ""), block.text, re.M), place
        assert (block.not_run == "fragment") <= (block.language == "toml"), place
        # A reader saves only blocks of these languages; a `bash` block that begins with a file's name would not run.
        assert not block.file or block.file.endswith(SUFFIXES.get(block.language, "-")), place


@pytest.mark.parametrize("page", PAGES)
def test_a_saved_file_is_used_later(page: str) -> None:
    run = [block for block in blocks(page) if not block.not_run]
    for i, block in enumerate(run):
        used = any(block.file in later.text for later in run[i + 1 :] if later.language in ("bash", "python"))
        assert not block.file or used, f"{page}:{block.line}"


@pytest.mark.parametrize("page", PAGES)
def test_a_fragment_of_a_scene_file_is_valid(page: str, tmp_path: Path) -> None:
    for block in blocks(page):
        if block.language == "toml":
            table = tomllib.loads(block.text)
            if {*table} == {"settings"}:
                example = (CHECKOUT / "assets/scenes/assignment.toml").read_text().partition("[settings]")[0]
                (tmp_path / "scene.toml").write_text(f"{example}\n{block.text}")
                rt.load_settings(tmp_path / "scene.toml")
