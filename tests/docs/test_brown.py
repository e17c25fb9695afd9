"""Brown's movements: every script of the page runs, says nothing twice, and keys nothing."""

from __future__ import annotations

import random
import re
from typing import NamedTuple

import pytest

import movimentum as mv
from tests.docs.pages import DOCS


class Entry(NamedTuple):
    """A movement of the page."""

    number: int
    prose: str
    script: str
    picture: str


_ENTRY = re.compile(
    r"^## (\d+) · ([^\n]+)\n\n([^`]+?)\n\n```mov\n([^`]*)^```\n\n!\[([^\n]*)\]\(pictures/brown-(\d+)\.svg\)\n",
    re.MULTILINE,
)
PAGE = (DOCS / "brown.md").read_text("utf-8")
ENTRIES = [Entry(int(n), prose, script, picture) for n, _, prose, script, _, picture in _ENTRY.findall(PAGE)]
FAST = set(random.Random(1868).sample([e.number for e in ENTRIES if ".gap" not in e.script], 6))
"""Movements that are tried each time; the others are marked slow."""


def test_the_page_lists_many_of_browns_movements() -> None:
    numbers = [entry.number for entry in ENTRIES]
    assert len(numbers) == len(re.findall(r"^## ", PAGE, re.MULTILINE)), "a heading, words, a script, a picture"
    assert numbers == sorted(set(numbers))
    assert 1 <= numbers[0] < numbers[-1] <= 507
    assert len(numbers) >= 80
    assert sum(".pushes" in entry.script for entry in ENTRIES) >= 20, "what only pushing makes possible"


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: str(entry.number))
def test_what_a_movement_consists_of(entry: Entry) -> None:
    """Words; one step, and the end of the film: poses are not keyed; its picture."""
    assert re.search(r"[.)]$", entry.prose.strip())
    assert len(re.findall(r"@[\d.]+", entry.script)) == 2
    assert entry.script.startswith(".config(25")
    assert int(entry.picture) == entry.number


@pytest.mark.parametrize(
    "entry",
    [pytest.param(e, marks=[pytest.mark.slow] * (e.number not in FAST), id=str(e.number)) for e in ENTRIES],
)
def test_every_movement_runs_and_its_claims_hold(entry: Entry) -> None:
    script = mv.loads(entry.script, name=f"brown-{entry.number}.mov")
    assert [f"{item.code}: {item.message}" for item in script.diagnostics if item.severity != "note"] == []
    motion = script.solve()
    assert len(motion.times) >= 25
