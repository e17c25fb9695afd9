"""Merges two people's changes to one text, line by line."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import SequenceMatcher

from movimentum.records import dataclass


@dataclass(frozen=True, slots=True)
class Clash:
    """Lines that both have changed, and differently: from ``line`` (from 1) of ``mine`` on."""

    line: int
    mine: tuple[str, ...]
    theirs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Merged:
    """``text`` has the changes of both; where they clash, mine. ``taken``: how many places come from theirs."""

    text: str
    clashes: tuple[Clash, ...]
    taken: int


Change = tuple[int, int, list[str]]
"""Lines ``[first, stop)`` of the base, and what takes their place."""


def merged(base: str, mine: str, theirs: str) -> Merged:
    """A three-way merge by lines: ``base`` with all changes of ``mine`` and ``theirs``."""
    before = _lines(base)
    ours, others = _changes(before, _lines(mine)), _changes(before, _lines(theirs))
    lines: list[str] = []
    clashes: list[Clash] = []
    place = taken = 0
    while ours or others:
        first = min(change[0] for change in (*ours[:1], *others[:1]))
        stop, own, other = _together(first, ours, others)
        lines += before[place:first]
        said, heard = _applied(before, first, stop, own), _applied(before, first, stop, other)
        if own and other and said != heard:
            clashes.append(Clash(len(lines) + 1, tuple(said), tuple(heard)))
        taken += bool(other) and said != heard and not own
        lines += said if own else heard
        place = stop
    return Merged("".join([*lines, *before[place:]]), tuple(clashes), taken)


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


def _changes(before: Sequence[str], after: Sequence[str]) -> list[Change]:
    matcher = SequenceMatcher(None, before, after, autojunk=False)
    return [(a, b, list(after[c:d])) for what, a, b, c, d in matcher.get_opcodes() if what != "equal"]


def _together(first: int, ours: list[Change], others: list[Change]) -> tuple[int, list[Change], list[Change]]:
    """Take the changes off both lists that begin at line ``first`` or touch those that do: (where they end, of each
    list).
    """
    stop = first
    own: list[Change] = []
    other: list[Change] = []
    grown = True
    while grown:
        grown = False
        for left, taken in ((ours, own), (others, other)):
            while left and (left[0][0] < stop or left[0][0] == first):
                stop = max(stop, left[0][1])
                taken.append(left.pop(0))
                grown = True
    return stop, own, other


def _applied(before: Sequence[str], first: int, stop: int, changes: Sequence[Change]) -> list[str]:
    lines: list[str] = []
    place = first
    for begin, end, text in changes:
        lines += [*before[place:begin], *text]
        place = end
    return [*lines, *before[place:stop]]
