"""Newton's method on one block's equations, for many instants or starts at once.

Rows and unknowns are scaled to size one before any decision. Square blocks take LU steps; rectangular ones take the
step that is least in the block's metric (free blocks) or in the least-squares sense (redundant ones), with rank decided
relative to the largest singular value.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, first_of
from movimentum.planning.codegen.writing import Compiled
from movimentum.records import dataclass
from movimentum.solver.basis.effort import charge_effort
from movimentum.solver.block.linearization import chord_newton
from movimentum.solver.block.problem import BlockProblem, relative_error, scaled
from movimentum.tolerances import (
    LEAST_DIVISOR,
    LEFT_OF_RANDOM_MOTION,
    NEWTON_LAST_STEP,
    NEWTON_SOLVED,
    NEWTON_STALLED,
    NEWTON_STEP_DONE,
    QUADRATIC_CONVERGENCE,
    RANK_FOR_FREEDOM,
    RANK_OF_ROWS,
    START_EXACT,
)

LONGEST_WAY = 1e5
"""Of the residual of a start that is a solution: a way from there that is longer is a singular pose's, and means
nothing.
"""
FAR_START = 0.05


JACOBIAN_ENTRIES_AT_A_TIME = 1_000_000
"""Numbers of all instants' Jacobians that are held at a time; decompositions take ten times as much memory."""
WELL_CONDITIONED = 1e8
"""Of the normal equations of rows: well below where their rank is in question, at 1 / `RANK_OF_ROWS` squared."""


def newton_step(
    jacobian: FloatArray, residual: FloatArray, scale: FloatArray, square: bool, *, afar: bool = False
) -> FloatArray:
    """(F, n) Newton steps; least-norm (in units of the unknowns' scale), least-squares where not square or singular.

    ``afar``: steps need not be more exact than to 1e-8 of their length, so that rows more or fewer than unknowns can be
    solved by their normal equations, which takes a tenth of the time.
    """
    if residual.shape[1] == 0:
        return np.zeros((len(residual), scale.shape[-1]))
    rows, lengths = scaled(jacobian, scale)
    right = residual / lengths
    if square:
        try:
            return -np.linalg.solve(rows, right[..., None])[..., 0] * scale
        except np.linalg.LinAlgError:
            pass
    finite = np.asarray(np.isfinite(rows).all(axis=(1, 2)) & np.isfinite(right).all(axis=1), dtype=np.bool_)
    result = np.full((len(rows), scale.shape[-1]), np.nan)
    if afar and rows.shape[1] != rows.shape[2]:
        finite[_by_normal_equations(rows, right, scale, finite, result)] = False
    if finite.any():
        inverse = np.linalg.pinv(rows[finite], rcond=RANK_OF_ROWS)
        result[finite] = -np.einsum("fnm,fm->fn", inverse, right[finite])
        result[finite] *= scale if scale.ndim == 1 else scale[finite]
    return result


