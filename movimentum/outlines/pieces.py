"""Makes outlines from expressions of a parameter, which may have jumps and corners.

Functions with kinks (abs, ranges, floor, mod …) are found in the expression. Between two kinks each one is a single
smooth branch, so every piece is smooth and exact. Where the position jumps, a straight piece joins both ends; where the
direction does, a corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import ONE, ZERO, Expr, add, call, const, div, mul, neg, rebuild, sub, walk
from movimentum.expressions.tables import Ends, Table
from movimentum.outlines.contour import PLACE, Contour, numeric, put_in, slope, smooth
from movimentum.tolerances import (
    BESIDE_AN_END,
    KINK_AS_SAID,
    LEAST_DIVISOR,
    LINE_TURNS_BACK,
    OUTLINE_CLOSES,
    OUTLINE_CORNER,
    SHORTEST_PIECE,
)

SEARCHED = 4096
"""Where kinks are looked for: between so many places."""
MOST_PIECES = 2000
"""Of a curve by expressions: more are not told apart by the places between which they are looked for."""
TURN = 1.0
"""Of the parameter: what a corner or a straight piece between two ends takes."""


class Undefined(Exception):
    """The expression has no value at ``place``."""

    def __init__(self, place: float) -> None:
        super().__init__(place)
        self.place = place


class TooManyPieces(Exception):
    """An expression has ``count`` jumps and corners or more."""

    def __init__(self, count: int) -> None:
        super().__init__(count)
        self.count = count


def traced(x: Expr, y: Expr, first: float, last: float, *, closed: bool) -> Contour:
    """The curve of two expressions of `PLACE`. Errors: `Undefined` where one has no value, `TooManyPieces`."""
    kinks = _kinks((x, y), first, last)
    bounds = [first, *kinks, last]
    middles = [(a + b) / 2.0 for a, b in pairwise(bounds)]
    own = [(at_piece(x, m), at_piece(y, m)) for m in middles]
    _check(own, bounds)
    if len(own) == 1 and _is_smooth(own[0], first, last, closed=closed):
        return smooth(own[0], first, last, closed=closed)
    pieces = [(position, a, b) for position, (a, b) in zip(own, pairwise(bounds), strict=True)]
    size = _size([_ends(*each) for each in pieces])
    moving = [each for each in pieces if not _stands(*each, size)]
    return assembled(moving or pieces, closed=closed)


Smooth: TypeAlias = "tuple[tuple[Expr, Expr], float, float]"
"""A smooth piece of a curve: its position by `PLACE`, from where to where."""


def assembled(own: Sequence[Smooth], *, closed: bool) -> Contour:
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
            pieces += _joined(ends[k][1], ends[(k + 1) % count][0], jump=joints[k] == "jump")
    return chained(pieces, closed=closed)


def repeated(own: Sequence[Smooth], count: int) -> Contour:
    """A closed curve about the origin that is ``count`` times the same: its smooth pieces, each turned on from the one
    before by a part of a whole turn. The pieces meet.
    """
    pieces: list[CurvePiece] = []
    turn = 360.0 / count
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    ends = [_ends(*each) for each in own]
    again = ends[0][0] @ np.array([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, c, s], [0, 0, -s, c]])
    for each, here, following in zip(own, ends, [*(end[0] for end in ends[1:]), again], strict=True):
        pieces += [CurvePiece(*each), *_joined(here[1], following, jump=False)]
    one = chained(pieces, closed=False)
    number = call("floor", div(PLACE, const(one.last)))
    angle = mul(const(turn), number)
    inner = sub(PLACE, mul(const(one.last), number))
    x, y, tx, ty = (put_in(each, inner) for each in (*one.position, *one.direction))
    cosine, sine = call("cosd", angle), call("sind", angle)

    def turned(u: Expr, v: Expr) -> tuple[Expr, Expr]:
        return sub(mul(cosine, u), mul(sine, v)), add(mul(sine, u), mul(cosine, v))

    breaks = [*(k * one.last + each for k in range(count) for each in one.breaks[:-1]), count * one.last]
    return Contour(turned(x, y), turned(tx, ty), breaks, times=count, own=one.own)


def there_and_back_along(own: Sequence[Smooth], reach: float = 0.0) -> Contour:
    """The outline of a line of smooth pieces that meet, which has two sides."""
    back = [((put_in(x, neg(PLACE)), put_in(y, neg(PLACE))), -end, -begin) for (x, y), begin, end in reversed(own)]
    return assembled([*own, *back], closed=True).but(reach=reach, doubled=True)


def _size(ends: Sequence[FloatArray]) -> float:
    extents = [float(np.ptp(each[:, :2])) for each in ends]
    return max(LEAST_DIVISOR, *extents, *(abs(float(v)) for each in ends for v in each[:, :2].flat))


def _stands(position: tuple[Expr, Expr], begin: float, end: float, size: float) -> bool:
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
        self.direction = direction or (slope(position[0]), slope(position[1]))


def chained(pieces: Sequence[CurvePiece], *, closed: bool) -> Contour:
    """Pieces one after the other, by a parameter that goes on from one to the next."""
    starts = [0.0]
    columns: list[list[Expr]] = [[], [], [], []]
    for piece in pieces:
        place = add(PLACE, const(piece.begin - starts[-1]))
        for column, root in zip(columns, (*piece.position, *piece.direction), strict=True):
            column.append(put_in(root, place))
        starts.append(starts[-1] + piece.end - piece.begin)
    own = list(zip(*columns, strict=True))
    x, y, tx, ty = (_chosen(column, starts[1:-1]) for column in columns)
    if closed:
        saw = Table(np.array([0.0, starts[-1]]), np.array([0.0, starts[-1]]), ends=Ends.PERIODIC)
        wrapped = call("table", PLACE, payload=saw)
        x, y, tx, ty = (put_in(each, wrapped) for each in (x, y, tx, ty))
    return Contour((x, y), (tx, ty), starts, closed=closed, own=own)


def _joined(end: FloatArray, begin: FloatArray, *, jump: bool) -> list[CurvePiece]:
    """What joins the end of a piece to the beginning of the next: corners, and a straight line between them."""
    p, q = (const(float(end[0])), const(float(end[1]))), (const(float(begin[0])), const(float(begin[1])))
    before, after = (math.degrees(math.atan2(float(e[3]), float(e[2]))) for e in (end, begin))
    if not jump:
        return corner(p, before, after)
    along = math.degrees(math.atan2(float(begin[1] - end[1]), float(begin[0] - end[0])))
    line = tuple(add(a, mul(PLACE, sub(b, a))) for a, b in zip(p, q, strict=True))
    return [*corner(p, before, along), CurvePiece((line[0], line[1]), 0.0, TURN), *corner(q, along, after)]


def corner(at: tuple[Expr, Expr], before: float, after: float) -> list[CurvePiece]:
    """The direction turns the shorter way round, at one point; nothing if it does not turn."""
    turn = math.remainder(after - before, 360.0)
    if abs(turn) <= math.degrees(OUTLINE_CORNER):
        return []
    turn = abs(turn) if 180.0 - abs(turn) < LINE_TURNS_BACK else turn  # round the end of a line
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
            raise Undefined(float(places[wrong][0]))


def _ends(position: tuple[Expr, Expr], begin: float, end: float) -> FloatArray:
    """(2, 4): where a piece begins and ends, and its direction there; if it stands still there, that beside it."""
    values = numeric([*position, *map(slope, position)])
    off = BESIDE_AN_END * (end - begin)
    exact = np.stack(values(np.array([begin, end])), axis=-1)
    beside = np.stack(values(np.array([begin + off, end - off])), axis=-1)
    speed = np.hypot(exact[:, 2], exact[:, 3])
    still = ~(speed > OUTLINE_CORNER * np.hypot(beside[:, 2], beside[:, 3]))
    exact[still, 2:] = beside[still, 2:]
    return exact


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


# --- kinks


def _kinks(roots: Sequence[Expr], first: float, last: float) -> list[float]:
    """Where a function of ``roots`` goes from one of its pieces to another."""
    states = [state for node in walk(*roots) for state in _states(node)]
    if not states:
        return []
    values = numeric(states)

    def state(places: FloatArray) -> FloatArray:
        found = np.stack(values(places))
        return np.where(np.isfinite(found), np.floor(found), -np.inf)

    places = np.linspace(first, last, SEARCHED + 1)
    seen = state(places)
    inner: list[float] = []
    changes = np.nonzero((seen[:, 1:] != seen[:, :-1]).any(axis=0))[0].tolist()
    if len(changes) > MOST_PIECES:
        raise TooManyPieces(len(changes))
    for k in changes:
        inner += _between(state, float(places[k]), float(places[k + 1]))
    least = SHORTEST_PIECE * (last - first)
    found: list[float] = []
    for place in inner:
        if first + least < place < last - least and (not found or place - found[-1] > least):
            found.append(place)
    return found


def _between(state: Callable[[FloatArray], FloatArray], low: float, high: float) -> list[float]:
    """Where the state changes between two places; a value that is its own piece (at the kink) is passed over."""
    at = state(np.array([low, high]))
    begin = at[:, 0]
    for _ in range(100):
        middle = (low + high) / 2.0
        if not low < middle < high:
            break
        if (state(np.array([middle]))[:, 0] == begin).all():  # type: ignore[operator]
            low = middle
        else:
            high = middle
    near = round(high * 2.0**20) / 2.0**20  # a kink where the script says, if it is that close
    return [near if abs(near - high) <= KINK_AS_SAID * max(1.0, abs(high)) else high]


def _states(node: Expr) -> list[Expr]:
    """Expressions whose whole part changes where ``node`` goes from one of its pieces to another."""
    args = node.args
    if not any(PLACE in walk(arg) for arg in args):
        return []
    match node.op:
        case "abs":
            return [_sign(args[0])]
        case "min" | "max" | "le":
            return [_sign(sub(args[0], args[1]))]
        case "floor":
            return [args[0]]
        case "mod":
            return [Expr("div", args)]
        case "ease":
            return [_sign(args[0]), _sign(sub(args[0], ONE))]
        case "tand":
            return [Expr("div", (sub(args[0], const(90.0)), const(180.0)))]
        case "table" if isinstance(node.payload, Table) and not node.payload.smooth:
            table = node.payload
            rows = Table(table.x, np.arange(len(table.x), dtype=np.float64), ends=table.ends)
            return [call("table", args[0], payload=rows)]
        case _:
            return []


def _sign(value: Expr) -> Expr:
    """-1 below zero, else 0."""
    return call("le", ZERO, value, ZERO, const(-1.0))


def at_piece(root: Expr, place: float) -> Expr:
    """``root`` with each such function replaced by the piece that it is at ``place``."""
    nodes = list(walk(root))
    values = numeric(nodes)(np.array([place]))
    value = {node: float(each[0]) for node, each in zip(nodes, values, strict=True)}
    memo: dict[Expr, Expr] = {}
    for node in nodes:
        args = tuple(memo[arg] for arg in node.args)
        v = [value[arg] for arg in node.args]
        match node.op:
            case "abs":
                memo[node] = args[0] if v[0] >= 0.0 else neg(args[0])
            case "min" | "max":
                memo[node] = args[0] if (v[0] <= v[1]) == (node.op == "min") else args[1]
            case "le":
                memo[node] = args[2] if v[0] <= v[1] else args[3]
            case "floor":
                memo[node] = const(value[node])
            case "mod":
                memo[node] = sub(args[0], mul(const(math.floor(v[0] / v[1])), args[1]))
            case "ease":
                u = args[0]
                inside = mul(mul(u, u), sub(const(3.0), mul(const(2.0), u)))
                memo[node] = ZERO if v[0] <= 0.0 else ONE if v[0] >= 1.0 else inside
            case "table" if isinstance(node.payload, Table) and not node.payload.smooth and args[0].value is None:
                memo[node] = _line_of(node.payload, args[0], v[0])
            case _:
                memo[node] = rebuild(node, args)
    return memo[root]


def _line_of(table: Table, argument: Expr, at: float) -> Expr:
    """The straight line of a table that its value at ``at`` is on."""
    value, rate = float(table.at(at)), table.derived()
    change = 0.0 if rate is None else float(rate.at(at))
    return add(const(value), mul(const(change), sub(argument, const(at))))
