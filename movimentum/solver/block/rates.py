"""One block's equations differentiated: its unknowns as Taylor series in time, given those of earlier blocks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr
from movimentum.planning.blocks.velocities import BlockRows
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.arithmetic.taylor import Series, Taylor, coefficient
from movimentum.solver.basis.instants import Instants
from movimentum.tolerances import LEAST_DIVISOR, SINGULAR_FOR_RATES


@dataclass(slots=True, eq=False)
class SeriesMoment:
    """A plan's unknowns as series at F instants: ``values`` by number, as far as they are known."""

    plan: Plan
    instants: Instants
    values: list[Series | None]
    ahead: bool

    def of(self, number: int | None) -> Series | None:
        """An unknown's series; None where the plan has none."""
        return None if number is None else self.values[number]

    def clock(self, node: Expr) -> Series:
        """Time since an instant."""
        one = np.float64(1.0)
        if node.start in self.plan.clocks:
            return self.instants.clocks[self.plan.clocks.index(node.start)], one
        return self.instants.tau + float(self.plan.system.segment.start - node.start), one

    def leaf(self, node: Expr) -> Series:
        """A clock or an unknown."""
        if node.op == "clock":
            return self.clock(node)
        assert isinstance(node.payload, int)
        value = self.values[node.payload]
        assert value is not None
        return value

    def series(self, nodes: Sequence[Expr], outputs: Sequence[Expr], order: int) -> list[Series]:
        """The series of ``outputs`` up to ``order``, as far as the unknowns are known."""
        return Taylor(order, ahead=self.ahead).values(nodes, outputs, self.leaf)

    def coefficients(self, nodes: Sequence[Expr], outputs: Sequence[Expr], order: int) -> FloatArray:
        """(len(outputs), F): their coefficients of that order."""
        found = self.series(nodes, outputs, order)
        count = len(self.instants)
        rows = [np.broadcast_to(coefficient(item, order), count) for item in found]
        return np.array(rows, dtype=np.float64).reshape(len(rows), count)

    def extend(self, number: int, value: FloatArray) -> None:
        """One more coefficient of an unknown."""
        known = self.values[number]
        assert known is not None
        self.values[number] = (*known, value)


def differentiated(rows: BlockRows, moment: SeriesMoment, depth: int) -> FloatArray:
    """Give the unknowns of ``rows`` their derivatives up to order ``depth``; returns (F,) the Jacobian's reciprocal
    condition number.
    """
    count = len(moment.instants)
    jacobian = np.zeros((count, len(rows.residuals), len(rows.unknowns)))
    for (i, j), value in zip(rows.entries, moment.coefficients(rows.slope_nodes, rows.slopes, 0), strict=True):
        jacobian[:, i, j] += value
    solver = _Solver(jacobian)
    for order in range(1, depth + 1):
        found = solver.solve(-moment.coefficients(rows.nodes, rows.residuals, order).T)
        for j, n in enumerate(rows.unknowns):
            moment.extend(n, found[:, j])
    return solver.condition


class _Solver:
    """J x = b for F Jacobians (F, m, n), m >= n, balanced first; ``condition`` (F,) are their reciprocal condition
    numbers (0 where singular, nan where not finite).
    """

    def __init__(self, jacobian: FloatArray) -> None:
        count, m, n = jacobian.shape
        self.rows, self.columns = np.ones((count, m)), np.ones((count, n))
        matrix = jacobian
        for _ in range(3):
            self.rows = self.rows / _lengths(matrix, 2)
            matrix = jacobian * self.rows[:, :, None] * self.columns[:, None, :]
            self.columns = self.columns / _lengths(matrix, 1)
            matrix = jacobian * self.rows[:, :, None] * self.columns[:, None, :]
        finite = np.asarray(np.isfinite(matrix).all(axis=(1, 2)), dtype=np.bool_)
        self.matrix = np.where(finite[:, None, None], matrix, np.eye(m, n))
        if m == n:
            signs = np.asarray(np.linalg.slogdet(self.matrix)[0], dtype=np.float64)
            regular = np.asarray(signs != 0.0, dtype=np.bool_)
            self.matrix = np.where(regular[:, None, None], self.matrix, np.eye(n))
            self.inverse = np.linalg.inv(self.matrix)
            reach = np.linalg.norm(self.matrix, axis=(1, 2)) * np.linalg.norm(self.inverse, axis=(1, 2)) / max(n, 1)
            condition = np.where(regular, 1.0 / np.maximum(reach, 1.0), 0.0)
        else:
            left, singular, right = np.linalg.svd(self.matrix, full_matrices=False)
            condition = singular[:, -1] / np.maximum(singular[:, 0], LEAST_DIVISOR)
            inverted = np.where(
                singular > SINGULAR_FOR_RATES * singular[:, :1], 1.0 / np.maximum(singular, LEAST_DIVISOR), 0.0
            )
            self.inverse = np.einsum("fki,fk,fmk->fim", right, inverted, left)
        self.condition = np.where(finite, condition, np.nan)

    def solve(self, right: FloatArray) -> FloatArray:
        """(F, n) for right-hand sides (F, m)."""
        wanted = right * self.rows
        x = np.einsum("fnm,fm->fn", self.inverse, wanted)
        left = wanted - np.einsum("fmn,fn->fm", self.matrix, x)
        x = x + np.einsum("fnm,fm->fn", self.inverse, left)
        return x * self.columns


def _lengths(matrix: FloatArray, axis: int) -> FloatArray:
    lengths = np.sqrt(np.sum(np.square(matrix), axis=axis))
    return np.where((lengths > 0.0) & np.isfinite(lengths), lengths, 1.0)
