"""What is asked about an expression over the whole film: when it has a value, when a condition holds, extremes."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from movimentum.analysis.interactive.crossings import Crossing, Curve, ExtremeValue, Way, crossings, extreme
from movimentum.arrays import FloatArray
from movimentum.errors import script_error
from movimentum.query import Query, parsed_statement
from movimentum.records import dataclass, replace
from movimentum.solver.rates.rates import UndefinedRate
from movimentum.syntax.expression_tree import Comparison
from movimentum.tolerances import DIFFERENCED_RATE, VALUE_TOUCHED

if TYPE_CHECKING:
    from movimentum.workflow.inspector import Inspector

_ABOVE = {Comparison.ABOVE, Comparison.AT_LEAST}


@dataclass(frozen=True, slots=True)
class Times:
    """When a condition holds: at ``crossings`` of an equality, or in the intervals ``holding`` of an inequality (the
    first and the last time of each).
    """

    crossings: tuple[Crossing, ...] = ()
    holding: tuple[tuple[Fraction, Fraction], ...] = ()

    @property
    def begins(self) -> tuple[Fraction, ...]:
        """The times at which it comes to hold."""
        return tuple(item.time for item in self.crossings) + tuple(first for first, _ in self.holding)

    @property
    def ends(self) -> tuple[Fraction, ...]:
        """The times at which it holds last."""
        return tuple(item.until for item in self.crossings) + tuple(last for _, last in self.holding)


def when(inspector: Inspector, condition: str) -> Times:
    """When a condition such as ``Rod.B.x = 300`` or ``Rod.B.x < 300`` holds. `ScriptError` (``query/expression``) for
    what is none.
    """
    whole = f"{condition.strip().removesuffix(';')};"
    statement = parsed_statement(whole, condition)
    if statement is None:
        raise script_error("query/expression", f"`{condition.strip()}` is not a condition such as `Rod.B.x = 300`")
    left, right = (whole[side.span.start : side.span.end] for side in (statement.left, statement.right))
    difference = inspector.query(f"({left}) - ({right})")
    sides = [inspector.query(side).expressions for side in (left, right)]
    turns = any(len(side) == 1 and side[0].op == "atan2d" for side in sides)
    curves = _curves(inspector, difference, turns=turns)
    if statement.comparison is Comparison.EQUAL:
        return Times(crossings=tuple(_common(curves)))
    if len(curves) != 1 or statement.comparison is Comparison.WISH:
        raise script_error("query/expression", f"`{condition.strip()}` is not a condition such as `Rod.B.x < 300`")
    return Times(holding=tuple(_holding(curves[0], above=statement.comparison in _ABOVE)))


def extremes(inspector: Inspector, expression: str, *, largest: bool) -> list[ExtremeValue | None]:
    """The largest or the smallest value of each component of an expression."""
    return [extreme(curve, largest=largest) for curve in _curves(inspector, inspector.query(expression), turns=False)]


def _curves(inspector: Inspector, query: Query, *, turns: bool) -> list[Curve]:
    """The components of a query as curves."""
    motion = inspector.work.motion
    count = len(query.expressions) or query.values(inspector.poses()).shape[1]

    def values(k: int, times: Sequence[Fraction]) -> FloatArray:
        poses = motion.poses_at(times)
        found = np.array(query.values(poses)[:, k], dtype=np.float64)
        found[~poses.solved] = np.nan
        return found

    def rates(k: int, times: Sequence[Fraction]) -> FloatArray:
        if query.expressions:
            try:
                return query.rates(motion, 1, times)[:, k]
            except UndefinedRate:  # of a free motion, which has no equations for it
                pass
        step = Fraction(DIFFERENCED_RATE) * (motion.timeline.end - motion.timeline.start)
        before, after = (values(k, [time + aside for time in times]) for aside in (-step, step))
        return (after - before) / float(2 * step)

    def of(k: int) -> Curve:
        return Curve(motion, lambda times: values(k, times), lambda times: rates(k, times), turns)

    return [of(k) for k in range(count)]


def _common(curves: Sequence[Curve]) -> list[Crossing]:
    """The crossings of one curve, or those times at which all of several are zero."""
    if len(curves) == 1:
        return crossings(curves[0])
    every = [crossings(curve) for curve in curves]
    still = [len(found) == 1 and found[0].way is Way.STAYS for found in every]
    leading = every[still.index(False)] if False in still else every[0]
    near = 100.0 * VALUE_TOUCHED * curves[0].motion.size
    met = [item for item in leading if all(abs(float(curve.values([item.time])[0])) <= near for curve in curves)]
    return [item if item.way is Way.STAYS else replace(item, way=Way.MEETS) for item in met]


def _holding(curve: Curve, *, above: bool) -> list[tuple[Fraction, Fraction]]:
    """The intervals in which a curve is on one side of zero."""
    timeline = curve.motion.timeline
    found = crossings(curve)
    bounds = sorted({timeline.start, timeline.end, *(t for item in found for t in (item.time, item.until))})
    gaps = {float(s.segment.start) for s in curve.motion.segments}
    bounds = sorted({*bounds, *(Fraction(start) for start in gaps if timeline.start <= start <= timeline.end)})
    result: list[tuple[Fraction, Fraction]] = []
    if len(bounds) == 1:
        value = float(curve.values(bounds)[0])
        return [(bounds[0], bounds[0])] if (value > 0.0) is above and value != 0.0 else []
    for first, last in pairwise(bounds):
        value = float(curve.values([(first + last) / 2])[0])
        if np.isfinite(value) and (value > 0.0 if above else value < 0.0):
            if result and result[-1][1] == first:
                result[-1] = (result[-1][0], last)
            else:
                result.append((first, last))
    return result
