"""What would do where a profile crosses itself: a roller's radius, or how much farther away a straight face must be."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.outlines.contour import Contour
from movimentum.outlines.envelope import ToolMotion, ToolPoses
from movimentum.records import dataclass
from movimentum.scene.model import Thing
from movimentum.tolerances import CUT_ALONG, CUT_CURVED, CUT_WOULD_DO

COMPARED_POINTS = 512
"""Points of a way that are compared with each other."""
PARTS_AROUND_INSTANT = 32
"""Parts of the time around an instant, where something is largest or smallest."""
CROSSING_INSTANTS = 4.0
"""Instants: where there is less room than the way between so many, the way crosses itself."""


@dataclass(frozen=True, slots=True, eq=False)
class _CentrePath:
    """Of a roller's centre: points (N, 2), unit normals (N, 2) and curvatures (N,), at those of ``times`` (N,) where
    all of this is known.
    """

    times: FloatArray
    points: FloatArray
    normals: FloatArray
    bend: FloatArray

    @staticmethod
    def of(film: ToolPoses) -> _CentrePath:
        x, y, _c, _s, vx, vy, _w, ax, ay, _b = film.poses
        with np.errstate(all="ignore"):
            speed = np.hypot(vx, vy)
            bend = (vx * ay - vy * ax) / speed**3
            points, normals = np.stack([x, y], axis=-1), np.stack([-vy, vx], axis=-1) / speed[:, None]
        known = np.isfinite(points).all(axis=-1) & np.isfinite(normals).all(axis=-1) & np.isfinite(bend)
        return _CentrePath(film.times[known], points[known], normals[known], bend[known])


def fitting_radius(relative_motion: ToolMotion, film: ToolPoses, radius: float, *, outer: bool) -> float | None:
    """The largest radius of a roller that goes the same way as one of that ``radius`` and leaves a profile which does
    not cross itself: where it touches the profile it must reach no other place of the way of its centre.
    """
    way = _CentrePath.of(film)
    if len(way.times) < 2:
        return None
    x, y, _c, _s, vx, vy = film.poses[:6]
    inwards = math.copysign(1.0, float(np.nansum(x * vy - y * vx)))
    # a smaller one may leave the edge at the frame's origin where this one goes over that
    sides = (-inwards,) if outer else (inwards, -inwards)
    room = 0.0
    for side in sides:
        k = int(np.argmax(side * way.bend))
        most = max(
            1.0 / radius,
            float(side * way.bend[k]),
            *(side * _CentrePath.of(_film_around(relative_motion, way.times, k)).bend),
        )
        room = min(1.0 / most, _narrowest(relative_motion, way, side)) * CUT_WOULD_DO
        if room < float(np.hypot(*way.points.T).min()):
            break
    step = float(np.median(np.hypot(*np.diff(way.points, axis=0).T)))
    return room if room > CROSSING_INSTANTS * step else None


def required_offset(relative_motion: ToolMotion, film: ToolPoses, tool: Thing, outline: Contour) -> float | None:
    """By how much a straight face must be farther away."""
    if tool.kind.word != "bar" or len(tool.anchors) != 2 or not outline.doubled:
        return None
    (px, py), (qx, qy) = (anchor.local for anchor in tool.anchors)
    size = math.hypot(qx - px, qy - py)
    nx, ny = (py - qy) / size, (qx - px) / size
    x, y, c, s = film.poses[:4]
    side = math.copysign(1.0, float(np.nanmedian(x * (c * nx - s * ny) + y * (s * nx + c * ny))))
    bend = side * _face_curvature_radii(film.poses, nx, ny)
    if np.isnan(bend).all():
        return None
    around = _film_around(relative_motion, film.times, int(np.nanargmin(bend)))
    least = min(
        float(np.nanmin(bend)), float(np.nanmin(side * _face_curvature_radii(around.poses, nx, ny), initial=np.inf))
    )
    return -least if least < -CUT_CURVED * outline.size else None


def _face_curvature_radii(poses: FloatArray, nx: float, ny: float) -> FloatArray:
    """(N,): radii of curvature of what a face with that normal cuts. The distance h of the face from the frame's origin
    depends on its direction a: they are h + d²h/da².
    """
    x, y, c, s, vx, vy, w, ax, ay, b = poses
    nx, ny = c * nx - s * ny, s * nx + c * ny
    away, across = x * nx + y * ny, y * nx - x * ny
    first = vx * nx + vy * ny + w * across
    second = ax * nx + ay * ny + 2.0 * w * (vy * nx - vx * ny) + b * across - w * w * away
    with np.errstate(all="ignore"):
        return np.asarray(away + (second - first / w * b) / (w * w))


def _film_around(relative_motion: ToolMotion, times: FloatArray, k: int) -> ToolPoses:
    """The film from the instant before number k to the one behind it, in small steps."""
    low, high = (Fraction(float(times[each])) for each in (max(k - 1, 0), min(k + 1, len(times) - 1)))
    some = [low + (high - low) * Fraction(part, PARTS_AROUND_INSTANT) for part in range(PARTS_AROUND_INSTANT + 1)]
    return ToolPoses(np.array([float(time) for time in some]), relative_motion(some))


def _narrowest(relative_motion: ToolMotion, way: _CentrePath, side: float) -> float:
    """The radius of the least circle that touches a way in one of its points, on the side of its normal, or on the
    other one if ``side`` is -1, and goes through another one.
    """
    least = CUT_ALONG * float(np.ptp(way.points, axis=0).max())

    def rooms(some: _CentrePath, others: FloatArray) -> FloatArray:
        dx, dy = (others[:, axis] - some.points[:, axis, None] for axis in (0, 1))
        ahead = side * (dx * some.normals[:, 0, None] + dy * some.normals[:, 1, None])
        square = dx * dx + dy * dy
        touching = (ahead > 0.0) & (square > least * least)
        return np.where(touching, square, np.inf) / np.where(ahead > 0.0, 2.0 * ahead, 1.0)

    def best(some: IntArray, others: IntArray) -> tuple[int, int, float]:
        found = rooms(_some_points(way, some), way.points[others])
        one, other = np.unravel_index(int(np.argmin(found)), found.shape)
        return int(some[one]), int(others[other]), float(found[one, other])

    step = max(1, len(way.times) // COMPARED_POINTS)
    coarse = np.arange(0, len(way.times), step)
    one, other, found = best(coarse, coarse)
    one, other, found = best(*(_window(len(way.times), k, step) for k in (one, other)))
    if not np.isfinite(found):
        return found
    finer = [_CentrePath.of(_film_around(relative_motion, way.times, k)) for k in (one, other)]
    return min(found, float(rooms(finer[0], finer[1].points).min(initial=np.inf)))


def _some_points(way: _CentrePath, which: IntArray) -> _CentrePath:
    return _CentrePath(way.times[which], way.points[which], way.normals[which], way.bend[which])


def _window(count: int, k: int, step: int) -> IntArray:
    return np.arange(max(k - step, 0), min(k + step + 1, count))
