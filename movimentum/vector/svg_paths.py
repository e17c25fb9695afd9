"""The shapes of an SVG as absolute lines and Bézier curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree import ElementTree

from movimentum.geometry import Affine
from movimentum.rendering.drawings import length_of
from movimentum.rendering.path_data import PathFault, PathPiece, numbers_of, path_pieces
from movimentum.vector.numbers import joined

Element = ElementTree.Element

ROUND = 4.0 / 3.0 * (math.sqrt(2.0) - 1.0)
"""Of its radius: the handles of a quarter of a circle."""


def outline_of(element: Element, tag: str) -> list[PathPiece] | None:
    """The outline of a shape in its own coordinates; None if it is not understood. What is not drawn is empty."""
    try:
        return _outline(element, tag)
    except PathFault:
        return None


def _outline(element: Element, tag: str) -> list[PathPiece] | None:
    def value(name: str, default: float = 0.0) -> float:
        text = element.get(name)
        return default if text is None or text.strip() == "auto" else length_of(text)

    lengths = ("x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "rx", "ry", "width", "height")
    if any(not math.isfinite(value(name)) for name in lengths):
        return None
    match tag:
        case "path":
            return list(path_pieces(element.get("d", "")))
        case "line":
            return [
                PathPiece("M", (complex(value("x1"), value("y1")),)),
                PathPiece("L", (complex(value("x2"), value("y2")),)),
            ]
        case "polyline" | "polygon":
            numbers = numbers_of(element.get("points", ""))
            pairs = [complex(*pair) for pair in zip(numbers[::2], numbers[1::2], strict=False)]
            found = [PathPiece("L" if k else "M", (point,)) for k, point in enumerate(pairs)]
            return [*found, PathPiece("Z")] if tag == "polygon" and found else found
        case "circle":
            r = value("r")
            return _ellipse(complex(value("cx"), value("cy")), r, r)
        case "ellipse":
            rx, ry = value("rx", math.nan), value("ry", math.nan)
            rx, ry = (ry if math.isnan(rx) else rx), (rx if math.isnan(ry) else ry)
            return _ellipse(complex(value("cx"), value("cy")), rx, ry)
        case "rect":
            rx, ry = value("rx", math.nan), value("ry", math.nan)
            rx, ry = (ry if math.isnan(rx) else rx), (rx if math.isnan(ry) else ry)
            return _rectangle(value("x"), value("y"), value("width"), value("height"), rx, ry)
        case _:
            return None


def _ellipse(c: complex, rx: float, ry: float) -> list[PathPiece]:
    return _rectangle(c.real - rx, c.imag - ry, 2.0 * rx, 2.0 * ry, rx, ry) if rx > 0.0 and ry > 0.0 else []


def _rectangle(x: float, y: float, w: float, h: float, rx: float, ry: float) -> list[PathPiece]:
    if not (w > 0.0 and h > 0.0):
        return []
    rx, ry = min(max(rx, 0.0), w / 2.0), min(max(ry, 0.0), h / 2.0)
    if not (rx > 0.0 and ry > 0.0):
        corners = [complex(x, y), complex(x + w, y), complex(x + w, y + h), complex(x, y + h)]
        return [*(PathPiece("L" if k else "M", (corner,)) for k, corner in enumerate(corners)), PathPiece("Z")]
    found = [PathPiece("M", (complex(x + rx, y),))]
    corners = [complex(x + w, y), complex(x + w, y + h), complex(x, y + h), complex(x, y)]
    for corner, way in zip(corners, (1 + 0j, 1j, -1 + 0j, -1j), strict=True):
        turn = way * 1j
        before = corner - complex(way.real * rx, way.imag * ry)
        after = corner + complex(turn.real * rx, turn.imag * ry)
        found += [
            PathPiece("L", (before,)),
            PathPiece("C", (before + ROUND * (corner - before), after + ROUND * (corner - after), after)),
        ]
    return [*found, PathPiece("Z")]


def moved(outline: Sequence[PathPiece], place: Affine) -> list[PathPiece]:
    """An outline under a map."""
    return [
        PathPiece(each.command, tuple(complex(*place.apply(point.real, point.imag)) for point in each.points))
        for each in outline
    ]


def reach(outline: Sequence[PathPiece]) -> tuple[float, float, float, float]:
    """(left, top, right, bottom) around an outline and its handles."""
    points = [point for each in outline for point in each.points]
    xs, ys = [point.real for point in points], [point.imag for point in points]
    return min(xs), min(ys), max(xs), max(ys)


def box(outline: Sequence[PathPiece]) -> tuple[float, float, float, float]:
    """(left, top, right, bottom) of an outline itself, to a thousandth of its curves."""
    points: list[complex] = []
    for each in outline:
        if each.command == "C":
            a, (b, c, d) = points[-1], each.points
            shares = (k / 32.0 for k in range(1, 32))
            points += [(1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t * t * (1 - t) * c + t**3 * d for t in shares]
        points += each.points[-1:]
    xs, ys = [point.real for point in points], [point.imag for point in points]
    return min(xs), min(ys), max(xs), max(ys)


def written(outline: Sequence[PathPiece], decimals: int) -> str:
    """An outline as the ``d`` of a path: absolute, each command with its letter."""
    return "".join(
        each.command
        + joined(*(value for point in each.points for value in (point.real, point.imag)), decimals=decimals)
        for each in outline
    )
