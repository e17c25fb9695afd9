"""Where a path comes to violate an inequality, or an equation that did not determine it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.solver.basis.bisection import bisected
from movimentum.solver.block.change_points import find_events
from movimentum.solver.kinds.kernels import solutions_meet
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import DISCRIMINANT_ZERO, INEQUALITY_BLURRED, INEQUALITY_MET, LEAST_DIVISOR, REDUNDANT_LATER


def first_violation(piece: Piece, horizon: float) -> tuple[int, float] | None:
    """The first time before ``horizon`` at which an inequality is violated along the piece, with its number.

    Where the path itself ends at the horizon, what is violated from there on is no news.
    """
    plan = piece.plan
    best: tuple[int, float] | None = None
    nodes = piece.nodes[piece.nodes < horizon]
    nodes = np.append(nodes, min(horizon, piece.end))
    if len(nodes) < 2 or not plan.selectors:
        return None
    with np.errstate(all="ignore"):
        instants = piece.instants(nodes)
        state, _ = piece.solve(instants)
        for i, function in enumerate(plan.selectors):

            def slack(tau: FloatArray, function: Compiled = function) -> FloatArray:
                moments = piece.instants(tau)
                values = function(piece.evaluate(moments)[0], moments.clocks)[0]
                return np.broadcast_to(values, len(tau)) / plan.size + INEQUALITY_MET

            values = np.broadcast_to(function(state, instants.clocks)[0], len(nodes)) / plan.size + INEQUALITY_MET
            if np.nanmin(values) > 0.3 * (np.nanmax(values) - np.nanmin(values)):
                continue
            low = _first_gap(piece, i, slack, nodes, values)
            if low is not None and low < horizon and (best is None or low < best[1]):
                before = nodes[nodes < low]
                best = i, _crossing(slack, float(before[-1]) if len(before) else low, low)
    return best


def _first_gap(
    piece: Piece, i: int, slack: Callable[[FloatArray], FloatArray], nodes: FloatArray, values: FloatArray
) -> float | None:
    """Where inequality ``i`` is violated first, its ``slack`` known as ``values`` at the ``nodes``."""
    values = values.copy()
    while True:
        below = np.nonzero(~(values >= -DISCRIMINANT_ZERO))[0]
        seen = slice(0, int(below[0]) + 1 if len(below) else None)  # what rounding decides may have many gaps
        gaps = find_events(slack, nodes[seen], values[seen]).gaps
        first = min((low for low, high in gaps if not _is_only_rounding(piece, i, slack, low, high)), default=None)
        if first is not None or not len(below):
            return first
        values[below[0]] = INEQUALITY_MET  # it is just met there; what comes after that is looked at


def _is_only_rounding(piece: Piece, i: int, slack: Callable[[FloatArray], FloatArray], low: float, high: float) -> bool:
    """Whether inequality ``i`` seems violated in [``low``, ``high``] by rounding only: two solutions meet there."""
    points = np.linspace(low, high, 5)
    if not (slack(points) >= -INEQUALITY_BLURRED).all():
        return False
    unknowns = symbol_numbers(piece.plan.system.selectors[i].value)
    for tau in points:
        instants = piece.instants(np.array([tau]))
        if not solutions_meet(piece.plan, unknowns, piece.evaluate(instants)[0], instants.clocks):
            return False
    return True


def _crossing(slack: Callable[[FloatArray], FloatArray], good: float, bad: float) -> float:
    """The time in [good, bad] from which on a value is below zero; ``slack`` is more by the tolerance, and zero at
    ``bad``. The latter where it is not above zero before.
    """

    def holds(tau: float) -> bool:
        return bool(slack(np.array([tau]))[0] > INEQUALITY_MET)

    return bisected(holds, good, bad)[0] if holds(good) else bad


def first_disagreement(piece: Piece, horizon: float) -> tuple[int, float] | None:
    """The first time before ``horizon`` at which an equation that the plan took for redundant no longer holds, with the
    equation's number.
    """
    plan = piece.plan
    nodes = piece.nodes[piece.nodes < horizon]
    if len(nodes) < 2 or not plan.checks:
        return None

    def off(number: int, tau: FloatArray) -> NDArray[np.bool_]:
        instants = piece.instants(tau)
        state, bad = piece.evaluate(instants)
        value, size = plan.check_values[number](state, instants.clocks)
        return np.broadcast_to(np.abs(value) > REDUNDANT_LATER * np.maximum(size, LEAST_DIVISOR), len(tau)) & ~bad

    best: tuple[int, float] | None = None
    with np.errstate(all="ignore"):
        for number, equation in enumerate(plan.checks):
            places = np.nonzero(off(number, nodes))[0]
            if len(places) == 0:
                continue
            good, wrong = float(nodes[max(places[0] - 1, 0)]), float(nodes[places[0]])
            _, wrong = bisected(lambda tau, number=number: not off(number, np.array([tau]))[0], good, wrong)
            if best is None or wrong < best[1]:
                best = equation, wrong
    return best
