"""The parts of a picture: one item for each thing that is drawn, with a common interface.

An item reports what its picture depends on (`state`) and where it can be (`bounds`), and draws itself in one frame.
Items are values: they are sent to other processes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from movimentum import geometry
from movimentum.geometry import Affine
from movimentum.rendering.canvas import Canvas, Color
from movimentum.rendering.coverage import FARTHEST, Point, bounded, disc, polygon, union
from movimentum.rendering.sprites import Sprite
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]


class Item(Protocol):
    """One part of the picture."""

    def state(self, poses: Poses) -> Floats:
        """(F, K): all numbers that this item's picture depends on; equal rows are equal pictures."""
        ...

    def bounds(self, poses: Poses) -> Floats:
        """(F, 4): left, bottom, right, top in the world; rows of NaN where nothing is drawn."""
        ...

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i`` (a position in ``poses``)."""
        ...


@dataclass(frozen=True, slots=True)
class Paint:
    """A thing's colour (of a sprite: its tint) and opacity, as its definition gives them and as constraints change
    them.
    """

    thing: int
    color: Color

    def state(self, poses: Poses) -> list[Floats]:
        """Visibility and the properties that change, each (F, 1)."""
        columns = [poses.visible[self.thing].astype(np.float64)[:, None]]
        columns += [values[:, None] for (thing, _), values in sorted(poses.properties.items()) if thing == self.thing]
        return columns

    def at(self, poses: Poses, i: int) -> tuple[float, Color]:
        """(opacity, colour) in frame ``i``; opacity 0 where the thing is not visible."""
        if not poses.visible[self.thing, i]:
            return 0.0, self.color
        changed = poses.properties
        opacity = changed.get((self.thing, "opacity"))
        channels = [changed.get((self.thing, name)) for name in ("red", "green", "blue")]
        red, green, blue = (
            own if values is None else round(min(max(float(values[i]), 0.0), 255.0))
            for own, values in zip(self.color, channels, strict=True)
        )
        return (1.0 if opacity is None else min(max(float(opacity[i]), 0.0), 1.0)), (red, green, blue)


@dataclass(frozen=True, slots=True)
class PictureItem:
    """A sprite, or a label's text."""

    paint: Paint
    sprite: Sprite

    def state(self, poses: Poses) -> Floats:
        """Pose, visibility, opacity, colour."""
        return _pose_state(self.paint, poses)

    def bounds(self, poses: Poses) -> Floats:
        """The box about the sprite's turned outline."""
        return _box(poses, self.paint.thing, _world(poses, self.paint.thing, self.sprite.local_corners()), 0.0)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``."""
        opacity, color = self.paint.at(poses, i)
        if opacity > 0.0:
            to_world = _pose(poses, self.paint.thing, i) @ self.sprite.to_local
            canvas.picture(self.sprite, to_image @ to_world, opacity, color)


@dataclass(frozen=True, slots=True)
class BarItem:
    """A bar or an arrow: a polyline through a thing's local ``points``."""

    paint: Paint
    points: tuple[Point, ...]
    width: float
    arrow: bool = False

    def state(self, poses: Poses) -> Floats:
        """Pose, visibility, opacity, colour."""
        return _pose_state(self.paint, poses)

    def bounds(self, poses: Poses) -> Floats:
        """The box about the polyline with its width, or its arrow's head."""
        reach = arrow_head(self.width)[1] if self.arrow else self.width / 2.0
        return _box(poses, self.paint.thing, _world(poses, self.paint.thing, self.points), reach)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``."""
        opacity, color = self.paint.at(poses, i)
        if opacity > 0.0:
            place = to_image @ _pose(poses, self.paint.thing, i)
            draw_line(
                canvas,
                [place.apply(*point) for point in self.points],
                self.width * to_image.a,
                self.arrow,
                (color, opacity),
            )


@dataclass(frozen=True, slots=True)
class DiscItem:
    """A circle about a local point, filled, or with ``width`` its outline."""

    paint: Paint
    centre: Point
    radius: float
    width: float | None

    def state(self, poses: Poses) -> Floats:
        """Pose, visibility, opacity, colour."""
        return _pose_state(self.paint, poses)

    def bounds(self, poses: Poses) -> Floats:
        """The box about the circle."""
        reach = self.radius + (self.width or 0.0) / 2.0
        return _box(poses, self.paint.thing, _world(poses, self.paint.thing, [self.centre]), reach)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``."""
        opacity, color = self.paint.at(poses, i)
        if opacity > 0.0:
            scale = to_image.a
            centre = (to_image @ _pose(poses, self.paint.thing, i)).apply(*self.centre)
            width = None if self.width is None else self.width * scale
            canvas.fill(disc(centre, self.radius * scale, width, canvas.size), color, opacity)


