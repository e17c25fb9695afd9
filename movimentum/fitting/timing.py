"""Precision points at unknown times: finds the best times of given mechanisms directly, without a search.

Where a constant is only the time of precision points, its best value for a mechanism is where the curve comes nearest
to them. So the search need not try times: for every mechanism the best ones are known (variable projection: Golub &
Pereyra, SIAM J. Numer. Anal. 10, 1973). Requirements such as `t1 < t2` make chains of times; the best times in their
order are found by dynamic programming over the instants at which a mechanism is solved anyway.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.expressions import Expr, walk
from movimentum.fitting.aims import ReducedExpr, SideFormulas, signed
from movimentum.fitting.slopes import Dual
from movimentum.records import dataclass
from movimentum.tolerances import LEAST_DIVISOR, ORDER_LINEAR
from movimentum.variants.together.pattern import Pattern
from movimentum.variants.tracing import Reduced, Varied, varied_names

FAR = 1e300
"""The cost of a forbidden time."""


@dataclass(frozen=True, slots=True)
class FreeTime:
    """A constant, number ``column``, that is the time of reductions ``parts`` in ``aims``, and nothing else."""

    column: int
    parts: tuple[int, ...]
    aims: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class TimeChain:
    """Times, by their place in `FreeTimes.times`, each at least ``gaps`` after the one before (the first: 0)."""

    places: tuple[int, ...]
    gaps: tuple[float, ...]


class FreeTimes:
    """The free times among the constants of ``formulas``. ``used``: constants that the mechanism itself depends on."""

    def __init__(self, formulas: SideFormulas, used: set[str]) -> None:
        self.formulas = formulas
        lowered, names = formulas.lowered, formulas.names
        orders = {a: order for a in range(len(lowered.aims)) if (order := _order(formulas, a)) is not None}
        taken = set(used)
        for part in lowered.reductions:
            taken |= varied_names(part.inner)
            if part.time is not None and not _plain(part.time):
                taken |= varied_names(part.time)
        for number, aim in enumerate(lowered.aims):
            if aim.extreme:
                taken |= {name for k in _reduced(aim.sides) for name in _times(lowered.reductions[k])}
            if number not in orders:
                taken |= varied_names(*aim.sides)
        reading = [_reduced(aim.sides) for aim in lowered.aims]
        self.times: list[FreeTime] = []
        for column, name in enumerate(names):
            parts = {
                k
                for k, part in enumerate(lowered.reductions)
                if part.time is not None and name in varied_names(part.time)
            }
            aims = tuple(a for a, found in enumerate(reading) if found & parts)
            alone = all(reading[a] <= parts and not lowered.aims[a].lasting for a in aims)
            if parts and aims and alone and name not in taken:
                self.times.append(FreeTime(column, tuple(sorted(parts)), aims))
        place = {time.column: k for k, time in enumerate(self.times)}
        edges = [(place[a], place[b], gap) for a, b, gap in orders.values() if a in place and b in place]
        self.chains = _chains(len(self.times), edges)

    @property
    def columns(self) -> list[int]:
        """The numbers of these constants."""
        return [time.column for time in self.times]

    def misses(self, constants: FloatArray, inner: Sequence[Dual]) -> list[FloatArray]:
        """(V, T, R) what is missed at T instants, for each free time; ``inner``: the reductions' expressions there."""
        formulas, lowered = self.formulas, self.formulas.lowered
        count = len(constants)
        instants = max(np.shape(inner[part].value)[-1] for time in self.times for part in time.parts)
        known = [np.nan] * len(formulas.payloads)
        varied = [constants[:, k : k + 1] for k in range(constants.shape[1])]
        found: list[FloatArray] = []
        for time in self.times:
            reduced = [inner[k].value if k in time.parts else np.nan for k in range(len(lowered.reductions))]
            rows: list[FloatArray] = []
            for a in time.aims:
                aim = lowered.aims[a]
                for dual in formulas.outer[a].duals([*known, *varied, *reduced], (), None):
                    side = signed(aim, np.asarray(dual.value))[0]
                    side = side if aim.sign == 0.0 else np.maximum(side, 0.0)
                    rows.append(np.broadcast_to(np.sqrt(aim.timed_claim.claim.weight) * side, (count, instants)))
            found.append(np.stack(rows, axis=-1))
        return found

    def best(self, misses: Sequence[FloatArray], starts: IntArray, times: FloatArray, box: FloatArray) -> FloatArray:
        """(V, N) the best N times, within their intervals ``box`` (N, 2), given what is `misses` at ``times`` (T,).
        Between instant ``starts`` (I,) and the next one, what is missed is taken to change evenly.
        """
        begin, end = times[starts], times[starts + 1]
        costs: list[FloatArray] = []
        moments: list[FloatArray] = []
        for missed, (low, high) in zip(misses, box.tolist(), strict=True):
            a = missed[:, starts]
            step = missed[:, starts + 1] - a
            square = np.einsum("vir,vir->vi", step, step)
            share = np.clip(-np.einsum("vir,vir->vi", a, step) / np.maximum(square, LEAST_DIVISOR), 0.0, 1.0)
            nearest = a + share[..., None] * step
            cost = np.einsum("vir,vir->vi", nearest, nearest)
            outside = (end < low) | (begin > high)
            costs.append(np.where(outside | ~np.isfinite(cost), FAR, cost))
            moments.append(np.clip(begin + share * (end - begin), low, high))
        found = np.zeros((len(misses[0]), len(misses)))
        rows = np.arange(len(found))
        for chain in self.chains:
            chosen = _in_order([costs[n] for n in chain.places], begin, chain.gaps)
            before: FloatArray | None = None
            for n, gap, interval in zip(chain.places, chain.gaps, chosen, strict=True):
                moment = moments[n][rows, interval]
                before = moment if before is None else np.minimum(np.maximum(moment, before + gap), box[n, 1])
                found[:, n] = before
        return found


