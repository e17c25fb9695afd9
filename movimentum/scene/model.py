"""The product of the scene stage: things, anchors and constraints, names and kinds resolved.

Frame of reference: the world, in pixels, y up, origin at the canvas' lower-left corner. A thing's *local* frame is the
world frame of its definition ("as drawn"): an unmoved, unturned thing has its local coordinates for world coordinates.
Angles are in degrees, counter-clockwise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import TypeAlias

from movimentum.diagnostics import Diagnostic
from movimentum.expressions import Expr, const
from movimentum.records import dataclass, field
from movimentum.scene.expansion.placement import HERE, CopyFrame
from movimentum.scene.expansion.product import NamedConstant
from movimentum.scene.expansion.table_files import Tables
from movimentum.scene.relations import GapSide as GapSide
from movimentum.scene.relations import Relation as Relation
from movimentum.scene.shown import CameraView, Piece
from movimentum.scene.themes import Theme
from movimentum.source import SourceText, Span
from movimentum.syntax.tree import Purpose
from movimentum.syntax.tree import Toward as Toward
from movimentum.things.kind import Look, Own, ThingKind
from movimentum.things.kinds.disc import Round
from movimentum.things.kinds.sprite import SpriteImage
from movimentum.things.kinds.toothed import Toothed
from movimentum.things.kinds.vector import VECTOR

Elements = dict[tuple[str, str], tuple[float, float]]
"""(picture, id) -> the centre of that element of an SVG, in the drawing's pixels, y down."""

# --- what a symbol of an expression can stand for (payloads of Expr "symbol") ---------------------


@dataclass(frozen=True, slots=True)
class AnchorCoordinate:
    """World coordinate ``axis`` (0: x, 1: y) of anchor number ``anchor`` of thing number ``thing``."""

    thing: int
    anchor: int
    axis: int


@dataclass(frozen=True, slots=True)
class ThingAngle:
    """How far a thing is turned from how it was drawn: degrees, continuous over time."""

    thing: int


@dataclass(frozen=True, slots=True)
class ThingProperty:
    """``opacity`` (0 to 1), ``red``, ``green``, ``blue`` (0 to 255), ``visible`` (1 or 0), ``layer`` or ``scale``."""

    thing: int
    name: str


@dataclass(frozen=True, slots=True)
class VariableComponent:
    """A named variable: ``axis`` None for a scalar, 0 or 1 for a vector's x or y."""

    name: str
    axis: int | None


@dataclass(frozen=True, slots=True)
class Anonymous:
    """One ``_``: ``number`` counts them through the script; ``axis`` as for a variable."""

    number: int
    axis: int | None
    span: Span = field(compare=False)


def is_blank(node: Expr) -> bool:
    """Whether an expression is one ``_``."""
    return node.op == "symbol" and isinstance(node.payload, Anonymous)


@dataclass(frozen=True, slots=True)
class GearPair:
    """How many degrees thing ``second`` is turned beyond where it runs with thing ``first``: by their teeth, or by a
    ``belt`` (``crossed``: which turns them against each other). The timeline replaces it by an expression of angles.
    """

    first: int
    second: int
    belt: bool
    crossed: bool = False


# --- things ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Anchor:
    """A named point of a thing, ``local`` (x, y) in its local frame (world pixels, y up).

    ``stated``: the same as constant expressions, which know how the script states them (0.3 + 1.1 is 1.4).
    """

    name: str
    local: tuple[float, float]
    span: Span
    stated: tuple[Expr, Expr] | None = field(default=None, compare=False, repr=False)

    @property
    def coordinates(self) -> tuple[Expr, Expr]:
        """x and y as constant expressions."""
        return self.stated or (const(self.local[0]), const(self.local[1]))


@dataclass(frozen=True, slots=True)
class AnchorRef:
    """Anchor ``anchor`` of thing ``thing``, both by number."""

    thing: int
    anchor: int


@dataclass(frozen=True, slots=True)
class FixedPoint:
    """A point of the canvas (``anchor``, which has no name) at which thing number ``thing`` is drawn."""

    thing: int
    anchor: Anchor


PointRef: TypeAlias = AnchorRef | FixedPoint
"""A point at which a thing is drawn."""


