"""Labels at anchors of other things: their letters and leader lines."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.line_frames import own_of
from movimentum.drawing.model import Spot, SymbolMark
from movimentum.drawing.style import MIDDLE
from movimentum.solver.poses import Poses
from movimentum.text import unraised
from movimentum.things.kinds.label import Beside

LETTER = 0.58
"""Of a font's size: the breadth of a letter, to place a text beside a line."""
HIGH = 0.72
"""Of a font's size: how high capitals are."""
NEAREST = Spot((0.7071067811865476, 0.7071067811865476), 5.0)
"""Where a label is whose place was not looked for: above its anchor, to the right."""
_THIN = 0.9  # world pixels: of a leader
_CLEAR = 3.0  # world pixels between a leader and the letters


def broad(text: str, size: float) -> float:
    """About how broad a text is, in world pixels."""
    return LETTER * len(unraised(text)) * size


def label_place(mark: SymbolMark, points: FloatArray, poses: Poses, texts: list[str]) -> tuple[FloatArray, str]:
    """(F, 2) where the letters are, and what of them is there ("left", "center" or "right" of their baseline, or the
    "middle").
    """
    own = own_of(mark, Beside)
    if own.offset is None:
        return points[:, 0] + _away(mark, poses, texts), "middle"
    x, y = own.offset
    align = own.align or ("left" if x > 0.0 else "right" if x < 0.0 else "center")
    down = 0.0 if y > 0.0 else HIGH * mark.size if y < 0.0 else MIDDLE * mark.size
    return points[:, 0] + np.array([x, y - down]), align


def leader(mark: SymbolMark, points: FloatArray, shown: BoolArray, poses: Poses) -> Iterator[MovingPart]:
    """The line from the anchor to the letters."""
    own = own_of(mark, Beside)
    if not own.leader or mark.text == ():
        return
    if own.offset is None:
        away = _away(mark, poses, [_sample(mark)] * len(points))
        half = np.array([broad(_sample(mark), mark.size) / 2.0 + _CLEAR, 0.5 * mark.size + _CLEAR])
        part = np.min(half / np.maximum(np.abs(away), 1.0), axis=1)
        end = points[:, 0] + away * np.maximum(1.0 - part, 0.0)[:, None]
    else:
        place, align = label_place(mark, points, poses, [])
        side = {"left": -_CLEAR, "right": _CLEAR, "center": 0.0}[align]
        up = 0.0 if align != "center" else 1.0 if own.offset[1] < 0.0 else -1.0
        end = place + np.array([side, MIDDLE * mark.size + up * (0.5 * HIGH * mark.size + _CLEAR)])
    line = FigurePart(PartForm.STROKE, (), _THIN, cap="butt")
    yield MovingPart(line, np.stack([points[:, 0], end], axis=1), shown)


def _sample(mark: SymbolMark) -> str:
    pieces = mark.text or ()
    return "".join(piece if isinstance(piece, str) else "0000" for piece in pieces)


def _away(mark: SymbolMark, poses: Poses, texts: list[str]) -> FloatArray:
    """(F, 2): from the anchor to the middle of the letters, whose box then touches what is as far away as its spot
    says, and which changes smoothly with the direction.
    """
    spot = mark.spot or NEAREST
    direction = np.tile(np.array(spot.direction), (len(poses.frames), 1))
    if spot.turning:
        c, s = np.moveaxis(poses.direction[mark.through[0][0]], -1, 0)
        x, y = spot.direction
        direction = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    half = np.array([broad(text, mark.size) / 2.0 for text in texts])
    reach = half * np.abs(direction[:, 0]) + 0.42 * mark.size * np.abs(direction[:, 1]) + spot.distance
    return direction * reach[:, None]
