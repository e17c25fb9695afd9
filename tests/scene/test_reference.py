"""Every example in the language reference is understood, and every code it lists is one of ours."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.understand import scene_of, script_of

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```mov( part)?\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_examples(number: int) -> None:
    part, text = BLOCKS[number]
    assert script_of(text).items
    scene = scene_of(text + ("@0" if part else ""))
    assert scene.diagnostics == ()


def test_there_are_examples() -> None:
    assert len(BLOCKS) >= 7
    assert sum(not part for part, _ in BLOCKS) >= 4


def test_the_codes_are_those_of_the_front_end() -> None:
    code = r"((?:syntax|name|kind|asset|timeline|limit)/[a-z-]+)"
    told = set(re.findall(f"`{code}`", PAGE))
    used = {
        found
        for stage in ("syntax", "scene", "timeline")
        for path in (ROOT / "movimentum" / stage).rglob("*.py")
        for found in re.findall(f'"{code}"', path.read_text(encoding="utf-8"))
    }
    assert used - told == set()
    # found by the stage that reads pictures, where any stage says too much, and where it is known what moves
    later = {"asset/unreadable", "asset/glyph", "limit/messages", "name/clock", "name/no-value"}
    later |= {"asset/element", "asset/unsafe", "asset/needs-svg", "limit/drawing", "limit/paths"}
    assert told - used == later


def test_the_words_are_those_of_the_language() -> None:
    from movimentum.syntax.words import CLOCKS, FUNCTIONS, SYNONYMS, THING_MEMBERS, VECTOR_MEMBERS
    from movimentum.things.registry import KINDS, SHAPES

    options = {rule.name for kind in KINDS.values() for rule in kind.options}
    for word in (*FUNCTIONS, *SYNONYMS, *options):
        assert re.search(rf"`\.{word}[(`]", PAGE), word
    for word in (*CLOCKS, *SHAPES):
        assert f".{word}" in PAGE
    for word in VECTOR_MEMBERS:
        assert f"`v.{word}`" in PAGE
    for word in THING_MEMBERS:
        assert f"`Thing.{word}`" in PAGE
