"""The equations of one block, given what it reads: residuals and Jacobians as functions of its core unknowns alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Free, Newton
from movimentum.planning.structure.linear_rows import SparseRows
from movimentum.records import dataclass, replace
from movimentum.solver.block.closed_form import State

Values = Mapping[int, FloatArray]
"""By unknown number: (F,), or what broadcasts to it."""


@dataclass(frozen=True, slots=True, eq=False)
class BlockProblem:
    """The rows of ``block`` at F instants: ``inputs`` are the values that it reads of earlier blocks, ``clocks`` (F,)
    each, ``scale`` (n,) the natural sizes of its n core unknowns; (F, n) where the "instants" are variants.

    Core values ``x`` are (F, n) throughout. Nothing that is passed in is ever written to.
    """

    block: Newton
    inputs: Values
    clocks: Sequence[FloatArray]
    scale: FloatArray

    @staticmethod
    def of(block: Newton, state: State, clocks: Sequence[FloatArray], scale: FloatArray) -> BlockProblem:
        """The problem in a solved state of all blocks before it."""
        inputs = {n: value for n in block.inputs if (value := state[n]) is not None}
        return BlockProblem(block, inputs, clocks, scale)

    def given(self, more: Values) -> BlockProblem:
        """The same with more inputs, or others."""
        return replace(self, inputs={**self.inputs, **more})

    def first(self, copies: int = 1) -> BlockProblem:
        """The first of the instants, ``copies`` times."""

        def repeated(value: FloatArray) -> FloatArray:
            return np.full(copies, first_of(value))

        inputs = {n: repeated(value) for n, value in self.inputs.items()}
        return replace(self, inputs=inputs, clocks=tuple(map(repeated, self.clocks)))

    def at(self, places: NDArray[np.int64], count: int) -> BlockProblem:
        """Some of ``count`` instants."""

        def some(value: FloatArray) -> FloatArray:
            return value[places] if len(value) == count else np.broadcast_to(value, count)[places]

        inputs = {n: value if np.ndim(value) == 0 else some(value) for n, value in self.inputs.items()}
        clocks = [some(np.atleast_1d(clock)) for clock in self.clocks]
        scale = self.scale if self.scale.ndim == 1 else self.scale[places]
        return replace(self, inputs=inputs, clocks=clocks, scale=scale)

    def every(self, step: int) -> BlockProblem:
        """The first of its instants, and every one that is so many after."""

        def some(value: FloatArray) -> FloatArray:
            return value[::step] if np.ndim(value) else value

        inputs = {n: some(value) for n, value in self.inputs.items()}
        return replace(self, inputs=inputs, clocks=tuple(map(some, self.clocks)))

    def values(self, x: FloatArray) -> dict[int, FloatArray]:
        """The inputs and the core, by unknown number."""
        return {**self.inputs, **dict(zip(self.block.core, x.T, strict=True))}

    def residual(self, x: FloatArray) -> FloatArray:
        """(F, m) residuals."""
        rows = self.sparse
        if rows is not None:
            return self.sparse_residual(rows, x)
        assert self.block.residual is not None
        found = self.block.residual(self.values(x), self.clocks)
        result = np.empty((len(x), len(found)))
        for i, value in enumerate(found):
            result[:, i] = value
        return result

    def jacobian(self, x: FloatArray) -> FloatArray:
        """(F, m, n) derivatives of the residuals by the core."""
        block = self.block
        rows = self.sparse
        if rows is not None:
            return _filled(rows, self.sparse_slopes(rows, x), len(block.core))
        assert block.jacobian is not None
        result = np.zeros((len(x), block.rows, len(block.core)))
        for (i, j), value in zip(block.entries, block.jacobian(self.values(x), self.clocks), strict=True):
            result[:, i, j] = value
        return result

    def wishes(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The errors (F, p) of the wishes that draw the block, and their Jacobian (F, p, n)."""
        block = self.block
        wishes = block.wishes if isinstance(block, Free) else None
        count = 0 if wishes is None else wishes.count
        errors = np.zeros((len(x), count))
        jacobian = np.zeros((len(x), count, len(block.core)))
        if wishes is not None:
            values = dict(self.inputs)  # and of the core what the wishes read: a large block has a thousand unknowns
            for j in {j for _, j in wishes.entries}:
                values[block.core[j]] = x[:, j]
            for i, value in enumerate(wishes.errors(values, self.clocks)):
                errors[:, i] = value
            for (i, j), value in zip(wishes.entries, wishes.slopes(values, self.clocks), strict=True):
                jacobian[:, i, j] = value
            # where it has no gradient (the distance of two places that are one), a wish draws nothing
            jacobian[~np.isfinite(jacobian).all(axis=2)] = 0.0
        return errors, jacobian

    def completed(self, x: FloatArray) -> dict[int, FloatArray]:
        """The inputs, the core, and the unknowns that are eliminated, by unknown number."""
        values = self.values(x)
        if self.block.explicit is not None:
            found = self.block.explicit(values, self.clocks)
            values.update(zip(self.block.targets, map(np.asarray, found), strict=True))
        return values

    @property
    def sparse(self) -> SparseRows | None:
        """The rows of a large block by their terms."""
        return self.block.sparse if isinstance(self.block, Free) else None

    def _coefficients(self, rows: SparseRows, count: int) -> FloatArray:
        """(F, T) coefficients of the terms at F instants."""
        values = np.repeat(rows.constants[None], count, axis=0)
        if rows.coefficients is not None:
            for t, value in zip(rows.varying, rows.coefficients(self.inputs, self.clocks), strict=True):
                values[:, t] = value
        return values

    def sparse_residual(self, rows: SparseRows, x: FloatArray) -> FloatArray:
        """(F, m) residuals of a large block."""
        values = self._coefficients(rows, len(x))
        for d in range(rows.factors.shape[1]):
            values = values * _extended(x)[:, rows.factors[:, d]]
        return np.array([np.bincount(rows.row, some, rows.rows) for some in values], dtype=np.float64)

    def sparse_slopes(self, rows: SparseRows, x: FloatArray) -> FloatArray:
        """(F, entries) of a large block's Jacobian, in the order of `SparseRows.indices`."""
        coefficients = self._coefficients(rows, len(x))
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


def _filled(rows: SparseRows, slopes: FloatArray, columns: int) -> FloatArray:
    """(F, m, n) from the (F, entries) of a sparse Jacobian."""
    result = np.zeros((len(slopes), rows.rows, columns))
    result[:, np.repeat(np.arange(rows.rows), np.diff(rows.indptr)), rows.indices] = slopes
    return result


def _extended(x: FloatArray) -> FloatArray:
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)
