"""The pages of the documentation, taken apart: blocks of code, headings, links."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from movimentum.cli.app import run_command_line
from tests.command import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
MADE = {"reference/commands.md", "reference/python.md", "reference/messages.md"}
"""Pages that docs/make_reference.py writes."""
_FENCE = re.compile(r"^```(?P<info>[^\n]*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A block of code: its language, its title (a file's name, or `part`), and its text."""

    language: str
    title: str
    text: str
    line: int

    @property
    def is_part(self) -> bool:
        """Whether a script needs a step of its own to be whole."""
        return self.title == "part"


def name_of(path: Path) -> str:
    return path.relative_to(DOCS).as_posix()


def blocks(path: Path) -> list[Block]:
    found: list[Block] = []
    page = path.read_text(encoding="utf-8")
    for match in _FENCE.finditer(page):
        language, _, rest = match["info"].strip().partition(" ")
        title = re.search(r'title="([^"]*)"', rest)
        line = page.count("\n", 0, match.start()) + 1
        found.append(Block(language, title[1] if title else "", match["text"], line))
    return found


def prose(path: Path) -> str:
    """A page without its blocks, its code and its comments."""
    text = re.sub(r"<!--.*?-->", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    return re.sub(r"`[^`\n]+`", "", _FENCE.sub("", text))


def anchors(path: Path) -> set[str]:
    """The anchors of a page's headings, as the site has them."""
    text = _FENCE.sub("", path.read_text(encoding="utf-8"))
    found: set[str] = set()
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|[`*]", r"\1", heading)
        plain = unicodedata.normalize("NFKD", plain).encode("ascii", "ignore").decode()
        slug = re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", plain).strip().lower())
        count = 0
        while f"{slug}_{count}" * bool(count) + slug * (not count) in found:
            count += 1
        found.add(f"{slug}_{count}" if count else slug)
    return found


def links(path: Path) -> Iterator[str]:
    """Where a page's links and pictures lead, outside its code."""
    text = re.sub(r"`[^`\n]+`", "", _FENCE.sub("", path.read_text(encoding="utf-8")))
    yield from re.findall(r"\]\(([^)\s]+)\)", text)


def answer(command: str) -> str:
    """What a line of a session prints, here and now, on both streams."""
    words = shlex.split(command)
    assert words[0] == "movimentum", command
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        run_command_line(words[1:])
    return said.getvalue().replace(os.getcwd() + os.sep, "")


def alike(shown: str, said: str) -> bool:
    """Whether a session shows what is said; `…` stands for anything, alone on a line for any lines."""
    lines = [
        "(?:.*\n)*" if line == "…" else re.escape(line.rstrip()).replace("…", ".*") + " *\n"
        for line in shown.strip().splitlines()
    ]
    return re.fullmatch("".join(lines), said.strip() + "\n") is not None
