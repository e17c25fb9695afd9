"""A taut cord: straight parts and arcs about wheels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import MovingPart
from movimentum.drawing.line_frames import own_of, stroke
from movimentum.drawing.model import SymbolMark
from movimentum.solver.poses import Poses
from movimentum.things.kinds.cord import Course

_ARC_POINTS = 49


def cord(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """One line; about a wheel at an end it goes once around."""
    yield MovingPart(stroke(mark), course(points, own_of(mark, Course).radii), shown)


def course(points: FloatArray, radii: tuple[float, ...]) -> FloatArray:
    """(F, N, 2): the points of a cord, in the world. ``points`` (F, P, 2) are those that it runs to and the wheels'
    centres, ``radii`` as in `Course`. Tangents as in `movimentum.timeline.cords`; where there is none, because a wheel
    reaches beyond the next point, the cord goes the straight way.
    """
    reach = np.diff(points, axis=1)
    apart = np.hypot(reach[..., 0], reach[..., 1])
    lower = -np.diff(np.array(radii))  # (P - 1,)
    sine = np.clip(np.divide(lower, apart, out=np.zeros_like(apart), where=apart > 0.0), -1.0, 1.0)
    along = np.arctan2(reach[..., 1], reach[..., 0]) - np.arcsin(sine)  # (F, P - 1)
    last = len(radii) - 1
    closed = radii[0] != 0.0 and radii[0] == radii[last] and bool(np.array_equal(points[:, 0], points[:, last]))
    pieces: list[FloatArray] = []
    for n, radius in enumerate(radii):
        if radius == 0.0:
            pieces.append(points[:, n : n + 1])
            continue
        side = np.sign(radius)
        if closed and n == last:
            pieces.append(pieces[0][:, :1])
            continue
        if 0 < n < last or closed:
            came, turn = along[:, n - 1], np.mod(side * (along[:, n - 1] - along[:, n]), 2.0 * np.pi)
        else:
            came, turn = along[:, 0 if n == 0 else -1], np.full(len(points), 2.0 * np.pi)
        angles = came[:, None] - side * turn[:, None] * np.linspace(0.0, 1.0, _ARC_POINTS)
        normals = np.stack([-np.sin(angles), np.cos(angles)], axis=-1)
        pieces.append(points[:, n : n + 1] + radius * normals)
    return np.concatenate(pieces, axis=1)
