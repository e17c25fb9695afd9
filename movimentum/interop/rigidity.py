"""The rigidity matrix of a linkage, over its vertices, as the program "linkages" writes it.

Source: H. Cooper, "Mechanical Linkages in Python" (2007), section "Rigidity Theory".
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.interop.linkages import Linkage


def rigidity_rows(linkage: Linkage) -> tuple[tuple[str, ...], FloatArray]:
    """The name of each row, and the matrix (m, 2n) that takes the velocities x0, y0, x1, y1, … of the vertices to
    zero. Nothing is scaled: entries of a rod are in pixels, those of an angle in square pixels per radian divided by
    pixels.

    Rows, in this order: two for each fixed vertex, with a single 1; one for each rod i j, p_j - p_i at i and p_i - p_j
    at j; one for each angle i j k, the rate of the angle times the lengths of its sides. In an angle's row a fixed
    vertex has no entry, because it does not move.
    """
    p = np.array(linkage.vertices, dtype=np.float64).reshape(-1, 2)
    names: list[str] = []
    rows: list[FloatArray] = []

    def row(name: str) -> FloatArray:
        names.append(name)
        rows.append(np.zeros((len(p), 2)))
        return rows[-1]

    for i in linkage.fixed:
        for axis in (0, 1):
            row(f"vertex {i} is fixed .{'xy'[axis]}")[i, axis] = 1.0
    for i, j in linkage.rods:
        rod = row(f"rod {i} {j}")
        rod[i], rod[j] = p[j] - p[i], p[i] - p[j]
    for i, j, k in linkage.angles:
        angle = row(f"angle {i} {j} {k}")
        to_j, to_k = p[j] - p[i], p[k] - p[i]
        ratio = np.hypot(*to_k) / np.hypot(*to_j)
        angle[j] = ratio * np.array([-to_j[1], to_j[0]])
        angle[k] = np.array([to_k[1], -to_k[0]]) / ratio
        angle[i] = -angle[j] - angle[k]
        angle[list(linkage.fixed)] = 0.0
    return tuple(names), np.array(rows).reshape(len(rows), 2 * len(p)) + 0.0
