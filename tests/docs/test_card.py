"""The language on one page, for language models: its blocks run, its words exist, and ten scripts written from it hold.

The scripts in ``card/`` were written with nothing but the page and the captions of the gallery.
"""

from __future__ import annotations

import re
from pathlib import Path

import click
import pytest

import movimentum as mv
from movimentum.cli.app import commands
from tests.command import ROOT
from tests.docs.pages import DOCS, Block, blocks

CARD = DOCS / "llms.txt"
WRITTEN = sorted((Path(__file__).parent / "card").glob("*.mov"))
SCRIPTS = [block for block in blocks(CARD) if block.language == "mov"]


def told(script: mv.Script) -> list[str]:
    return [f"{item.code}: {item.message}" for item in script.diagnostics if item.severity != mv.Severity.NOTE]


@pytest.mark.parametrize("block", SCRIPTS, ids=lambda block: f"line {block.line}")
def test_every_block_runs(block: Block) -> None:
    if block.title == "lines":
        from tests.understand import script_of

        assert script_of(f"@0 {block.text}").items
    elif block.is_part:
        without = re.sub(r"^Photo.*\n", "", block.text, flags=re.MULTILINE)  # there is no picture here
        assert told(mv.loads(f"{without}@0")) == []
    else:
        script = mv.loads(block.text)
        assert told(script) == []
        assert len(script.solve().times) > 10


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.stem)
def test_what_was_written_from_it_holds(path: Path) -> None:
    script = mv.load(path)
    assert told(script) == []
    assert len(script.solve().times) >= 50
    assert (ROOT / "scripts" / path.name).exists(), "it is one of the gallery's"


def test_ten_were_written() -> None:
    assert len(WRITTEN) == 10
    assert sum(".claim " in path.read_text("utf-8") for path in WRITTEN) >= 6


def test_it_names_only_words_and_commands_that_exist() -> None:
    text = CARD.read_text("utf-8")
    reference = "".join(path.read_text("utf-8") for path in (DOCS / "reference" / "language").glob("*.md"))
    word = re.compile(r"(?<![\w.\])])\.([a-zA-Z]+)\b")
    code = " ".join(re.findall(r"`([^`\n]+)`", text.replace("```", "")))
    assert set(word.findall(code)) - set(word.findall(reference)) <= {"mov", "csv", "gif", "svg", "html", "png"}
    context = click.Context(commands)
    for name in re.findall(r"movimentum (\w+)", text):
        assert commands.get_command(context, name) is not None, name
    for name, options in re.findall(r"^\| `movimentum (\w+)([^`]*)`", text, re.MULTILINE):
        command = commands.get_command(context, name)
        assert command is not None
        spelled = {option for each in command.params for option in each.opts}
        assert set(re.findall(r"(?<!\w)--?[a-z]+", options)) <= spelled, name


def test_it_is_one_page_and_linked() -> None:
    assert len(CARD.read_text("utf-8").split()) < 2500
    assert "docs/llms.txt" in (ROOT / "README.md").read_text("utf-8")
    assert "llms.txt" in (DOCS / "index.md").read_text("utf-8")
