"""Whether a moving outline passes over given points."""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.outlines.contour import Contour
from movimentum.records import dataclass
from movimentum.tolerances import CUT_STRAIGHT, OUTLINE_CLOSES

FINER = 8
"""Pieces between two samples of an outline."""
AT_ONCE = 512
"""Points that are compared with all poses at once."""


class SweptOutline:
    """What ``tool`` (a circle of that ``radius``, if one is given) goes over while it has ``poses`` (7, N), in order of
    time.
    """

    def __init__(self, tool: Contour, poses: FloatArray, radius: float | None = None) -> None:
        self.radius = radius
        self.tool = tool
        self.poses = poses[:4]
        samples = tool.samples
        fine = np.interp(np.arange(FINER * (len(samples) - 1) + 1) / FINER, np.arange(len(samples)), samples)
        points = tool.points(fine)
        new = np.append(True, np.hypot(*np.diff(points, axis=0).T) > OUTLINE_CLOSES * tool.size)
        points = points[new]
        if tool.closed and np.hypot(*(points[-1] - points[0])) <= OUTLINE_CLOSES * tool.size:
            points = points[:-1]
        self.outline = _straightened(points)
        self.area = tool.closed and not tool.doubled
        self.reach = tool.reach
        self.far = float(np.hypot(*self.outline.T).max()) + self.reach

    def covers(self, points: FloatArray) -> Any:
        """Which of points (M, 2) of the frame it goes over."""
        if self.poses.shape[1] == 0:
            return np.zeros(len(points), dtype=bool)
        if self.radius is not None:
            return self._in_circle(points, self.radius)
        found = np.zeros(len(points), dtype=bool)
        x, y, c, s = self.poses
        low = np.min(self.poses[:2], axis=1) - self.far
        high = np.max(self.poses[:2], axis=1) + self.far
        alive = np.nonzero(((points >= low) & (points <= high)).all(axis=1))[0]
        before: FloatArray | None = None
        crosses = not self.area and self.reach == 0.0
        for k in range(self.poses.shape[1]):
            if not len(alive):
                break
            px, py = points[alive, 0] - x[k], points[alive, 1] - y[k]
            local = np.stack([c[k] * px + s[k] * py, c[k] * py - s[k] * px], axis=-1)
            near = np.hypot(px, py) <= self.far
            hit = np.zeros(len(alive), dtype=bool)
            if crosses:
                if before is not None:
                    near |= np.hypot(*before.T) <= self.far
                    hit[near] = self._crossed(before[near], local[near])
            elif near.any():
                hit[near] = self._within(local[near])
            found[alive[hit]] = True
            alive, before = alive[~hit], local[~hit]
        return found

    def _in_circle(self, points: FloatArray, radius: float) -> Any:
        found = np.zeros(len(points), dtype=bool)
        for k in range(0, len(points), AT_ONCE):
            off = points[k : k + AT_ONCE, :, None] - self.poses[:2]
            found[k : k + AT_ONCE] = (np.hypot(off[:, 0], off[:, 1]) < radius).any(axis=1)
        return found

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


def _straightened(points: FloatArray) -> FloatArray:
    """Without points on a straight line between their neighbours."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    size = np.hypot(*before.T) * np.hypot(*after.T)
    kept = (turn > CUT_STRAIGHT * size) | (np.sum(before * after, axis=1) < 0.0)
    return points[kept] if kept.sum() > 1 else points
