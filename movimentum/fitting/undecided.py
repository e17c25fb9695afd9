"""What goals and requirements leave open: constants that nothing depends on, and how many more may be chosen freely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.fitting.search import Search

NOTHING = 1e-12
"""In sizes of the scene, for the whole of a constant's interval: what changes by no more does not depend on it."""
RANK = 1e-6
"""Of the largest singular value: one that is smaller belongs to a direction in which nothing changes."""
ACTIVE = 1e-6
"""Of the scene's size: a requirement with no more to spare decides."""
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
    """What is left open at a solution, a ``point`` (C,) of the unit box."""
    sampler = np.random.default_rng(search.seed)
    around = np.clip(point + sampler.uniform(-NEARBY, NEARBY, (ELSEWHERE, len(point))), 0.0, 1.0)
    found = search.at(np.concatenate([point[None], around]), slopes=True)
    assert found.slopes is not None
    slopes = np.nan_to_num(found.slopes)
    idle = np.asarray((np.abs(slopes) <= NOTHING * search.size).all(axis=(0, 1)), dtype=np.bool_)
    if not np.isfinite(found.sides[0]).all():
        return Undecided(idle, 0)
    merit, sides = search.merit, found.sides[0]
    margin = np.where(merit.required, merit.allowed, 0.0) + ACTIVE * search.size
    counts = merit.equal | (sides > -margin)
    at_end = (point <= 0.0) | (point >= 1.0)
    rows = np.concatenate([slopes[0][counts] * merit.scale[counts, None], np.eye(len(point))[at_end & ~idle]])
    rows = rows[:, ~idle]
    singular = np.linalg.svd(rows, compute_uv=False) if rows.size else np.zeros(0)
    rank = int(np.sum(singular > RANK * np.max(singular, initial=0.0)))
    return Undecided(idle, rows.shape[1] - rank)
