"""A prepared drawing with its motion in all frames, from which SVGs and pages are written."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import reduce

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.camera import detail
from movimentum.drawing.clips import clip_outline
from movimentum.drawing.model import (
    DiscMark,
    FreeArrow,
    InsetMark,
    LinkMark,
    NoteMark,
    Point,
    PolylineMark,
    SymbolMark,
    TextMark,
)
from movimentum.drawing.motion import arrow_shown, paint_over
from movimentum.drawing.symbols import symbol_shown
from movimentum.records import dataclass, replace
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.prepare import PreparedDrawing
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses

FARTHEST = 1e12
"""World pixels: what is farther is drawn as if it were there, so that every number can be written and read."""
_CANDIDATES = 12  # points of a body that are tried for its pivot


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """Where a body is: its local point ``pivot`` is at world (x, y), turned by ``angle`` degrees, y up; each (F,).

    The pivot is a point that moves little: about a fixed one, a body only turns, and less has to be written.
    """

    pivot: Point
    x: FloatArray
    y: FloatArray
    angle: FloatArray
    visible: BoolArray

    def local(self, point: Point) -> Point:
        """A local point, measured from the pivot."""
        x, y = point[0] - self.pivot[0], point[1] - self.pivot[1]
        return min(max(x, -FARTHEST), FARTHEST), min(max(y, -FARTHEST), FARTHEST)


@dataclass(frozen=True, slots=True)
class Film:
    """A whole film. Frame k is shown from k / ``fps`` seconds. ``loop``: how often it is played, 0 for ever.

    ``live``: its texts are texts in the SVG. ``poses`` are those of all F frames. ``bodies`` has the motion of
    everything that a mark or a trace is attached to.
    """

    title: str
    scene: Scene
    prepared: PreparedDrawing
    poses: Poses
    bodies: dict[int, BodyMotion]
    fps: Fraction
    loop: int
    live: bool = False

    @property
    def frames(self) -> int:
        """How many frames there are, F."""
        return len(self.poses.frames)

    def frame(self, number: int) -> Film:
        """The film of one frame alone, measured from the same pivots."""
        one = slice(number, number + 1)
        bodies = {
            body: replace(move, x=move.x[one], y=move.y[one], angle=move.angle[one], visible=move.visible[one])
            for body, move in self.bodies.items()
        }
        return replace(self, poses=self.poses.select(one), bodies=bodies)

    def paint(self, item: PreparedMark) -> tuple[FloatArray, FloatArray]:
        """(F,) opacity, 0 where the mark is not drawn, and (F, 3) colour."""
        opacity, color = self._paint(item)
        if item.clip is not None:
            opacity = np.where(clip_outline(item.clip, self.poses).shown, opacity, 0.0)
        return opacity, color

    def _paint(self, item: PreparedMark) -> tuple[FloatArray, FloatArray]:
        mark, poses = item.mark, self.poses
        match mark:
            case NoteMark():
                return poses.visible[mark.body].astype(np.float64), _constant(mark.color, self.frames)
            case FreeArrow():
                return arrow_shown(mark, poses).astype(np.float64), _constant(mark.color, self.frames)
            case InsetMark():
                opacity, color = paint_over(mark.paint, poses)
                return np.where(detail(mark, poses)[1], opacity, 0.0), color
            case SymbolMark():
                opacity, color = paint_over(mark.paint, poses)
                return np.where(symbol_shown(mark, poses), opacity, 0.0), color
            case LinkMark():
                opacity, color = paint_over(mark.paint, poses)
                shown = reduce(np.logical_and, [poses.visible[thing] for thing, _ in mark.through])
                return np.where(shown, opacity, 0.0), color
            case _:
                return paint_over(mark.paint, poses)


def make_film(
    scene: Scene,
    prepared: PreparedDrawing,
    poses: Poses,
    title: str,
    fps: Fraction,
    loop: int,
    *,
    everything: bool = False,
) -> Film:
    """The film of all frames of ``poses``. ``everything``: with the motion of all things that have anchors, drawn or
    not.
    """
    points: dict[int, list[Point]] = {thing.number: [] for thing in scene.things if everything and thing.anchors}
    for body, point in _attachments(prepared):
        points.setdefault(body, [])
        if point is not None:
            points[body].append(point)
    bodies = {
        body: _moving(poses, body, [*dict.fromkeys([*some, *(anchor.local for anchor in scene.things[body].anchors)])])
        for body, some in sorted(points.items())
    }
    return Film(title, scene, prepared, poses, bodies, fps, loop)


def _constant(color: tuple[int, int, int], frames: int) -> FloatArray:
    return np.tile(np.array(color, dtype=np.float64), (frames, 1))


def _attachments(prepared: PreparedDrawing) -> Iterator[tuple[int, Point | None]]:
    """The attachment of marks: a body, and a point of it if there is one."""
    for item in (*prepared.things, *prepared.beside, *prepared.overlays):
        mark = item.mark
        match mark:
            case LinkMark() | SymbolMark():
                yield from mark.through
            case PolylineMark():
                yield from ((mark.body, point) for point in mark.points)
            case DiscMark():
                yield mark.body, mark.centre
            case TextMark():
                yield mark.body, mark.start
            case NoteMark():
                yield mark.body, mark.local
            case FreeArrow():
                yield mark.body, mark.tail
            case _:
                yield mark.body, None
    for trace in prepared.traces:
        yield trace.mark.body, trace.mark.local


def _moving(poses: Poses, body: int, points: list[Point]) -> BodyMotion:
    tried = [(poses.world(body, point), point) for point in points[:_CANDIDATES] or [(0.0, 0.0)]]
    where, pivot = min(tried, key=lambda some: float(np.ptp(some[0], axis=0).max()))
    where = np.clip(where, -FARTHEST, FARTHEST)
    c, s = poses.direction[body, :, 0], poses.direction[body, :, 1]
    return BodyMotion(pivot, where[:, 0], where[:, 1], np.degrees(np.arctan2(s, c)), poses.visible[body])
