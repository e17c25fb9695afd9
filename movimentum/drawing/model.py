"""The display list: what is drawn, in paint order, apart from how it moves.

Every way to draw a film (Pillow's painter, SVG, the player of a page) draws this one list, so a thing looks the same
everywhere. Marks are in their bodies' local frames or attached to anchors, in world pixels, y up; where the bodies are
in a frame is in `solver.poses`, and `drawing.motion` combines the two.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from movimentum.drawing.figure_outlines import FigurePart, Point
from movimentum.drawing.slots import Slot
from movimentum.drawing.style import Color
from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.scene.shown import Piece
from movimentum.source import Span
from movimentum.things.kind import Own, ThingKind
from movimentum.things.kinds.graph import Axes


@dataclass(frozen=True, slots=True)
class Paint:
    """Whose visibility, opacity, colour and scale a mark has: those of thing number ``thing``. ``color`` (of an image:
    its tint) and ``opacity`` as the definition gives them; constraints may change them.

    ``about``: the local point about which a mark in its body's frame is scaled; ``zoom``: how many times as large it
    gets. ``slot``: of a mark that is in the list several times, when it is drawn here.
    """

    thing: int
    color: Color
    opacity: float = 1.0
    about: Point | None = None
    zoom: float = 1.0
    slot: Slot | None = None


@dataclass(frozen=True, slots=True)
class ImageMark:
    """The image file ``path``, its lower-left corner at the local origin; an image pixel is ``pixel`` world pixels.

    ``placed``: where a placed copy has it instead, in the local frame.
    """

    paint: Paint
    path: str
    pixel: float
    span: Span | None = None
    placed: Affine | None = None

    @property
    def body(self) -> int:
        """The thing that it moves with."""
        return self.paint.thing


@dataclass(frozen=True, slots=True)
class TextMark:
    """A line of text whose baseline begins at the local point ``start`` (has its middle or its end there, as ``align``
    says); the font is ``height`` high. ``pieces``: the parts of a text whose numbers change; then ``text`` is a sample.
    """

    paint: Paint
    text: str
    height: float
    start: Point
    span: Span | None = None
    align: str = "left"
    italic: bool = False
    pieces: tuple[Piece, ...] = ()

    @property
    def body(self) -> int:
        """The thing that it moves with."""
        return self.paint.thing


@dataclass(frozen=True, slots=True)
class PolylineMark:
    """A line through a body's local ``points`` with round caps and joins; with ``arrow``, a head at the last point."""

    paint: Paint
    points: tuple[Point, ...]
    width: float
    arrow: bool = False

    @property
    def body(self) -> int:
        """The thing that it moves with."""
        return self.paint.thing


@dataclass(frozen=True, slots=True)
class DiscMark:
    """A circle about a local point, filled, or with ``width`` its outline, centred on the circle."""

    paint: Paint
    centre: Point
    radius: float
    width: float | None

    @property
    def body(self) -> int:
        """The thing that it moves with."""
        return self.paint.thing


@dataclass(frozen=True, slots=True)
class FigureMark:
    """A body made of several ``parts``, back to front, in its local frame; faded as one. ``carried``: it moves with
    that thing; ``loose``: a canvas without a size does not become larger for it.
    """

    paint: Paint
    parts: tuple[FigurePart, ...]
    carried: int | None = None
    loose: bool = False

    @property
    def body(self) -> int:
        """The thing that it moves with."""
        return self.paint.thing if self.carried is None else self.carried


