"""Curves as polygons: the parameters of their corners."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from movimentum.arrays import FloatArray


def flattened(points: Callable[[FloatArray], FloatArray], breaks: Sequence[float], off: float) -> FloatArray:
    """Places between which straight lines are within ``off`` of a curve: from the first of ``breaks`` (included) to the
    last (not), with all of these. ``points``: those of the curve (N, 2) at places (N,).
    """
    edges = np.array(breaks)
    begin = (edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(8) / 8.0)).ravel()
    end = np.append(begin[1:], edges[-1])
    done: list[FloatArray] = []
    for _ in range(14):
        middle = (begin + end) / 2.0
        between = (begin + middle) / 2.0
        p, m, q, r = (points(each) for each in (begin, middle, between, end))
        far = np.maximum(_off_chord(p, m, r), _off_chord(p, q, r)) > off
        done.append(begin[~far])
        begin, end = np.concatenate([begin[far], middle[far]]), np.concatenate([middle[far], end[far]])
        if not far.any():
            break
    return np.sort(np.concatenate([*done, begin]))


def _off_chord(a: FloatArray, p: FloatArray, b: FloatArray) -> FloatArray:
    chord = b - a
    size = np.hypot(*chord.T)
    with np.errstate(all="ignore"):  # a curve that goes so far is refused
        across = np.abs(chord[:, 0] * (p - a)[:, 1] - chord[:, 1] * (p - a)[:, 0]) / np.where(size > 0.0, size, 1.0)
    return np.where(size > 0.0, across, np.hypot(*(p - a).T))
