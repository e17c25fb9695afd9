"""Searches for the best constants: many starts, each followed to its nearest optimum, some at a time.

A *piece* of the search is a part of a Sobol sequence, whose best points are starts; an *island* is a population that
evolves (differential evolution), whose best members are starts. The result of a piece depends only on its number, so
pieces may be done anywhere, in any order.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, Protocol

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.fitting.aims import Evaluation
from movimentum.fitting.least_squares import Rows, inside, minimize_batch
from movimentum.fitting.merit import Evaluate, Lagrangian, Merit
from movimentum.fitting.timing import FreeTimes
from movimentum.records import dataclass, field, replace
from movimentum.tolerances import (
    FINER,
    INSIDE,
    POLISHED,
    POPULATION_SETTLED,
    SAME_POINT,
    STEP_ONE_BY_ONE,
    STEP_TOGETHER,
)

PENALTIES = (1.0, 10.0, 100.0)
"""Of what requirements are off by, round by round."""
ROUNDS = 14
"""Of the last fits, at most: until requirements are met and nothing gets better."""
DEEP = 8
"""Long rounds of the last fits, at most."""
FALLING = 0.5
"""Times what a cost was: what it must fall to, for its fit to go on."""
APART = 0.05
"""How far starts of one piece are apart, at least, by the root of the number of constants."""
DEAR = 1e9
"""The cost of a variant that does not move all the way, in squares of the scene's size: dearer than any that does."""


class Timing(Protocol):
    """Knows the best times of precision points."""

    free_times: FreeTimes

    def retimed(self, constants: FloatArray) -> FloatArray:
        """(V, C) constants with the best free times."""
        ...


SAMPLE = 64
"""Variants that tell how goals and requirements change."""


@dataclass(frozen=True, slots=True)
class SearchEffort:
    """How much is tried: the ``points`` of a piece, the ``starts`` taken of them; ``heats``: how many steps are made
    from them before only the best so many go on; the ``iterations`` of these, and the ``generations`` of an island of
    ``population`` points; ``tolerance``: the step, in units of the box, at which a start ends.
    """

    points: int
    starts: int
    heats: tuple[tuple[int, int], ...]
    iterations: int
    generations: int
    population: int
    tolerance: float


TOGETHER = SearchEffort(512, 192, ((4, 64), (12, 24)), 30, 60, 96, STEP_TOGETHER)
ONE_BY_ONE = SearchEffort(16, 2, (), 6, 0, 0, STEP_ONE_BY_ONE)
"""Where each variant is solved by itself, or slopes are differences of several."""
OTHER_TIME = 0.01
"""Of an interval: a time that is farther off is another one, and not the same told less exactly."""
PIECES, ISLANDS = 4, 2

Task = tuple[str, int]
"""A part of the search: "piece" or "island", and its number."""


def tasks_of(effort: SearchEffort, times: int) -> list[Task]:
    """The parts of a search, so many ``times`` as many as usual."""
    tasks: list[Task] = []
    for part in range(times):
        tasks += [("piece", k) for k in range(PIECES * part, PIECES * (part + 1))]
        if effort.generations:
            tasks += [("island", k) for k in range(ISLANDS * part, ISLANDS * (part + 1))]
    return tasks


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """M points (M, C) in units of their intervals, the ``costs`` (M,) of missed goals there, and by how much the
    requirements are off at ``worst`` (M,); inf where nothing moves.
    """

    points: FloatArray
    costs: FloatArray
    worst: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    def order(self) -> IntArray:
        """Their numbers, the best first: by requirements, then by goals."""
        off = np.where(self.worst > 0.0, self.worst, 0.0)
        return np.lexsort((np.arange(len(self)), self.costs, off))

    def best(self, count: int) -> Candidates:
        """The best ``count`` that are apart."""
        chosen: list[int] = []
        for k in self.order():
            near = any(np.max(np.abs(self.points[k] - self.points[j])) < SAME_POINT for j in chosen)
            if np.isfinite(self.costs[k]) and not near:
                chosen.append(int(k))
            if len(chosen) == count:
                break
        return self.take(chosen)

    def take(self, chosen: list[int]) -> Candidates:
        """Some of them."""
        return Candidates(self.points[chosen], self.costs[chosen], self.worst[chosen])

    def and_others(self, other: Candidates) -> Candidates:
        """These and others."""
        return Candidates(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.costs, other.costs]),
            np.concatenate([self.worst, other.worst]),
        )


