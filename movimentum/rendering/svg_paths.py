"""Paths of SVG elements as cubic Bézier curves."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from itertools import pairwise

from movimentum.diagnostics import Diagnostic
from movimentum.errors import ScriptError
from movimentum.rendering.drawings import drawing, element_of, fault, number_of, placed, tag_of
from movimentum.rendering.path_data import PathFault, path_pieces

Point = tuple[float, float]
Cubic = tuple[Point, Point, Point, Point]
MOST_TURN = math.pi / 16.0
"""Radians that a curve turns at most: an arc of so much is within 1e-9 of its radius."""


def path_of(file: str, name: str) -> tuple[list[Cubic], bool, float] | Diagnostic:
    """The pieces of an element's path in the drawing's pixels, y down; whether it is closed; and the drawing's height
    in pixels. Or what is wrong.
    """
    try:
        made = drawing(file)
        element = element_of(made, name)
        place = placed(made, element)
        if place is None:
            message = f"the place of `#{name}` in `{file}` depends on styles, or on an element that is used elsewhere"
            raise fault("asset/element", message, "give its path no transformation by style")
        pieces, closed = _pieces(file, name, element)
        moved = [tuple(place(*point) for point in piece) for piece in pieces]
        return [(a, b, c, d) for a, b, c, d in moved], closed, float(made.pixels[1])
    except ScriptError as error:
        return error.diagnostics[0]


def _pieces(file: str, name: str, element: ET.Element) -> tuple[list[Cubic], bool]:
    def value(word: str) -> float:
        return number_of(element, word)

    match tag_of(element):
        case "path":
            return _parsed(file, name, element.get("d") or "")
        case "circle" | "ellipse" as tag:
            rx, ry = (value("r"), value("r")) if tag == "circle" else (value("rx"), value("ry"))
            return _ellipse((value("cx"), value("cy")), rx, ry), True
        case "polygon" | "polyline" | "line" | "rect" as tag:
            points = _corners(tag, element, value)
            closed = tag in ("polygon", "rect")
            return [_straight(p, q) for p, q in pairwise([*points, points[0]] if closed else points) if p != q], closed
        case tag:
            raise fault("asset/element", f"`#{name}` of `{file}` is a `<{tag}>`, which is no path", "name a `<path>`")


def _corners(tag: str, element: ET.Element, value: Callable[[str], float]) -> list[Point]:
    if tag == "line":
        return [(value("x1"), value("y1")), (value("x2"), value("y2"))]
    if tag == "rect":
        x, y, w, h = (value(word) for word in ("x", "y", "width", "height"))
        return [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
    numbers = [
        float(each) for each in re.findall(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", element.get("points") or "")
    ]
    return list(zip(numbers[::2], numbers[1::2], strict=False)) or [(0.0, 0.0)]


def _straight(p: Point, q: Point) -> Cubic:
    third = (q[0] - p[0]) / 3.0, (q[1] - p[1]) / 3.0
    return p, (p[0] + third[0], p[1] + third[1]), (q[0] - third[0], q[1] - third[1]), q


def _parsed(file: str, name: str, text: str) -> tuple[list[Cubic], bool]:
    """The pieces of the first subpath of a ``d``."""
    found: list[Cubic] = []
    here, start = (0.0, 0.0), (0.0, 0.0)
    try:
        for piece in path_pieces(text, MOST_TURN):
            points = [(each.real, each.imag) for each in piece.points]
            if piece.command == "M":
                if found:
                    break  # another subpath
                here = start = points[0]
                continue
            if piece.command == "C":
                found.append((here, points[0], points[1], points[2]))
            end = points[-1] if points else start
            if piece.command != "C" and end != here:
                found.append(_straight(here, end))
            here = end
            if piece.command == "Z":
                return found, True
    except PathFault:
        message = f"the path of `#{name}` in `{file}` cannot be read"
        raise fault("asset/element", message, "save the drawing anew") from None
    return found, bool(found) and found[0][0] == here


def _ellipse(centre: Point, rx: float, ry: float) -> list[Cubic]:
    """A whole ellipse in curves of `MOST_TURN`."""
    count = max(1, math.ceil(2.0 * math.pi / MOST_TURN))
    step = 2.0 * math.pi / count
    reach = 4.0 / 3.0 * math.tan(step / 4.0)

    def at(x: float, y: float) -> Point:
        return centre[0] + rx * x, centre[1] + ry * y

    found: list[Cubic] = []
    for k in range(count):
        a, b = k * step, (k + 1) * step
        (ca, sa), (cb, sb) = (math.cos(a), math.sin(a)), (math.cos(b), math.sin(b))
        found.append(
            (at(ca, sa), at(ca - reach * sa, sa + reach * ca), at(cb + reach * sb, sb - reach * cb), at(cb, sb))
        )
    return found
