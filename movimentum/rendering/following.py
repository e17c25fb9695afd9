"""Labels along curves: the outlines of their letters, and the mark that replaces such a label."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.drawing.along import body_curve, outline_parts
from movimentum.drawing.model import (
    Along,
    DiscMark,
    FigureMark,
    FollowMark,
    Point,
    PolylineMark,
    SymbolMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.paths import frame_path, paths
from movimentum.drawing.style import SLANT
from movimentum.rendering.layout import laid_out, width_of
from movimentum.rendering.outlines import edges_of
from movimentum.rendering.stream import PoseSource, chunks
from movimentum.solver.motion import PathMotion

OFF = 0.1
"""World pixels that a path may be missed by under letters."""


def following(mark: FollowMark, source: PoseSource, motion: PathMotion | None) -> ThingMark:
    """The letters of a label, along its curve."""
    letters = tuple(_letters(mark.text, mark.size, mark.italic))
    curve = mark.curve
    width = mark.size * width_of(mark.text)
    match curve:
        case SymbolMark():
            along = Along(letters, width, mark.align, mark.offset, curve)
            return SymbolMark(
                mark.paint, mark.kind, curve.through, 1.0, mark.size, mark.own, mark.paint.color, text=(), along=along
            )
        case TraceMark():
            points, closed, carried = _path(curve, source, motion), False, None
        case DiscMark() | FigureMark() | PolylineMark():
            (points, closed), carried = body_curve(curve), curve.body
    parts = outline_parts(Along(letters, width, mark.align, mark.offset), points, closed) if points.size else ()
    return FigureMark(mark.paint, parts, carried)


def _letters(text: str, size: float, italic: bool) -> Iterator[tuple[float, float, tuple[Point, ...]]]:
    """For each letter how far its middle is along the text, its breadth, and its outline about there: one ring, with
    ways without breadth between its edges.
    """
    found = laid_out(text)
    ends = [*(letters.x for letters in found[1:]), width_of(text)] if found else []
    for letters, end in zip(found, ends, strict=True):
        middle, ring = (letters.x + end) / 2.0, list[Point]()
        for edge in edges_of(letters):
            corners = [(letters.size * x + letters.x - middle, letters.size * y + letters.rise) for x, y in edge]
            if italic:
                corners = [(x + SLANT * y, y) for x, y in corners]
            ring += [*corners, corners[0], *ring[:1]]
        if ring:
            yield size * middle, size * (end - letters.x), tuple((size * x, size * y) for x, y in ring)


def _path(mark: TraceMark, source: PoseSource, motion: PathMotion | None) -> FloatArray:
    """(1, P, 2): the path of a trace in the whole film, as far as it is in one piece."""
    if motion is None:
        rows = np.concatenate([np.zeros((0, 4)), *(frame_path(mark, chunk) for chunk in chunks(source))])
    else:
        timeline = motion.timeline
        times = [timeline.frame_time(frame) for frame in range(timeline.frame_count)]
        (rows,) = paths(motion, [mark], [*times, timeline.end] if timeline.loops else times, OFF)
    shown = rows[:, 2] > 0.0
    begin = int(np.argmax(shown)) if shown.any() else len(rows)
    gap = np.flatnonzero(~shown[begin:])
    return rows[None, begin : begin + int(gap[0]) if len(gap) else len(rows), :2]
