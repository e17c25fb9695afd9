"""Newton's method on one block's equations, for many instants or starts at once.

Rows and unknowns are scaled to size one before any decision. Square blocks take LU steps; rectangular ones take the
step that is least in the block's metric (free blocks) or in the least-squares sense (redundant ones), with rank decided
relative to the largest singular value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.planning.blocks.kinds import Free, Newton
from movimentum.planning.codegen.generate import Compiled
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.linearization import chord_newton
from movimentum.solver.block.rows import jacobian_of, residual_of
from movimentum.solver.block.scaling import RANK_TOLERANCE, relative_error, scaled

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

STEP_TOLERANCE = 1e-14
"""In units of the unknowns' scale."""
LAST_STEP = 1e-8
FAR = 0.05
MOVING = 1e-4
"""Of a random motion: what is left of it where a large block has freedom."""


def step_of(jacobian: FloatArray, residual: FloatArray, scale: FloatArray, square: bool) -> FloatArray:
    """(F, n) Newton steps; least-norm (in units of ``scale``), least-squares where not square or singular."""
    if residual.shape[1] == 0:
        return np.zeros((len(residual), len(scale)))
    rows, lengths = scaled(jacobian, scale)
    right = residual / lengths
    if square:
        try:
            return -np.linalg.solve(rows, right[..., None])[..., 0] * scale
        except np.linalg.LinAlgError:
            pass
    finite = np.isfinite(rows).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    result = np.full((len(rows), len(scale)), np.nan)
    if finite.any():
        inverse = np.linalg.pinv(rows[finite], rcond=RANK_TOLERANCE)
        result[finite] = -np.einsum("fnm,fm->fn", inverse, right[finite]) * scale
    return result


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """``x`` (F, n); ``converged`` (F,); ``error`` (F,) the last relative residual."""

    x: FloatArray
    converged: BoolArray
    error: FloatArray


def newton(
    block: Newton,
    u: State,
    k: Sequence[FloatArray],
    start: FloatArray,
    scale: FloatArray,
    *,
    iterations: int = 12,
    limit: float | None = None,
) -> Outcome:
    """Solve the block from ``start`` (F, n). ``limit`` bounds a single step (in units of ``scale``), for starts from
    afar.

    Stops where steps are below `STEP_TOLERANCE` or no longer shrink; converged means a relative residual below 1e-9
    (near a singularity the step is no measure, the residual is).
    """
    x = np.array(start, dtype=np.float64)
    if isinstance(block, Free) and block.sparse is not None:
        return _sparse_newton(block, u, k, x, scale, iterations, limit)
    square = block.rows == len(block.core) and not block.free
    last = np.full(len(x), np.inf)
    going = np.ones(len(x), dtype=np.bool_)  # what has arrived moves no more: no instant depends on the others
    residual = residual_of(block, u, k, x)
    with np.errstate(all="ignore"):
        for done in range(1, iterations + 1):
            jacobian = jacobian_of(block, u, k, x)
            step = step_of(jacobian, residual, scale, square)
            size = np.max(np.abs(step) / scale, axis=1, initial=0.0)
            if limit is not None:
                step = step * np.minimum(1.0, limit / np.maximum(size, 1e-300))[:, None]
            moved = going & np.isfinite(step).all(axis=1)
            x = np.where(moved[:, None], x + np.where(moved[:, None], step, 0.0), x)
            residual = residual_of(block, u, k, x)
            going &= ~(size <= STEP_TOLERANCE)
            if done > 3 and limit is None:
                going &= ~((size >= 0.5 * last) & (size < 1e-9))
            if not going.any():
                break
            last = size
        error = relative_error(residual, jacobian_of(block, u, k, x), scale)
    return Outcome(x, np.isfinite(error) & (error <= 1e-9), error)


def _sparse_newton(
    block: Free,
    u: State,
    k: Sequence[FloatArray],
    x: FloatArray,
    scale: FloatArray,
    iterations: int,
    limit: float | None,
) -> Outcome:
    """`newton` for a large free block, one instant after the other."""
    size = float(np.max(scale))
    error = np.full(len(x), np.inf)
    for f in range(len(x)):
        one: State = [None] * len(u)
        for n in block.inputs:
            if u[n] is not None:
                one[n] = np.broadcast_to(u[n], len(x))[f : f + 1]
        clocks = tuple(np.broadcast_to(clock, len(x))[f : f + 1] for clock in k)
        x[f], off, _ = chord_newton(block, one, clocks, x[f], iterations, None if limit is None else limit * size)
        error[f] = off
    return Outcome(x, np.isfinite(error) & (error <= 1e-9), error)


def freedom_of(block: Newton, u: State, k: Sequence[FloatArray], x: FloatArray, scale: FloatArray) -> int:
    """Unknowns minus rank at core values ``x`` (n,) at one instant; of a large block, 1 where there is any freedom."""
    if isinstance(block, Free) and block.sparse is not None:
        return int(len(block.core) > block.rows or _moves(block, u, k, x))
    rows, _ = scaled(jacobian_of(block, u, k, x[None]), scale)
    if 0 in rows.shape:
        return len(x)
    singular = np.linalg.svd(np.nan_to_num(rows[0], posinf=0.0, neginf=0.0), compute_uv=False)
    return len(x) - int(np.sum(singular > 1e-7 * max(singular[0], 1e-300)))


def _moves(block: Free, u: State, k: Sequence[FloatArray], x: FloatArray) -> bool:
    """Whether the rows of a large block leave anything of a random motion."""
    from movimentum.solver.block.sparse import saddle

    tangent = saddle(block, u, k, x)
    motion = np.random.default_rng(5).normal(size=len(x)) * tangent.scale
    left = tangent.least(np.zeros(block.rows), -block.metric.applied(motion))
    return bool(np.max(np.abs(left) / tangent.scale) > MOVING * np.max(np.abs(motion) / tangent.scale))


def unrolled(
    block: Newton, u: State, k: Sequence[FloatArray], x: FloatArray, scale: FloatArray, step: Compiled
) -> BoolArray:
    """Improve ``x`` (n, F) in place by Newton steps that ``step`` computes; returns which instants converged (F,).

    A step below 1e-8 is the last one needed: the next would be its square. Instants whose steps do not come down so
    far, or lead far away, are left to a method that chooses its pivots.
    """
    start = x.copy()
    last = np.full(x.shape[1], np.inf)
    for _ in range(6):
        for j, n in enumerate(block.core):
            u[n] = x[j]
        steps = step(u, k)
        last = np.zeros(x.shape[1])
        for j, s in enumerate(steps):
            x[j] -= s
            np.fmax(last, np.abs(s) / scale[j], out=last)
            last += s - s  # nan stays
        if not (last > LAST_STEP).any():
            break
    far = np.max(np.abs(x - start) / scale[:, None], axis=0) > FAR
    good = (last <= LAST_STEP) & ~far
    x[:, ~good] = start[:, ~good]
    return good
