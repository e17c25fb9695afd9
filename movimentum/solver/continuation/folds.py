"""The very end of one Newton block's path: where two solutions meet and there is none beyond (a fold).

There the Jacobian is singular and the path's speed infinite: stepping comes no nearer than rounding lets it, which
makes an error in time that grows without bound as the drive slows down. The fold itself is a regular solution of a
larger system: the equations, and a vector that the Jacobian takes to zero (Moore & Spence 1980, SIAM J. Numer. Anal.
17; Seydel, *Practical Bifurcation and Stability Analysis*, ch. 5).
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.solver.block.local import Local
from movimentum.solver.block.newton import newton
from movimentum.solver.block.scaling import scaled
from movimentum.tolerances import (
    FOLD_BEYOND_PATH,
    FOLD_CLOSED,
    FOLD_DIFFERENCE,
    FOLD_DIRECTION_MET,
    FOLD_POSE_DONE,
    FOLD_TIME_DONE,
    SHORTEST_PATH_STEP,
)

NEAR = 0.05
"""Of the unknowns' scale: how far a pose at the very end may be from the last one before."""
ROUNDS = 20


def path_end(local: Local, tau: float, x: FloatArray, scale: FloatArray, total: float) -> float:
    """When the path that was stepped as far as ``tau``, to core values ``x`` (n,), comes to its end; ``total`` is the
    length of the interval.
    """
    fold = fold_near(local, tau, x, scale, total)
    return _last(local, tau, x, scale, total) if fold is None else max(fold, tau)


def fold_near(local: Local, tau: float, x: FloatArray, scale: FloatArray, total: float) -> float | None:
    """The time of the fold near ``tau`` and core values ``x`` (n,); None where there is none so near."""
    n = len(x)

    def parts(instants: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (F, m) and Jacobians (F, m, n), rows of unit length at ``x``, unknowns in units of ``scale``."""
        problem = local.probe(instants)
        residual = problem.residual(points * scale)
        return residual / lengths, problem.jacobian(points * scale) * scale / lengths[..., None]

    rows, lengths = scaled(local.probe(np.array([tau])).jacobian(x[None]), scale)
    if rows.shape[1] < n or not np.isfinite(rows).all():
        return None
    z, time = x / scale, tau
    null = np.linalg.svd(rows[0])[2][-1]
    weight = null.copy()
    m = rows.shape[1]
    for _ in range(ROUNDS):
        delta = local.delta
        instants = np.array([time, time, time, time + delta, time - delta])
        aside = FOLD_DIFFERENCE * null
        residual, jacobian = parts(instants, np.stack([z, z + aside, z - aside, z, z]))
        bent = (jacobian[1] - jacobian[2]) / (2.0 * FOLD_DIFFERENCE)  # second derivatives are symmetric
        drift = (residual[3] - residual[4]) / (2.0 * delta)
        turning = (jacobian[3] - jacobian[4]) @ null / (2.0 * delta)
        matrix = np.zeros((2 * m + 1, 2 * n + 1))
        matrix[:m, :n], matrix[:m, -1] = jacobian[0], drift * total
        matrix[m : 2 * m, :n], matrix[m : 2 * m, n : 2 * n], matrix[m : 2 * m, -1] = bent, jacobian[0], turning * total
        matrix[-1, n : 2 * n] = weight
        right = np.concatenate([residual[0], jacobian[0] @ null, [weight @ null - 1.0]])
        if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
            return None
        step = np.linalg.lstsq(matrix, -right, rcond=None)[0]
        z, null, time = z + step[:n], null + step[n : 2 * n], time + float(step[-1]) * total
        if abs(time - tau) > 100.0 * FOLD_BEYOND_PATH * total or np.max(np.abs(z - x / scale)) > NEAR:
            return None
        if np.max(np.abs(step[:n])) < FOLD_POSE_DONE and abs(step[-1]) < FOLD_TIME_DONE:
            break
    residual, jacobian = parts(np.array([time]), z[None])
    met = np.max(np.abs(residual)) <= FOLD_CLOSED and np.max(np.abs(jacobian[0] @ null)) <= FOLD_DIRECTION_MET
    return time if met and abs(time - tau) <= FOLD_BEYOND_PATH * total else None


def _last(local: Local, tau: float, x: FloatArray, scale: FloatArray, total: float) -> float:
    """The last instant, at or a little after ``tau``, at which there is a solution near core values ``x`` (n,): a
    path stepped to its end stops a little short of it.
    """

    def solvable(instant: float) -> bool:
        outcome = newton(local.probe(np.array([instant])), x[None, :], iterations=40)
        near = np.max(np.abs(outcome.x[0] - x) / scale) <= NEAR
        return bool(outcome.error[0] <= FOLD_CLOSED and near)

    good, step = tau, SHORTEST_PATH_STEP * total
    while step <= FOLD_BEYOND_PATH * total and solvable(good + step):
        good, step = good + step, 2.0 * step
    bad = good + step
    for _ in range(60):
        middle = 0.5 * (good + bad)
        if not good < middle < bad:
            break
        good, bad = (middle, bad) if solvable(middle) else (good, middle)
    return good