@dataclass(frozen=True, slots=True)
class Field:
    """The field of a graph: values ``low`` to ``high`` (x, y) in a rectangle of ``sides`` from the local point
    ``start``. If ``polar``, x is an angle in degrees and y a distance, both from the middle.
    """

    start: Point
    sides: Point
    low: Point
    high: Point
    polar: bool = False


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a label is: in a ``direction`` (of length 1) from its anchor, its letters ``distance`` world pixels away;
    if ``turning``, the direction turns with the anchor's body.
    """

    direction: Point
    distance: float
    turning: bool = False


@dataclass(frozen=True, slots=True)
class Along:
    """Letters along a curve: for each how far along the text its middle is, its breadth, and its outline about there;
    the text's ``width``, ``align`` (None: the middle on what is closed, else the beginning) and ``offset`` (along the
    curve, and away from it). ``curve``: what they stand along, where that is drawn anew in every frame.
    """

    letters: tuple[tuple[float, float, tuple[Point, ...]], ...]
    width: float
    align: str | None
    offset: Point
    curve: SymbolMark | None = None


@dataclass(frozen=True, slots=True)
class SymbolMark:
    """A mark at points of other things, drawn for their distances: a spring, a dimension, a support …

    ``own`` is what only things of its ``kind`` have. ``through``: (thing number, local point) each; it is drawn while
    all of them are visible. ``width``: of its lines; ``size``: of the symbol, or of its letters; ``ink`` of its lines
    where that is not the colour of its paint; ``fill`` of what is inside. ``text``: what is written at it, not its
    value. ``lengths``: the least and the greatest distance of its points in the whole film, where its parts depend on
    them. ``spot``: where a label was put; ``field``: that of a graph; ``number``: which of several values it shows;
    ``along``: the letters of a label that follows a symbol;
    ``room``: the rectangle of the world that is seen (left, bottom, right, top), of what points to its edge.
    """

    paint: Paint
    kind: ThingKind
    through: tuple[tuple[int, Point], ...]
    width: float
    size: float
    own: Own
    fill: Color
    dash: tuple[float, ...] = ()
    cap: str = "round"
    text: tuple[Piece, ...] | None = None
    italic: bool = False
    ink: Color | None = None
    lengths: tuple[float, float] = (0.0, 0.0)
    spot: Spot | None = None
    field: Field | None = None
    number: int = 0
    room: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    along: Along | None = None
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class LinkMark:
    """A line through points of other things, (thing number, local point) each; drawn while all of them are visible."""

    paint: Paint
    through: tuple[tuple[int, Point], ...]
    width: float


@dataclass(frozen=True, slots=True)
class NoteMark:
    """A text beside a body's local point, upright, on a halo of `style.PAPER`; with ``dot`` > 0 a dot of that radius at
    the point. ``offset`` is from the point to the start of the baseline (world pixels, y up).
    """

    body: int
    local: Point
    text: str
    color: Color
    offset: Point
    dot: float = 0.0


@dataclass(frozen=True, slots=True)
class FreeArrow:
    """An arrow from a body's local ``tail``: how that point moves in a free motion.

    ``velocity`` in the local frame; the fastest point of a motion moves by 1 and has an arrow of `style.LONGEST`. It is
    shown at times from ``begin`` to ``end``, both included, if it is at least `style.SHORTEST` long.
    """

    body: int
    tail: Point
    velocity: Point
    color: Color
    begin: float = -math.inf
    end: float = math.inf


@dataclass(frozen=True, slots=True)
class TraceMark:
    """The path of a body's local point, from the film's first frame to the present one.

    With ``tail``, only what was drawn in so much time, and fading. ``whole``: from the first frame on, all that it ever
    draws. ``paint``: of a trace that is a thing of the script. ``conditions``: how many of them must hold where the
    pen is down.
    """

    body: int
    local: Point
    color: Color
    width: float
    whole: bool = False
    tail: float | None = None
    paint: Paint | None = None
    dash: tuple[float, ...] = ()
    cap: str = "round"
    conditions: int = 0


@dataclass(frozen=True, slots=True)
class GraphMark:
    """A graph of the values of thing number ``paint.thing``, with its field's corner at the local point ``start``. Its
    lines, its letters and its dots take its place as soon as the whole film is known (`drawing.graphs`). ``colors``:
    those of the curves behind the first one (none: the usual ones).
    """

    paint: Paint
    axes: Axes
    start: Point
    curves: int
    width: float
    size: float
    ink: Color
    inside: Color
    span: Span | None = None
    colors: tuple[Color, ...] = ()


@dataclass(frozen=True, slots=True)
class PolodeMark:
    """The curve that the pole of ``bodies`` goes through, moving with the thing ``carried`` (None: at rest); a figure
    takes its place as soon as the whole film is known (`drawing.polodes`). ``anchor``: a point of the first body;
    ``size``: that of the scene as drawn.
    """

    paint: Paint
    bodies: tuple[int, ...]
    carried: int | None
    anchor: tuple[int, Point]
    width: float
    dash: tuple[float, ...]
    cap: str
    size: float


@dataclass(frozen=True, slots=True)
class InsetMark:
    """A part of the film once more, larger: what the values of thing number ``paint.thing`` say, in a rectangle of
    ``sides`` from the local point ``start``, upright, on ``fill``. ``leader``: lines lead there from what it shows.
    """

    paint: Paint
    start: Point
    sides: Point
    width: float
    fill: Color | None
    leader: bool = False

    @property
    def body(self) -> int:
        """The thing that it moves with."""
        return self.paint.thing


@dataclass(frozen=True, slots=True)
class FollowMark:
    """A label whose letters stand along ``curve``; a figure or a symbol takes its place (`rendering.following`)."""

    paint: Paint
    kind: ThingKind
    own: Own
    text: str
    size: float
    italic: bool
    align: str | None
    offset: Point
    curve: PolylineMark | DiscMark | FigureMark | SymbolMark | TraceMark


FilmMark: TypeAlias = GraphMark | PolodeMark | FollowMark
"""Marks that can be drawn only when the whole film is known."""

BodyMark: TypeAlias = ImageMark | TextMark | PolylineMark | DiscMark | FigureMark
"""Marks in a body's own frame."""

ThingMark: TypeAlias = ImageMark | TextMark | PolylineMark | DiscMark | LinkMark | FigureMark | SymbolMark | InsetMark
"""The marks of things of the scene."""

OverMark: TypeAlias = NoteMark | FreeArrow
"""Marks drawn over a picture on request."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """``paths`` (traces of the whole film), ``things`` from back to front, then ``traces``, then ``overlays``, on
    ``background``.

    The first ``under`` things lie under all others, whatever their layers. ``clips``: (thing number, the mark inside
    which that thing is shown). ``groups``: (thing number, the paint of the group that it is in). ``matte`` is the
    background colour even if the picture is transparent: what video, which has no transparency, shows.
    """

    things: tuple[ThingMark | FilmMark, ...]
    traces: tuple[TraceMark, ...]
    overlays: tuple[OverMark, ...]
    matte: Color
    transparent: bool = False
    paths: tuple[TraceMark, ...] = ()
    clips: tuple[tuple[int, ThingMark], ...] = ()
    groups: tuple[tuple[int, Paint], ...] = ()
    under: int = 0

    @property
    def background(self) -> Color | None:
        """The colour of the ground; None if it is transparent."""
        return None if self.transparent else self.matte
