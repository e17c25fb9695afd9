"""Finds the nearest names, for "did you mean"."""

from __future__ import annotations

from collections.abc import Iterable

from movimentum.diagnostics import Fix, insertion

_LONGEST = 100
"""Longer names are hardly misspelled (and comparing them takes time)."""


def distance(first: str, second: str) -> int:
    """How many letters must be changed, deleted, inserted or swapped to get from one to the other."""
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, a in enumerate(first, 1):
        previous, row, oldest = row, [i], before
        for j, b in enumerate(second, 1):
            best = min(previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (a != b))
            if i > 1 and j > 1 and a == second[j - 2] and first[i - 2] == b:
                best = min(best, oldest[j - 2] + 1)
            row.append(best)
        before = previous
    return row[-1]


def nearest(name: str, candidates: Iterable[str]) -> str | None:
    """The candidate that ``name`` is most likely a misspelling of; None if nothing is near."""
    if len(name) > _LONGEST:
        return None
    limit = max(1, len(name) // 3) if len(name) > 1 else 0  # any other letter is "near" a single one
    best: str | None = None
    for candidate in sorted(set(candidates)):
        if candidate.lower() == name.lower():
            return candidate
        if max(_beyond(name, candidate), _beyond(candidate, name)) > limit:
            continue  # no comparison is that short, and most names end here
        steps = distance(name, candidate)
        if steps <= limit:
            best, limit = candidate, steps - 1
    return best


def _beyond(first: str, second: str) -> int:
    """How many letters ``first`` has that ``second`` has not: at least so many steps are between the two."""
    return sum(max(first.count(letter) - second.count(letter), 0) for letter in set(first))


def dotted(word: str, place: int) -> Fix:
    """A dot at ``place``, in front of one of the language's own words (as it is to be shown)."""
    return insertion(f"write `.{word}`: the language's own words begin with a dot", place, ".")
