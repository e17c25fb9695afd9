"""What is drawn over a picture on request: names, anchors, free motions, and the paths of anchors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.geometry import Affine
from movimentum.rendering.canvas import Canvas, Color
from movimentum.rendering.coverage import Coverage, Point, disc, stroke
from movimentum.rendering.items import arrow_head, boxes, draw_line
from movimentum.rendering.options import FreeMark, Show
from movimentum.rendering.sprites import Sprite
from movimentum.rendering.style import ACCENT, MOTIONS, NOTE_HEIGHT, PAPER
from movimentum.scene.colors import INK
from movimentum.scene.model import Thing
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]

LONGEST, SHORTEST = 36.0, 3.0
"""World pixels: the arrow of the fastest anchor, and the length below which an arrow is too short to be seen."""
ARROW_WIDTH = 2.5


@dataclass(frozen=True, slots=True)
class Note:
    """A text beside a thing's local point, upright, at whole pixels; with ``dot`` a mark at the point itself."""

    thing: int
    local: Point
    text: Sprite
    ground: Sprite
    color: Color
    offset: Point
    dot: float = 0.0

    def state(self, poses: Poses) -> Floats:
        """Where the point is, and whether it is shown."""
        return _point_state(self.thing, self.local, poses)

    def bounds(self, poses: Poses) -> Floats:
        """Nowhere: notes do not make a canvas larger."""
        return np.full((len(poses.frames), 4), np.nan)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``."""
        if not poses.visible[self.thing, i]:
            return
        scale = to_image.a
        x, y = to_image.apply(*poses.select(slice(i, i + 1)).world(self.thing, self.local)[0].tolist())
        if self.dot:
            canvas.fill(disc((x, y), self.dot * scale, None, canvas.size), PAPER)
            canvas.fill(disc((x, y), self.dot * scale, 1.2 * scale, canvas.size), self.color)
        place = Affine(
            *(scale, 0.0, float(round(x + self.offset[0] * scale))),
            *(0.0, -scale, float(round(y - self.offset[1] * scale))),
        )
        canvas.picture(self.ground, place @ self.ground.to_local, 1.0, PAPER)
        canvas.picture(self.text, place @ self.text.to_local, 1.0, self.color)


@dataclass(frozen=True, slots=True)
class FreeArrow:
    """How a point moves in a free motion: an arrow from it, in the motion's colour."""

    mark: FreeMark

    def state(self, poses: Poses) -> Floats:
        """Where the point is, which way it is turned, and whether it is shown."""
        thing = self.mark.thing
        now = self._now(poses)[:, None].astype(np.float64)
        return np.concatenate([_point_state(thing, self.mark.local, poses), poses.direction[thing], now], axis=1)

    def _now(self, poses: Poses) -> NDArray[np.bool_]:
        return (self.mark.begin <= poses.times) & (poses.times <= self.mark.end)

    def _drawn(self, poses: Poses) -> NDArray[np.bool_]:
        long_enough = math.hypot(*self.mark.velocity) * LONGEST >= SHORTEST
        return poses.visible[self.mark.thing] & self._now(poses) & long_enough

    def _ends(self, poses: Poses) -> Floats:
        """(F, 2, 2): where the arrow begins and where its tip is, in the world."""
        tail = poses.world(self.mark.thing, self.mark.local)
        c, s = np.moveaxis(poses.direction[self.mark.thing], -1, 0)
        vx, vy = self.mark.velocity
        along = np.stack([c * vx - s * vy, s * vx + c * vy], axis=-1) * LONGEST
        return np.stack([tail, tail + along], axis=1)

    def bounds(self, poses: Poses) -> Floats:
        """The box about the arrow with its head: it may be the only thing that is visible."""
        return boxes(self._ends(poses), self._drawn(poses), arrow_head(ARROW_WIDTH)[1])

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``."""
        now = poses.select(slice(i, i + 1))
        if self._drawn(now)[0]:
            color = MOTIONS[self.mark.motion % len(MOTIONS)]
            points = [to_image.apply(x, y) for x, y in self._ends(now)[0].tolist()]
            draw_line(canvas, points, ARROW_WIDTH * to_image.a, True, (color, 1.0))


@dataclass(frozen=True, slots=True)
class Trace:
    """The path of a thing's local point, from the animation's first frame to the present one.

    ``past`` are the points, as `points` gives them, of frames before the first one that is drawn.
    """

    thing: int
    local: Point
    color: Color
    width: float
    past: Floats | None = None

    def points(self, poses: Poses) -> Floats:
        """(F, 3): world x, y, and 1 where the thing is visible, else 0."""
        return _point_state(self.thing, self.local, poses)


class TraceLayer:
    """One trace as far as it has been drawn. Segments only ever add, one at a time, so the picture of a frame is the
    same however the frames were divided into runs (pixels keep the largest coverage, whatever the order).
    """

    def __init__(self, trace: Trace, size: tuple[int, int]) -> None:
        self.trace = trace
        self._size = size
        self._values = np.zeros((size[1], size[0]), dtype=np.uint8)
        self._last: Point | None = None
        self._box: tuple[int, int, int, int] | None = None

    def state(self, poses: Poses) -> Floats:
        """The newest point."""
        return self.trace.points(poses)

    def feed(self, points: Floats, to_image: Affine) -> None:
        """Continue along ``points`` (M, 3) as `Trace.points` gives them."""
        width = self.trace.width * to_image.a
        for x, y, shown in points.tolist():
            if not shown:
                self._last = None
                continue
            point = to_image.apply(x, y)
            if point != self._last:
                # the start of a path is a dot
                self._add(stroke([self._last or point, point], width, self._size))
                self._last = point

    def _add(self, part: Coverage | None) -> None:
        if part is None:
            return
        left, top = part.left, part.top
        bottom, right = top + part.values.shape[0], left + part.values.shape[1]
        into = self._values[top:bottom, left:right]
        np.maximum(into, part.values, out=into)
        box = self._box or (left, top, right, bottom)
        self._box = (min(box[0], left), min(box[1], top), max(box[2], right), max(box[3], bottom))

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the path so far over the canvas."""
        del to_image, poses, i  # it was fed
        if self._box is not None:
            left, top, right, bottom = self._box
            canvas.fill(Coverage(left, top, self._values[top:bottom, left:right]), self.trace.color)


