"""Many instants of a phase at once: the velocities at them, and how hard the contacts press.

This is `solver.pushing.push_law` for known, holding contacts. They hold as long as each of them presses: for each level
of wishes, and for the least motion below them, the forces along the contacts' slopes are those that balance the
gradient (the multipliers of the quadratic program), and none of them pulls.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.structure.metric import Metric
from movimentum.records import dataclass
from movimentum.solver.block.problem import Damping, damped, scaled
from movimentum.solver.pushing.quadratic_program import Rows
from movimentum.tolerances import (
    LEAST_DIVISOR,
    PUSH_HOLDS,
    PUSH_INDEPENDENT,
    PUSH_MOVES,
    PUSH_RANK,
    PUSH_RESTS,
    PUSH_UNSEEN,
    RANK_OF_ROWS,
)


@dataclass(frozen=True, slots=True, eq=False)
class PushedInstants:
    """A block at F instants; see `PushedInstant`: all its arrays, with F first. ``levels``: slopes (F, p, n), wants (F,
    p) and damping. ``values``, ``along`` and ``fan`` (F, k) of the contacts, see `ContactRows`.
    """

    metric: Metric
    rows: FloatArray
    want: FloatArray
    pull: FloatArray | None
    levels: Sequence[tuple[FloatArray, FloatArray, Damping]]
    pushes: FloatArray
    least: FloatArray
    rounding_rate: float
    values: FloatArray
    along: FloatArray
    fan: FloatArray


def velocities_with_active(
    now: PushedInstants, which: Rows, posed: BoolArray | None = None
) -> tuple[FloatArray, FloatArray] | None:
    """The velocities (F, n) with the contacts ``which`` (k,) kept as equations, as `push_law.velocity_with_active`
    gives each, and what projects on the whitened directions (n, n) in which poses are free at the last, before wishes:
    only contacts that are ``posed`` (k,; None: all) keep a pose. None where a number is not finite.
    """
    metric = now.metric
    white, scale = metric.whitening
    rows = np.concatenate([now.rows, now.pushes[:, which]], axis=1)
    want = np.concatenate([now.want, now.least[:, which]], axis=1)
    wide, lengths = scaled(rows @ white, np.ones(len(scale)))
    if not (np.isfinite(wide).all() and np.isfinite(want).all()):
        return None
    inverse, free = _pseudo_inverses(wide)
    y = _matrix_times(inverse, want / lengths)
    if now.pull is not None:
        y = y - _matrix_times(free, now.pull @ white)
    first = free[-1]
    if posed is not None and not posed.all():
        first = _pseudo_inverses(wide[-1:, np.append(np.ones(now.rows.shape[1], dtype=np.bool_), posed)])[1][0]
    for slopes, wants, damping in now.levels:
        whitened = slopes @ white
        along, sizes = _without_rounding_rows(whitened @ free, whitened)
        if not along.any():
            continue
        across = np.swapaxes(along, 1, 2)
        gradients = slopes * np.where(metric.weighted, scale, 0.0)
        missing = wants - _matrix_times(whitened, y)
        y = y + _matrix_times(
            across, damped(along @ across, missing, damping, white @ across / scale[:, None], gradients)
        )
        free = free @ _pseudo_inverses(along / np.maximum(sizes, LEAST_DIVISOR))[1]
    v = y @ white.T
    size = np.abs(v) / scale
    return np.where(size > PUSH_RESTS * np.max(size, axis=1, keepdims=True, initial=0.0), v, 0.0), first


def contact_forces(now: PushedInstants, which: Rows, v: FloatArray) -> FloatArray:
    """(F, L, k) how hard the contacts ``which`` press at each of L levels, where the velocities are ``v`` (F, n): a
    negative one would have to pull. 0 where the level does not press on them, but for rounding.
    """
    metric = now.metric
    white, _ = metric.whitening
    y = v @ metric.unwhitening.T
    wide, _ = scaled(now.rows @ white, np.ones(len(white)))
    free = _pseudo_inverses(wide)[1]
    pushes = now.pushes[:, which] @ white
    found: list[FloatArray] = []
    for slopes, wants, _ in now.levels:
        whitened = slopes @ white
        missing = _matrix_times(whitened, y) - wants
        large = np.linalg.norm(whitened, axis=2) * np.linalg.norm(y, axis=1)[:, None] + np.abs(wants)
        told = np.where(np.abs(missing) > np.maximum(PUSH_UNSEEN * large, now.rounding_rate), missing, 0.0)
        along, sizes = _without_rounding_rows(whitened @ free, whitened)
        gradient = _matrix_times(np.swapaxes(along, 1, 2), told)
        most = np.linalg.norm(along, axis=(1, 2)) * np.linalg.norm(told, axis=1)
        had = np.linalg.norm(gradient, axis=1) > PUSH_UNSEEN * most  # or else what is missing is not to be had
        gradient = np.where(had[:, None], gradient, 0.0)
        found.append(_forces_of(pushes, free, gradient) if had.any() else np.zeros(pushes.shape[:2]))
        free = free @ _pseudo_inverses(along / np.maximum(sizes, LEAST_DIVISOR))[1]
    still = y if now.pull is None else y + now.pull @ white
    last = _forces_of(pushes, free, _matrix_times(free, still))
    found.append(np.where(np.abs(last) * np.linalg.norm(pushes, axis=2) > now.rounding_rate, last, 0.0))
    return np.stack(found, axis=1)


def opening_rates_at_instants(now: PushedInstants, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(F, k) how fast each contact opens with velocities ``v`` (F, n), and what is slower than moving (F, k)."""
    white, _ = now.metric.whitening
    lengths = np.maximum(np.linalg.norm(now.pushes @ white, axis=2), LEAST_DIVISOR)
    demanded = np.max(np.abs(now.least) / lengths, axis=1, initial=0.0)
    fastest = np.maximum(np.linalg.norm(v @ now.metric.unwhitening.T, axis=1), demanded)
    tolerance = np.maximum(PUSH_MOVES * fastest[:, None], now.rounding_rate / lengths)
    return (_matrix_times(now.pushes, v) - now.least) / lengths, tolerance


