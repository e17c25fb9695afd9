"""The marks of a display list as Pillow's painter draws them: values, which can be sent to other processes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum import geometry
from movimentum.drawing.model import (
    BodyMark,
    DiscMark,
    FigureMark,
    FreeArrow,
    ImageMark,
    LinkMark,
    NoteMark,
    Paint,
    Point,
    PolylineMark,
    SymbolMark,
    TextMark,
)
from movimentum.drawing.motion import arrow_ends, arrow_shown, drawn_pose, paint_at, paint_over
from movimentum.drawing.style import ARROW_WIDTH, DOT_EDGE, NOTE_HEIGHT, PAPER, Color
from movimentum.drawing.texts import written
from movimentum.geometry import Affine
from movimentum.records import replace
from movimentum.rendering.canvas import Canvas
from movimentum.rendering.coverage import HERE, disc
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.shapes import Filled, line_shape, part_shape, round_shape
from movimentum.rendering.sprites import Sprite
from movimentum.solver.poses import Poses
from movimentum.tolerances import SAME_SCALE_OF_TEXT


class Item:
    """One part of the picture."""

    __slots__ = ("_coarse", "_scale", "_shapes", "prepared")

    def __init__(self, prepared: PreparedMark) -> None:
        self.prepared = prepared
        self._shapes: list[Filled] | None = None
        self._scale = 0.0
        self._coarse: dict[int, Sprite] = {}

    @property
    def still(self) -> bool:
        """Whether the camera leaves it where it is."""
        return self.prepared.still

    def again(self) -> Item:
        """The same, to be drawn elsewhere."""
        return Item(self.prepared)

    def state(self, poses: Poses) -> NDArray[np.float64]:
        """(F, K): all numbers that this item's picture depends on; equal rows are equal pictures."""
        return self.prepared.state(poses)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i`` (a position in ``poses``)."""
        clip = self.prepared.clip
        if clip is None:
            self._draw(canvas, to_image, poses, i)
            return
        from movimentum.drawing.clips import clip_outline  # few films have any

        inside = clip_outline(clip, poses.one(i))
        if inside.shown[0]:
            points: list[Point] = [(x, y) for x, y in inside.points[0].tolist()]
            outline = part_shape(replace(inside.style, points=tuple(points)), to_image.a).at(to_image, to_image.a)
            canvas.within(outline, lambda sheet: self._draw(sheet, to_image, poses, i))

    def _draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        mark, sprite, scale = self.prepared.mark, self.prepared.sprite, to_image.a
        if isinstance(mark, NoteMark):
            _note(self.prepared, mark, canvas, to_image, poses.one(i))
            return
        if isinstance(mark, FreeArrow):
            now = poses.one(i)
            if arrow_shown(mark, now)[0]:
                ends: list[Point] = [(x, y) for x, y in arrow_ends(mark, now)[0].tolist()]
                canvas.fill(line_shape(ends, ARROW_WIDTH, True, scale).at(to_image, scale), mark.color)
            return
        paint = paint_at(mark.paint, poses, i)
        if paint[0] <= 0.0:
            return
        match mark:
            case LinkMark():
                if all(poses.visible[thing, i] for thing, _ in mark.through):
                    points = [_pose(poses, thing, i).apply(*local) for thing, local in mark.through]
                    shape = line_shape(points, mark.width, False, scale, canvas.thinnest)
                    canvas.fill(shape.at(to_image, scale), paint[1], paint[0])
            case SymbolMark():
                _symbol(mark, canvas, to_image, poses.one(i), paint)
            case PolylineMark() | DiscMark() | FigureMark():
                fine = scale * mark.paint.zoom
                if self._shapes is None or self._scale != fine:
                    self._shapes, self._scale = _shapes(mark, fine, canvas.thinnest), fine
                size, place = _drawn(mark, poses, i)
                _together(canvas, self._shapes, to_image @ place, fine, paint, size * scale / fine)
            case TextMark() if mark.pieces or (sprite is not None and _enlarged(sprite, scale * mark.paint.zoom)):
                now = poses.one(i)
                _live_text(mark, canvas, to_image, *_drawn(mark, poses, i), now, paint)
            case ImageMark() | TextMark() if sprite is not None:
                sprite = self._fitting(sprite, scale * mark.paint.zoom)
                canvas.picture(sprite, to_image @ (_drawn(mark, poses, i)[1] @ sprite.to_local), *paint)
            case _:
                pass

    def _fitting(self, sprite: Sprite, scale: float) -> Sprite:
        """A picture with no more than twice as many pixels, each way, as are drawn of it."""
        level = 0
        share = math.hypot(sprite.to_local.a, sprite.to_local.d) * scale
        while level < 5 and share * 2 ** (level + 1) <= 1.0:
            level += 1
        if level == 0 or sprite.image.mode == "L":
            return sprite
        if level not in self._coarse:
            self._coarse[level] = sprite.coarser(2**level)
        return self._coarse[level]


def _enlarged(sprite: Sprite, scale: float) -> bool:
    """Whether the letters of a text are drawn in another size than they were made for."""
    return abs(math.hypot(sprite.to_local.a, sprite.to_local.d) * scale - 1.0) > SAME_SCALE_OF_TEXT


class ItemGroup:
    """Parts of the picture that are faded as one."""

    __slots__ = ("_paint", "items")

    def __init__(self, paint: Paint, items: tuple[Item, ...]) -> None:
        self._paint, self.items = paint, items

    @property
    def still(self) -> bool:
        """Whether the camera leaves it where it is."""
        return all(item.still for item in self.items)

    def again(self) -> ItemGroup:
        """The same, to be drawn elsewhere."""
        return ItemGroup(self._paint, tuple(item.again() for item in self.items))

    def state(self, poses: Poses) -> NDArray[np.float64]:
        """(F, K): all numbers that the picture of the group depends on."""
        own = paint_over(self._paint, poses)[0][:, None]
        return np.concatenate([own, *(item.state(poses) for item in self.items)], axis=1)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i`` (a position in ``poses``)."""

        def parts(sheet: Canvas) -> None:
            for item in self.items:
                item.draw(sheet, to_image, poses, i)

        canvas.together(paint_at(self._paint, poses, i)[0], parts)


