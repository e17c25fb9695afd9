"""The distance between two anchors, written beside them."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import CAP, DASH, LINED, PLACES, WRITTEN, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class Distance(Own):
    """``places``: decimals; ``offset``: of its line from the two anchors, to the left, in world pixels."""

    places: int = 0
    offset: float = 24.0


DIMENSION = ThingKind(
    "dimension",
    place=16,
    anchors=None,
    points=(2, 2),
    options=(*LINED, DASH, CAP, *WRITTEN, PLACES, OptionRule("offset", OptionForm.NUMBER, "the offset")),
    own=Distance,
    width=1.2,
    size=14.0,
)
