"""The relations between the two sides of a constraint."""

from __future__ import annotations

from enum import StrEnum

from movimentum.records import dataclass


class Relation(StrEnum):
    """The direction of a constraint; part of its key. A goal may be that something is as large as can be."""

    EQUAL = "="
    BELOW = "<"
    ABOVE = ">"
    WISH = "~"
    LARGEST = ".largest"
    SMALLEST = ".smallest"


@dataclass(frozen=True, slots=True)
class GapSide:
    """One side of a gap that pushes: the outline of thing number ``thing``, or only its anchor ``anchor``."""

    thing: int
    anchor: int | None = None