@dataclass(frozen=True, slots=True)
class Thing:
    """A rigid body (or what is only drawn at other things' anchors: those in ``through``).

    ``own``: what only things of its ``kind`` have. ``text`` is a label's, or what is written at a dimension, an arc or
    a vector; where numbers in it change, ``pieces`` are its parts, and ``text`` is how it looks where all of them are
    0. ``about``: the things that it is about, by number; ``clip``: the thing inside which it is seen. ``values``: what
    a graph shows (first that over which it shows it), or the points whose velocities are shown. ``placement``: that of
    the copy which a thing belongs to (its anchors are placed already).
    """

    number: int
    name: str
    kind: ThingKind
    anchors: tuple[Anchor, ...]
    span: Span
    name_span: Span
    own: Own = field(default_factory=Own)
    look: Look = field(default_factory=Look)
    text: str | None = None
    pieces: tuple[Piece, ...] = ()
    through: tuple[PointRef, ...] = ()
    about: tuple[int, ...] = ()
    clip: int | None = None
    values: tuple[tuple[Expr, ...], ...] = ()
    placement: CopyFrame = HERE

    @property
    def is_body(self) -> bool:
        """Whether the thing has a pose of its own."""
        return self.kind.anchors is not None and (self.kind.points is None or bool(self.anchors))

    @property
    def called(self) -> str:
        """As messages speak of it: ``a line``, ``an arc``."""
        return f"{self.kind.article} {self.kind.word}"

    @property
    def hidden(self) -> bool:
        """Whether it is never drawn."""
        return self.look.hidden

    @property
    def layer(self) -> float:
        """Higher is nearer. Without a ``.layer`` it is the number of its definition; supports and guides are under
        everything.
        """
        if self.look.layer is not None:
            return self.look.layer
        return -1.0 if self.kind.under else float(self.number)

    @property
    def picture(self) -> SpriteImage | None:
        """The picture that a sprite shows."""
        return self.own if isinstance(self.own, SpriteImage) else None

    @property
    def toothed(self) -> Toothed:
        """The teeth of a gear or a rack; of nothing else."""
        assert isinstance(self.own, Toothed)
        return self.own

    @property
    def tooth_direction(self) -> float:
        """Where a tooth of a gear is centred: degrees about its first anchor, in its local frame (as drawn).

        It is the direction to its second anchor, or that of x. A ring has a tooth there, too, which points inwards. Of
        a rack: the direction in which it runs, from its first anchor (where a tooth is centred) to its second; its
        teeth are on the left.
        """
        if len(self.anchors) < 2:
            return 0.0
        (x, y), (u, v) = self.anchors[0].local, self.anchors[1].local
        return math.degrees(math.atan2(v - y, u - x)) if (x, y) != (u, v) else 0.0

    @property
    def radius(self) -> float | None:
        """A disc's radius, in world pixels."""
        return self.own.radius if isinstance(self.own, Round) else None

    def undriven(self, name: str) -> float:
        """The value of a property (see `ThingProperty`) if nothing states it."""
        if name == "opacity":
            return self.look.opacity
        if name == "layer":
            return self.layer
        if name in ("visible", "scale"):
            return 1.0
        return float(self.look.paint[("red", "green", "blue").index(name)])


# --- constraints ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Constraint:
    """``left RELATION right``, componentwise: one expression each for a scalar, two for a vector.

    ``key`` is the canonical text of the left-hand side (meaning, not white space); together with the relation it is
    what a later step can restate or end. ``anchor`` is set where the left-hand side is just one anchor. ``.t`` is
    already lowered to a clock, ``.iv`` to a ``lifetime`` leaf with this constraint's number. ``strict`` distinguishes
    ``<`` from ``<=``. ``speed``: how fast a wish may be followed, in its own units per time unit. ``paired``: about
    gears or a belt, whose leaves the timeline has replaced. ``touches``: it is an equation whose places of contact are
    followed. ``pushes``: an inequality that moves what is free, and does not only select; ``gaps``: the pairs, if
    it is about the gap of these. ``toward`` and ``weakness``: where a wish draws, and how far it is below others (0: it
    is like any other; 1 and more: `.weak`). ``pin``: the place of a point that it puts onto a curve with corners or
    cusps. ``gap_side``: 1 if its left side is a gap, -1 if its right.
    """

    number: int
    step: int
    relation: Relation
    key: str
    left: tuple[Expr, ...]
    right: tuple[Expr, ...]
    span: Span
    left_span: Span
    anchor: AnchorRef | None = None
    strict: bool = False
    speed: float | None = None
    paired: bool = False
    touches: bool = False
    pushes: bool = False
    gaps: tuple[tuple[GapSide, GapSide], ...] = ()
    toward: Toward = Toward.VALUE
    weakness: int = 0
    pin: Expr | None = None
    gap_side: int = 0


@dataclass(frozen=True, slots=True)
class Claim:
    """An expected result, ``left RELATION right`` to within ``tolerance``; it has no influence on the motion. Or what a
    fit is to bring about: a goal with its ``weight``, or a requirement; these may have ``reduction`` nodes. Laid out as
    `Constraint` (``number`` counts claims only; the relation is never a wish); what a bare ``_`` leaves open is left
    out; what is to be largest or smallest has 0 on its right. ``tolerance`` None: a default by the scene's size.
    ``side_texts``: the text of each side. ``always``: to be proved. ``of_gaps``: it is about outlines.
    """

    number: int
    step: int
    relation: Relation
    key: str
    left: tuple[Expr, ...]
    right: tuple[Expr, ...]
    span: Span
    side_texts: tuple[str, str]
    strict: bool = False
    tolerance: Fraction | None = None
    purpose: Purpose = Purpose.CLAIM
    weight: float = 1.0
    always: bool = False
    of_gaps: bool = False


