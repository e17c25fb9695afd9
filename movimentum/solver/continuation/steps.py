"""One step of a predictor–corrector continuation in time (Allgower & Georg, *Numerical Continuation Methods*, ch. 6).

The predictor continues position, velocity and acceleration, the corrector is Newton's method. A step counts only if the
corrector moved little and the two velocities integrate to the displacement.
"""

from __future__ import annotations

import math

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.solver.block.local import Local
from movimentum.solver.block.sizes import sizes_at
from movimentum.tolerances import ACCELERATION_SPAN, LEAST_DIVISOR, RESTING_ON_PATH, SINGULAR_ON_PATH


@dataclass(frozen=True, slots=True)
class StepLimits:
    """Of a step that counts: what the corrector may move (``correction``), and by how much the velocities at the step's
    two ends may miss what it moves (``mismatch``), both as parts of what it moves. Of a step that moves anything by
    more than ``far``, in units of the unknowns' scale, more is asked, and none may move it by twice as much.
    """

    far: float
    correction: float
    mismatch: float


CERTAIN = StepLimits(0.3, 0.2, 0.05)
"""For a step whose end is on the same path."""
WELL = 0.6
"""The strain that a step aims at."""


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """A point of a path: core values (n,), their velocity and acceleration (n,) at the offset ``tau``.

    ``strain``: how near the step that came here was to one that does not count (1); it goes with the step's square.
    """

    tau: float
    x: FloatArray
    v: FloatArray
    bend: FloatArray
    strain: float = 1.0

    @property
    def growth(self) -> float:
        """How much longer, or shorter, the next step may well be."""
        return min(max(math.sqrt(WELL / max(self.strain, LEAST_DIVISOR)), 0.5), 2.0)


def attempt(
    local: Local, here: Standing, length: float, scale: FloatArray, side: float, limits: StepLimits = CERTAIN
) -> Standing | None:
    """The point of the path that is ``length`` later (earlier where negative); None where that is too long a step, or
    where the Jacobian has another orientation there than ``side`` (0: none is known): a singular point is on the way.
    """
    tau = here.tau + length
    predicted = here.x + length * here.v + 0.5 * length * length * here.bend
    x, converged = local.corrected(tau, predicted)
    unit = sizes_at(here.x, scale)
    moved = _moved(here.x, x, unit)
    corrected = _part(x - predicted, moved, limits.correction, unit, limits)
    if not converged or not corrected <= 1.0:
        return None
    v, smallest = local.rate(tau, x, scale)
    # on a singular point the block alone cannot tell the velocity: go on with the one we have
    if smallest < SINGULAR_ON_PATH:
        v = (x - here.x) / length * 2.0 - here.v
    missed = _part(x - here.x - 0.5 * length * (here.v + v), moved, limits.mismatch, unit, limits)
    if not missed <= 1.0:
        return None
    if side * local.orientation(tau, x, scale) < 0.0:
        return None
    return Standing(tau, x, v, (v - here.v) / length, float(max(corrected, missed)))


def in_agreement(tau: FloatArray, x: FloatArray, v: FloatArray, bend: FloatArray, scale: FloatArray) -> BoolArray:
    """(K - 1,) whether the steps between K points of a path would have counted: core values ``x`` and their velocities
    ``v`` (K, n) at offsets ``tau`` (K,); ``bend`` (n,): the acceleration at the first.
    """
    length = np.diff(tau)[:, None]
    bends = np.concatenate([bend[None], np.diff(v, axis=0)[:-1] / length[:-1]])
    predicted = x[:-1] + length * v[:-1] + 0.5 * length * length * bends
    with np.errstate(all="ignore"):
        unit = sizes_at(x[:-1], scale)
        moved = _moved(x[:-1], x[1:], unit)
        corrected = _part(x[1:] - predicted, moved, CERTAIN.correction, unit, CERTAIN)
        missed = _part(x[1:] - x[:-1] - 0.5 * length * (v[:-1] + v[1:]), moved, CERTAIN.mismatch, unit, CERTAIN)
        return np.asarray((corrected <= 1.0) & (missed <= 1.0), dtype=np.bool_)


def initial_bend(local: Local, here: Standing, length: float, scale: FloatArray) -> FloatArray | None:
    """The acceleration (n,) at the beginning of a path, over a small part of a step of ``length``.

    What begins to move from rest, as every drive that eases in, has no velocity to predict anything from.
    """
    after = here.tau + ACCELERATION_SPAN * length
    x, converged = local.corrected(after, here.x + (after - here.tau) * here.v)
    if not converged or not np.max(np.abs(x - here.x) / scale) <= CERTAIN.far * ACCELERATION_SPAN:
        return None
    v, smallest = local.rate(after, x, scale)
    return (v - here.v) / (after - here.tau) if smallest > SINGULAR_ON_PATH else None


def _moved(x: FloatArray, later: FloatArray, scale: FloatArray) -> FloatArray:
    return np.asarray(np.max(np.abs(later - x) / scale, axis=-1), dtype=np.float64)


def _part(off: FloatArray, moved: FloatArray, limit: float, scale: FloatArray, limits: StepLimits) -> FloatArray:
    """What is ``off`` in steps that move something by ``moved``, as a part of the ``limit`` on that."""
    bound = limit * np.minimum(1.0, np.square(limits.far / np.maximum(moved, LEAST_DIVISOR))) * moved + RESTING_ON_PATH
    found = np.max(np.abs(off) / scale, axis=-1) / bound
    return np.asarray(np.where(moved <= 2.0 * limits.far, found, np.inf), dtype=np.float64)