@dataclass(frozen=True, slots=True)
class LineItem:
    """A ``.line``: through the points of other things, (thing number, local point) each."""

    paint: Paint
    through: tuple[tuple[int, Point], ...]
    width: float

    def state(self, poses: Poses) -> Floats:
        """World points, visibility of the things that it is attached to, colour."""
        return np.concatenate([self._points(poses).reshape(len(poses.frames), -1), *self._shown(poses)], axis=1)

    def bounds(self, poses: Poses) -> Floats:
        """The box about the polyline with its width."""
        shown = np.logical_and.reduce([column[:, 0] > 0.0 for column in self._shown(poses)[: len(self.through) + 1]])
        return boxes(self._points(poses), shown, self.width / 2.0)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``, if all things that it is attached to have appeared."""
        opacity, color = self.paint.at(poses, i)
        if opacity > 0.0 and all(poses.visible[thing, i] for thing, _ in self.through):
            points = [(to_image @ _pose(poses, thing, i)).apply(*local) for thing, local in self.through]
            draw_line(canvas, points, self.width * to_image.a, False, (color, opacity))

    def _shown(self, poses: Poses) -> list[Floats]:
        hung = [poses.visible[thing].astype(np.float64)[:, None] for thing, _ in self.through]
        return [*hung, *self.paint.state(poses)]

    def _points(self, poses: Poses) -> Floats:
        return np.stack([poses.world(thing, local) for thing, local in self.through], axis=1)


def arrow_head(width: float) -> tuple[float, float]:
    """(length, half breadth) of the head of an arrow whose shaft is ``width`` wide."""
    return 4.5 * width, 1.8 * width


def draw_line(canvas: Canvas, points: list[Point], width: float, arrow: bool, paint: tuple[Color, float]) -> None:
    """A polyline in image coordinates, with ``arrow`` a head whose tip is its last point; one coverage altogether."""
    color, opacity = paint
    points = bounded(points)
    if not arrow or len(points) < 2:
        canvas.fill(canvas.line(points, width), color, opacity)
        return
    (bx, by), (tx, ty) = points[-2], points[-1]
    reach = math.hypot(tx - bx, ty - by)
    length, breadth = arrow_head(min(width, FARTHEST))
    if reach <= 1e-9 or length <= 1e-9:
        canvas.fill(canvas.line(points, width), color, opacity)
        return
    fit = min(1.0, reach / length)
    length, breadth = length * fit, breadth * fit
    ux, uy = (tx - bx) / reach, (ty - by) / reach
    base = (tx - length * ux, ty - length * uy)
    head = polygon(
        [(tx, ty), (base[0] - breadth * uy, base[1] + breadth * ux), (base[0] + breadth * uy, base[1] - breadth * ux)],
        canvas.size,
    )
    # the shaft ends inside the head, where its round cap cannot show
    inside = min(length / 2.0, width / 2.0)
    shaft = canvas.line([*points[:-1], (base[0] + inside * ux * 0.5, base[1] + inside * uy * 0.5)], width)
    canvas.fill(union([shaft, head]), color, opacity)


def _pose(poses: Poses, thing: int, i: int) -> Affine:
    x, y = poses.origin[thing, i].tolist()
    cosine, sine = poses.direction[thing, i].tolist()
    return geometry.pose(x, y, cosine, sine)


def _pose_state(paint: Paint, poses: Poses) -> Floats:
    return np.concatenate([poses.origin[paint.thing], poses.direction[paint.thing], *paint.state(poses)], axis=1)


def _world(poses: Poses, thing: int, points: list[Point] | tuple[Point, ...]) -> Floats:
    """(F, P, 2)."""
    return np.stack([poses.world(thing, point) for point in points], axis=1)


def _box(poses: Poses, thing: int, points: Floats, reach: float) -> Floats:
    return boxes(points, poses.visible[thing], reach)


def boxes(points: Floats, shown: NDArray[np.bool_], reach: float) -> Floats:
    """(F, 4) boxes about ``points`` (F, P, 2) with ``reach`` around them; rows of NaN where not ``shown``."""
    box = np.concatenate([points.min(axis=1) - reach, points.max(axis=1) + reach], axis=1)
    return np.where(shown[:, None], box, np.nan)
