"""What makes no difference to a fit: constants that are periodic, and what the goals leave open.

A full turn of an angle is a period, and so is the length of a film that loops.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.fitting.search import SAMPLE, Search, sobol
from movimentum.records import dataclass
from movimentum.tolerances import (
    CURVATURE_STEP,
    GOAL_LEFT_OVER,
    NO_CURVATURE,
    RANK_OF_SLOPES,
    REQUIREMENT_ACTIVE,
    SAME_AFTER_A_PERIOD,
    SLOPE_OF_AN_IDLE_CONSTANT,
)

FEW = 4
"""Variants that tell, where each is solved by itself."""


def periods_of(search: Search, length: float) -> FloatArray:
    """(C,) the periods of constants, in units of the box: their interval, or a full turn; infinite where there is none.
    ``length``: of the film. Where each variant is solved by itself, only such intervals are tried as are usual.
    """
    together = bool(search.effort.heats)
    points = sobol(len(search.low), 0).random(SAMPLE if together else FEW)
    found = np.full(len(search.low), np.inf)
    for column, width in enumerate((search.high - search.low).tolist()):
        usual = together or width in (360.0, length)
        for period in (width if usual else 360.0, 360.0):
            if period <= width and _same_after(search, points, column, period / width):
                found[column] = period / width
    return found


def _same_after(search: Search, points: FloatArray, column: int, period: float) -> bool:
    """Whether goals and requirements are the same, and change alike, when a constant grows by ``period``; not if they
    never change.
    """
    slopes = bool(search.effort.heats)
    first, last, between = points.copy(), points.copy(), points.copy()
    first[:, column], last[:, column], between[:, column] = 0.0, period, 0.37 * period
    one, other, third = (search.at(each, slopes=slopes) for each in (first, last, between))
    both = one.moves & other.moves
    if not both.any():
        return False
    apart = np.abs(one.sides - other.sides)[both].max()
    if one.slopes is not None and other.slopes is not None:
        steep = max(search.size, float(np.abs(one.slopes[both]).max()))
        apart = max(apart, search.size / steep * np.abs(one.slopes - other.slopes)[both].max())
    idle = np.array_equal(one.sides, third.sides, equal_nan=True)
    return bool(apart <= SAME_AFTER_A_PERIOD * search.size) and not idle


ELSEWHERE, NEARBY = 2, 0.02
"""Points, besides the solution, at which a constant must make no difference either; and how far from there, in units
of the box.
"""
APART = 0.01
"""Of an interval: solutions that are isolated are no nearer to each other."""


@dataclass(frozen=True, slots=True, eq=False)
class Undecided:
    """``idle`` (C,): the constants that no goal and no requirement depends on. ``free``: of the others, how many may be
    chosen, and the rest still be found.
    """

    idle: BoolArray
    free: int

    def apart(self, points: FloatArray, chosen: FloatArray) -> FloatArray:
        """Those of ``points`` (M, C) of the unit box that are other solutions than ``chosen`` (C,), and than those
        before them.
        """
        kept = [chosen]
        for point in points:
            if all(np.max(np.abs(point - other)[~self.idle], initial=0.0) > APART for other in kept):
                kept.append(point)
        return np.array(kept[1:]).reshape(-1, len(chosen))


def undecided(search: Search, point: FloatArray) -> Undecided:
    """The directions left open at a solution, a ``point`` (C,) of the unit box."""
    sampler = np.random.default_rng(search.seed)
    around = point + np.where(point < 0.5, 1.0, -1.0) * sampler.uniform(0.0, NEARBY, (ELSEWHERE, len(point)))
    found = search.at(np.concatenate([point[None], around]), slopes=True)
    assert found.slopes is not None
    slopes = np.nan_to_num(found.slopes)
    idle = np.asarray((np.abs(slopes) <= SLOPE_OF_AN_IDLE_CONSTANT * search.size).all(axis=(0, 1)), dtype=np.bool_)
    if not np.isfinite(found.sides[0]).all():
        return Undecided(idle, 0)
    merit, sides = search.merit, found.sides[0]
    margin = np.where(merit.required, merit.allowed, 0.0) + REQUIREMENT_ACTIVE * search.size
    counts = merit.equal | (sides > -margin)
    at_end = ((point <= 0.0) | (point >= 1.0)) & np.isinf(search.periods)
    ends = np.eye(len(point))[at_end & ~idle]
    if merit.extremes or float(merit.cost(found.sides[:1])[0]) > (GOAL_LEFT_OVER * search.size) ** 2:
        limits = [np.eye(len(sides))[counts & merit.required]]
        linear = np.zeros(len(sides))
        for each in merit.extremes:  # all of its greatest sides stay alike
            own = sides[each.sides]
            first, *others = each.sides[own >= np.max(own) - REQUIREMENT_ACTIVE * search.size]
            linear[first] += 0.5 * each.weight
            limits.append(np.eye(len(sides))[others] - np.eye(len(sides))[first])
        held = _Held(np.concatenate(limits), linear, ends)
        return Undecided(idle, _flat(search, point, np.where(counts & merit.goals, merit.scale**2, 0.0), held, ~idle))
    rows = np.concatenate([slopes[0][counts] * merit.scale[counts, None], ends])[:, ~idle]
    return Undecided(idle, rows.shape[1] - _rank(rows))


def _rank(rows: FloatArray) -> int:
    singular = np.linalg.svd(rows, compute_uv=False) if rows.size else np.zeros(0)
    return int(np.sum(singular > RANK_OF_SLOPES * np.max(singular, initial=0.0)))


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """What stays as it is: ``limits`` (K, S) are sums of sides, and ``ends`` (E, C) constants. ``linear`` (S,): half of
    what is to be small, as a sum of sides.
    """

    limits: FloatArray
    linear: FloatArray
    ends: FloatArray


def _flat(search: Search, point: FloatArray, weights: FloatArray, held: _Held, used: BoolArray) -> int:
    """In how many directions of the ``used`` constants the Lagrangian has no curvature at a ``point`` where goals
    (``weights`` (S,) of their squares) are missed, while what is ``held`` stays. Slopes alone do not tell: a minimum
    may be isolated although fewer goals than constants change at first order (Nocedal & Wright, Numerical Optimization,
    theorem 12.6).
    """
    if not search.effort.heats:  # slopes are differences, too coarse to be differentiated again
        return 0
    columns = np.nonzero(used)[0]
    steps = CURVATURE_STEP * np.eye(len(point))[columns]
    found = search.at(np.concatenate([point[None], point + steps, point - steps]), slopes=True)
    assert found.slopes is not None
    if not np.isfinite(found.sides).all():
        return 0
    slopes = np.nan_to_num(found.slopes[:, :, used])
    gradients = np.einsum("vs,vsc->vc", weights * found.sides + held.linear, slopes)
    limits = np.einsum("ks,vsc->vkc", held.limits, slopes)
    rows = np.concatenate([limits[0], held.ends[:, used]])
    multipliers: FloatArray = np.zeros(len(held.limits))
    if len(rows):
        least_squares: Any = np.linalg.lstsq
        forces: FloatArray = least_squares(rows.T, -gradients[0], rcond=None)[0]
        multipliers = forces[: len(multipliers)]
    gradients = gradients + np.einsum("r,vrc->vc", multipliers, limits)
    half = len(columns)
    curvature = (gradients[1 : half + 1] - gradients[half + 1 :]) / (2.0 * CURVATURE_STEP)
    free = np.eye(half)
    if len(rows):
        free = np.linalg.svd(rows)[2][_rank(rows) :].T
    bends = np.abs(np.linalg.eigvalsh(free.T @ (0.5 * (curvature + curvature.T)) @ free)) if free.size else np.zeros(0)
    return int(np.sum(bends <= NO_CURVATURE * np.max(np.abs(curvature), initial=0.0)))
