"""The outlines of shapes with arcs and teeth: sectors, polygons and links with arcs, gears, racks, Bézier curves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise

from movimentum.expressions import ONE, Expr, add, call, const, mul, sub
from movimentum.geometry import Point, arc_between
from movimentum.outlines.contour import PLACE, Contour, smooth_contour
from movimentum.outlines.expression_outlines import Smooth, curve_of_pieces, repeated_curve, there_and_back_along
from movimentum.outlines.lines import polygon, there_and_back


@lru_cache(maxsize=64)
def circle_outline(radius: float, *, hollow: bool = False) -> Contour:
    """A circle about the origin, by its angle."""
    found = smooth_contour(_arc((0.0, 0.0), radius), 0.0, 360.0, closed=True)
    return found.changed(hollow=True) if hollow else found


def _arc(centre: Point, radius: float) -> tuple[Expr, Expr]:
    x, y = (mul(const(radius), call(op, PLACE)) for op in ("cosd", "sind"))
    return add(const(centre[0]), x), add(const(centre[1]), y)


def _line(p: Point, q: Point) -> Smooth:
    x, y = (add(const(a), mul(PLACE, const(b - a))) for a, b in zip(p, q, strict=True))
    return (x, y), 0.0, 1.0


def _edge(p: Point, through: Point | None, q: Point) -> Smooth:
    """A straight edge, or the arc from p through a point to q."""
    if through is None:
        return _line(p, q)
    arc = arc_between(p, through, q)
    if arc is None:
        return _line(p, q)
    centre, begin, turn = arc
    x, y = _arc(centre, math.dist(centre, p))
    if turn > 0.0:
        return (x, y), begin, begin + turn
    # the other way round: by the negative angle
    back = mul(const(-1.0), PLACE)
    x, y = (
        add(const(centre[k]), mul(const(math.dist(centre, p)), call(op, back))) for k, op in enumerate(("cosd", "sind"))
    )
    return (x, y), -begin, -begin - turn


@lru_cache(maxsize=256)
def polygon_with_arcs(
    corners: tuple[Point, ...], arcs: tuple[Point | None, ...], reach: float, *, closed: bool
) -> Contour:
    """A polygon, or a line there and back, whose edges may be arcs: the edge to each corner goes through that of
    ``arcs``, if there is one.
    """
    if not any(arcs):
        return polygon(corners, reach) if closed else there_and_back(corners, reach)
    ways = [*pairwise(corners), *([(corners[-1], corners[0])] if closed else [])]
    bends = [*arcs[1:], *([arcs[0]] if closed else [])]
    edges = [_edge(p, bend, q) for (p, q), bend in zip(ways, bends, strict=True)]
    return curve_of_pieces(edges, closed=True).changed(reach=reach) if closed else there_and_back_along(edges, reach)


@lru_cache(maxsize=256)
def sector_outline(radius: float, begin: float, turn: float) -> Contour:
    """A sector of a disc about the origin, counter-clockwise by ``turn`` (less than 360) degrees."""
    ends = [(radius * math.cos(math.radians(a)), radius * math.sin(math.radians(a))) for a in (begin, begin + turn)]
    arc = _arc((0.0, 0.0), radius), begin, begin + turn
    return curve_of_pieces([_line((0.0, 0.0), ends[0]), arc, _line(ends[1], (0.0, 0.0))], closed=True)


@lru_cache(maxsize=256)
def bezier_outline(points: tuple[Point, ...], reach: float) -> Contour:
    """A line there and back along Bézier's cubic curves (through every third point), or one of lower degree."""
    own: list[Smooth] = []
    for some in [points] if len(points) < 4 else [points[k : k + 4] for k in range(0, len(points) - 1, 3)]:
        column: Sequence[tuple[Expr, Expr]] = [(const(x), const(y)) for x, y in some]
        while len(column) > 1:
            column = [
                tuple(add(mul(sub(ONE, PLACE), a), mul(PLACE, b)) for a, b in zip(p, q, strict=True))  # type: ignore[misc]
                for p, q in pairwise(column)
            ]
        own.append((column[0], 0.0, 1.0))
    return there_and_back_along(own, reach)


# --- teeth


@lru_cache(maxsize=64)
def gear_outline(
    teeth: int, module: float, pressure: float, addendum: float, dedendum: float, direction: float
) -> Contour:
    """Involute teeth about the origin, one of them in a direction (degrees); ``pressure``: their angle; heights in
    modules. Below the base circle flanks are radial.
    """
    radius, pitch = module * teeth / 2.0, 180.0 / teeth
    base = radius * math.cos(math.radians(pressure))
    root = max(radius - dedendum * module, 0.1 * module)
    own = pitch / 2.0 + _involute(math.tan(math.radians(pressure)))  # half a tooth at the base circle, in degrees

    def half(r: float) -> float:
        return own - _involute(math.sqrt(max((r / base) ** 2 - 1.0, 0.0)))

    tip = tip_radius(half, radius, radius + addendum * module)
    low, high = (math.sqrt(max((r / base) ** 2 - 1.0, 0.0)) for r in (root, tip))
    begin = direction - half(root)
    pieces: list[Smooth] = []
    if root < base:
        pieces.append(_line(_polar(root, begin), _polar(base, begin)))
    pieces.append(_flank(base, direction - own, low, high))
    if half(tip) > 0.0:
        pieces.append((_arc((0.0, 0.0), tip), direction - half(tip), direction + half(tip)))
    pieces.append(_flank(base, -direction - own, low, high, back=True))
    if root < base:
        end = direction + half(root)
        pieces.append(_line(_polar(base, end), _polar(root, end)))
    pieces.append((_arc((0.0, 0.0), root), direction + half(root), 2.0 * pitch + begin))
    return repeated_curve(pieces, teeth)


def _involute(turn: float) -> float:
    """By how many degrees an involute goes round where its string has turned through the tangent ``turn``."""
    return math.degrees(turn - math.atan(turn))


def _polar(radius: float, angle: float) -> Point:
    return radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle))


def _flank(base: float, direction: float, low: float, high: float, *, back: bool = False) -> Smooth:
    """The involute of a circle from where its string has turned through ``low`` (radians) to ``high``; or ``back``, its
    mirror image in the axis of x.
    """
    turn = mul(const(-1.0), PLACE) if back else PLACE
    angle = add(const(direction), mul(const(math.degrees(1.0)), turn))
    c, s = call("cosd", angle), call("sind", angle)
    x = mul(const(base), add(c, mul(turn, s)))
    y = mul(const(base), sub(s, mul(turn, c)))
    return ((x, mul(const(-1.0), y)), -high, -low) if back else ((x, y), low, high)


def tip_radius(half: Callable[[float], float], low: float, high: float) -> float:
    """The radius of the tip: where a tooth would be pointed if that is below ``high``."""
    if half(high) >= 0.0:
        return high
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if half(middle) >= 0.0 else (low, middle)
    return low