def _forces_of(pushes: FloatArray, free: FloatArray, gradient: FloatArray) -> FloatArray:
    """(F, k) what the rows (F, k, n) press with in the ``free`` directions (F, n, n) to bear a gradient (F, n)."""
    rows, lengths = _without_rounding_rows(pushes @ free, pushes)
    unit = rows / np.maximum(lengths, LEAST_DIVISOR)
    solved = np.linalg.solve(_gram(unit), _matrix_times(unit, gradient)[..., None])
    forces = np.asarray(solved[..., 0], dtype=np.float64)
    borne = np.linalg.norm(_matrix_times(np.swapaxes(unit, 1, 2), forces), axis=1)
    return np.where((borne > PUSH_HOLDS * np.linalg.norm(gradient, axis=1))[:, None], forces, 0.0)


def _gram(rows: FloatArray) -> FloatArray:
    """Rows times rows; those that depend on each other share what they do."""
    return np.asarray(rows @ np.swapaxes(rows, 1, 2) + PUSH_RANK * np.eye(rows.shape[1]), dtype=np.float64)


def _without_rounding_rows(along: FloatArray, slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slopes ``along`` what is free, without those that are rounding, and their lengths (F, p, 1)."""
    sizes = np.linalg.norm(along, axis=2, keepdims=True)
    seen: BoolArray = sizes > PUSH_UNSEEN * np.linalg.norm(slopes, axis=2, keepdims=True)
    return np.where(seen, along, 0.0), sizes


def _matrix_times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """(F, m) from (F, m, n) and (F, n)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0], dtype=np.float64)


def _independent_pseudo_inverses(matrices: FloatArray) -> FloatArray | None:
    """The pseudo-inverses of matrices whose rows of unit length are clearly independent; None where they are not."""
    across = np.swapaxes(matrices, 1, 2)
    try:
        squares = np.linalg.inv(matrices @ across)
    except np.linalg.LinAlgError:
        return None
    if not np.max(np.abs(squares)) <= PUSH_INDEPENDENT:
        return None
    found = across @ squares
    return np.asarray(2.0 * found - found @ (matrices @ found), dtype=np.float64)


def _pseudo_inverses(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The pseudo-inverses (F, n, m) of matrices (F, m, n), and what projects on their null spaces (F, n, n)."""
    count, m, n = matrices.shape
    whole = np.broadcast_to(np.eye(n), (count, n, n))
    if m == 0:
        return np.zeros((count, n, 0)), whole
    if m <= n:
        found = _independent_pseudo_inverses(matrices)
        if found is not None:
            return found, whole - np.swapaxes(matrices, 1, 2) @ np.swapaxes(found, 1, 2)
    left, singular, right = np.linalg.svd(matrices, full_matrices=False)
    known = singular > RANK_OF_ROWS * np.maximum(singular[:, :1], LEAST_DIVISOR)
    across = np.swapaxes(right, 1, 2)
    inverse = (across * (known / np.maximum(singular, LEAST_DIVISOR))[:, None]) @ np.swapaxes(left, 1, 2)
    return inverse, whole - (across * known[:, None]) @ right
