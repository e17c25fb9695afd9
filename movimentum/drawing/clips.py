"""Clips: the area of the thing that cuts off another one, in the world."""

from __future__ import annotations

from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.model import DiscMark, FigureMark, Point, SymbolMark, ThingMark
from movimentum.drawing.motion import placed_points
from movimentum.drawing.outlines import body_outline
from movimentum.solver.poses import Poses


def clip_outline(mark: ThingMark, poses: Poses) -> MovingPart:
    """The area that a thing covers, as a filled part; it is not shown if nothing is inside."""
    shown = poses.visible[mark.paint.thing]
    if isinstance(mark, SymbolMark):
        from movimentum.drawing.areas import area_outline
        from movimentum.drawing.symbols import symbol_points, symbol_shown

        return MovingPart(_INSIDE, area_outline(mark, symbol_points(mark, poses)), symbol_shown(mark, poses))
    assert isinstance(mark, DiscMark | FigureMark)
    return MovingPart(_INSIDE, placed_points(mark, poses, _covered(mark)), shown)


def _covered(mark: DiscMark | FigureMark) -> list[Point]:
    """Local points around what a body covers: all its pieces, without their holes, which go round the other way. Lines
    there and back join them to one outline, and cover nothing.
    """
    around = body_outline(mark)
    pieces = [] if isinstance(mark, DiscMark) else [part for part in mark.parts if part.form is PartForm.FILL]
    more = [ring for k, piece in enumerate(pieces) for ring in ((piece.points,) if k else ()) + piece.holes]
    for ring in more:
        around += [around[0], *ring, ring[0]]
    return around


_INSIDE = FigurePart(PartForm.FILL, ())