def _in_order(costs: Sequence[FloatArray], begin: FloatArray, gaps: Sequence[float]) -> list[IntArray]:
    """(V,) the interval of each member of a chain: the least sum of ``costs`` (V, I), each after the one before."""
    total = costs[0]
    last: list[IntArray] = []
    for cost, gap in zip(costs[1:], gaps[1:], strict=True):
        least = np.minimum.accumulate(total, axis=1)
        numbers: IntArray = np.arange(total.shape[1], dtype=np.int64) * (total == least)
        where = np.maximum.accumulate(numbers, axis=1)
        limit = np.searchsorted(begin, begin - gap, side="right") - 1
        possible = limit >= 0
        limit = np.maximum(limit, 0)
        last.append(where[:, limit])
        total = np.where(possible, np.minimum(least[:, limit] + cost, FAR), FAR)
    rows = np.arange(len(total))
    found = [np.argmin(total, axis=1)]
    for where in reversed(last):
        found.append(where[rows, found[-1]])
    return found[::-1]


def _chains(count: int, edges: Sequence[tuple[int, int, float]]) -> list[TimeChain]:
    """Chains of ``count`` times; ``edges``: (earlier, later, gap). Where these branch, they are left out."""
    after: dict[int, tuple[int, float]] = {}
    before: dict[int, int] = {}
    for a, b, gap in edges:
        if a not in after and b not in before and a != b:
            after[a], before[b] = (b, gap), a
    chains: list[TimeChain] = []
    for first in range(count):
        if first in before:
            continue
        places, gaps = [first], [0.0]
        while places[-1] in after:
            following, gap = after[places[-1]]
            places.append(following)
            gaps.append(gap)
        chains.append(TimeChain(tuple(places), tuple(gaps)))
    covered = {n for chain in chains for n in chain.places}
    return chains + [TimeChain((n,), (0.0,)) for n in range(count) if n not in covered]  # a circle cannot be met


def _order(formulas: SideFormulas, number: int) -> tuple[int, int, float] | None:
    """(earlier, later, gap) if an aim requires no more than that constants are in that order."""
    aim = formulas.lowered.aims[number]
    if not aim.required or aim.lasting or aim.sign == 0.0 or len(aim.sides) != 1 or _reduced(aim.sides):
        return None
    names = formulas.names
    columns = sorted(names.index(name) for name in varied_names(aim.sides[0]))
    if len(columns) != 2:
        return None

    def value(a: float, b: float) -> float:
        inputs = [np.nan] * (len(formulas.payloads) + len(names) + len(formulas.lowered.reductions))
        for column, given in zip(columns, (a, b), strict=True):
            inputs[len(formulas.payloads) + column] = given
        return float(np.asarray(signed(aim, np.asarray(formulas.outer[number].duals(inputs, (), None)[0].value))[0]))

    none = value(0.0, 0.0)
    for sign, (earlier, later) in ((1.0, columns), (-1.0, columns[::-1])):
        if all(
            abs(value(a, b) - none - sign * (a - b)) <= ORDER_LINEAR for a, b in ((1.0, 0.0), (0.0, 1.0), (0.37, 0.71))
        ):
            return earlier, later, max(none, 0.0)
    return None


def constants_of_motion(pattern: Pattern) -> set[str]:
    """The names of the varied constants that the mechanism itself depends on."""
    roots = [part for thing in pattern.scene.things for anchor in thing.anchors for part in anchor.coordinates]
    for segment in pattern.segments:
        system = segment.plan.system
        roots += [equation.residual for equation in system.equations]
        roots += [selector.value for selector in system.selectors]
    return varied_names(*map(pattern.unfolding.unfolded, roots))


def _times(part: ReducedExpr) -> set[str]:
    return set() if part.time is None else varied_names(part.time)


def _plain(root: Expr) -> bool:
    return root.op == "symbol" and isinstance(root.payload, Varied)


def _reduced(sides: Sequence[Expr]) -> set[int]:
    nodes = (node for side in sides for node in walk(side))
    return {node.payload.number for node in nodes if node.op == "symbol" and isinstance(node.payload, Reduced)}