@dataclass(frozen=True, slots=True)
class Ending:
    """``lhs = _;`` (or ``<``, ``>``, ``~``): ends what was stated (claimed, for a ``purpose``) under the key."""

    step: int
    relation: Relation
    key: str
    span: Span
    purpose: Purpose | None = None


@dataclass(frozen=True, slots=True)
class Step:
    """``@t`` with its statements and its claims, in the order written; ``aims`` are goals and requirements."""

    number: int
    time: Fraction
    span: Span
    statements: tuple[Constraint | Ending, ...]
    claims: tuple[Claim | Ending, ...] = ()
    aims: tuple[Claim | Ending, ...] = ()


@dataclass(frozen=True, slots=True)
class Config:
    """``.config(fps, width, height)`` and its options; ``size`` None: fit what is drawn."""

    fps: Fraction
    size: tuple[int, int] | None = None
    background: tuple[int, int, int] | None = None
    span: Span | None = None
    style: Theme | None = None

    @property
    def theme(self) -> str | None:
        """The name of its theme, or the file that states it."""
        return None if self.style is None else self.style.name


@dataclass(frozen=True, slots=True)
class Scene:
    """A whole script, understood. ``variables`` are by name, in the order of their first uses."""

    source: SourceText
    config: Config
    things: tuple[Thing, ...]
    variables: dict[str, Variable]
    steps: tuple[Step, ...]
    diagnostics: tuple[Diagnostic, ...] = ()
    mentioned: dict[int, int] = field(default_factory=dict[int, int])
    """thing number -> number of the first step that mentions it (absent: no step does)."""
    constants: tuple[NamedConstant, ...] = ()
    settings: tuple[tuple[str, str | Expr], ...] = ()  # constants that were set from outside: (name, expression)
    loop: Span | None = None  # where the script says that the film begins again at its end (``.loop;``)
    joints: Mapping[int, frozenset[int]] = field(default_factory=dict[int, "frozenset[int]"])
    """Thing number -> the numbers of its anchors that equations join to others, or that are fixed."""
    skeletons: tuple[int, ...] = ()  # things that show others as a kinematic diagram
    grounds: tuple[AnchorRef, ...] = ()  # fixed anchors drawn with a support although the script does not say so
    elements: Elements = field(default_factory=Elements)  # of drawings, that anchors are named after
    tables: Tables = field(default_factory=Tables)
    """The tables that it reads of files."""
    views: tuple[CameraView, ...] = ()  # what the camera shows, by time
    changing: frozenset[tuple[int, str]] = frozenset()  # properties that statements mention: thing number and name
    profiles: Mapping[str, object] = field(default_factory=dict[str, object])  # of what is cut, see `scene.cutting`

    def drawing_order(self) -> tuple[int, ...]:
        """Thing numbers from back to front: by layer, then by order of definition. Those of a group lie together."""
        gathered, things = self.gathered, self.things

        def place(thing: Thing) -> tuple[float, int, float, int]:
            whole = things[gathered.get(thing.number, thing.number)]
            return whole.layer, whole.number, thing.layer, thing.number

        return tuple(thing.number for thing in sorted(things, key=place))

    @property
    def gathered(self) -> dict[int, int]:
        """The number of a thing -> that of the first group that it is in."""
        groups = [thing for thing in self.things if thing.kind.gathers]
        return {number: group.number for group in reversed(groups) for number in group.about}

    def changes(self, name: str) -> bool:
        """Whether a statement mentions a property of that name."""
        return any(each == name for _, each in self.changing)

    def local(self, ref: PointRef) -> tuple[float, float]:
        """Where a point is in the local frame of its thing."""
        return ref.anchor.local if isinstance(ref, FixedPoint) else self.things[ref.thing].anchors[ref.anchor].local

    @property
    def shows_numbers(self) -> bool:
        """Whether its pictures show anything but where things are: numbers in texts, velocities."""
        live = (thing.pieces or thing.values or thing.about or thing.kind is VECTOR for thing in self.things)
        return bool(self.views) or any(live)

    def constraints(self) -> tuple[Constraint, ...]:
        """All constraints."""
        return tuple(item for step in self.steps for item in step.statements if isinstance(item, Constraint))


@dataclass(frozen=True, slots=True)
class Variable:
    """A named variable and where it is first used."""

    name: str
    is_vector: bool
    span: Span
