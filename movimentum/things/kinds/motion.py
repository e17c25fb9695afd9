"""What shows how things move: paths, arrows of velocities, poles, and the curves that poles go through."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.colors import NOTED
from movimentum.things.kind import Own, ThingKind, Valued
from movimentum.things.options import (
    CAP,
    CLIP,
    COLOR,
    DASH,
    HIDDEN,
    ITALIC,
    LAYER,
    LINED,
    OFFSTAGE,
    OPACITY,
    SIZE,
    STILL,
    TEXT,
    WHOLE,
    WIDTH,
    WRITTEN,
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
"""The path of an anchor."""


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
"""The velocity or the acceleration of an anchor, as an arrow."""


@dataclass(frozen=True, slots=True)
class Polygon(Own):
    """``magnified``: pixels of an arrow for a pixel a time unit."""

    magnified: float = 0.2


VELOCITIES = ThingKind(
    "velocities",
    place=24,
    options=(
        *(COLOR, WIDTH, LAYER, HIDDEN, OFFSTAGE, OPACITY, SIZE, ITALIC, CLIP, STILL),
        OptionRule("scale", OptionForm.POSITIVE, "the scale of velocities", field="magnified"),
    ),
    own=Polygon,
    width=2.0,
    size=14.0,
    ink=NOTED,
    accented=True,
    valued=Valued.VELOCITIES,
    beside=True,
)
"""The velocities of several points as arrows from one point."""


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
"""A curve that a pole goes through in the whole film."""

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
