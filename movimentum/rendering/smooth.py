"""Paths between frames: the points of a whole path, close enough that it shows no corners where it has none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SHARP = np.cos(np.radians(75.0))
"""A path that turns by more at one point has a corner there: a stop, a step, or too few frames to know."""
OFF = 0.05
"""World pixels by which the pieces may miss the curve."""
SAME = 1e-6
"""World pixels between the ends of a path that is closed: a solver's last digits."""
MOST = 24
"""Pieces between two frames."""


def smooth(points: Floats) -> Floats:
    """(P, 3) from (F, 3): world x, y and whether the point is visible. The points themselves are kept.

    Between two visible ones lie those of a cubic whose tangents are central differences (Catmull & Rom, 1974), so the
    curve is of third order in the time between frames. A path whose last point is its first is closed smoothly.
    """
    if len(points) < 4 or not (points[:, 2] > 0.0).all():
        return points
    where = points[:, :2]
    closed = bool(np.abs(where[0] - where[-1]).max() < SAME)
    before = np.diff(where, axis=0, prepend=where[-2:-1] if closed else where[:1])
    after = np.diff(where, axis=0, append=where[1:2] if closed else where[-1:])
    length = np.hypot(*before.T) * np.hypot(*after.T)
    through = (before * after).sum(axis=1) > SHARP * length
    middle = np.where(through[:, None], (before + after) / 2.0, 0.0)
    leaving, arriving = (np.where(through[:, None], middle, own)[part] for own, part in _ends(before, after))
    bend = np.hypot(*(leaving - after[:-1]).T) + np.hypot(*(arriving - after[:-1]).T)
    pieces = np.clip(np.ceil(np.sqrt(bend / (8.0 * OFF))), 1, MOST).astype(int)
    made = [where[:1]]
    for k, count in enumerate(pieces.tolist()):
        u: Floats = (np.arange(1, count + 1, dtype=np.float64) / count)[:, None]
        made.append(
            (2 * u**3 - 3 * u**2 + 1) * where[k]
            + (u**3 - 2 * u**2 + u) * leaving[k]
            + (3 * u**2 - 2 * u**3) * where[k + 1]
            + (u**3 - u**2) * arriving[k]
        )
    found = np.concatenate(made)
    return np.concatenate([found, np.ones((len(found), 1))], axis=1)


def _ends(before: Floats, after: Floats) -> tuple[tuple[Floats, slice], tuple[Floats, slice]]:
    """The tangents of corners: along the piece itself, where one leaves a point and where one arrives at it."""
    return (after, slice(None, -1)), (before, slice(1, None))
