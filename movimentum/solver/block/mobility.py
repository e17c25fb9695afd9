"""Whether equations that determine their unknowns by their number leave a motion all the same.

That is so where some are redundant by their geometry (a third parallel crank, the rhombuses of a tiling). At a dead
centre the rank is lost too, and nothing can move: so another solution is looked for beside it, where the rank must be
lost again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.tolerances import POSE_BESIDE_MET, POSE_BESIDE_NEARLY_MET, RANK_LOST_AT_POSE, RANK_OF_ROWS

Rows = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Unknowns (n,) in units of their scale to residuals (m,) and their Jacobian (m, n), rows scaled alike."""

ASIDE = 0.03
"""Of the unknowns' scale: how far beside a pose another solution is looked for."""
ITERATIONS = 40


def is_mobile(rows: Rows, x: FloatArray) -> bool:
    """Whether the equations that ``x`` (n,) satisfies, square and without full rank there, let it move."""
    unit = _unit(rows, x)
    direction = None if unit is None else _lost(unit[1])
    if direction is None:
        return False
    y = x + ASIDE * direction / float(np.max(np.abs(direction)))
    for _ in range(ITERATIONS):
        beside = _unit(rows, y)
        if beside is None:
            return False
        residual, matrix = beside
        error = float(np.max(np.abs(residual)))
        if error < POSE_BESIDE_MET:
            break
        step = np.linalg.lstsq(matrix, residual, rcond=RANK_OF_ROWS)[0]
        if error < POSE_BESIDE_NEARLY_MET and np.max(np.abs(step)) < POSE_BESIDE_MET:
            break
        y = y - step
    else:
        return False
    return float(np.max(np.abs(y - x))) > 0.5 * ASIDE and _lost(matrix) is not None


def _lost(matrix: FloatArray) -> FloatArray | None:
    """The direction (n,) in which nothing holds; None where something does."""
    _, singular, turned = np.linalg.svd(matrix)
    return turned[-1] if singular[-1] <= RANK_LOST_AT_POSE * singular[0] else None


def _unit(rows: Rows, x: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Residuals and Jacobian with its rows brought to unit length; None where something is not finite."""
    residual, matrix = rows(x)
    largest = np.max(np.abs(matrix), axis=1, initial=0.0)
    largest = np.where(largest > 0.0, largest, 1.0)
    lengths = largest * np.sqrt(np.sum((matrix / largest[:, None]) ** 2, axis=1))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    residual, matrix = residual / lengths, matrix / lengths[:, None]
    return (residual, matrix) if np.isfinite(matrix).all() and np.isfinite(residual).all() else None
