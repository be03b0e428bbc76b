"""The pages of the documentation: their blocks of code, links, headings and sentences, as a reader sees them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from markdown_it import MarkdownIt
from markdown_it.token import Token

from .scenes import CHECKOUT

# Every page that a reader may open, relative to the checkout. benchmarks/results has tables that benchmarks write.
PAGES = sorted(
    path.relative_to(CHECKOUT).as_posix()
    for folder in (".", "docs", "shaders", "examples", "benchmarks")
    for path in (CHECKOUT / folder).glob("*.md")
)
# Comments directly before a block that a reader does not paste, and the reasons that a page may have.
_NOT_RUN = re.compile(r"<!-- (fragment|not run: .+) -->\s*$")
NOT_RUN = (
    "fragment",
    "not run: installation",
    "not run: opens a window",
    "not run: takes minutes",
    "not run: needs another machine",
)
# A reader saves a block that begins with a comment like `# lamp.toml` under this name.
_FILE = re.compile(r"# ([\w-]+\.(?:toml|csv|py))$", re.M)
# A sentence ends at a full stop, a question mark or an exclamation mark before a space, also with a bracket or a quote
# between them. The full stop of an initial or an abbreviation ends none.
_END = re.compile(r"""(?:(?<=[.?!])|(?<=[.?!][)"]))(?<!\b[A-Z]\.)(?<!e\.g\.)(?<!i\.e\.)(?<!vs\.)(?<!etc\.)\s+""")
# Text that was meant as a link, but is none by the rules of Markdown, as with a space in its target.
_NO_LINK = re.compile(r"\]\s?[(\[]|\[[^\]]+\]:")


class Block(NamedTuple):
    """A block of code: its language, its text, its first line in the page, and the reason not to run it, or ""."""

    language: str
    text: str
    line: int
    not_run: str

    @property
    def file(self) -> str:
        """The name under which a reader saves the block; "" without one."""
        match = _FILE.match(self.text)
        return match[1] if match else ""


@cache
def tokens(page: str) -> list[Token]:
    return MarkdownIt("commonmark").enable("table").parse((CHECKOUT / page).read_text())


def blocks(page: str) -> Iterator[Block]:
    """Yield the blocks of code of a page in their order."""
    before = ""
    for token in tokens(page):
        if token.type in ("fence", "code_block"):
            mark = _NOT_RUN.search(before)
            assert token.map
            yield Block(token.info, token.content, token.map[0] + 1, mark[1] if mark else "")
        before = token.content if token.type == "html_block" else ""


def _inline(page: str) -> Iterator[Token]:
    for token in tokens(page):
        yield from token.children or ()


def links(page: str) -> list[str]:
    """List the targets of a page's links."""
    return [str(token.attrs["href"]) for token in _inline(page) if token.type == "link_open"]


def broken_links(page: str) -> list[str]:
    """List the texts of a page that look like a link but are none."""
    return [token.content for token in tokens(page) if token.type == "inline" and _NO_LINK.search(_plain(token))]


def inline_code(page: str) -> list[str]:
    """List the texts in backquotes."""
    return [token.content for token in _inline(page) if token.type == "code_inline"]


def pictures(page: str) -> list[tuple[str, str]]:
    """List the pictures of a page: the file and the alternative text of each."""
    return [(str(token.attrs["src"]), token.content) for token in _inline(page) if token.type == "image"]


@cache
def anchors(page: str) -> set[str]:
    """Return the anchors of a page's headings, by GitHub's rule: lower case, no punctuation, `-1` for a repetition."""
    counts: Counter[str] = Counter()
    names = set()
    for heading, text in zip(tokens(page), tokens(page)[1:], strict=False):
        if heading.type == "heading_open":
            name = re.sub(r"[^\w\- ]", "", _text(text).lower()).replace(" ", "-")
            names.add(f"{name}-{counts[name]}" if counts[name] else name)
            counts[name] += 1
    return names


def _text(token: Token) -> str:
    """The text of a paragraph or a cell as shown: code counts as a word, pictures are left out."""
    return "".join(
        " " if child.type in ("softbreak", "hardbreak") else child.content
        for child in token.children or ()
        if child.type in ("text", "code_inline", "softbreak", "hardbreak")
    )


def _plain(token: Token) -> str:
    """The text of a paragraph or a cell without code, whose brackets are no link."""
    return "".join(child.content if child.type == "text" else " `` " for child in token.children or ())


def sentences(page: str) -> Iterator[str]:
    """Yield the sentences of a page's paragraphs, list entries and table cells."""
    for token in tokens(page):
        if token.type == "inline":
            yield from _END.split(_text(token))


def page_text(page: str) -> str:
    return (CHECKOUT / page).read_text()


def target(page: str, link: str) -> tuple[Path, str]:
    """Return the file that a relative link of a page leads to, and its anchor or ""."""
    path, _, anchor = link.partition("#")
    return ((CHECKOUT / page).parent / path).resolve() if path else CHECKOUT / page, anchor
