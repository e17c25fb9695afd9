"""Geometry marks: right angles, equal lengths, parallel lines."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import CAP, DASH, LINED, SIZE, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class Counted(Own):
    """``count``: how many signs stand beside each other."""

    count: int = 1


_COUNT = OptionRule("count", OptionForm.WHOLE, "the number of signs", lowest=1, highest=9)

RIGHT = ThingKind("right", 20, (*LINED, DASH, CAP, SIZE), anchors=None, points=(3, 3), width=1.2, size=12.0)
"""The sign of the right angle at the second of three anchors."""

TICKS = ThingKind(
    "ticks", 21, (*LINED, CAP, SIZE, _COUNT), anchors=None, points=(2, 2), own=Counted, width=1.4, size=10.0
)
"""Short strokes across the middle of a line: lines with as many are equally long."""

PARALLEL = ThingKind(
    "parallel", 22, (*LINED, CAP, SIZE, _COUNT), anchors=None, points=(2, 2), own=Counted, width=1.4, size=10.0
)
"""Arrow heads on a line: lines with as many are parallel."""