def _by_normal_equations(
    rows: FloatArray, right: FloatArray, scale: FloatArray, chosen: BoolArray, result: FloatArray
) -> BoolArray:
    """Set the steps ``result`` (F, n) of those instants among ``chosen`` (F,) whose rows (F, m, n) have full rank
    beyond doubt; returns which these are (F,).
    """
    some = rows[chosen]
    across, fewer = np.swapaxes(some, 1, 2), rows.shape[1] < rows.shape[2]
    normal = some @ across if fewer else across @ some
    sound = np.zeros(len(rows), dtype=np.bool_)
    try:
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError:  # one of them is singular
        return sound
    condition = np.linalg.norm(normal, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
    sound[chosen] = condition <= WELL_CONDITIONED
    one, other = (across, inverse) if fewer else (inverse, across)
    steps = -(one @ (other @ right[chosen][..., None]))[..., 0] * (scale if scale.ndim == 1 else scale[chosen])
    result[sound] = steps[condition <= WELL_CONDITIONED]
    return sound


@dataclass(frozen=True, slots=True, eq=False)
class NewtonResult:
    """``x`` (F, n); ``converged`` (F,); ``error`` (F,) the last relative residual; ``last`` (F,) the size of the last
    step, in units of the unknowns' scale; ``jacobian`` (F, m, n) at the end, None where it is not known.
    """

    x: FloatArray
    converged: BoolArray
    error: FloatArray
    last: FloatArray
    jacobian: FloatArray | None = None

    @staticmethod
    def joined(parts: Sequence[NewtonResult]) -> NewtonResult:
        """The results of several calls, one after the other."""
        x, converged, error, last = (
            np.concatenate(each)
            for each in zip(*((one.x, one.converged, one.error, one.last) for one in parts), strict=True)
        )
        return NewtonResult(
            x, converged, error, last, np.concatenate([p.jacobian for p in parts if p.jacobian is not None])
        )


def is_converged(size: Any, before: Any) -> Any:
    """Whether a step of that ``size``, in units of the unknowns' scale, is the last one: it is rounding, or so much
    shorter than the one ``before`` that the next would be its square.
    """
    return (size <= NEWTON_STEP_DONE) | ((size <= NEWTON_LAST_STEP) & (size <= QUADRATIC_CONVERGENCE * before))


def newton(
    problem: BlockProblem,
    start: FloatArray,
    *,
    iterations: int = 12,
    limit: float | None = None,
    afar: bool = False,
) -> NewtonResult:
    """Solve a block from ``start`` (F, n). ``limit`` bounds a single step (in units of the unknowns' scale), and
    ``afar`` makes steps cheaper (see `newton_step`), for starts from afar.

    Stops where steps have `is_converged` or no longer shrink; converged means a relative residual below 1e-9 (near a
    singularity the step is no measure, the residual is). What an instant comes to does not depend on the others.
    """
    x = np.array(start, dtype=np.float64)
    if problem.sparse is not None:
        return _sparse_newton(problem, x, iterations, limit)
    many = max(1, JACOBIAN_ENTRIES_AT_A_TIME // max(1, x.shape[1]) ** 2)
    if len(x) > many:
        parts = [np.arange(first, min(first + many, len(x))) for first in range(0, len(x), many)]
        return NewtonResult.joined(
            [newton(problem.at(part, len(x)), x[part], iterations=iterations, limit=limit, afar=afar) for part in parts]
        )
    square = problem.block.is_square
    before, last = np.full(len(x), np.inf), np.full(len(x), np.inf)
    with np.errstate(all="ignore"):
        some, places, going = problem, np.arange(len(x)), np.ones(len(x), dtype=np.bool_)
        y, residual, earlier = x, problem.residual(x), last
        for done in range(1, iterations + 1):
            jacobian = some.jacobian(y)
            if done == 1 and square:
                before = relative_error(residual, jacobian, some.scale)
            step = newton_step(jacobian, residual, some.scale, square, afar=afar)
            size = np.max(np.abs(step) / some.scale, axis=1, initial=0.0)
            if limit is not None:
                step = step * np.minimum(1.0, limit / np.maximum(size, LEAST_DIVISOR))[:, None]
            moved = going & np.isfinite(step).all(axis=1)
            y = np.where(moved[:, None], y + np.where(moved[:, None], step, 0.0), y)
            x[places] = y
            last[places] = np.where(going, size, last[places])
            going &= ~is_converged(size, earlier)
            if done > 3 and limit is None:
                going &= ~((size >= 0.5 * earlier) & (size < NEWTON_STALLED))
            if not going.any():
                break
            earlier = size
            if 2 * np.count_nonzero(going) <= len(going):  # the rest is left out
                places, y, earlier, going = places[going], y[going], earlier[going], going[going]
                some = problem.at(places, len(x))
            residual = some.residual(y)
        jacobian = problem.jacobian(x)
        error = relative_error(problem.residual(x), jacobian, problem.scale)
        moved = np.max(np.abs(x - start) / problem.scale, axis=1, initial=0.0)
        kept = (before <= START_EXACT) & ~(moved <= LONGEST_WAY * before)
        x[kept], error[kept] = start[kept], before[kept]
    return NewtonResult(x, _solved(error), error, last, jacobian)


def newton_of_variants(problem: BlockProblem, start: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """`newton` for V variants: where it ends (V, n), whether that is beyond doubt a solution (V,), and the determinant
    (V,) of the Jacobian with rows and unknowns of size one.
    """
    found = newton(problem, start, iterations=8)
    assert found.jacobian is not None
    rows, _ = scaled(found.jacobian, problem.scale)
    determinant = np.asarray(np.linalg.det(np.nan_to_num(rows)), dtype=np.float64)
    return found.x, found.converged & (found.last <= NEWTON_LAST_STEP), determinant


def newton_at_instant(problem: BlockProblem, start: FloatArray, iterations: int) -> tuple[FloatArray, bool] | None:
    """`newton` for a square block at one instant, from core values ``start`` (n,), in plain floats: where it ends and
    whether that is a solution; None where floats cannot tell, because something is divided by zero or the Jacobian is
    singular.

    Following a path asks for one pose after the other. For a few unknowns, arrays of length one cost ten times as much
    as floats, whose arithmetic is the same to the last bit.
    """
    block, scale = problem.block, problem.scale
    assert block.residual is not None
    assert block.jacobian is not None
    given = {n: first_of(value) for n, value in problem.inputs.items()}
    clocks: list[Any] = [first_of(clock) for clock in problem.clocks]
    places = tuple(np.array(block.entries, dtype=np.intp).reshape(-1, 2).T)
    x, before, last, left = start, np.inf, np.inf, iterations
    try:
        with np.errstate(all="ignore"):
            while True:
                values: dict[int, Any] = {**given, **dict(zip(block.core, x.tolist(), strict=True))}
                wide = np.zeros((len(x), len(x)))
                wide[places] = block.jacobian(values, clocks)
                wide *= scale
                residual = np.array(block.residual(values, clocks), dtype=np.float64)
                if not left or is_converged(last, before):
                    break
                left -= 1
                charge_effort()
                lengths = np.sqrt(np.einsum("mn,mn->m", wide, wide))
                step = np.asarray(np.linalg.solve(wide / lengths[:, None], residual / lengths), dtype=np.float64)
                before, last = last, float(np.max(np.abs(step)))
                if not last < np.inf or not lengths.all():
                    return None
                x = x - step * scale
            error = np.max(np.abs(residual) / np.maximum(np.max(np.abs(wide), axis=1), LEAST_DIVISOR))
    except (ZeroDivisionError, OverflowError, np.linalg.LinAlgError):
        return None
    return x, bool(error <= NEWTON_SOLVED)


def _solved(error: FloatArray) -> BoolArray:
    return np.isfinite(error) & (error <= NEWTON_SOLVED)


def _sparse_newton(problem: BlockProblem, x: FloatArray, iterations: int, limit: float | None) -> NewtonResult:
    """`newton` for a large free block, one instant after the other."""
    size = float(np.max(problem.scale))
    error = np.full(len(x), np.inf)
    for f in range(len(x)):
        one = problem.at(np.array([f]), len(x))
        x[f], off, _ = chord_newton(one, x[f], iterations, None if limit is None else limit * size)
        error[f] = off
    return NewtonResult(x, _solved(error), error, np.full(len(x), np.nan))


def freedom_of(problem: BlockProblem, x: FloatArray) -> int:
    """Unknowns minus rank at core values ``x`` (n,) at one instant; of a large block, 1 where there is any freedom."""
    if problem.sparse is not None:
        return int(len(problem.block.core) > problem.block.rows or _is_mobile(problem, x))
    rows, _ = scaled(problem.jacobian(x[None]), problem.scale)
    if 0 in rows.shape:
        return len(x)
    singular = np.linalg.svd(np.nan_to_num(rows[0], posinf=0.0, neginf=0.0), compute_uv=False)
    return len(x) - int(np.sum(singular > RANK_FOR_FREEDOM * max(singular[0], LEAST_DIVISOR)))


def _is_mobile(problem: BlockProblem, x: FloatArray) -> bool:
    """Whether the rows of a large block leave anything of a random motion."""
    from movimentum.solver.block.sparse import saddle_point

    block = problem.free_block
    tangent = saddle_point(problem, x)
    motion = np.random.default_rng(5).normal(size=len(x)) * tangent.scale
    left = tangent.least_velocity(np.zeros(block.rows), -block.metric.applied(motion))
    return bool(np.max(np.abs(left) / tangent.scale) > LEFT_OF_RANDOM_MOTION * np.max(np.abs(motion) / tangent.scale))


def newton_unrolled(problem: BlockProblem, x: FloatArray, step: Compiled) -> BoolArray:
    """Improve ``x`` (n, F) in place by Newton steps that ``step`` computes; returns which instants converged (F,).

    A step below 1e-8 is the last one needed: the next would be its square. Instants whose steps do not come down so
    far, or lead far away, are left to a method that chooses its pivots.
    """
    start, scale = x.copy(), problem.scale
    last = np.full(x.shape[1], np.inf)
    for _ in range(6):
        steps = step(problem.values(x.T), problem.clocks)
        last = np.zeros(x.shape[1])
        for j, s in enumerate(steps):
            x[j] -= s
            np.fmax(last, np.abs(s) / scale[j], out=last)
            last += s - s  # nan stays
        if not (last > NEWTON_LAST_STEP).any():
            break
    far = np.max(np.abs(x - start) / scale[:, None], axis=0) > FAR_START
    good = (last <= NEWTON_LAST_STEP) & ~far
    x[:, ~good] = start[:, ~good]
    return good
