"""How a thing looks, apart from what it is: the options of its definition that no equation knows."""

from __future__ import annotations

from typing import TypeAlias

from movimentum.expressions import Expr
from movimentum.records import dataclass
from movimentum.source import Span

Color: TypeAlias = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

Elements: TypeAlias = dict[tuple[str, str], tuple[float, float]]
"""(picture, id) -> the centre of that element of an SVG, in the drawing's pixels, y down."""

PIN_RADIUS = 4.0
"""World pixels: of the circle at a joint."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A number in a text: the value of ``value``, written as Python's format ``spec`` says."""

    value: Expr
    spec: str
    span: Span


Piece: TypeAlias = str | Shown
"""A part of a text: letters, or a number that changes."""


def formatted(value: float, spec: str) -> str:
    """A number as Python's format ``spec`` writes it; formats for whole numbers round it."""
    return format(round(value), spec) if spec[-1:] in _WHOLE else format(value, spec)


_WHOLE = frozenset("bcdoxX")
"""Types of formats that Python has for whole numbers only."""

ARROW = ("arrow x", "arrow y")
"""Names of the components of a vector's arrow (world pixels) among the properties of poses."""


def text_number(number: int) -> str:
    """The name of number ``number`` of a thing's text among the properties of poses."""
    return f"text {number}"


@dataclass(frozen=True, slots=True)
class Look:
    """Options that all kinds share; lengths in world pixels, None where the kind decides.

    ``fill`` and ``edge`` (``edge_width`` wide): of what is filled; a bar with an edge is an outlined link. ``pins``:
    the radius of circles at joints, of the colour ``ink`` with ``pin_fill`` inside. ``drawn``: the anchors (by number)
    that it is drawn through. ``size``: the height of letters, or the breadth of a symbol.
    """

    fill: Color | None = None
    edge: Color | None = None
    edge_width: float | None = None
    dash: tuple[float, ...] = ()
    cap: str = "round"
    opacity: float = 1.0
    pins: float | None = None
    pin_fill: Color = (255, 255, 255)
    drawn: tuple[int, ...] | None = None
    fixed: bool = False
    size: float | None = None
    align: str = "left"
    italic: bool = False
    ink: Color | None = None


@dataclass(frozen=True, slots=True)
class Figure:
    """Options of one kind of follower each: lengths in world pixels, times in time units.

    ``whole``: a trace from the first frame on, or an arc of up to a whole turn. ``tail``: how long a trace lasts.
    ``velocity``, ``acceleration``: pixels of the arrow for a pixel a time unit (squared).
    """

    coils: int = 8
    whole: bool = False
    tail: float | None = None
    places: int = 0
    offset: float = 24.0
    radius: float = 28.0
    velocity: float | None = None
    acceleration: float | None = None
