"""The marks of a display list, as Pillow's painter draws them. Items are values: they are sent to other processes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum import geometry
from movimentum.drawing.arrows import arrow_parts
from movimentum.drawing.model import (
    DiscMark,
    FigureMark,
    FreeArrow,
    LinkMark,
    NoteMark,
    Point,
    PolylineMark,
    SymbolMark,
    TextMark,
)
from movimentum.drawing.motion import arrow_ends, arrow_shown, paint_at, state
from movimentum.drawing.style import ARROW_WIDTH, DOT_EDGE, PAPER, Color
from movimentum.drawing.texts import written
from movimentum.geometry import Affine
from movimentum.rendering.canvas import Canvas
from movimentum.rendering.coverage import FARTHEST, bounded, disc, polygon, union
from movimentum.rendering.prepare import PreparedMark
from movimentum.rendering.sprites import Sprite
from movimentum.solver.poses import Poses


@dataclass(frozen=True, slots=True)
class Item:
    """One part of the picture."""

    prepared: PreparedMark

    def state(self, poses: Poses) -> NDArray[np.float64]:
        """(F, K): all numbers that this item's picture depends on; equal rows are equal pictures."""
        return state(self.prepared.mark, poses)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i`` (a position in ``poses``)."""
        mark, sprite = self.prepared.mark, self.prepared.sprite
        match mark:
            case NoteMark():
                _note(self.prepared, mark, canvas, to_image, poses.select(slice(i, i + 1)))
            case FreeArrow():
                now = poses.select(slice(i, i + 1))
                if arrow_shown(mark, now)[0]:
                    points = [to_image.apply(x, y) for x, y in arrow_ends(mark, now)[0].tolist()]
                    _line(canvas, points, ARROW_WIDTH * to_image.a, True, (1.0, mark.color))
            case LinkMark():
                paint = paint_at(mark.paint, poses, i)
                if paint[0] > 0.0 and all(poses.visible[thing, i] for thing, _ in mark.through):
                    points = [(to_image @ _pose(poses, thing, i)).apply(*local) for thing, local in mark.through]
                    _line(canvas, points, mark.width * to_image.a, False, paint)
            case SymbolMark():
                paint = paint_at(mark.paint, poses, i)
                if paint[0] > 0.0:
                    _symbol(mark, canvas, to_image, poses.select(slice(i, i + 1)), paint)
            case _:
                paint = paint_at(mark.paint, poses, i)
                if paint[0] > 0.0:
                    to_world = _pose(poses, mark.body, i)
                    if isinstance(mark, PolylineMark):
                        place = to_image @ to_world
                        points = [place.apply(*point) for point in mark.points]
                        _line(canvas, points, mark.width * to_image.a, mark.arrow, paint)
                    elif isinstance(mark, DiscMark):
                        _disc(mark, canvas, to_image, (to_image @ to_world).apply(*mark.centre), paint)
                    elif isinstance(mark, FigureMark):
                        _figure(mark, canvas, to_image @ to_world, to_image.a, paint)
                    elif isinstance(mark, TextMark) and mark.pieces:
                        _live_text(mark, canvas, to_image, to_world, poses.select(slice(i, i + 1)), paint)
                    elif sprite is not None:
                        canvas.picture(sprite, to_image @ (to_world @ sprite.to_local), *paint)


def _figure(mark: FigureMark, canvas: Canvas, place: Affine, scale: float, paint: tuple[float, Color]) -> None:
    """The parts of a body; what lies over each other is faded as one."""

    def parts(sheet: Canvas) -> None:
        for part in mark.parts:
            rings = [[place.apply(*point) for point in ring] for ring in (part.points, *part.holes)]
            sheet.fill(sheet.part(part, rings, scale), part.color or paint[1])

    canvas.together(paint[0], parts)


def _symbol(mark: SymbolMark, canvas: Canvas, to_image: Affine, poses: Poses, paint: tuple[float, Color]) -> None:
    """A symbol in the one frame of ``poses``."""
    from movimentum.drawing.symbols import caption, moving_parts, symbol_shown  # only some films have symbols

    if not symbol_shown(mark, poses)[0]:
        return
    found = [part for part in moving_parts(mark, poses) if part.shown[0]]
    words = caption(mark, poses)

    def parts(sheet: Canvas) -> None:
        for part in found:
            ring = [to_image.apply(x, y) for x, y in part.points[0].tolist()]
            sheet.fill(sheet.part(part.style, [ring], to_image.a), part.style.color or paint[1])
        if words is not None:
            from movimentum.rendering.text import written_sprite

            sprite = written_sprite(words.texts[0], mark.size, to_image.a, "middle", mark.italic, mark.span)
            if sprite is not None:
                x, y = words.middle[0].tolist()
                sheet.picture(sprite, to_image @ (Affine(1.0, 0.0, x, 0.0, 1.0, y) @ sprite.to_local), 1.0, paint[1])

    canvas.together(paint[0], parts)


def _live_text(
    mark: TextMark, canvas: Canvas, to_image: Affine, to_world: Affine, poses: Poses, paint: tuple[float, Color]
) -> None:
    """A label in the one frame of ``poses``."""
    from movimentum.rendering.text import written_sprite

    text = written(mark.pieces, mark.paint.thing, poses)[0]
    sprite = written_sprite(text, mark.height, to_image.a, mark.align, mark.italic, mark.span)
    if sprite is not None:
        canvas.picture(sprite, to_image @ (to_world @ sprite.moved(*mark.start).to_local), *paint)


def _note(prepared: PreparedMark, mark: NoteMark, canvas: Canvas, to_image: Affine, poses: Poses) -> None:
    """A note in the one frame of ``poses``."""
    if not poses.visible[mark.body, 0]:
        return
    scale = to_image.a
    x, y = to_image.apply(*poses.world(mark.body, mark.local)[0].tolist())
    if mark.dot:
        canvas.fill(disc((x, y), mark.dot * scale, None, canvas.size), PAPER)
        canvas.fill(disc((x, y), mark.dot * scale, DOT_EDGE * scale, canvas.size), mark.color)
    place = Affine(scale, 0.0, x + mark.offset[0] * scale, 0.0, -scale, y - mark.offset[1] * scale)
    layers: list[tuple[Sprite | None, Color]] = [(prepared.halo, PAPER), (prepared.sprite, mark.color)]
    for sprite, color in layers:
        if sprite is not None:
            canvas.picture(sprite, place @ sprite.to_local, 1.0, color)


def _disc(mark: DiscMark, canvas: Canvas, to_image: Affine, centre: Point, paint: tuple[float, Color]) -> None:
    opacity, color = paint
    width = None if mark.width is None else mark.width * to_image.a
    canvas.fill(disc(centre, mark.radius * to_image.a, width, canvas.size), color, opacity)


def _line(canvas: Canvas, points: list[Point], width: float, arrow: bool, paint: tuple[float, Color]) -> None:
    """A polyline in image coordinates, with ``arrow`` a head whose tip is its last point; one coverage altogether."""
    opacity, color = paint
    points = bounded(points)
    parts = arrow_parts(points, min(width, FARTHEST)) if arrow else None
    if parts is None:
        canvas.fill(canvas.line(points, width), color, opacity)
        return
    shaft, head = parts
    tip = polygon(head, canvas.size)
    canvas.fill(union([canvas.line(shaft, width), tip]), color, opacity)


def _pose(poses: Poses, thing: int, i: int) -> Affine:
    x, y = poses.origin[thing, i].tolist()
    cosine, sine = poses.direction[thing, i].tolist()
    return geometry.pose(x, y, cosine, sine)
