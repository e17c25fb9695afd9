"""Poles of a body's motion: instant centres, the curves that they trace, and the inflection circle."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.colors import NOTED
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import (
    CAP,
    COLOR,
    DASH,
    HIDDEN,
    ITALIC,
    LAYER,
    OPACITY,
    SIZE,
    TEXT,
    WIDTH,
    OptionForm,
    OptionRule,
)

_LINED = (COLOR, WIDTH, LAYER, HIDDEN, OPACITY)

CENTRE = ThingKind(
    "centre",
    25,
    (*_LINED, SIZE, ITALIC, TEXT),
    anchors=None,
    wholes=(1, 2),
    width=1.6,
    size=14.0,
    ink=NOTED,
    accented=True,
    loose=True,
)
"""The instant centre of a body, or that of one body relative to another."""


@dataclass(frozen=True, slots=True)
class Rolling(Own):
    """``moving``: the curve that the pole goes through on the (first) body, else that on the ground (or the second)."""

    moving: bool = False
    resting: bool = False

    @property
    def of_film(self) -> bool:
        """It is the whole curve."""
        return True


POLODE = ThingKind(
    "polode",
    26,
    (
        *_LINED,
        DASH,
        CAP,
        OptionRule("fixed", OptionForm.FLAG, least=0, most=0, field="resting"),
        OptionRule("moving", OptionForm.FLAG, least=0, most=0),
    ),
    anchors=None,
    wholes=(1, 2),
    own=Rolling,
    width=1.6,
    ink=NOTED,
    accented=True,
    loose=True,
)

INFLECTION = ThingKind(
    "inflection",
    27,
    (*_LINED, DASH, CAP),
    anchors=None,
    wholes=(1, 1),
    width=1.4,
    ink=NOTED,
    accented=True,
    loose=True,
)
"""The circle of the points of a body whose paths are straight at this moment."""
