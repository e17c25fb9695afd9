"""Many instants of a phase at once: poses that satisfy the equations and keep the phase's contacts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.solver.block.problem import BlockProblem, scaled
from movimentum.solver.pushing.contacts import Contacts, PartPair
from movimentum.tolerances import (
    LEAST_DIVISOR,
    PUSH_AFTER_INDEPENDENT,
    PUSH_AFTER_THIS,
    PUSH_INDEPENDENT,
    PUSH_RANK,
    PUSH_RESTORED,
)

NEWTON_STEPS = 12
"""Newton steps at most."""


def project_onto_contacts(
    contacts: Contacts,
    problem: BlockProblem,
    x: FloatArray,
    active: Sequence[PartPair],
    at: Sequence[float],
    frame: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """The core values (F, n) nearest to ``x`` that satisfy the equations and have ``active`` contacts ``at`` these
    values (nan: at any); and how far they are off (F,), relative to the unknowns' scale. ``frame`` (n, k): the whitened
    directions that may move (see `Metric.among`).
    """
    kept = [k for k, value in enumerate(at) if not np.isnan(value)]
    some, wanted = [active[k] for k in kept], np.array([at[k] for k in kept])
    scale, x = problem.scale, x.copy()
    going, error = np.arange(len(x)), np.full(len(x), np.inf)
    best = x.copy()
    for _ in range(NEWTON_STEPS):
        own = problem.at(going, len(x)) if len(going) < len(x) else problem
        lines = contacts.lines(some, own, x[going])
        residual = np.concatenate([own.residual(x[going]), lines.values - wanted], axis=1)
        rows = np.concatenate([own.jacobian(x[going]), lines.slopes], axis=1)
        wide, lengths = scaled(rows @ frame, np.ones(int(frame.shape[1])))
        off = np.max(
            np.abs(residual) / np.maximum(np.max(np.abs(rows) * scale, axis=2), LEAST_DIVISOR), axis=1, initial=0.0
        )
        off = np.where(np.isfinite(off), off, np.inf)
        better = off < error[going]
        best[going[better]] = x[going[better]]
        go = better & (off > PUSH_RESTORED) & (off < 0.5 * error[going])
        error[going] = np.where(better, off, error[going])
        if not go.any():
            break
        matrix, right = wide[go], residual[go] / lengths[go]
        # rows that depend on each other agree, so a trace of the identity changes nothing but that there is a solution
        squares = matrix @ np.swapaxes(matrix, 1, 2) + PUSH_RANK * np.eye(matrix.shape[1])
        inverse = np.asarray(np.linalg.inv(squares), dtype=np.float64)
        step = np.swapaxes(matrix, 1, 2) @ (inverse @ right[..., None])
        clear = np.max(np.abs(inverse), axis=(1, 2), initial=0.0) <= PUSH_INDEPENDENT
        last = off[go] <= np.where(clear, PUSH_AFTER_INDEPENDENT, PUSH_AFTER_THIS)
        going = going[go]
        x[going] -= step[..., 0] @ frame.T
        done = going[last]
        best[done], error[done] = x[done], np.square(error[done])
        going = going[~last]
        if not len(going):
            break
    return best, error
