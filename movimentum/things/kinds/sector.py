"""Sectors of discs, and rings: outlines of arcs about the first anchor."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import AREA, JOINTS, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class Annular(Own):
    """From the ``inner`` radius to the ``outer`` one, in world pixels."""

    outer: float
    inner: float


@dataclass(frozen=True, slots=True)
class Wedge(Own):
    """Of a disc of ``radius``: counter-clockwise from the direction ``begin`` to ``end``, in degrees as drawn."""

    radius: float
    begin: float
    end: float

    @property
    def turn(self) -> float:
        """How far it goes, more than 0 and at most 360 degrees."""
        turn = self.end - self.begin
        return 360.0 if turn >= 360.0 else turn % 360.0 or 360.0


RING = ThingKind(
    "ring",
    place=30,
    arguments=(
        OptionRule("outer", OptionForm.POSITIVE, "the outer radius of a ring"),
        OptionRule("inner", OptionForm.POSITIVE, "the inner radius of a ring"),
    ),
    options=(*AREA, *JOINTS),
    own=Annular,
    width=1.6,
    inside=True,
    supported=True,
    filled=True,
    followed=True,
)
SECTOR = ThingKind(
    "sector",
    place=31,
    arguments=(
        OptionRule("radius", OptionForm.POSITIVE, "the radius of a sector"),
        OptionRule("begin", OptionForm.NUMBER, "the angle at which a sector begins"),
        OptionRule("end", OptionForm.NUMBER, "the angle at which a sector ends"),
    ),
    options=(*AREA, *JOINTS),
    own=Wedge,
    width=1.6,
    inside=True,
    supported=True,
    filled=True,
    cuts=True,
    followed=True,
)
