"""Maps for the camera and insets: the world onto itself, one map for each frame.

Such a map is (F, 3): a zoom, then x and y. The world point p is drawn where ``zoom * p + (x, y)`` would be drawn
without a camera. Strokes and letters are zoomed, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.model import FilmMark, InsetMark, Point, ThingMark
from movimentum.geometry import Affine, View
from movimentum.scene.model import Scene
from movimentum.scene.shown import CAMERA, FILM, value_name
from movimentum.solver.poses import Poses
from movimentum.tolerances import LARGEST_VIEW, SMALLEST_VIEW

SHARPEST = 16.0
"""By how much pictures and paths are prepared to be enlarged; beyond it they lose sharpness."""


def camera(poses: Poses, view: View) -> FloatArray | None:
    """The map of the whole picture; None without a camera. ``view``: what the canvas shows without one."""
    found = [poses.properties.get((FILM, name)) for name in CAMERA]
    x, y, rest, zoom = found
    if x is None or y is None or rest is None or zoom is None:
        return None
    middle = _middle(view)
    centre = np.stack([x, y], axis=1) + rest[:, None] * middle
    return np.column_stack([zoom, middle - zoom[:, None] * centre])


def _middle(view: View) -> FloatArray:
    return np.array([view.left + view.width / view.scale / 2.0, view.bottom + view.height / view.scale / 2.0])


def detail(mark: InsetMark, poses: Poses) -> tuple[FloatArray, BoolArray]:
    """The map of an inset, and (F,) whether there is one: what it shows may have no value."""
    names = (value_name(0), value_name(0, 1), value_name(1))
    none = np.full(len(poses.frames), np.nan)  # where no numbers travel with the poses
    x, y, zoom = (poses.properties.get((mark.paint.thing, name), none) for name in names)
    shown = np.isfinite(x) & np.isfinite(y) & (zoom > 0.0) & poses.visible[mark.paint.thing]
    x, y = (np.where(shown, value, 0.0) for value in (x, y))
    zoom = np.clip(np.where(shown, zoom, 1.0), SMALLEST_VIEW, LARGEST_VIEW)
    corner = poses.world(mark.paint.thing, mark.start)
    middle = corner + np.array(mark.sides) / 2.0
    return np.column_stack([zoom, middle - zoom[:, None] * np.stack([x, y], axis=1)]), shown


def inset_frame(mark: InsetMark, poses: Poses) -> MovingPart:
    """The rectangle of an inset, filled."""
    corner = poses.world(mark.paint.thing, mark.start)
    points = corner[:, None, :] + np.array(_corners(mark.sides))
    return MovingPart(FigurePart(PartForm.FILL, (), color=mark.fill), points, detail(mark, poses)[1])


def inset_lines(mark: InsetMark, poses: Poses, whole: FloatArray | None) -> list[MovingPart]:
    """What is drawn over an inset: its frame, the same around what it shows, and lines between the two. ``whole``: the
    map of the picture.
    """
    frame, (look, shown) = inset_frame(mark, poses), detail(mark, poses)
    inside = (frame.points - look[:, None, 1:]) / look[:, None, :1]
    if whole is not None:
        inside = whole[:, None, :1] * inside + whole[:, None, 1:]
    ring = FigurePart(PartForm.STROKE, (), mark.width, closed=True)
    found = [MovingPart(ring, inside, shown), MovingPart(ring, frame.points, shown)]
    if mark.leader:
        line = FigurePart(PartForm.STROKE, (), mark.width / 2.0)
        for side in _outer(frame.points, inside):
            places = side[:, None, None]
            ends = [np.take_along_axis(points, places, axis=1)[:, 0] for points in (inside, frame.points)]
            found.insert(0, MovingPart(line, np.stack(ends, axis=1), shown))
    return found


def _outer(frame: FloatArray, inside: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(F,) each: the two corners between which lines of leaders touch neither rectangle: all others are on one side."""
    way = frame - inside
    others = np.concatenate([frame, inside], axis=1)[:, None] - inside[:, :, None]  # (F, lines, corners, 2)
    across = way[:, :, None, 0] * others[..., 1] - way[:, :, None, 1] * others[..., 0]
    return across.min(axis=2).argmax(axis=1), across.max(axis=2).argmin(axis=1)


def _corners(sides: Point) -> list[Point]:
    return [(0.0, 0.0), (sides[0], 0.0), sides, (0.0, sides[1])]


def is_still(scene: Scene, number: int) -> bool:
    """Whether the camera leaves a thing: it says so, or it is beside the film and no statement mentions it."""
    thing = scene.things[number]
    return thing.look.still or (thing.kind.beside and not thing.through and number not in scene.mentioned)


def seen(to_image: Affine, look: FloatArray) -> Affine:
    """World to picture, with a row of such a map."""
    zoom, x, y = look.tolist()
    return to_image @ Affine(zoom, 0.0, x, 0.0, zoom, y)


def largest_zoom(marks: Sequence[ThingMark | FilmMark], source: Iterable[Poses]) -> float:
    """By how much anything is larger than without a camera, at most and at least 1."""
    insets = [mark for mark in marks if isinstance(mark, InsetMark)]
    most = 1.0
    for poses in source:
        zooms = [detail(mark, poses)[0][:, 0] for mark in insets]
        if (FILM, CAMERA[3]) in poses.properties:
            zooms.append(poses.properties[FILM, CAMERA[3]])
        most = max(most, *(float(zoom.max(initial=1.0)) for zoom in zooms))
    return min(most, SHARPEST)
