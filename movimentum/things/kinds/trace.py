"""The path of an anchor."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind
from movimentum.things.option_rules import (
    CAP,
    COLOR,
    DASH,
    HIDDEN,
    LAYER,
    OPACITY,
    WHOLE,
    WIDTH,
    OptionForm,
    OptionRule,
)


@dataclass(frozen=True, slots=True)
class Track(Own):
    """``whole``: from the first frame on, all that it ever draws. ``tail``: how long it lasts, in time units."""

    whole: bool = False
    tail: float | None = None


TRACE = ThingKind(
    "trace",
    place=15,
    anchors=None,
    points=(1, 1),
    options=(
        COLOR,
        WIDTH,
        LAYER,
        HIDDEN,
        OPACITY,
        DASH,
        CAP,
        WHOLE,
        OptionRule("tail", OptionForm.POSITIVE, "how long a trace lasts"),
        OptionRule("while", OptionForm.EXPRESSIONS, most=64),
    ),
    own=Track,
    width=1.6,
    accented=True,
    of_film=True,
    followed=True,
)