@dataclass(eq=False)
class Search:
    """Searches the box ``low`` to ``high`` (C,) for what ``evaluate`` and ``merit`` call best. ``size``: of the scene;
    ``own``: the script's own constants, in units of the box; ``periods`` (C,): after which a constant is the same
    again, infinite where it never is.
    """

    evaluate: Evaluate
    merit: Merit
    low: FloatArray
    high: FloatArray
    size: float
    own: FloatArray
    seed: int
    effort: SearchEffort
    timing: Timing | None = None
    periods: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if len(self.periods) == 0:
            self.periods = np.full(len(self.low), np.inf)

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(C,) each: where points may be while they are looked for. What has a period may pass the ends."""
        beyond = np.where(np.isfinite(self.periods), 1.0, 0.0)
        return -beyond, 1.0 + beyond

    def inside(self, points: FloatArray) -> FloatArray:
        """Points (…, C) as points of the box."""
        return inside(points, self.periods)

    def retimed(self, points: FloatArray) -> FloatArray:
        """Points (M, C) with the best free times of their mechanisms (`fitting.timing`)."""
        if self.timing is None or len(points) == 0:
            return points
        return (self.timing.retimed(self.low + points * (self.high - self.low)) - self.low) / (self.high - self.low)

    def at(self, points: FloatArray, *, slopes: bool = False) -> Evaluation:
        """What the aims come to at points (M, C) of the unit box; slopes are by its units."""
        found = self.evaluate(self.low + points * (self.high - self.low), slopes=slopes)
        if found.slopes is None:
            return found
        return Evaluation(found.sides, found.slopes * (self.high - self.low), found.moves, found.sure, found.reach)

    def balance(self) -> None:
        """Have requirements weigh as much as goals: see `Merit.balanced`."""
        points = sobol(len(self.low), 0).random(SAMPLE)
        found = self.at(self.retimed(points), slopes=True)
        if found.moves.any() and found.slopes is not None:
            self.merit = self.merit.balanced(found.sides[found.moves], found.slopes[found.moves])

    def judged(self, points: FloatArray) -> Candidates:
        """Points as candidates."""
        found = self.at(points)
        costs = np.where(found.moves, self.merit.cost(np.nan_to_num(found.sides)), np.inf)
        return Candidates(points, costs, self.merit.worst(found.sides))

    def piece(self, number: int) -> Candidates:
        """Where the starts of one piece come to; those of the first piece include the script's own constants."""
        sampler = sobol(len(self.low), self.seed)
        if number:
            sampler.fast_forward(number * self.effort.points)
        points = self.retimed(sampler.random(self.effort.points))
        if number == 0:
            points = np.concatenate([self.own[None], points])
        return self.descended(self._starts(points, keep=number == 0))

    def island(self, number: int) -> Candidates:
        """Where the best of one population come to."""
        differential_evolution: Any = import_module("scipy.optimize").differential_evolution

        timed = [] if self.timing is None else self.timing.free_times.columns
        tried = np.setdiff1d(np.arange(len(self.low)), timed)

        def points_of(rows: FloatArray) -> FloatArray:
            points = np.full((len(rows), len(self.low)), 0.5)
            points[:, tried] = np.clip(rows, 0.0, 1.0)
            return self.retimed(points)

        def cost(columns: FloatArray) -> FloatArray:
            found = self.at(points_of(columns.T))
            sides = np.nan_to_num(found.sides)
            total = self.merit.cost(sides) + PENALTIES[-1] * self.merit.penalty(sides)
            dear = DEAR * self.size**2
            return np.where(found.moves, np.minimum(total, dear), dear * (2.0 - found.reach))

        generator = np.random.default_rng([self.seed, number])
        first = generator.random((self.effort.population, len(tried)))
        found = differential_evolution(
            cost,
            [(0.0, 1.0)] * len(tried),
            init=first,
            maxiter=self.effort.generations,
            seed=generator,
            polish=False,
            vectorized=True,
            updating="deferred",
            tol=POPULATION_SETTLED,
        )
        return self.descended(self._starts(points_of(found.population), keep=False))

    def _starts(self, points: FloatArray, *, keep: bool) -> FloatArray:
        """The best points that are well apart; the first one too, if it is to be kept and moves."""
        merit = self._merits(points)
        order = [int(k) for k in np.argsort(merit, kind="stable") if np.isfinite(merit[k])]
        chosen: list[int] = [0] if keep and np.isfinite(merit[0]) else []
        apart = APART * np.sqrt(len(self.low))
        for least in (apart, 0.2 * apart):
            for k in order:
                if len(chosen) == self.effort.starts:
                    break
                if k not in chosen and all(np.linalg.norm(points[k] - points[j]) > least for j in chosen):
                    chosen.append(k)
        return points[chosen]

    def descended(self, starts: FloatArray, *, goals: bool = True) -> Candidates:
        """Where starts (M, C) come to. ``goals`` False: only requirements count."""
        if len(starts) == 0:
            return Candidates(starts, np.zeros(0), np.zeros(0))
        lagrangian = Lagrangian(self.merit, np.zeros((len(starts), len(self.merit.scale))), PENALTIES[0], goals)
        penalties = PENALTIES if self.merit.required.any() and goals else (PENALTIES[0],)
        iterations = self.effort.iterations * (1 if len(penalties) > 1 else 2)
        points = starts
        for steps, best in self.effort.heats:  # most show soon that they lead nowhere
            if len(points) > best:
                points = self._better_timed(self._minimized(lagrangian, points, steps))
                points = points[np.sort(np.argsort(self._merits(points), kind="stable")[:best])]
                lagrangian = replace(lagrangian, multipliers=lagrangian.multipliers[:best])
        for penalty in penalties:
            if penalty != lagrangian.penalty:
                points = self._better_timed(points)
                lagrangian = lagrangian.updated(self.at(points).sides, penalty)
            points = self._minimized(lagrangian, points, iterations, self.effort.tolerance)
        return self.judged(points)

    def _minimized(
        self, lagrangian: Lagrangian, points: FloatArray, iterations: int, tolerance: float = STEP_TOGETHER
    ) -> FloatArray:
        return minimize_batch(self._rows(lagrangian), points, iterations, tolerance, self.periods).points

    def _better_timed(self, points: FloatArray) -> FloatArray:
        """`retimed` points, where that is better."""
        if self.timing is None:
            return points
        new = self.retimed(points)
        return np.where((self._merits(new) < self._merits(points))[:, None], new, points)

    def _merits(self, points: FloatArray) -> FloatArray:
        """(M,) what goals and requirements are off by together; inf where nothing moves."""
        found = self.at(points)
        sides = np.nan_to_num(found.sides)
        return np.where(found.moves, self.merit.cost(sides) + PENALTIES[0] * self.merit.penalty(sides), np.inf)

    def refined(self, found: Candidates, enough: float = -1.0) -> Candidates:
        """Candidates brought as near to their best as numbers allow, requirements met; no farther where one has a cost
        of ``enough``. The last steps change paths, so that they may come nearer to a point at another time.
        """
        every = best = self._brought(found, enough)
        for _ in range(ROUNDS if self.timing is not None else 0):
            points = self.retimed(best.points)
            other = np.max(np.abs(points - best.points), axis=1, initial=0.0) > OTHER_TIME
            if not other.any() or ((best.costs <= enough) & (best.worst == 0.0)).any():
                break
            best = self._brought(self.judged(points[other]), enough)
            every = every.and_others(best)
        return every

    def _brought(self, found: Candidates, enough: float) -> Candidates:
        twice = 2 if self.effort.heats else 1  # followed with both kinds of damping
        points = np.repeat(found.points, twice, axis=0)
        lagrangian = Lagrangian(self.merit, np.zeros((len(points), len(self.merit.scale))), PENALTIES[1])
        least = float(np.min(found.costs, initial=np.inf))
        fine = FINER * self.effort.tolerance
        required = bool(self.merit.required.any())
        for number in range(DEEP):
            points = self._minimized(lagrangian, points, 8 * self.effort.iterations, fine)
            now = self.judged(points)
            best = float(np.min(now.costs, initial=np.inf))
            met = ((now.costs <= enough) & (now.worst == 0.0)).any()
            falling = best < FALLING * least
            if met or not (required or falling):
                return now
            if number + 1 >= len(PENALTIES) and not falling:
                break
            least = best
            if len(points) > len(found):
                points = points[np.sort(now.order()[: len(found)])]
                lagrangian = replace(lagrangian, multipliers=lagrangian.multipliers[: len(points)])
            if required:
                penalty = PENALTIES[min(number + 1, len(PENALTIES) - 1)]
                lagrangian = lagrangian.updated(self.at(points).sides, penalty)
        before = np.full(len(points), np.inf)
        for _ in range(ROUNDS if required else 0):
            points = self._minimized(lagrangian, points, self.effort.iterations // 2, fine)
            now = self.judged(points)
            slow = now.worst > 0.25 * before
            penalty = lagrangian.penalty * (10.0 if slow.any() and (now.worst[slow] > 0.0).any() else 1.0)
            settled = (now.worst == 0.0) & (before == 0.0)
            before = now.worst
            if settled.all():
                break
            lagrangian = lagrangian.updated(self.at(points).sides, min(penalty, 1e8))
        return self.judged(points)

    def polished(self, point: FloatArray) -> FloatArray:
        """A point without active requirements, polished by SciPy's least squares; as it was if that is no better."""
        least_squares: Any = import_module("scipy.optimize").least_squares

        lagrangian = Lagrangian(self.merit, np.zeros((1, len(self.merit.scale))), PENALTIES[0])

        def rows(u: FloatArray) -> FloatArray:
            found = self.at(self.inside(u)[None], slopes=True)
            return np.nan_to_num(lagrangian.rows(found)[0][0], nan=1e3 * self.size)

        def slopes(u: FloatArray) -> FloatArray:
            found = lagrangian.rows(self.at(self.inside(u)[None], slopes=True))[1]
            assert found is not None
            return np.nan_to_num(found[0])

        low, high = self.bounds
        start = np.clip(point, low + INSIDE, high - INSIDE)
        tiny = dict.fromkeys(("ftol", "xtol", "gtol"), POLISHED)
        found = least_squares(rows, start, slopes, bounds=(low, high), method="dogbox", max_nfev=60, **tiny)
        both = self.judged(np.stack([point, self.inside(found.x)]))
        better = both.worst[1] <= both.worst[0] and both.costs[1] < both.costs[0]
        return both.points[1] if better else point

    def _rows(self, lagrangian: Lagrangian) -> Rows:
        def rows(points: FloatArray, chosen: BoolArray, worse_than: FloatArray) -> tuple[FloatArray, FloatArray]:
            values, slopes = lagrangian.rows(self.at(points, slopes=together), chosen)
            if slopes is None:  # they cost many solutions, so only where they are of use
                slopes = np.zeros((*values.shape, points.shape[1]))
                better = 0.5 * np.einsum("vr,vr->v", values, values) < worse_than
                if better.any():
                    some = np.zeros_like(chosen)
                    some[np.nonzero(chosen)[0][better]] = True
                    found = lagrangian.rows(self.at(points[better], slopes=True), some)[1]
                    assert found is not None
                    slopes[better] = found
            return values, slopes

        together = bool(self.effort.heats)
        return rows


def sobol(columns: int, seed: int) -> Any:
    """A sequence of points of the unit box."""
    qmc: Any = import_module("scipy.stats").qmc
    return qmc.Sobol(columns, scramble=True, seed=np.random.default_rng(seed))
