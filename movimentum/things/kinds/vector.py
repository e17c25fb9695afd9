"""The velocity or the acceleration of an anchor, as an arrow."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.colors import NOTED
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import CAP, DASH, LINED, WRITTEN, OptionForm, OptionRule


@dataclass(frozen=True, slots=True)
class VectorScale(Own):
    """Pixels of the arrow for a pixel a time unit (squared); one of the two is None."""

    velocity: float | None = None
    acceleration: float | None = None


VECTOR = ThingKind(
    "vector",
    place=18,
    anchors=None,
    points=(1, 1),
    options=(
        *LINED,
        DASH,
        CAP,
        *WRITTEN,
        OptionRule("velocity", OptionForm.NUMBER, "the scale of a velocity"),
        OptionRule("acceleration", OptionForm.NUMBER, "the scale of an acceleration"),
    ),
    own=VectorScale,
    width=2.4,
    size=14.0,
    ink=NOTED,
    accented=True,
)
