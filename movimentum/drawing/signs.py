"""Signs of geometry at anchors: right angles, equal lengths, parallel lines."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.laid import frame, line, own_of, stroke
from movimentum.drawing.model import SymbolMark
from movimentum.drawing.parts import MovingPart
from movimentum.solver.poses import Poses
from movimentum.things.kinds.signs import Counted


def right_angle(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """The two sides of a small square at the second point."""
    corner = points[:, 1]
    first, second = (frame(points[:, [1, end]]) for end in (0, 2))
    side = mark.size * np.minimum(1.0, 0.5 * np.minimum(first[2], second[2]) / mark.size)[:, None]
    u, v = side * first[0], side * second[0]
    yield MovingPart(stroke(mark), np.stack([corner + u, corner + u + v, corner + v], axis=1), shown)


def ticks(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """Strokes across the middle of the line."""
    for middle in _middles(mark, points, 0.4):
        ends = (middle, -0.5 * mark.size), (middle, 0.5 * mark.size)
        yield MovingPart(stroke(mark), line(points, len(points), *ends), shown)


def parallel(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """Heads of arrows on the middle of the line, which point to its end."""
    for middle in _middles(mark, points, 0.6):
        back, half = middle - 0.35 * mark.size, 0.45 * mark.size
        corners = (back, -half), (middle + 0.35 * mark.size, 0.0), (back, half)
        yield MovingPart(stroke(mark), line(points, len(points), *corners), shown)


def _middles(mark: SymbolMark, points: FloatArray, apart: float) -> Iterator[FloatArray]:
    """(F,) how far along the line each sign is."""
    count = own_of(mark, Counted).count
    _, _, length = frame(points)
    for number in range(count):
        yield length / 2.0 + (number - (count - 1) / 2.0) * apart * mark.size
