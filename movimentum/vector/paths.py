"""Traces in an SVG: paths that grow, fade, or are there from the first frame on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.drawing.model import TraceMark
from movimentum.drawing.motion import paint_over
from movimentum.drawing.style import BANDS, FAINT
from movimentum.rendering.prepare import Trace
from movimentum.vector.film import FARTHEST, Film
from movimentum.vector.numbers import XmlElement, hex_color, joined, last_shown, short, texts
from movimentum.vector.parts import Animator

_FAR = 99999  # world pixels: a gap that no path is longer than (times the scale of the picture)


class PathWriter:
    """Writes the traces of one film."""

    def __init__(self, film: Film, decimals: int, animate: Animator) -> None:
        self.film = film
        self._decimals = decimals
        self._animate = animate

    def trace(self, trace: Trace) -> Iterator[str]:
        """The part of a path drawn in each frame."""
        return self._growing(trace) if trace.mark.tail is None else self._fading(trace)

    def whole(self, trace: Trace) -> Iterator[str]:
        """The whole path, faint, in all frames."""
        points = self._rounded(trace.path)
        for first, end in _runs(points[:, 2] > 0.0):
            corners = _without_repetition(points[first:end, :2])
            path = self._path(trace.mark, corners)
            if trace.mark.dash:
                path.attributes.append(f'stroke-dasharray="{" ".join(short(x, 3) for x in trace.mark.dash)}"')
            yield self._painted(path, trace.mark, FAINT)

    def _rounded(self, points: FloatArray) -> FloatArray:
        points = np.clip(points, -FARTHEST, FARTHEST)
        points[:, :2] = np.round(points[:, :2], self._decimals)
        return points

    def _path(self, mark: TraceMark, corners: FloatArray) -> XmlElement:
        line = joined(*corners.ravel().tolist(), decimals=self._decimals + 1).replace(
            " -", "-"
        )  # all read that in paths
        path = XmlElement("path", [f'd="M{line}{"h0" if len(corners) == 1 else ""}"'])
        width = short(mark.width, self._decimals + 1)
        path.attributes += [f'stroke="{hex_color(mark.color)}"', f'stroke-width="{width}"']
        if mark.cap != "round":
            path.attributes.append(f'stroke-linecap="{mark.cap}"')
        return path

    def _painted(self, path: XmlElement, mark: TraceMark, factor: float = 1.0) -> str:
        """A path in the paint of its thing, where it has one."""
        if mark.paint is None and factor == 1.0:
            return f"{path}\n"
        group = XmlElement("g")
        opacity = np.full(self.film.frames, factor)
        if mark.paint is not None:
            opacity, colors = paint_over(mark.paint, self.film.poses)
            opacity = opacity * factor
            if not (colors == colors[0]).all():
                self._animate(path, "stroke", [hex_color(row) for row in last_shown(colors, opacity)])
        values = texts([opacity], 3)
        if set(values) != {"1"}:
            self._animate(group, "opacity", values)
        group.inside.append(str(path))
        return f"{group}\n" if set(values) != {"1"} else f"{path}\n"

    def _growing(self, trace: Trace) -> Iterator[str]:
        """A path for each interval in which the body is visible: a dash that becomes longer."""
        rows, ends = trace.through(self.film.poses)
        points = self._rounded(rows)
        for first, end in _runs(points[:, 2] > 0.0):
            where = points[first:end, :2]
            far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(where, axis=0).T))])
            path = self._path(trace.mark, _without_repetition(where))
            if far[-1] > 0.0:
                long = far[np.clip(ends - 1 - first, 0, end - first - 1)]
                gap = short(max(_FAR, 2.0 * float(far[-1])), 0)
                self._animate(path, "stroke-dasharray", [self._dashes(trace.mark, x, gap) for x in long.tolist()])
            if first >= ends[0]:
                self._animate(path, "opacity", texts([(ends > first).astype(np.float64)], 0))
            yield self._painted(path, trace.mark)

    def _dashes(self, mark: TraceMark, long: float, gap: str) -> str:
        """A pattern that shows the first ``long`` of a path."""
        if not mark.dash:
            return f"{short(long, self._decimals + 2)} {gap}"
        shown: list[float] = []
        done, place = 0.0, 0
        while done < long and len(shown) < 2000:
            shown.append(min(mark.dash[place % len(mark.dash)], long - done))
            done += shown[-1]
            place += 1
        if len(shown) % 2 == 0:
            shown.append(0.0)
        return " ".join([*(short(value, self._decimals + 1) for value in shown), gap])

    def _fading(self, trace: Trace) -> Iterator[str]:
        """The path several times over itself, each time less of it: what is newer is covered more often."""
        tail = trace.mark.tail
        assert tail is not None
        rows, _ = trace.through(self.film.poses)
        points, now = self._rounded(rows), self.film.poses.times
        for first, end in _runs(points[:, 2] > 0.0):
            where, times = points[first:end, :2], points[first:end, 3]
            far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(where, axis=0).T))])
            if far[-1] == 0.0:
                continue
            gap = short(max(_FAR, 2.0 * float(far[-1])), 0)
            lines = XmlElement("g")
            for band in range(1, BANDS + 1):
                line = self._path(trace.mark, _without_repetition(where))
                low = np.interp(now - tail * (1.0 - (band - 0.5) / BANDS), times, far)
                long = np.where(now >= times[0], np.interp(now, times, far) - low, 0.0)
                low = np.where(long > 0.0, low, 1.5 * far[-1] + 99.0)  # nothing is seen
                self._animate(line, "stroke-dasharray", [f"{x} {gap}" for x in texts([long], self._decimals + 1)])
                self._animate(line, "stroke-dashoffset", texts([-low], self._decimals + 1))
                line.attributes.append(f'opacity="{short(1.0 / (BANDS - band + 1), 4)}"')
                lines.inside.append(str(line))
            yield self._painted(lines, trace.mark)


def _runs(shown: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[list[int]]:
    """(first, end) of each interval in which something is shown."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]]).astype(np.int8)))
    return edges.reshape(-1, 2).tolist()


def _without_repetition(where: FloatArray) -> FloatArray:
    return where[np.concatenate([[True], np.hypot(*np.diff(where, axis=0).T) > 0.0])]
