"""The angle at the second of three anchors, with its value."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import CAP, DASH, LINED, PLACES, WHOLE, WRITTEN, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class Angle(Own):
    """``places``: decimals; ``radius`` in world pixels; ``whole``: of up to a whole turn."""

    places: int = 0
    radius: float = 28.0
    whole: bool = False


ARC = ThingKind(
    "arc",
    place=17,
    anchors=None,
    points=(3, 3),
    options=(*LINED, DASH, CAP, *WRITTEN, PLACES, OptionRule("radius", OptionForm.POSITIVE, "the radius"), WHOLE),
    own=Angle,
    width=1.4,
    size=14.0,
    followed=True,
)
