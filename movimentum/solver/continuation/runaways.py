"""Times at which something runs away to infinity and comes back from the other side: poles of computed values.

They are zeros of divisors: in a block's equations, the leading coefficient of a quadratic one, and the determinant of a
linear one (two lines that become parallel). Zeros are detected between nodes, so no frame needs to be near. A zero
shared with the dividend is not a pole: the growth beside it tells.

Poles of integrands are found too, also those that quadrature steps across; there the integral has no finite value. An
integrable singularity, |t - t*|^-p with p < 1, only makes quadrature slow; beyond a pole, p >= 1, the result is
meaningless. Both leave intervals that refinement does not improve, so p is read off the integrand's growth there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.planning.blocks.kinds import Block, Integral, Newton
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.solver.basis.block_memo import code_of
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.tracks import Gap, NodeTrack, Path
from movimentum.tolerances import (
    DIVISOR_VANISHES,
    FARTHEST_GROWTH_AT_POLE,
    LEAST_POLE_WIDTH,
    NEAREST_GROWTH_AT_POLE,
    NEAREST_LOOK_AT_POLE,
    NEAREST_NODE_AT_POLE,
)

INFINITY_DISTANCE = 1e8
"""Of the scene's size: what is farther away than that is as good as at infinity; rounding there is a pixel's 1e-6."""
RUNAWAY_DISTANCE = 1e6
"""Of its scale: what comes farther away than that before its path ends runs away; where iteration is lost in rounding.
"""
ROUNDS, SAMPLES = 26, 9
GROWTH_OFFSETS = np.geomspace(NEAREST_GROWTH_AT_POLE, FARTHEST_GROWTH_AT_POLE, 17)
"""Of the way to the next nodes: where the growth beside a pole is looked at."""
LEAST_POLE_POWER = 0.25
"""The least power with which a pole grows; what is smooth has -1."""
NODE_OFFSETS = np.geomspace(NEAREST_NODE_AT_POLE, 1.0, 28)[:-1]
"""Of the way to the next nodes: nodes beside a pole, between which nothing changes by more than about 2."""
DISTANCE_OFFSETS = np.geomspace(NEAREST_LOOK_AT_POLE, 1.0, 105)
"""Of the way to the next nodes: where is looked at how far something is."""


def vanishing_divisors(path: Path, grid: Grid, block: Block) -> list[tuple[float, float]]:
    """The times at which something that ``block`` divides by is zero, ascending, and for each how far it is to the
    nearest node; nodes are put beside them.
    """
    if not block.moving or not (block.divisors or block.linear_system):
        return []
    divisors = code_of(block.divisors, path.plan.clocks) if block.divisors else None
    found: set[tuple[float, float]] = set()
    with np.errstate(all="ignore"):
        rows = _values_of(block, divisors, grid.state, grid.instants.clocks, len(grid.tau))
        for number, row in enumerate(rows):

            def size(tau: FloatArray, number: int = number) -> FloatArray:
                instants = path.instants(tau)
                before = path.before(block.number, instants)
                return np.abs(_values_of(block, divisors, before, instants.clocks, len(tau))[number])

            found.update(_zeros(size, grid.tau, row))
    if found:
        beside = [place + side * width * NODE_OFFSETS for place, width in found for side in (-1.0, 1.0)]
        nodes = np.unique(np.concatenate(beside))
        grid.insert(nodes[(nodes > path.begin) & (nodes < path.end)])
    return sorted(found)


def first_runaway(path: Path, block: Block, places: Sequence[tuple[float, float]]) -> list[Gap]:
    """The first pole of a block in closed form among ``places`` (see `vanishing_divisors`): the time about it in which
    something is farther away than `INFINITY_DISTANCE`.
    """
    if not block.closed_form:
        return []
    with np.errstate(all="ignore"):
        gaps = (_pole(path, block, place, width) for place, width in places)
        first = next((gap for gap in gaps if gap is not None), None)
        return [] if first is None else [first]


def pole_ahead(path: Path, block: Newton, track: NodeTrack, scale: FloatArray) -> Gap | None:
    """The time about the end of a path that Newton's method follows, in which one of its values is as good as at
    infinity; None where none runs away. Beside a pole, a value divided by its velocity goes to zero evenly.
    """
    size = np.abs(track.values) / scale
    n = int(np.argmax(size[-1]))
    some = np.nonzero(size[:, n] <= RUNAWAY_DISTANCE)[0][-2:]
    if not size[-1, n] > RUNAWAY_DISTANCE or len(some) < 2:
        return None
    with np.errstate(all="ignore"):
        a, b = (track.values[some, n] / track.rates[some, n]).tolist()
        tau = track.tau[some]
        pole = float(tau[1] - b * (tau[1] - tau[0]) / (b - a))
    if not (tau[1] < pole < path.end and abs(pole - track.until) <= 0.5 * (pole - tau[1])):
        return None
    return Gap(float(tau[1]), min(2.0 * pole - float(tau[1]), path.end), block.number, pole)


def _values_of(
    block: Block, divisors: Compiled | None, state: State, clocks: Sequence[FloatArray], count: int
) -> list[FloatArray]:
    """(count,) for each divisor; of a linear block the last one is its determinant."""
    rows = [] if divisors is None else [np.broadcast_to(value, count) for value in divisors(state, clocks)]
    determinant = closed_form.determinant(block, state, clocks)
    if determinant is not None:
        rows.append(np.broadcast_to(determinant, count))
    return rows


def _zeros(size: Callable[[FloatArray], FloatArray], tau: FloatArray, row: FloatArray) -> Iterator[tuple[float, float]]:
    """The zeros of a divisor between the nodes ``tau``, where it is ``row``, with the distance to the next nodes."""
    low, high = _brackets(row)
    a, b = tau[low].copy(), tau[high].copy()
    place = 0.5 * (a + b)
    least = np.full(len(a), np.inf)
    for _ in range(ROUNDS if len(a) else 0):
        points = a[:, None] + (b - a)[:, None] * np.linspace(0.0, 1.0, SAMPLES + 2)
        values = size(points.reshape(-1)).reshape(points.shape)
        values = np.where(np.isnan(values), np.inf, values)
        i, rows = np.argmin(values, axis=1), np.arange(len(a))
        place, least = points[rows, i], values[rows, i]
        a, b = points[rows, np.maximum(i - 1, 0)], points[rows, np.minimum(i + 1, SAMPLES + 1)]
    vanishes = (least <= DIVISOR_VANISHES * np.maximum(np.abs(row[low]), np.abs(row[high]))) & (place > tau[0])
    width = 0.5 * (tau[high] - tau[low])
    yield from zip(place[vanishes].tolist(), width[vanishes].tolist(), strict=True)


def _brackets(row: FloatArray) -> tuple[IntArray, IntArray]:
    """Pairs of nodes between which values (N,) may come to zero: about a change of sign, or a minimum of the size."""
    size = np.where(np.isfinite(row), np.abs(row), np.inf)
    last = len(row) - 1
    change = np.nonzero(np.sign(row[:-1]) * np.sign(row[1:]) < 0.0)[0]
    around = np.concatenate([[np.inf], size, [np.inf]])
    minimum = (size <= around[:-2]) & (size <= around[2:]) & np.isfinite(size)
    minimum[change] = minimum[change + 1] = False
    i = np.nonzero(minimum)[0]
    low, high = np.maximum(i - 1, 0), np.minimum(i + 1, last)
    worth = size[i] < 0.5 * np.maximum(size[low], size[high])
    low, high = np.append(change, low[worth]), np.append(change + 1, high[worth])
    return low.astype(np.int64), high.astype(np.int64)


def _pole(path: Path, block: Block, place: float, width: float) -> Gap | None:
    """The gap about ``place``, where an unknown of the block grows without bound on a side of it."""
    reach, grows = 0.0, False
    unknowns = [n for n in block.unknowns if not isinstance(path.plan.system.unknowns[n].payload, PoseCos | PoseSin)]
    for side in (-1.0, 1.0):
        beside, near = (
            _values(path, block, unknowns, place + side * width * part) for part in (GROWTH_OFFSETS, DISTANCE_OFFSETS)
        )
        for n, values, nearer in zip(unknowns, beside, near, strict=True):
            steps = np.diff(values)
            power = np.log(abs(steps[0] / steps[-1])) / np.log(GROWTH_OFFSETS[-1] / GROWTH_OFFSETS[0])
            if power > LEAST_POLE_POWER and (np.all(steps > 0.0) or np.all(steps < 0.0)):
                grows = True
                is_place = isinstance(path.plan.system.unknowns[n].payload, PoseX | PoseY)
                far = np.abs(nearer) > INFINITY_DISTANCE * (path.plan.size if is_place else abs(values[-1]))
                reach = max(reach, width * float(np.max(DISTANCE_OFFSETS[far], initial=0.0)))
    if not grows:
        return None
    reach = max(reach, LEAST_POLE_WIDTH * max(abs(place), abs(float(path.segment_start) + place)))
    return Gap(max(place - reach, path.begin), min(place + reach, path.end), block.number, place)


def _values(path: Path, block: Block, unknowns: Sequence[int], tau: FloatArray) -> list[FloatArray]:
    """(F,) each; nan outside of the path."""
    inside = (tau >= path.begin) & (tau <= path.end)
    instants = path.instants(np.clip(tau, path.begin, path.end))
    state, _ = path.evaluate(instants, (*path.upstream(block.number), block.number))
    return [np.where(inside, np.broadcast_to(state[n], len(tau)), np.nan) for n in unknowns]


INNER, OUTER = 16.0, 256.0
"""Widths of the finest interval at which the growth is measured: there the place of the pole is known well enough."""
LEAST_POWER = 0.97
MOST_PLACES = 64
"""Places that are looked at."""
INTEGRAND_PLACES = 17
"""Places beside a pole at which its integrand only falls. Where something cancels, rounding grows as fast, but up and
down.
"""


def first_pole(path: Path, block: Integral, low: FloatArray, high: FloatArray) -> float | None:
    """The first pole of an integral's integrand in the intervals [low, high] (each of the finest width), in which
    quadrature does not settle; None where all is integrable.
    """
    for a, b in list(zip(low.tolist(), high.tolist(), strict=True))[:MOST_PLACES]:
        width = b - a
        # beside the pole itself quadrature may happen to settle, by symmetry
        place = _steepest(path, block, max(path.begin, a - 2.0 * width), min(path.end, b + 2.0 * width))
        side = 1.0 if path.end - place > place - path.begin else -1.0  # where there is more of the film
        at = place + side * width * np.array([INNER, 2.0 * INNER, OUTER, 2.0 * OUTER])
        one, two, three, four = _integrand(path, block, at)
        near, far = abs(one - two), abs(three - four)  # differences know nothing of what is added to the pole
        if not (near > 0.0 and far > 0.0 and np.isfinite(near)):
            continue
        grows = np.log(near / far) / np.log(OUTER / INNER) > LEAST_POWER
        if grows and _steady(
            _integrand(path, block, place + side * width * np.geomspace(INNER, OUTER, INTEGRAND_PLACES))
        ):
            return place
    return None


def _steady(values: FloatArray) -> bool:
    """Whether values only grow, or only fall."""
    steps = np.diff(values)
    return bool(np.all(steps > 0.0) or np.all(steps < 0.0))


def _steepest(path: Path, block: Integral, low: float, high: float) -> float:
    """Where the integrand is largest in [low, high], closed in on."""
    place = low
    for _ in range(8):
        inside = np.linspace(low, high, 65)
        sizes = np.abs(_integrand(path, block, inside))
        best = int(np.argmax(np.where(np.isfinite(sizes), sizes, np.inf)))
        place = float(inside[best])
        low, high = float(inside[max(best - 1, 0)]), float(inside[min(best + 1, 64)])
    return place


def _integrand(path: Path, block: Integral, tau: FloatArray) -> FloatArray:
    instants = path.instants(tau)
    state = path.before(block.number, instants)
    (values,) = block.integrand(state, instants.clocks)
    return np.broadcast_to(values, tau.shape)
