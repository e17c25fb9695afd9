"""What is drawn at anchors of other things: lines, symbols of machine parts, measures and signs of geometry."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.colors import PALE
from movimentum.things.kind import Own, ThingKind
from movimentum.things.options import AREA as OPTIONS
from movimentum.things.options import (
    CAP,
    DASH,
    EDGE,
    FILL,
    JOINTS,
    LINED,
    PLACES,
    SIZE,
    THROUGH,
    WHOLE,
    WRITTEN,
    OptionForm,
    OptionRule,
    flag,
)

LINE = ThingKind(
    "line", place=10, anchors=None, points=(2, None), options=(*LINED, DASH, CAP), plain=False, followed=True
)


ARROW = ThingKind(
    "arrow", place=2, anchors=2, options=(*LINED, DASH, CAP, *JOINTS, THROUGH), width=3.0, plain=False, followed=True
)
"""With its head at the last anchor."""


BEZIER = ThingKind(
    "bezier", place=32, anchors=3, points=(3, None), options=(*LINED, DASH, CAP), plain=False, followed=True
)
"""With control points: its own anchors, or anchors of other things."""


@dataclass(frozen=True, slots=True)
class Course(Own):
    """``radii``: of what the cord runs about at each of its points, in pixels: positive for a wheel on its right,
    negative for one on its left, 0 for a point.
    """

    radii: tuple[float, ...] = ()


CORD = ThingKind("cord", place=33, anchors=None, points=(2, None), options=(*LINED, DASH, CAP), own=Course)
"""Taut, from one place to another and about wheels."""


@dataclass(frozen=True, slots=True)
class Bounded(Own):
    """``smooth``: its edge is one smooth curve. ``bulge``: how high the arcs are that are its edges, in lengths of the
    edges, outwards: one for all, or one for each in turn.
    """

    smooth: bool = False
    bulge: tuple[float, ...] = ()


AREA = ThingKind(
    "area",
    place=19,
    anchors=None,
    points=(3, None),
    options=(*OPTIONS, flag("smooth"), OptionRule("bulge", OptionForm.NUMBERS, "a bulge", most=64)),
    own=Bounded,
    width=1.6,
    ink=PALE,
    surface=True,
    cuts=True,
    followed=True,
)
"""Filled, with anchors of other things as its corners."""


GROUND = ThingKind("ground", place=9, points=(1, 1), options=(*LINED, SIZE), width=1.6, size=22.0, under=True)
"""The hatched support under a fixed pin: at an anchor of its own, or at one of another thing."""


SLIDE = ThingKind(
    "slide", place=11, anchors=None, points=(2, None), options=(*LINED, SIZE), size=24.0, under=True, of_film=True
)
"""Two guides beside the line through the anchors."""


@dataclass(frozen=True, slots=True)
class Coiled(Own):
    """``coils``: how many turns it shows."""

    coils: int = 8


SPRING = ThingKind(
    "spring",
    place=12,
    anchors=None,
    points=(2, 2),
    options=(*LINED, SIZE, OptionRule("coils", OptionForm.WHOLE, "the number of coils", lowest=1, highest=200)),
    own=Coiled,
    attached=True,
)


DAMPER = ThingKind("damper", place=13, anchors=None, points=(2, 2), options=(*LINED, SIZE), attached=True, of_film=True)

CYLINDER = ThingKind(
    "cylinder",
    place=14,
    anchors=None,
    points=(2, 2),
    options=(*LINED, FILL, EDGE, SIZE),
    width=1.6,
    attached=True,
    of_film=True,
)


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
"""The angle at the second of three anchors, with its value."""


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
"""The distance of two anchors, written beside them."""


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
