"""The quadratic program of a push: the shortest vector that inequalities allow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.records import dataclass
from movimentum.solver.block.problem import null_space
from movimentum.tolerances import (
    LEAST_DIVISOR,
    PUSH_FEASIBLE,
    PUSH_HOLDS,
    PUSH_MOVES,
    PUSH_RANK,
    PUSH_ROUNDING,
    PUSH_SLOPE,
    PUSH_UNSEEN,
)

Rows = NDArray[np.intp]


def row_numbers(rows: Rows) -> list[int]:
    """The numbers of rows as a list."""
    found: list[int] = rows.tolist()
    return found


@dataclass(frozen=True, slots=True, eq=False)
class ShortestVector:
    """``y`` (n,), and the inequalities that hold it (their numbers). Where no vector satisfies all, ``y`` is None, and
    these are the ones that contradict each other.
    """

    y: FloatArray | None
    active: Rows


def shortest_vector(rows: FloatArray, least: FloatArray, guess: Rows | None = None) -> ShortestVector:
    """The shortest y (n,) with ``rows`` (k, n) y >= ``least`` (k,); ``guess``: which of them may hold it.

    Least distance programming (Lawson & Hanson 1974, *Solving Least Squares Problems*, ch. 23): its dual is a
    non-negative least squares problem, which bears rows that depend on each other. Rows that oppose each other and are
    only just met by anything are equations.
    """
    count, n = rows.shape
    if count == 0 or not (least > 0.0).any():
        still: FloatArray = np.zeros(int(n))
        return ShortestVector(still, np.zeros(0, dtype=np.intp))
    lengths = np.maximum(np.sqrt(np.einsum("kn,kn->k", rows, rows)), LEAST_DIVISOR)
    unit, wanted = rows / lengths[:, None], least / lengths
    size = float(np.max(wanted))
    wanted = wanted / size
    matrix = np.concatenate([unit.T, wanted[None] - PUSH_HOLDS])  # those that oppose each other but for rounding
    target = np.zeros(n + 1)
    target[-1] = 1.0
    forces = non_negative_least_squares(matrix, target, guess)
    residual = matrix @ forces - target
    if -residual[-1] > PUSH_FEASIBLE * max(float(np.max(forces)), 1.0):
        return ShortestVector(-residual[:n] / residual[-1] * size, np.nonzero(forces > 0.0)[0])
    return _with_opposing_equations(unit, wanted, np.nonzero(forces > PUSH_HOLDS * np.max(forces))[0], size)


def _with_opposing_equations(unit: FloatArray, wanted: FloatArray, holding: Rows, size: float) -> ShortestVector:
    """The same where ``holding`` oppose each other: with these as equations, if they agree; in units of ``size``."""
    _, across, inverse = null_space(unit[holding])
    place = inverse @ wanted[holding]
    if np.max(np.abs(unit[holding] @ place - wanted[holding]), initial=0.0) > PUSH_MOVES:
        return ShortestVector(None, holding)
    others = np.setdiff1d(np.arange(len(unit)), holding).astype(np.intp)
    along, missing = unit[others] @ across, wanted[others] - unit[others] @ place
    seen = np.linalg.norm(along, axis=1) > PUSH_UNSEEN
    short = others[~seen & (missing > PUSH_MOVES)]
    if len(short):
        return ShortestVector(None, np.union1d(holding, short).astype(np.intp))
    found = shortest_vector(along[seen], missing[seen])
    which = np.union1d(holding, others[seen][found.active]).astype(np.intp)
    return ShortestVector(None if found.y is None else (place + across @ found.y) * size, which)


def non_negative_least_squares(matrix: FloatArray, target: FloatArray, guess: Rows | None = None) -> FloatArray:
    """The x >= 0 (n,) that makes |``matrix`` (m, n) x - ``target``| least (Lawson & Hanson, ch. 23); ``guess``: which
    may be positive.
    """
    n = matrix.shape[1]
    passive = np.zeros(n, dtype=np.bool_)
    x = np.zeros(n)
    if guess is not None and len(guess):
        some = guess[guess < n]
        found = _solved(matrix[:, some], target)
        if (found > 0.0).all():
            passive[some] = True
            x[some] = found
    tolerance = PUSH_SLOPE * float(np.max(np.abs(matrix), initial=1.0)) * max(float(np.max(np.abs(target))), 1.0)
    barred = np.zeros(n, dtype=np.bool_)
    for _ in range(3 * n + 10):
        slope = matrix.T @ (target - matrix @ x)
        slope[passive | barred] = -np.inf
        k = int(np.argmax(slope)) if n else 0
        if n == 0 or not slope[k] > tolerance:
            break
        passive[k] = True
        first = True
        while True:
            places = np.nonzero(passive)[0]
            found = _solved(matrix[:, places], target)
            if first and found[np.searchsorted(places, k)] <= 0.0:  # it depends on the others, but for rounding
                passive[k] = False
                barred[k] = True
                break
            first = False
            low = found <= 0.0
            if not low.any():
                x[:] = 0.0
                x[places] = found
                barred[:] = False
                break
            now = x[places]
            share = float(np.min(now[low] / np.maximum(now[low] - found[low], LEAST_DIVISOR)))
            x[places] = now + share * (found - now)
            passive[places[x[places] <= PUSH_ROUNDING * max(float(np.max(x)), LEAST_DIVISOR)]] = False
            x[~passive] = 0.0
    return x


def _solved(matrix: FloatArray, target: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.lstsq(matrix, target, rcond=PUSH_RANK)[0], dtype=np.float64)
