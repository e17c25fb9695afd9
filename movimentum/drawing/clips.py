"""What a thing is cut off by that is shown only inside another one: that one's outline, in the world."""

from __future__ import annotations

from movimentum.drawing.model import DiscMark, FigureMark, SymbolMark, ThingMark
from movimentum.drawing.motion import placed_points
from movimentum.drawing.outlines import body_outline
from movimentum.drawing.parts import FigurePart, MovingPart, PartForm
from movimentum.solver.poses import Poses


def clip_outline(mark: ThingMark, poses: Poses) -> MovingPart:
    """The outline of a thing with an inside, as a filled part; it is not shown where there is nothing inside."""
    shown = poses.visible[mark.paint.thing]
    if isinstance(mark, SymbolMark):
        from movimentum.drawing.areas import area_outline
        from movimentum.drawing.symbols import symbol_points, symbol_shown

        return MovingPart(_INSIDE, area_outline(mark, symbol_points(mark, poses)), symbol_shown(mark, poses))
    assert isinstance(mark, DiscMark | FigureMark)
    return MovingPart(_INSIDE, placed_points(mark, poses, body_outline(mark)), shown)


_INSIDE = FigurePart(PartForm.FILL, ())
