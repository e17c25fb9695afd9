"""Numbers shown in pictures: those in texts, and the arrows of vectors."""

from __future__ import annotations

from fractions import Fraction
from typing import TypeAlias

from movimentum.expressions import Expr
from movimentum.records import dataclass
from movimentum.source import Span


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


POLE = ("pole x", "pole y", "pole w")
"""Names of the homogeneous coordinates of a pole (x w, y w, w) among the properties of poses."""
CIRCLE = ("circle x", "circle y", "circle r")
"""The same for the centre and the radius of an inflection circle."""


FILM = -1
"""What has the number of a thing among the properties of poses, but is none: the film."""
CAMERA = ("camera x", "camera y", "camera rest", "camera zoom")
"""What the camera shows: the world point (x, y) and ``rest`` times the middle of the canvas is in the middle."""


def value_name(number: int, axis: int = 0) -> str:
    """The name of a component of value number ``number`` of a graph and the like among the properties of poses."""
    return f"value {number} {axis}"


def text_number(number: int) -> str:
    """The name of number ``number`` of a thing's text among the properties of poses."""
    return f"text {number}"


@dataclass(frozen=True, slots=True)
class CameraView:
    """What the camera shows from ``begin`` on: the point ``centre`` (nothing: the middle of the canvas) in the middle,
    everything ``zoom`` times as large. It goes there, eased, until ``until`` (None, or ``cut``: it is there at once).
    """

    begin: Fraction
    until: Fraction | None
    cut: bool
    centre: tuple[Expr, ...]
    zoom: Expr
    span: Span
