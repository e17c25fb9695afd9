"""A block's rows at core values: residuals, Jacobians, and the errors of its wishes; of large blocks by their terms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.planning.blocks.kinds import Free, Newton
from movimentum.planning.structure.linear_rows import SparseRows
from movimentum.solver.block.closed_form import State

FloatArray = NDArray[np.float64]


def residual_of(block: Newton, u: State, k: Sequence[FloatArray], x: FloatArray) -> FloatArray:
    """(F, m) residuals at core values ``x`` (F, n)."""
    if isinstance(block, Free) and block.sparse is not None:
        return sparse_residual(block.sparse, u, k, x)
    assert block.residual is not None
    for j, n in enumerate(block.core):
        u[n] = x[:, j]
    values = block.residual(u, k)
    result = np.empty((len(x), len(values)))
    for i, value in enumerate(values):
        result[:, i] = value
    return result


def jacobian_of(block: Newton, u: State, k: Sequence[FloatArray], x: FloatArray) -> FloatArray:
    """(F, m, n) Jacobian at core values ``x`` (F, n)."""
    if isinstance(block, Free) and block.sparse is not None:
        return _filled(block.sparse, sparse_slopes(block.sparse, u, k, x), len(block.core))
    assert block.jacobian is not None
    for j, n in enumerate(block.core):
        u[n] = x[:, j]
    result = np.zeros((len(x), block.rows, len(block.core)))
    for (i, j), value in zip(block.entries, block.jacobian(u, k), strict=True):
        result[:, i, j] = value
    return result


def _filled(rows: SparseRows, slopes: FloatArray, columns: int) -> FloatArray:
    """(F, m, n) from the (F, entries) of a sparse Jacobian."""
    result = np.zeros((len(slopes), rows.rows, columns))
    result[:, np.repeat(np.arange(rows.rows), np.diff(rows.indptr)), rows.indices] = slopes
    return result


def wishes_of(block: Newton, u: State, k: Sequence[FloatArray], x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The errors (F, p) of the wishes that draw a block, and their Jacobian (F, p, n), at core values ``x`` (F, n)."""
    wishes = block.wishes if isinstance(block, Free) else None
    count = 0 if wishes is None else wishes.count
    errors = np.zeros((len(x), count))
    jacobian = np.zeros((len(x), count, len(block.core)))
    if wishes is not None:
        for j, n in enumerate(block.core):
            u[n] = x[:, j]
        for i, value in enumerate(wishes.errors(u, k)):
            errors[:, i] = value
        for (i, j), value in zip(wishes.entries, wishes.slopes(u, k), strict=True):
            jacobian[:, i, j] = value
        # where it has no gradient (the distance of two places that are one), a wish draws nothing
        jacobian[~np.isfinite(jacobian).all(axis=2)] = 0.0
    return errors, jacobian


def _coefficients(rows: SparseRows, u: State, k: Sequence[FloatArray], count: int) -> FloatArray:
    """(F, T) coefficients of the terms at F instants."""
    values = np.repeat(rows.constants[None], count, axis=0)
    if rows.coefficients is not None:
        for t, value in zip(rows.varying, rows.coefficients(u, k), strict=True):
            values[:, t] = value
    return values


def sparse_residual(rows: SparseRows, u: State, k: Sequence[FloatArray], x: FloatArray) -> FloatArray:
    """(F, m) residuals at core values ``x`` (F, n)."""
    values = _coefficients(rows, u, k, len(x))
    for d in range(rows.factors.shape[1]):
        values = values * _extended(x)[:, rows.factors[:, d]]
    return np.array([np.bincount(rows.row, some, rows.rows) for some in values], dtype=np.float64)


def sparse_slopes(rows: SparseRows, u: State, k: Sequence[FloatArray], x: FloatArray) -> FloatArray:
    """(F, entries) of the Jacobian at core values ``x`` (F, n), in the order of `SparseRows.indices`."""
    coefficients = _coefficients(rows, u, k, len(x))
    chosen = [_extended(x)[:, rows.factors[:, d]] for d in range(rows.factors.shape[1])]
    result = np.zeros((len(x), len(rows.indices) + 1))
    for d in range(len(chosen)):
        slope = coefficients
        for other, value in enumerate(chosen):
            if other != d:
                slope = slope * value
        for f, some in enumerate(slope):
            result[f] += np.bincount(rows.slots[:, d], some, result.shape[1])
    return result[:, :-1]


def _extended(x: FloatArray) -> FloatArray:
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)
