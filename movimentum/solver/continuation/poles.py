"""Where an integral has no finite value: poles of its integrand, also those that quadrature steps across.

An integrable singularity, |t - t*|^-p with p < 1, only makes quadrature slow; at a pole, p >= 1, what comes behind it
is meaningless. Both leave intervals that refinement does not mend, so p is read off the integrand's growth there.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Integral
from movimentum.solver.continuation.tracks import Path

NEAR, FAR = 16.0, 256.0
"""Widths of the finest interval at which the growth is measured: there the place of the pole is known well enough."""
LEAST_POWER = 0.97
MOST = 64
"""Places that are looked at."""
STEPS = 17
"""Places beside a pole at which its integrand only falls. Where something cancels, rounding grows as fast, but up and
down.
"""


def first_pole(path: Path, block: Integral, low: FloatArray, high: FloatArray) -> float | None:
    """The first pole of an integral's integrand in the intervals [low, high] (each of the finest width), in which
    quadrature does not settle; None where all is integrable.
    """
    for a, b in list(zip(low.tolist(), high.tolist(), strict=True))[:MOST]:
        width = b - a
        # beside the pole itself quadrature may happen to settle, by symmetry
        place = _steepest(path, block, max(path.begin, a - 2.0 * width), min(path.end, b + 2.0 * width))
        side = 1.0 if path.end - place > place - path.begin else -1.0  # where there is more of the film
        at = place + side * width * np.array([NEAR, 2.0 * NEAR, FAR, 2.0 * FAR])
        one, two, three, four = _values(path, block, at)
        near, far = abs(one - two), abs(three - four)  # differences know nothing of what is added to the pole
        if not (near > 0.0 and far > 0.0 and np.isfinite(near)):
            continue
        grows = np.log(near / far) / np.log(FAR / NEAR) > LEAST_POWER
        if grows and _steady(_values(path, block, place + side * width * np.geomspace(NEAR, FAR, STEPS))):
            return place
    return None


def _steady(values: FloatArray) -> bool:
    """Whether values only grow, or only fall."""
    steps = np.diff(values)
    return bool(np.all(steps > 0.0) or np.all(steps < 0.0))


def _steepest(path: Path, block: Integral, low: float, high: float) -> float:
    """Where the integrand is largest in [low, high], closed in on."""
    place = low
    for _ in range(8):
        inside = np.linspace(low, high, 65)
        sizes = np.abs(_values(path, block, inside))
        best = int(np.argmax(np.where(np.isfinite(sizes), sizes, np.inf)))
        place = float(inside[best])
        low, high = float(inside[max(best - 1, 0)]), float(inside[min(best + 1, 64)])
    return place


def _values(path: Path, block: Integral, tau: FloatArray) -> FloatArray:
    instants = path.instants(tau)
    state = path.before(block.number, instants)
    (values,) = block.integrand(state, instants.clocks)
    return np.broadcast_to(values, tau.shape)
