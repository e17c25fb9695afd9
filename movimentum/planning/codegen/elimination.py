"""Newton's step of a small sparse system as straight-line expressions: Gaussian elimination, unrolled.

A batched dense solver spends most of its time on overhead where the systems are small and there are many; unrolled over
arrays of frames each operation is one array operation, and zeros cost nothing. The order of pivots is fixed beforehand
from samples of the matrix (Markowitz 1957, with a threshold: Duff, Erisman & Reid, *Direct Methods for Sparse
Matrices*, ch. 7), so it must be verified where it is used.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.expressions import ONE, ZERO, Expr, div, mul, sub
from movimentum.tolerances import LEAST_DIVISOR

THRESHOLD = 0.1
"""A pivot should not be smaller than this share of the largest entry in its row, at any sample."""

Pivot = tuple[int, int]


def pivot_order(samples: NDArray[np.float64], present: Sequence[tuple[int, int]]) -> list[Pivot]:
    """(row, column) pivots in order, for sample matrices (K, n, n) whose entries ``present`` are not always zero."""
    matrices = np.array(samples, dtype=np.float64)
    size = matrices.shape[1]
    columns_of: list[set[int]] = [set() for _ in range(size)]
    for row, column in present:
        columns_of[row].add(column)
    rows, columns = set(range(size)), set(range(size))
    order: list[Pivot] = []
    while rows:
        best: tuple[tuple[bool, int, float], int, int] | None = None
        for row in sorted(rows):
            inside = sorted(columns_of[row] & columns)
            largest = np.max(np.abs(matrices[:, row, inside]), axis=1) if inside else np.zeros(len(matrices))
            for column in inside:
                share = float(np.min(np.abs(matrices[:, row, column]) / np.maximum(largest, LEAST_DIVISOR)))
                fill = (len(inside) - 1) * (sum(column in columns_of[other] for other in rows) - 1)
                good = share >= THRESHOLD
                rank = (not good, fill if good else 0, -share)
                if best is None or rank < best[0]:
                    best = rank, row, column
        if best is None:
            return []
        _, row, column = best
        order.append((row, column))
        rows.discard(row)
        columns.discard(column)
        pivot = matrices[:, row, column]
        pivot = np.where(pivot == 0.0, LEAST_DIVISOR, pivot)
        for other in rows:
            if column in columns_of[other]:
                factor = matrices[:, other, column] / pivot
                matrices[:, other] -= factor[:, None] * matrices[:, row]
                columns_of[other] |= columns_of[row] & columns
    return order


def newton_steps(
    size: int, entries: dict[tuple[int, int], Expr], residuals: Sequence[Expr], order: Sequence[Pivot]
) -> list[Expr]:
    """The n components of the solution s of J s = r; x - s is Newton's next point."""
    rows: list[dict[int, Expr]] = [{} for _ in range(size)]
    for (row, column), slope in entries.items():
        rows[row][column] = slope
    right = list(residuals)
    inverses: dict[int, Expr] = {}
    done: list[Pivot] = []
    for row, column in order:
        inverse = inverses[row] = div(ONE, rows[row][column])
        used = {r for r, _ in done} | {row}
        for other in range(size):
            if other in used or column not in rows[other]:
                continue
            factor = mul(rows[other].pop(column), inverse)
            for c, slope in rows[row].items():
                if c != column and c not in {k for _, k in done}:
                    rows[other][c] = sub(rows[other].get(c, ZERO), mul(factor, slope))
            right[other] = sub(right[other], mul(factor, right[row]))
        done.append((row, column))
    steps: dict[int, Expr] = {}
    for row, column in reversed(done):
        total = right[row]
        for c, slope in rows[row].items():
            if c in steps:
                total = sub(total, mul(slope, steps[c]))
        steps[column] = mul(total, inverses[row])
    return [steps[column] for column in range(size)]
