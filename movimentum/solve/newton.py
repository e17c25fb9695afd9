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

from movimentum.plan.blocks import Block
from movimentum.plan.codegen import Compiled
from movimentum.plan.linear_rows import SparseRows
from movimentum.solve.kernels import State

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

RANK_TOLERANCE = 1e-8
"""Of the largest singular value, rows and unknowns scaled to size one."""
STEP_TOLERANCE = 1e-14
"""In units of the unknowns' scale."""
LAST_STEP = 1e-8
FAR = 0.05


def residual_of(block: Block, u: State, k: Sequence[FloatArray], x: FloatArray) -> FloatArray:
    """(F, m) residuals at core values ``x`` (F, n)."""
    if block.sparse is not None:
        from movimentum.solve.sparse import sparse_residual

        return sparse_residual(block, u, k, x)
    assert block.coefficients is not None
    for j, n in enumerate(block.core):
        u[n] = x[:, j]
    values = block.coefficients(u, k)
    result = np.empty((len(x), len(values)))
    for i, value in enumerate(values):
        result[:, i] = value
    return result


def jacobian_of(block: Block, u: State, k: Sequence[FloatArray], x: FloatArray) -> FloatArray:
    """(F, m, n) Jacobian at core values ``x`` (F, n)."""
    if block.sparse is not None:
        from movimentum.solve.sparse import sparse_slopes

        return _filled(block.sparse, sparse_slopes(block, u, k, x), len(block.core))
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