def _shapes(mark: PolylineMark | DiscMark | FigureMark, scale: float, thinnest: float) -> list[Filled]:
    """The parts of a body, back to front."""
    match mark:
        case PolylineMark():
            return [line_shape(mark.points, mark.width, mark.arrow, scale, thinnest)]
        case DiscMark():
            return [round_shape(mark.centre, mark.radius, mark.width, scale)]
        case FigureMark():
            return [part_shape(part, scale, thinnest) for part in mark.parts]


def _together(
    canvas: Canvas, shapes: Sequence[Filled], place: Affine, scale: float, paint: tuple[float, Color], size: float
) -> None:
    """Shapes over each other, faded as one; ``size``: how many times as large as they were made."""

    def parts(sheet: Canvas) -> None:
        for shape in shapes:
            sheet.fill(shape.at(place, scale, size), shape.color or paint[1])

    if len(shapes) == 1:
        canvas.fill(shapes[0].at(place, scale, size), shapes[0].color or paint[1], paint[0])
    else:
        canvas.together(paint[0], parts)


def _symbol(mark: SymbolMark, canvas: Canvas, to_image: Affine, poses: Poses, paint: tuple[float, Color]) -> None:
    """A symbol in the one frame of ``poses``."""
    from movimentum.drawing.symbols import caption, moving_parts, symbol_shown  # only some films have symbols

    if not symbol_shown(mark, poses)[0]:
        return
    found = [part for part in moving_parts(mark, poses) if part.shown[0]]
    words, scale = caption(mark, poses), to_image.a

    def parts(sheet: Canvas) -> None:
        for part in found:
            points: list[Point] = [(x, y) for x, y in part.points[0].tolist()]
            shape = part_shape(replace(part.style, points=tuple(points)), scale, canvas.thinnest)
            sheet.fill(shape.at(to_image, scale), part.style.color or paint[1])
        if words is not None:
            from movimentum.rendering.text import written_sprite

            sprite = written_sprite(words.texts[0], mark.size, to_image.a, words.align, mark.italic, mark.span)
            if sprite is not None:
                x, y = words.place[0].tolist()
                sheet.picture(sprite, to_image @ (Affine(1.0, 0.0, x, 0.0, 1.0, y) @ sprite.to_local), 1.0, paint[1])

    canvas.together(paint[0], parts)


def _live_text(
    mark: TextMark,
    canvas: Canvas,
    to_image: Affine,
    size: float,
    to_world: Affine,
    poses: Poses,
    paint: tuple[float, Color],
) -> None:
    """A label in the one frame of ``poses``, ``size`` times as large."""
    from movimentum.rendering.text import written_sprite

    text = written(mark.pieces, mark.paint.thing, poses)[0] if mark.pieces else mark.text
    sprite = written_sprite(text, mark.height, to_image.a * size, mark.align, mark.italic, mark.span)
    if sprite is not None:
        canvas.picture(sprite, to_image @ (to_world @ sprite.moved(*mark.start).to_local), *paint)


def _note(prepared: PreparedMark, mark: NoteMark, canvas: Canvas, to_image: Affine, poses: Poses) -> None:
    """A note in the one frame of ``poses``."""
    if not poses.visible[mark.body, 0]:
        return
    scale = to_image.a
    x, y = to_image.apply(*poses.world(mark.body, mark.local)[0].tolist())
    if mark.dot:
        canvas.fill((disc((x, y), mark.dot * scale), HERE), PAPER)
        canvas.fill((disc((x, y), mark.dot * scale, DOT_EDGE * scale), HERE), mark.color)
    place = Affine(scale, 0.0, x + mark.offset[0] * scale, 0.0, -scale, y - mark.offset[1] * scale)
    around, sprite = prepared.halo, prepared.sprite
    if sprite is not None and _enlarged(sprite, scale):
        from movimentum.rendering.text import halo, written_sprite

        sprite = written_sprite(mark.text, NOTE_HEIGHT, scale, "left", False)
        around = None if sprite is None else halo(sprite)
    layers: list[tuple[Sprite | None, Color]] = [(around, PAPER), (sprite, mark.color)]
    for sprite, color in layers:
        if sprite is not None:
            canvas.picture(sprite, place @ sprite.to_local, 1.0, color)


def _drawn(mark: BodyMark, poses: Poses, i: int) -> tuple[float, Affine]:
    """How many times as large a mark is drawn, and where."""
    if mark.paint.about is None or (mark.paint.thing, "scale") not in poses.properties:
        return 1.0, _pose(poses, mark.body, i)
    origin, direction = drawn_pose(mark, poses.one(i))
    x, y, cosine, sine = *origin[0].tolist(), *direction[0].tolist()
    return math.hypot(cosine, sine), geometry.pose(x, y, cosine, sine)


def _pose(poses: Poses, thing: int, i: int) -> Affine:
    x, y = poses.origin[thing, i].tolist()
    cosine, sine = poses.direction[thing, i].tolist()
    return geometry.pose(x, y, cosine, sine)
