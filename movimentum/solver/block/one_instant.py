"""Newton's method on one square block at one instant, in plain floats.

Following a path asks for one pose after the other. For a few unknowns, arrays of length one cost ten times as much as
floats, whose arithmetic is the same to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Newton
from movimentum.solver.basis.effort import charge
from movimentum.solver.block.problem import BlockProblem
from movimentum.tolerances import (
    LEAST_DIVISOR,
    NEWTON_LAST_STEP,
    NEWTON_SOLVED,
    NEWTON_STEP_DONE,
    QUADRATIC_CONVERGENCE,
)


class OneInstant:
    """A square block at one instant. ``scale`` (n,) are the natural sizes of its core unknowns."""

    def __init__(self, problem: BlockProblem) -> None:
        block = problem.block
        self._block: Newton = block
        self._inputs = {n: first_of(value) for n, value in problem.inputs.items()}
        self._clocks = [first_of(clock) for clock in problem.clocks]
        self._scale = problem.scale
        self._places = tuple(np.array(block.entries, dtype=np.intp).reshape(-1, 2).T)

    def corrected(self, start: FloatArray, iterations: int) -> tuple[FloatArray, bool] | None:
        """Where Newton's method leads from core values ``start`` (n,), and whether that is a solution; None where plain
        floats cannot tell, because something is divided by zero or the Jacobian is singular.
        """
        try:
            with np.errstate(all="ignore"):
                return self._corrected(start, iterations)
        except (ZeroDivisionError, OverflowError, np.linalg.LinAlgError):
            return None

    def _corrected(self, x: FloatArray, iterations: int) -> tuple[FloatArray, bool] | None:
        last = np.inf
        for _ in range(iterations):
            charge()
            residual, wide = self._linearized(x)
            lengths: FloatArray = np.sqrt(np.einsum("mn,mn->m", wide, wide))
            step = np.asarray(np.linalg.solve(wide / lengths[:, None], residual / lengths), dtype=np.float64)
            size = float(np.max(np.abs(step)))
            if not size < np.inf or not lengths.all():
                return None
            x = x - step * self._scale
            if size <= NEWTON_STEP_DONE or (size <= NEWTON_LAST_STEP and size <= QUADRATIC_CONVERGENCE * last):
                break  # the next step would be this one's square
            last = size
        residual, wide = self._linearized(x)
        error = float(np.max(np.abs(residual) / np.maximum(np.max(np.abs(wide), axis=1), LEAST_DIVISOR)))
        return x, error <= NEWTON_SOLVED

    def _linearized(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The residuals (n,), and the Jacobian (n, n) by unknowns of size one."""
        block = self._block
        assert block.residual is not None
        assert block.jacobian is not None
        values = {**self._inputs, **dict(zip(block.core, _floats(x), strict=True))}
        jacobian = np.zeros((len(x), len(x)))
        jacobian[self._places] = block.jacobian(values, self._clocks)
        return np.array(block.residual(values, self._clocks), dtype=np.float64), jacobian * self._scale


def _floats(x: FloatArray) -> Sequence[float]:
    found: list[float] = x.tolist()
    return found
