"""Bodies: links, discs, sectors, plates, polygons, curves, pictures, and what is made of several of these."""

from __future__ import annotations

from typing import TYPE_CHECKING

from movimentum.records import dataclass, replace
from movimentum.things.kind import Own, ThingKind
from movimentum.things.options import (
    ARCTO,
    AREA,
    CAP,
    CLIP,
    HIDDEN,
    JOINTS,
    LAYER,
    OFFSTAGE,
    OPACITY,
    STILL,
    THROUGH,
    OptionForm,
    OptionRule,
    flag,
)

if TYPE_CHECKING:
    from movimentum.outlines.contour import Contour


BAR = ThingKind(
    "bar",
    place=1,
    anchors=2,
    options=(*AREA, CAP, *JOINTS, THROUGH, ARCTO),
    width=7.0,
    broad=1.0,
    link=True,
    supported=True,
    filled=True,
    followed=True,
)
"""Through two or more anchors: a link."""


PLATE = ThingKind(
    "plate",
    place=5,
    anchors=2,
    options=(*AREA, *JOINTS, THROUGH),
    width=20.0,
    inside=True,
    broad=1.7,
    link=True,
    supported=True,
    filled=True,
    cuts=True,
    followed=True,
)
"""Everything within half its width of the convex hull of its anchors."""


POLYGON = ThingKind(
    "polygon",
    place=6,
    anchors=3,
    options=(*AREA, *JOINTS, THROUGH, ARCTO),
    width=1.6,
    inside=True,
    link=True,
    supported=True,
    filled=True,
    cuts=True,
    followed=True,
)
"""With its anchors as corners."""


@dataclass(frozen=True, slots=True)
class Round(Own):
    """``radius``: in world pixels."""

    radius: float = 5.0


DISC = ThingKind(
    "disc",
    place=3,
    arguments=(OptionRule("radius", OptionForm.POSITIVE, "a disc's radius"),),
    options=(*AREA, *JOINTS),
    own=Round,
    filled=True,
    plain=False,
    cuts=True,
    followed=True,
)
"""About its first anchor; with ``.width``, only its circle."""


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


@dataclass(frozen=True, slots=True)
class Curved(Own):
    """``outline``: where the curve runs, from its first anchor on, as it is drawn; None after an error."""

    outline: Contour | None = None


RANGE = OptionRule("range", OptionForm.NUMBERS, "the range of a curve's parameter", least=2, most=2)
"""The parameter of `.polar` and `.param`: from where to where."""

CURVE = ThingKind(
    "curve",
    place=25,
    options=(
        *AREA,
        CAP,
        *JOINTS,
        OptionRule("polar", OptionForm.FUNCTION, "a radius", least=2, most=2),
        OptionRule("param", OptionForm.FUNCTION, "a place", least=2, most=2),
        OptionRule("through", OptionForm.PLACES, "a point of a curve", least=2, most=100_000, field="places"),
        OptionRule("points", OptionForm.TEXT, field="table"),
        RANGE,
        flag("open"),
    ),
    own=Curved,
    width=1.6,
    inside=True,
    filled=True,
    plain=False,
    cuts=True,
    followed=True,
)
"""By its radius, by its coordinates, through points, or of a drawing; measured from its first anchor."""

SHAPES = ("polar", "param", "through", "points")
"""The options that say how it runs: one of them."""


CUT = replace(
    CURVE, word="cut", place=34, options=(*AREA, CAP, flag("in"), flag("outer")), anchors=0, wholes=(2, 2)
)  # fmt: skip
"""It has one anchor, that of the thing which is cut (`scene.cutting`)."""


@dataclass(frozen=True, slots=True)
class SpriteImage(Own):
    """``image``: the path as found from the script's folder; ``image_size``: (width, height) in image pixels, None if
    it could not be read. One image pixel is ``scale`` world pixels, and the image's lower-left corner is at the local
    origin. ``border``: its outline, measured from the first anchor, if it has one.
    """

    image: str
    image_size: tuple[int, int] | None = None
    scale: float = 1.0
    border: Contour | None = None


SPRITE = ThingKind(
    "sprite",
    place=0,
    called="a picture",
    anchors=0,
    options=(
        LAYER,
        OptionRule("outline", OptionForm.OUTLINE, "the outline of a picture", most=1000, field="border"),
        OptionRule("scale", OptionForm.POSITIVE, "the scale"),
        flag("topleft"),
        HIDDEN,
        OFFSTAGE,
        OPACITY,
        *JOINTS,
        CLIP,
        STILL,
    ),
    own=SpriteImage,
    ink=(255, 255, 255),
    plain=False,
)
"""From a file."""


@dataclass(frozen=True, slots=True)
class Composite(Own):
    """``pieces``: of each connected piece its outline and its holes, measured from the first anchor."""

    pieces: tuple[tuple[Contour, ...], ...] = ()


BODY = ThingKind(
    "body",
    place=36,
    options=(*AREA, *JOINTS),
    own=Composite,
    width=1.6,
    inside=True,
    supported=True,
    filled=True,
    plain=False,
    cuts=True,
    followed=True,
)
"""One rigid thing of several shapes, some of them cut out of the others."""
