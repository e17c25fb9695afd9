"""Where expressions of a curve's parameter have kinks and jumps, what each is between two of them, and where a curve
stands still.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import ONE, ZERO, Expr, add, call, const, mul, neg, rebuild, sub, walk
from movimentum.expressions.tables import Table
from movimentum.outlines.contour import PLACE, derivative_by, numeric
from movimentum.tolerances import CUSP_SLOW, CUSP_STANDS, KINK_AS_SAID, SHORTEST_PIECE

KINK_SEARCH_PLACES = 4096
"""Where kinks are looked for: between so many places."""
MOST_PIECES = 2000
"""Of a curve by expressions: more are not told apart by the places between which they are looked for."""
CUSP_SEARCH_PLACES = 512
"""Where cusps are looked for, of each smooth piece."""


class TooManyPieces(Exception):
    """An expression has ``count`` jumps and corners or more."""

    def __init__(self, count: int) -> None:
        super().__init__(count)
        self.count = count


def cusps_of(position: tuple[Expr, Expr], begin: float, end: float) -> list[float]:
    """Where a smooth piece stands still for an instant, and may turn back."""
    rates = [derivative_by(each) for each in position]
    values = numeric([*rates, *map(derivative_by, rates)])

    def at(places: FloatArray) -> tuple[FloatArray, FloatArray]:
        with np.errstate(all="ignore"):  # a curve may go beyond all numbers
            x, y, u, v = values(places)
            return x * x + y * y, x * u + y * v  # the square of the speed, and half of how it changes

    places = np.linspace(begin, end, CUSP_SEARCH_PLACES + 1)
    square, change = at(places)
    most = float(np.max(square[np.isfinite(square)], initial=0.0))
    slow = np.minimum(square[:-1], square[1:]) <= CUSP_SLOW * CUSP_SLOW * most
    found: list[float] = []
    least = SHORTEST_PIECE * (end - begin)
    for k in np.nonzero(slow & (change[:-1] < 0.0) & (change[1:] >= 0.0))[0].tolist():
        (place,) = _between(lambda some: np.heaviside(at(some)[1], 1.0)[None], float(places[k]), float(places[k + 1]))
        stands = at(np.array([place]))[0][0] <= CUSP_STANDS * CUSP_STANDS * most
        if stands and begin + least < place < end - least:
            found.append(place)
    return found


def kinks_of(roots: Sequence[Expr], first: float, last: float) -> list[float]:
    """Where a function of ``roots`` goes from one of its pieces to another."""
    states = [state for node in walk(*roots) for state in _states(node)]
    if not states:
        return []
    values = numeric(states)

    def state(places: FloatArray) -> FloatArray:
        found = np.stack(values(places))
        return np.where(np.isfinite(found), np.floor(found), -np.inf)

    places = np.linspace(first, last, KINK_SEARCH_PLACES + 1)
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
