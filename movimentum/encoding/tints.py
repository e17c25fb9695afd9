"""The colours of a film, taken from its display list before any pixel is drawn: those that marks declare, and those
that they take over time. Also picks frames that together show all of them.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.drawing.model import (
    FigureMark,
    FreeArrow,
    ImageMark,
    NoteMark,
    OverMark,
    SymbolMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.motion import arrow_shown, paint_over
from movimentum.drawing.style import FAINT, PAPER, Color
from movimentum.encoding.palette import Keys, distinct, packed
from movimentum.records import dataclass
from movimentum.rendering.painter import Painter
from movimentum.rendering.stream import PoseSource, chunks
from movimentum.solver.poses import Poses

_EVENLY = 12
"""Frames that are looked at in any film."""
_MOST = 24
"""Frames that are looked at in all."""


@dataclass(frozen=True, slots=True)
class Tints:
    """``colors``: of areas, as they are where they lie on the ground; ``positions``: frames (ascending) that show all
    marks, as bright and as dark, as clear and as faint as they get.
    """

    colors: Keys
    positions: list[int]


def tints(painter: Painter, source: PoseSource, frames: int) -> Tints:
    """The colours of a film of so many ``frames``."""
    marks: list[ThingMark | OverMark | TraceMark] = [*painter.marks]
    marks += [trace.mark for trace in (*painter.paths, *painter.traces)]
    seen = sorted({number * frames // _EVENLY for number in range(_EVENLY)})
    colors = [packed(np.array([painter.background], dtype=np.uint8))]
    most: list[dict[int, tuple[float, int]]] = [{} for _ in marks]  # of each measure: its greatest value, and where
    looked: list[dict[int, float]] = [{} for _ in marks]  # the greatest value in the frames that are looked at
    start = 0
    for chunk in chunks(source):
        size = len(chunk.frames)
        here = [position - start for position in seen if start <= position < start + size]
        for mark, greatest, known in zip(marks, most, looked, strict=True):
            opacity, color = _painted(mark, chunk)
            colors.append(_areas(mark, opacity, color, painter.background))
            for number, values in enumerate(_measures(opacity, color)):
                place = int(values.argmax())
                if values[place] > greatest.get(number, (-np.inf, 0))[0]:
                    greatest[number] = float(values[place]), start + place
                if here:
                    known[number] = max(known.get(number, -np.inf), float(values[here].max()))
        start += size
    missed = [
        where
        for greatest, known in zip(most, looked, strict=True)
        for number, (value, where) in greatest.items()
        if value > known.get(number, -np.inf) + 0.02
    ]
    positions = {*seen, *sorted(set(missed))[: _MOST - _EVENLY]}
    return Tints(distinct(np.concatenate(colors)), sorted(positions))


def _painted(mark: ThingMark | OverMark | TraceMark, poses: Poses) -> tuple[FloatArray, FloatArray]:
    """(F,) opacity, 0 where it is not drawn, and (F, 3) colour of its paint."""
    if isinstance(mark, TraceMark | NoteMark | FreeArrow):
        paint = mark.paint if isinstance(mark, TraceMark) else None
        if paint is None:
            shown = arrow_shown(mark, poses) if isinstance(mark, FreeArrow) else poses.visible[mark.body]
            opacity = shown.astype(np.float64)
            color = np.tile(np.array(mark.color, dtype=np.float64), (len(opacity), 1))
        else:
            opacity, color = paint_over(paint, poses)
        return opacity * (FAINT if isinstance(mark, TraceMark) and mark.whole else 1.0), color
    return paint_over(mark.paint, poses)


def _areas(mark: ThingMark | OverMark | TraceMark, opacity: FloatArray, color: FloatArray, ground: Color) -> Keys:
    """The colours that areas of a mark have on the ground; not those of an image."""
    if isinstance(mark, ImageMark):
        return packed(np.zeros((0, 3), dtype=np.uint8))
    fixed: list[Color | None] = []
    match mark:
        case FigureMark():
            fixed = [part.color for part in mark.parts]
        case SymbolMark():
            fixed = [mark.ink, mark.fill]
        case NoteMark():
            fixed = [PAPER]
        case _:
            pass
    drawn = opacity > 0.0
    share = np.rint(255.0 * opacity[drawn])[:, None] / 255.0
    paints = [color[drawn], *(np.array([own], dtype=np.float64) for own in {*fixed} if own is not None)]
    mixed = [np.rint(share * paint + (1.0 - share) * np.array(ground)).astype(np.uint8) for paint in paints]
    return distinct(packed(np.concatenate(mixed)))


def _measures(opacity: FloatArray, color: FloatArray) -> list[FloatArray]:
    """(F,) each: where one of them is greatest, there is something to be seen of a mark."""
    shown = opacity > 0.0
    columns = [opacity, *(color.T / 255.0)]
    return [np.where(shown, sign * column, -2.0) for column in columns for sign in (1.0, -1.0)]
