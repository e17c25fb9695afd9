"""What stands beside the film or is about whole things: labels, graphs, insets, groups, the kinematic diagram."""

from __future__ import annotations

from movimentum.records import dataclass
from movimentum.things.kind import Own, ThingKind, Valued
from movimentum.things.options import (
    CLIP,
    COLOR,
    FILL,
    HIDDEN,
    ITALIC,
    LAYER,
    OFFSTAGE,
    OPACITY,
    PINS,
    SIZE,
    STILL,
    WIDTH,
    OptionForm,
    OptionRule,
    flag,
)


@dataclass(frozen=True, slots=True)
class Beside(Own):
    """Of a label at an anchor of another thing. ``offset``: of the text from there, in world pixels (None: where it
    crosses least); ``leader``: a line leads from the anchor to it; ``align``: what of it is there (None: what is
    nearest).
    """

    offset: tuple[float, float] | None = None
    leader: bool = False
    align: str | None = None

    @property
    def of_film(self) -> bool:
        """Whether it looks for a place where it crosses nothing in the whole film."""
        return self.offset is None


LABEL = ThingKind(
    "label",
    place=4,
    points=(1, 1),
    arguments=(OptionRule("text", OptionForm.TEXT),),
    options=(
        COLOR,
        LAYER,
        HIDDEN,
        OFFSTAGE,
        OPACITY,
        SIZE,
        OptionRule("align", OptionForm.CHOICE, "the alignment", words=("left", "center", "right")),
        ITALIC,
        OptionRule("offset", OptionForm.NUMBERS, "an offset", least=2, most=2),
        flag("leader"),
        OptionRule("follows", OptionForm.THING),
        CLIP,
        STILL,
    ),
    own=Beside,
    beside=True,
)
"""A text whose baseline begins at its first anchor, or that stands beside an anchor of another thing."""


@dataclass(frozen=True, slots=True)
class Axes(Own):
    """``sides``: how broad and how high the field of the curves is, in world pixels, from the anchor, its lower-left
    corner. ``title`` is above it, ``xlabel`` and ``ylabel`` are beside its axes. ``polar``: the first axis is an angle
    in degrees, the second the distance from the middle.
    """

    sides: tuple[float, float] = (200.0, 120.0)
    title: str = ""
    xlabel: str = ""
    ylabel: str = ""
    polar: bool = False

    @property
    def of_film(self) -> bool:
        """It shows the whole curve."""
        return True


GRAPH = ThingKind(
    "graph",
    place=23,
    options=(
        *(COLOR, WIDTH, LAYER, HIDDEN, OFFSTAGE, OPACITY, CLIP, STILL),
        OptionRule("over", OptionForm.EXPRESSIONS),
        OptionRule("size", OptionForm.SIDES, "the size of a graph", least=2, most=2, field="sides"),
        OptionRule("title", OptionForm.TEXT),
        OptionRule("xlabel", OptionForm.TEXT),
        OptionRule("ylabel", OptionForm.TEXT),
        flag("polar"),
    ),
    own=Axes,
    width=1.8,
    size=11.0,
    valued=Valued.NUMBERS,
    beside=True,
)
"""What an expression is in the whole film, and a dot where it is now."""


GROUP = ThingKind("group", 29, (LAYER, OPACITY), anchors=None, wholes=(1, 500), gathers=True)
"""Things that fade, appear and lie on a layer together."""


@dataclass(frozen=True, slots=True)
class Detail(Own):
    """``sides``: how broad and how high the frame is, in world pixels, from the anchor, its lower-left corner.
    ``leader``: two lines lead to it from what it shows.
    """

    sides: tuple[float, float] = (120.0, 120.0)
    leader: bool = False

    @property
    def of_film(self) -> bool:
        """How near it comes in the whole film says how fine pictures are."""
        return True


INSET = ThingKind(
    "inset",
    place=29,
    options=(
        *(COLOR, WIDTH, LAYER, HIDDEN, OPACITY, FILL),
        OptionRule("size", OptionForm.SIDES, "the size of an inset", least=2, most=2, field="sides"),
        flag("leader"),
    ),
    own=Detail,
    width=1.2,
    valued=Valued.DETAIL,
    beside=True,
)
"""A part of the film once more, larger."""


SKELETON = ThingKind(
    "skeleton",
    28,
    (COLOR, WIDTH, LAYER, HIDDEN, OPACITY, PINS),
    anchors=None,
    wholes=(0, 500),
    width=2.2,
)
"""Lines between joints in place of bodies."""
