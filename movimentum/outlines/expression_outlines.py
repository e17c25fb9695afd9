"""Makes outlines from expressions of a parameter, which may have jumps and corners.

Functions with kinks (abs, ranges, floor, mod …) are found in the expression. Between two kinks each one is a single
smooth branch, so every piece is smooth and exact. Where the position jumps, a straight piece joins both ends; where the
direction does, a corner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, add, call, const, div, mul, neg, sub
from movimentum.expressions.tables import Ends, Table
from movimentum.outlines.contour import PLACE, Contour, derivative_by, numeric, smooth_contour, substitute_place
from movimentum.outlines.kinks import at_piece, cusps_of, kinks_of
from movimentum.tolerances import (
    BESIDE_AN_END,
    LEAST_DIVISOR,
    LINE_TURNS_BACK,
    OUTLINE_CLOSES,
    OUTLINE_CORNER,
)

TURN = 1.0
"""Of the parameter: what a corner or a straight piece between two ends takes."""


class UndefinedPlace(Exception):
    """The expression has no value at ``place``."""

    def __init__(self, place: float) -> None:
        super().__init__(place)
        self.place = place


def curve_of_expressions(x: Expr, y: Expr, first: float, last: float, *, closed: bool) -> Contour:
    """The curve of two expressions of `PLACE`. Errors: `UndefinedPlace` where one has no value, `TooManyPieces`."""
    bounds = [first, *kinks_of((x, y), first, last), last]

    def parted() -> list[tuple[Expr, Expr]]:
        return [(at_piece(x, m), at_piece(y, m)) for m in ((a + b) / 2.0 for a, b in pairwise(bounds))]

    own = parted()
    _check(own, bounds)
    # what touches a closed curve goes round the tip of a cusp; along an open one pins go through it
    pieces_of = zip(own, pairwise(bounds), strict=True) if closed else ()
    if cusps := [place for each, ends in pieces_of for place in cusps_of(each, *ends)]:
        bounds = sorted([*bounds, *cusps])
        own = parted()
    if len(own) == 1 and _is_smooth(own[0], first, last, closed=closed):
        return smooth_contour(own[0], first, last, closed=closed)
    pieces = [(position, a, b) for position, (a, b) in zip(own, pairwise(bounds), strict=True)]
    size = _size([_ends(*each) for each in pieces])
    moving = [each for each in pieces if not _is_point(*each, size)]
    return curve_of_pieces(moving or pieces, closed=closed)


Smooth: TypeAlias = "tuple[tuple[Expr, Expr], float, float]"
"""A smooth piece of a curve: its position by `PLACE`, from where to where."""


def curve_of_pieces(own: Sequence[Smooth], *, closed: bool) -> Contour:
    """A curve of smooth pieces: the position of each by `PLACE`, from where to where. What lies between the end of one
    and the beginning of the next is joined by a straight piece.
    """
    ends = [_ends(*each) for each in own]
    size = _size(ends)
    count = len(own)
    joints = [_joint(ends[k][1], ends[(k + 1) % count][0], size) for k in range(count if closed else count - 1)]
    pieces: list[CurvePiece] = []
    for k in range(count):
        pieces.append(CurvePiece(*own[k]))
        if k < len(joints) and joints[k] != "smooth":
            following = (k + 1) % count
            way = _turn_side(own[k], own[following])
            pieces += _connecting_pieces(ends[k][1], ends[following][0], jump=joints[k] == "jump", way=way)
    return chained_pieces(pieces, closed=closed)


def repeated_curve(own: Sequence[Smooth], count: int) -> Contour:
    """A closed curve about the origin that is ``count`` times the same: its smooth pieces, each turned on from the one
    before by a part of a whole turn. The pieces meet.
    """
    pieces: list[CurvePiece] = []
    turn = 360.0 / count
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    ends = [_ends(*each) for each in own]
    again = ends[0][0] @ np.array([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, c, s], [0, 0, -s, c]])
    for each, here, following in zip(own, ends, [*(end[0] for end in ends[1:]), again], strict=True):
        pieces += [CurvePiece(*each), *_connecting_pieces(here[1], following, jump=False)]
    one = chained_pieces(pieces, closed=False)
    number = call("floor", div(PLACE, const(one.last)))
    angle = mul(const(turn), number)
    inner = sub(PLACE, mul(const(one.last), number))
    x, y, tx, ty = (substitute_place(each, inner) for each in (*one.position, *one.direction))
    cosine, sine = call("cosd", angle), call("sind", angle)

    def turned(u: Expr, v: Expr) -> tuple[Expr, Expr]:
        return sub(mul(cosine, u), mul(sine, v)), add(mul(sine, u), mul(cosine, v))

    breaks = [*(k * one.last + each for k in range(count) for each in one.breaks[:-1]), count * one.last]
    return Contour(turned(x, y), turned(tx, ty), breaks, times=count, own=one.own)


def there_and_back_along(own: Sequence[Smooth], reach: float = 0.0) -> Contour:
    """The outline of a line of smooth pieces that meet, which has two sides."""
    back = [
        ((substitute_place(x, neg(PLACE)), substitute_place(y, neg(PLACE))), -end, -begin)
        for (x, y), begin, end in reversed(own)
    ]
    return curve_of_pieces([*own, *back], closed=True).changed(reach=reach, doubled=True)


def _size(ends: Sequence[FloatArray]) -> float:
    extents = [float(np.ptp(each[:, :2])) for each in ends]
    return max(LEAST_DIVISOR, *extents, *(abs(float(v)) for each in ends for v in each[:, :2].flat))


def _is_point(position: tuple[Expr, Expr], begin: float, end: float, size: float) -> bool:
    """Whether all of a piece is one point."""
    x, y = numeric(position)(np.linspace(begin, end, 9))
    return float(max(np.ptp(x), np.ptp(y))) <= OUTLINE_CLOSES * size


def _is_smooth(position: tuple[Expr, Expr], first: float, last: float, *, closed: bool) -> bool:
    """Whether it is one piece that, if it is closed, goes on beyond its end as from its beginning."""
    if not closed:
        return True
    ends = _ends(position, first, last)
    size = _size([ends])
    return _joint(ends[1], ends[0], size) == "smooth" and _repeats(position, first, last, size)


class CurvePiece:
    """A position by `PLACE` from ``begin`` to ``end``, with its direction, if that is not how it moves."""

    def __init__(
        self, position: tuple[Expr, Expr], begin: float, end: float, direction: tuple[Expr, Expr] | None = None
    ) -> None:
        self.position, self.begin, self.end = position, begin, end
        self.direction = direction or (derivative_by(position[0]), derivative_by(position[1]))


def chained_pieces(pieces: Sequence[CurvePiece], *, closed: bool) -> Contour:
    """Pieces one after the other, by a parameter that goes on from one to the next."""
    starts = [0.0]
    columns: list[list[Expr]] = [[], [], [], []]
    for piece in pieces:
        place = add(PLACE, const(piece.begin - starts[-1]))
        for column, root in zip(columns, (*piece.position, *piece.direction), strict=True):
            column.append(substitute_place(root, place))
        starts.append(starts[-1] + piece.end - piece.begin)
    own = list(zip(*columns, strict=True))
    x, y, tx, ty = (_chosen(column, starts[1:-1]) for column in columns)
    if closed:
        saw = Table(np.array([0.0, starts[-1]]), np.array([0.0, starts[-1]]), ends=Ends.PERIODIC)
        wrapped = call("table", PLACE, payload=saw)
        x, y, tx, ty = (substitute_place(each, wrapped) for each in (x, y, tx, ty))
    return Contour((x, y), (tx, ty), starts, closed=closed, own=own)


def _connecting_pieces(end: FloatArray, begin: FloatArray, *, jump: bool, way: float = 1.0) -> list[CurvePiece]:
    """What joins the end of a piece to the beginning of the next: corners, and a straight line between them. ``way``:
    the side to which a direction turns that turns back.
    """
    p, q = (const(float(end[0])), const(float(end[1]))), (const(float(begin[0])), const(float(begin[1])))
    before, after = (math.degrees(math.atan2(float(e[3]), float(e[2]))) for e in (end, begin))
    if not jump:
        return corner_piece(p, before, after, way)
    along = math.degrees(math.atan2(float(begin[1] - end[1]), float(begin[0] - end[0])))
    line = tuple(add(a, mul(PLACE, sub(b, a))) for a, b in zip(p, q, strict=True))
    return [*corner_piece(p, before, along), CurvePiece((line[0], line[1]), 0.0, TURN), *corner_piece(q, along, after)]


def corner_piece(at: tuple[Expr, Expr], before: float, after: float, way: float = 1.0) -> list[CurvePiece]:
    """The direction turns the shorter way round, at one point; nothing if it does not turn. ``way``: the side to which
    it turns back, where it does: the left (1), as round the end of a line, or the right (-1).
    """
    turn = math.remainder(after - before, 360.0)
    if abs(turn) <= math.degrees(OUTLINE_CORNER):
        return []
    turn = math.copysign(turn, way) if 180.0 - abs(turn) < LINE_TURNS_BACK else turn
    angle = add(const(before), mul(const(turn), PLACE))
    return [CurvePiece(at, 0.0, TURN, (call("cosd", angle), call("sind", angle)))]


def _chosen(roots: Sequence[Expr], breaks: Sequence[float]) -> Expr:
    """The one of ``roots`` whose piece `PLACE` is in; there is one break between each two."""
    if len(roots) == 1 or all(root == roots[0] for root in roots):
        return roots[0]
    half = len(roots) // 2
    below, above = _chosen(roots[:half], breaks[: half - 1]), _chosen(roots[half:], breaks[half:])
    return call("le", PLACE, const(breaks[half - 1]), below, above)


def _check(own: Sequence[tuple[Expr, Expr]], bounds: Sequence[float]) -> None:
    for position, begin, end in zip(own, bounds, bounds[1:], strict=False):
        places = np.linspace(begin, end, 129)
        x, y = numeric(position)(places)
        wrong = ~(np.isfinite(x) & np.isfinite(y))
        if wrong.any():
            raise UndefinedPlace(float(places[wrong][0]))


def _ends(position: tuple[Expr, Expr], begin: float, end: float) -> FloatArray:
    """(2, 4): where a piece begins and ends, and its direction there; if it stands still there, the limit."""
    rates = [derivative_by(each) for each in position]
    values = numeric([*position, *rates, *map(derivative_by, rates)])
    off = BESIDE_AN_END * (end - begin)
    exact = np.stack(values(np.array([begin, end])), axis=-1)
    beside = np.stack(values(np.array([begin + off, end - off])), axis=-1)
    speed = np.hypot(exact[:, 2], exact[:, 3])
    still = ~(speed > OUTLINE_CORNER * np.hypot(beside[:, 2], beside[:, 3]))
    # it begins to move as its second derivative says, and ends against it; unless that is 0 too
    limit = exact[:, 4:] * [[off], [-off]]
    told = np.hypot(*limit.T) > 0.5 * np.hypot(beside[:, 2], beside[:, 3])
    exact[still, 2:4] = np.where(told[:, None], limit, beside[:, 2:4])[still]
    return exact[:, :4]


def _turn_side(one: Smooth, other: Smooth) -> float:
    """To which side the direction turns from the end of a piece to the beginning of another one: the left (1), or the
    right (-1). It is seen beside them, for at a cusp the direction turns back.
    """
    (position, begin, end), (following, first, last) = one, other
    x, y = (
        float(each[0])
        for each in numeric([derivative_by(each) for each in position])(np.array([end - BESIDE_AN_END * (end - begin)]))
    )
    u, v = (
        float(each[0])
        for each in numeric([derivative_by(each) for each in following])(
            np.array([first + BESIDE_AN_END * (last - first)])
        )
    )
    turn = math.degrees(math.atan2(x * v - y * u, x * u + y * v))
    return -1.0 if turn < 0.0 and 180.0 - abs(turn) > LINE_TURNS_BACK else 1.0


def _joint(end: FloatArray, begin: FloatArray, size: float) -> str:
    """How a piece goes on as the next: by a "jump", a "corner", or neither ("smooth")."""
    if math.hypot(*(begin - end)[:2]) > OUTLINE_CLOSES * size:
        return "jump"
    turn = math.atan2(float(end[2] * begin[3] - end[3] * begin[2]), float(end[2] * begin[2] + end[3] * begin[3]))
    return "corner" if abs(turn) > OUTLINE_CORNER else "smooth"


def _repeats(position: tuple[Expr, Expr], first: float, last: float, size: float) -> bool:
    """Whether the expressions go on beyond the end as from the beginning."""
    span = last - first
    places = first + span * np.array([-0.73, -0.31, 0.0, 0.17, 0.29, 0.57, 0.83])
    values = numeric(position)
    here, there = np.stack(values(places)), np.stack(values(places + span))
    return bool((np.abs(here - there) <= OUTLINE_CLOSES * size).all())