def notes(things: tuple[Thing, ...], show: frozenset[Show], magnification: float) -> list[Note]:
    """The names of things and anchors that ``show`` asks for, for all bodies that are not hidden."""
    found: list[Note] = []
    for thing in things:
        if thing.hidden or not thing.is_body or not thing.anchors:
            continue
        if Show.ANCHORS in show:
            for anchor in thing.anchors:
                found += _note(thing.number, anchor.local, anchor.name, ACCENT, (5.0, 4.0), 3.0, magnification)
        if Show.NAMES in show:
            x = sum(anchor.local[0] for anchor in thing.anchors) / len(thing.anchors)
            y = sum(anchor.local[1] for anchor in thing.anchors) / len(thing.anchors)
            # below the middle: an anchor has its own name above it
            found += _note(thing.number, (x, y), thing.name, INK, (5.0, -12.0), 0.0, magnification)
    return found


def _note(
    thing: int, local: Point, text: str, color: Color, offset: Point, dot: float, magnification: float
) -> list[Note]:
    from movimentum.rendering.text import halo, text_sprite

    sprite = text_sprite(text, NOTE_HEIGHT, magnification)
    return [] if sprite is None else [Note(thing, local, sprite, halo(sprite), color, offset, dot)]


def _point_state(thing: int, local: Point, poses: Poses) -> Floats:
    return np.concatenate([poses.world(thing, local), poses.visible[thing].astype(np.float64)[:, None]], axis=1)