def wishes_of(block: Block, u: State, k: Sequence[FloatArray], x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The errors (F, p) of the wishes that draw a block, and their Jacobian (F, p, n), at core values ``x`` (F, n)."""
    errors = np.zeros((len(x), block.wish_count))
    jacobian = np.zeros((len(x), block.wish_count, len(block.core)))
    if block.wishes is not None and block.wish_slopes is not None:
        for j, n in enumerate(block.core):
            u[n] = x[:, j]
        for i, value in enumerate(block.wishes(u, k)):
            errors[:, i] = value
        for (i, j), value in zip(block.wish_entries, block.wish_slopes(u, k), strict=True):
            jacobian[:, i, j] = value
    return errors, jacobian


@dataclass(frozen=True, slots=True)
class Damping:
    """How `damped` bounds what it finds. ``weak``: of the strongest direction, how much weaker another may be and still
    be followed exactly; ``near``: wanted in a weak direction, more than this is damped the more; ``far``: wanted and
    not to be had, it counts for no more than this.
    """

    weak: float = 0.2
    near: float = np.inf
    far: float = np.inf


LOST, FOUND = 1e-5, 1e-4
"""Of the strongest direction of some wishes: where another is not followed at all (rounding would choose the way), and
from where it is. In between it comes to be.
"""
NOISE = 1e-12
"""Of what cannot be followed: less in another direction is taken for none, see `damped`."""


def toward(rows: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
    """The least-squares solution of rows @ step = want, `damped`: as far as the rows let it, bounded where they do
    not.
    """
    if not np.isfinite(rows).all() or not np.isfinite(want).all():
        return np.zeros(int(rows.shape[1]), dtype=np.float64)
    reach = np.asarray(rows @ rows.T, dtype=np.float64)
    return np.asarray(rows.T @ damped(reach, want, damping), dtype=np.float64)


def damped(reach: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
    """The y (p,) with ``reach`` y = ``want`` for a symmetric matrix (p, p), damped in its weak directions.

    Directions that are strong are followed exactly. Where a direction loses its strength (an arm that comes to be
    stretched) damping sets in smoothly, so that speeds stay bounded (Nakamura & Hanafusa 1986, J. Dyn. Syst. Meas.
    Control 108; Maciejewski & Klein 1988, J. Robotic Syst. 5), the more of it the more is wanted there. What cannot be
    followed counts for only so much in the other directions: an arm would point ever more stiffly at a place ever
    farther out of its reach. The result depends on no basis.

    What is wanted in a lost direction shows in the others, by as much as rounding turns these. That is left out: it
    would grow where a straight chain is pushed along its line, or a bar turned away from its wish, and choose a side.
    """
    if not len(reach):
        return want
    squares, directions = np.linalg.eigh(reach)
    largest = float(np.max(squares, initial=0.0))
    if not largest > 0.0:
        return np.zeros_like(want)
    part = np.maximum(squares, 0.0) / largest
    wanted = directions.T @ want
    edge = damping.weak**2
    added = np.hypot(edge, wanted / damping.near) * np.maximum(1.0 - part / edge, 0.0) ** 2
    known = np.clip((np.sqrt(part) - LOST) / (FOUND - LOST), 0.0, 1.0)
    gains = known**2 * (3.0 - 2.0 * known) / (part + added)
    left = np.square(wanted * (1.0 - gains * part))
    elsewhere = np.sqrt(np.maximum(np.sum(left) - left, 0.0))
    told = np.abs(wanted) > NOISE * elsewhere
    followed = gains * np.where(told, wanted, 0.0) * np.minimum(1.0, damping.far / np.maximum(elsewhere, 1e-300))
    return np.asarray(directions @ followed, dtype=np.float64) / largest


def scaled(jacobian: FloatArray, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The Jacobian with unknowns in units of ``scale`` and rows of unit length, and those rows' lengths (F, m)."""
    wide = jacobian * scale
    lengths = np.sqrt(np.einsum("fmn,fmn->fm", wide, wide))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    return wide / lengths[..., None], lengths


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


def relative_error(residual: FloatArray, jacobian: FloatArray, scale: FloatArray) -> FloatArray:
    """(F,) largest residual, each row in units of its own gradient over unknowns of size ``scale``."""
    if residual.shape[1] == 0:
        return np.zeros(len(residual))
    wide = np.abs(jacobian) * scale
    return np.max(np.abs(residual) / np.maximum(wide.max(axis=2, initial=0.0), 1e-300), axis=1)


def newton(
    block: Block,
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
    if block.sparse is not None:
        return _sparse_newton(block, u, k, x, scale, iterations, limit)
    square = block.rows == len(block.core) and not block.free
    last = np.full(len(x), np.inf)
    residual = residual_of(block, u, k, x)
    with np.errstate(all="ignore"):
        for done in range(1, iterations + 1):
            jacobian = jacobian_of(block, u, k, x)
            step = step_of(jacobian, residual, scale, square)
            size = np.max(np.abs(step) / scale, axis=1, initial=0.0)
            if limit is not None:
                step = step * np.minimum(1.0, limit / np.maximum(size, 1e-300))[:, None]
            moved = np.asarray(np.isfinite(step).all(axis=1))
            x = np.where(moved[:, None], x + np.where(moved[:, None], step, 0.0), x)
            residual = residual_of(block, u, k, x)
            if (size <= STEP_TOLERANCE).all():
                break
            if done > 3 and limit is None and (size >= 0.5 * last).all() and (size < 1e-9).all():
                break
            last = size
        error = relative_error(residual, jacobian_of(block, u, k, x), scale)
    return Outcome(x, np.isfinite(error) & (error <= 1e-9), error)


def _sparse_newton(
    block: Block,
    u: State,
    k: Sequence[FloatArray],
    x: FloatArray,
    scale: FloatArray,
    iterations: int,
    limit: float | None,
) -> Outcome:
    """`newton` for a large free block, one instant after the other."""
    from movimentum.solve.tangents import chord_newton

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


def freedom_of(block: Block, u: State, k: Sequence[FloatArray], x: FloatArray, scale: FloatArray) -> int:
    """Unknowns minus rank at core values ``x`` (n,) at one instant."""
    rows, _ = scaled(jacobian_of(block, u, k, x[None]), scale)
    if 0 in rows.shape:
        return len(x)
    singular = np.linalg.svd(np.nan_to_num(rows[0], posinf=0.0, neginf=0.0), compute_uv=False)
    return len(x) - int(np.sum(singular > 1e-7 * max(singular[0], 1e-300)))


def unrolled(
    block: Block, u: State, k: Sequence[FloatArray], x: FloatArray, scale: FloatArray, step: Compiled
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


def null_space(matrix: FloatArray, tolerance: float = RANK_TOLERANCE) -> tuple[int, FloatArray, FloatArray]:
    """Rank, the null space (n, n - rank) and the pseudo-inverse (n, m) of one scaled matrix (m, n)."""
    m, n = matrix.shape
    if m == 0:
        return 0, np.eye(n), np.zeros((n, 0))
    left, singular, right = np.linalg.svd(np.nan_to_num(matrix, posinf=0.0, neginf=0.0))
    rank = int(np.sum(singular > tolerance * max(singular[0], 1e-300))) if len(singular) else 0
    inverse = (right[:rank].T / singular[:rank]) @ left[:, :rank].T
    return rank, right[rank:].T, inverse
