"""Whether a moving outline passes over given points."""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.outlines.contour import Contour
from movimentum.records import dataclass
from movimentum.tolerances import CUT_STRAIGHT, OUTLINE_CLOSES

PIECES_BETWEEN_SAMPLES = 8
"""Pieces between two samples of an outline."""
NUMBERS_AT_A_TIME = 1 << 17
"""Pairs of numbers that are compared at once."""


class SweptOutline:
    """What ``tool`` (a circle of that ``radius``, if one is given) goes over while it has ``poses`` (7, N), in order of
    time.
    """

    def __init__(self, tool: Contour, poses: FloatArray, radius: float | None = None) -> None:
        self.radius = radius
        self.tool = tool
        x, y, c, s = poses[:4]
        self.reach = tool.reach
        points = np.zeros((1, 2)) if radius is not None else _polygon(tool)
        # along the first axis it is as long as it can be, so that few points are in its box
        off = points - points[0]
        along = off[np.argmax(np.hypot(*off.T))]
        size = float(np.hypot(*along)) or 1.0
        ax, ay = (along / size).tolist() if along.any() else (1.0, 0.0)
        self.outline = points @ np.array([[ax, -ay], [ay, ax]])
        self.poses = np.stack([x, y, ax * c - ay * s, ax * s + ay * c])
        self.area = tool.closed and not tool.doubled
        room = (self.reach if radius is None else radius) + OUTLINE_CLOSES * tool.size
        self.box = self.outline.min(axis=0) - room, self.outline.max(axis=0) + room
        self.far = float(np.hypot(*self.outline.T).max()) + room

    def covers(self, points: FloatArray) -> Any:
        """Which of points (M, 2) of the frame it goes over."""
        found = np.zeros(len(points), dtype=bool)
        count = self.poses.shape[1]
        if count == 0:
            return found
        low, high = np.min(self.poses[:2], axis=1) - self.far, np.max(self.poses[:2], axis=1) + self.far
        alive = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
        line = self.radius is None and not self.area and self.reach == 0.0
        k = 0
        while len(alive) and k < count:
            end = min(k + max(1, NUMBERS_AT_A_TIME // len(alive)), count)
            hit = self._hit(points[alive], slice(max(k - 1, 0) if line else k, end), line)
            found[alive[hit]] = True
            alive, k = alive[~hit], end
        return found

    def _hit(self, points: FloatArray, some: slice, line: bool) -> Any:
        """Which of points (M, 2) it goes over in these of its poses, a ``line`` between them."""
        x, y, c, s = self.poses[:, some]
        px, py = points[:, :1] - x, points[:, 1:] - y
        local = (px, py) if self.radius is not None else (c * px + s * py, c * py - s * px)
        near = np.ones((len(points), px.shape[1] - line), dtype=bool)
        for own, low, high in zip(local, *self.box, strict=True):
            if line:
                near &= (np.maximum(own[:, 1:], own[:, :-1]) >= low) & (np.minimum(own[:, 1:], own[:, :-1]) <= high)
            else:
                near &= (own >= low) & (own <= high)
        number, k = np.nonzero(near)
        inside = np.stack([own[number, k] for own in local], axis=-1)
        hit = np.zeros(len(points), dtype=bool)
        if self.radius is not None:
            hit[number[np.hypot(*inside.T) < self.radius]] = True
            return hit
        after = np.stack([own[number, k + 1] for own in local], axis=-1) if line else inside
        step = max(1, NUMBERS_AT_A_TIME // len(self.outline))
        for begin in range(0, len(number), step):
            part = slice(begin, begin + step)
            met = self._crossed(inside[part], after[part]) if line else self._within(inside[part])
            hit[number[part][met]] = True
        return hit

    def _within(self, points: FloatArray) -> Any:
        hit = np.zeros(len(points), dtype=bool)
        px, py = points[:, 0, None], points[:, 1, None]
        (ax, ay), (bx, by) = self.outline.T, np.roll(self.outline, -1, axis=0).T
        if self.area:
            with np.errstate(all="ignore"):
                at = ax + (py - ay) / (by - ay) * (bx - ax)
            hit |= (np.sum(((ay > py) != (by > py)) & (px < at), axis=1) % 2).astype(bool)
        if self.reach > 0.0:
            ex, ey = bx - ax, by - ay
            length = np.where((ex == 0.0) & (ey == 0.0), 1.0, ex * ex + ey * ey)
            u = np.clip(((px - ax) * ex + (py - ay) * ey) / length, 0.0, 1.0)
            hit |= np.hypot(px - ax - u * ex, py - ay - u * ey).min(axis=1) < self.reach
        return hit

    def _crossed(self, p: FloatArray, q: FloatArray) -> Any:
        """Whether the way from p to q in the tool's frame crosses the line."""
        a, b = self.outline, np.roll(self.outline, -1, axis=0)
        d, e = (q - p)[:, None], (b - a)[None]
        w = a[None] - p[:, None]
        det = d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0]
        with np.errstate(all="ignore"):
            u = (w[..., 0] * e[..., 1] - w[..., 1] * e[..., 0]) / det
            v = (w[..., 0] * d[..., 1] - w[..., 1] * d[..., 0]) / det
        return ((u >= 0.0) & (u < 1.0) & (v >= 0.0) & (v <= 1.0)).any(axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class SweptOutlines:
    """What several outlines of one thing go over."""

    each: tuple[SweptOutline, ...]

    @property
    def size(self) -> float:
        """That of the largest."""
        return max(one.tool.size for one in self.each)

    def covers(self, points: FloatArray) -> Any:
        """Which of points (M, 2) of the frame one of them goes over."""
        return np.logical_or.reduce([one.covers(points) for one in self.each])


def _polygon(tool: Contour) -> FloatArray:
    """(M, 2): corners of a polygon that stands for an outline."""
    samples = tool.samples
    fine = np.interp(
        np.arange(PIECES_BETWEEN_SAMPLES * (len(samples) - 1) + 1) / PIECES_BETWEEN_SAMPLES,
        np.arange(len(samples)),
        samples,
    )
    points = tool.points(fine)
    new = np.append(True, np.hypot(*np.diff(points, axis=0).T) > OUTLINE_CLOSES * tool.size)
    points = points[new]
    if tool.closed and np.hypot(*(points[-1] - points[0])) <= OUTLINE_CLOSES * tool.size:
        points = points[:-1]
    return _without_collinear(points)


def _without_collinear(points: FloatArray) -> FloatArray:
    """Without points on a straight line between their neighbours."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    size = np.hypot(*before.T) * np.hypot(*after.T)
    kept = (turn > CUT_STRAIGHT * size) | (np.sum(before * after, axis=1) < 0.0)
    return points[kept] if kept.sum() > 1 else points
