"""The envelope of a moving outline: the points whose velocity lies along the outline, at every instant.

In the frame that is cut, an outline at (x, y), turned by (c, s), moves with the velocity (vx, vy) and turns by w
radians per time unit. A point of it belongs to the envelope where n·v = 0 (Litvin and Fuentes, *Gear Geometry and
Applied Theory*, chapter 6): one equation for the place on the outline, solved at every instant from exact rates, so
each point is exact. Corners of outlines are arcs of no length (`outlines.contour`), so one equation does.

At a point of the envelope the distance from the outline has no slope in time. Where that distance is largest, the tool
goes over the point just before and just after: where the envelope runs against the rising parameter, as between the two
cusps of a swallow's tail.

Places are followed in time and make *runs*. Where the motion rests or changes direction abruptly, the part of the
outline that was in front is a run of its own, a cap.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import reduce

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, within_half
from movimentum.outlines.contour import Contour
from movimentum.outlines.cubics import cubic_offsets
from movimentum.outlines.tangential_motion import inward_speed, outward_speed, tangential_places
from movimentum.records import dataclass
from movimentum.tolerances import CUT_ALONG, CUT_EXACT, CUT_MATCHED, CUT_RESTS

ToolMotion = Callable[[Sequence[Fraction]], FloatArray]
"""From N instants to (10, N): x, y, c, s, vx, vy and w of the tool in the frame that is cut, and the rates of the last
three, nan where there are none; nan without a solution.
"""

INSTANTS = 720
"""Of a film, to begin with; half a degree of a turn."""
HALVING_ROUNDS = 12
"""How often an interval is halved."""
MOST_INSTANTS = 20_000
CAP_POINTS = 4
"""Points of a cap between two samples of the outline."""
JUST_BEFORE = Fraction(1, 10**12)
"""Of a part of a film: how long before its end its last instant is, so that the motion is that of the part."""


@dataclass(frozen=True, slots=True, eq=False)
class EnvelopeRun:
    """Points (M, 2) of the envelope in order, with the tool on the right: unit directions (M, 2) of the walk, the
    curvatures ``bend`` (M,) there (nan where they are not known), instants (M,), and the number of the branch that was
    followed (caps: -1).
    """

    points: FloatArray
    along: FloatArray
    bend: FloatArray
    times: FloatArray
    branch: int


@dataclass(frozen=True, slots=True, eq=False)
class ToolPoses:
    """Poses (10, N) of a tool, as `ToolMotion` has them, at ``times`` (N,)."""

    times: FloatArray
    poses: FloatArray


NO_POSES = ToolPoses(np.empty(0), np.empty((10, 0)))


@dataclass(slots=True, eq=False)
class _CutInstants:
    """What is cut at N instants, in order: their times (N,), also as whole ``ticks`` of their part of the film, and
    poses (10, N); and the points of all, one instant's after the other's: ``begins`` (N + 1,) are the first ones.
    """

    ticks: IntArray
    times: FloatArray
    poses: FloatArray
    begins: IntArray
    place: FloatArray
    rising: BoolArray
    points: FloatArray
    along: FloatArray
    bend: FloatArray

    def __len__(self) -> int:
        return len(self.ticks)

    @property
    def counts(self) -> IntArray:
        """(N,): how many points each instant has."""
        return np.diff(self.begins)

    def rows(self, which: IntArray) -> IntArray:
        """The points of these instants."""
        counts = self.counts[which]
        ends = np.cumsum(counts)
        return np.repeat(self.begins[which] - ends + counts, counts) + np.arange(ends[-1] if len(ends) else 0)

    def each(self, which: IntArray, count: int) -> IntArray:
        """(M, count): the same, one row for each of M instants that have so many."""
        return self.rows(which).reshape(-1, count)

    def some(self, which: IntArray) -> _CutInstants:
        """Only these instants, in this order."""
        begins = np.append(0, np.cumsum(self.counts[which]))
        rows = self.rows(which)
        return _CutInstants(
            self.ticks[which], self.times[which], self.poses[:, which], begins,
            self.place[rows], self.rising[rows], self.points[rows], self.along[rows], self.bend[rows],
        )  # fmt: skip

    def followed_by(self, other: _CutInstants) -> _CutInstants:
        """These, and then the others."""
        names = ("ticks", "times", "place", "rising", "points", "along", "bend")
        parts = {name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in names}
        poses = np.concatenate([self.poses, other.poses], axis=1)
        return _CutInstants(poses=poses, begins=np.append(self.begins, self.begins[-1] + other.begins[1:]), **parts)


def envelope(
    tool: Contour, parts: Sequence[tuple[Fraction, Fraction]], tool_motion: ToolMotion, branches: int = 0
) -> tuple[list[EnvelopeRun], ToolPoses]:
    """The runs that ``tool`` cuts while it moves as ``tool_motion`` says, and its poses in order of time. ``parts``:
    from when to when the motion is smooth; ``branches``: so many have numbers already.
    """
    cut = _EnvelopeSearch(tool, tool_motion, branches)
    strands = [strand for begin, end in parts if end > begin and len(strand := cut.strand(begin, end))]
    if not strands:
        return [], NO_POSES
    runs = [run for strand in strands for run in cut.runs(strand)]
    film = reduce(_CutInstants.followed_by, strands)
    moving = film.some(np.flatnonzero(film.counts))
    for k in cut.standing(moving):
        if cut.turns(moving, k):
            runs += cut.caps(moving, k)
    return runs, ToolPoses(film.times, film.poses)


class _EnvelopeSearch:
    def __init__(self, tool: Contour, tool_motion: ToolMotion, branches: int) -> None:
        self.tool, self.tool_motion = tool, tool_motion
        self.fast = 0.0
        self.size = tool.size
        self.branches = branches

    # --- instants

    def strand(self, begin: Fraction, end: Fraction) -> _CutInstants:
        """The instants of one part of the film, so many that curves between them are known."""
        last = end - (end - begin) * JUST_BEFORE
        tick = (last - begin) / (INSTANTS << HALVING_ROUNDS)
        whole = begin.numerator * tick.denominator, tick.numerator * begin.denominator
        below = begin.denominator * tick.denominator

        def at(ticks: IntArray) -> _CutInstants:
            return self.instants(ticks, [Fraction(whole[0] + whole[1] * k, below) for k in ticks.tolist()])

        found = at(np.arange(INSTANTS + 1) << HALVING_ROUNDS)
        good = np.isfinite(found.poses[:7]).all(axis=0)
        if not good.all():
            found = found.some(np.arange(int(np.argmin(good))))
        if not len(found):
            return found
        self.size = max(self.size, float(np.ptp(found.poses[:2], axis=1).max()))
        wide = np.arange(len(found) - 1)  # after these instants there is to be another one
        for _ in range(HALVING_ROUNDS):
            if not len(wide) or len(found) + len(wide) > MOST_INSTANTS:
                break
            found, wide = self.halved(found, wide, at)
        return found

    def halved(
        self, found: _CutInstants, wide: IntArray, at: Callable[[IntArray], _CutInstants]
    ) -> tuple[_CutInstants, IntArray]:
        """With one more instant after each of ``wide``, and after which of all there is to be yet another one."""
        middles = at((found.ticks[wide] + found.ticks[wide + 1]) >> 1)
        good = np.isfinite(middles.poses[:7]).all(axis=0)
        if not good.all():
            middles, wide = middles.some(np.flatnonzero(good)), wide[good]
        made = found.followed_by(middles)
        made = made.some(np.argsort(made.ticks, kind="stable"))
        ones = wide + np.arange(len(wide))  # where they are now
        ones = ones[~self.known(made, ones + 1)]
        return made, np.sort(np.append(ones, ones + 1))

    def instants(self, ticks: IntArray, times: Sequence[Fraction]) -> _CutInstants:
        """What is cut at some instants."""
        poses = self.tool_motion(times)
        _x, _y, c, s, vx, vy, w = poses[:7]
        speed = np.hypot(vx, vy) + abs(w) * self.tool.size
        self.fast = max(self.fast, float(np.nanmax(speed, initial=0.0)))
        inward = np.stack([c * vx + s * vy, c * vy - s * vx, w])  # the velocity in the tool's frame
        moves = np.isfinite(poses[:7]).all(axis=0) & (speed > CUT_RESTS * self.fast)
        number, place, rising = tangential_places(self.tool, inward, moves)
        points, along = self.laid(place, poses[:4, number])
        begins = np.searchsorted(number, np.arange(len(times) + 1))
        moments = np.array([float(time) for time in times])
        bend = self.bends(place, poses[:, number])
        return _CutInstants(ticks, moments, poses, begins, place, rising, points, along, bend)

    def laid(self, place: FloatArray, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points (M, 2) of the tool in the frame, and the directions with the tool on the right."""
        px, py, tx, ty = self.tool.values(place)[:4]
        size = np.hypot(tx, ty)
        nx, ny = -self.tool.side * ty / size, self.tool.side * tx / size  # outwards
        px, py = px + self.tool.reach * nx, py + self.tool.reach * ny
        x, y, c, s = pose
        points = np.stack([x + c * px - s * py, y + s * px + c * py], axis=-1)
        return points, np.stack([s * nx + c * ny, s * ny - c * nx], axis=-1)

    def bends(self, place: FloatArray, pose: FloatArray) -> FloatArray:
        """(M,): the curvatures of the envelope there. By time, its direction turns as the tool does and as its place
        on the outline moves, and its point goes along itself (all in the tool's frame).
        """
        px, py, tx, ty, dx, dy, rx, ry = self.tool.values(place)
        _x, _y, c, s, vx, vy, w, ax, ay, aw = pose
        vx, vy, ax, ay = c * vx + s * vy, c * vy - s * vx, c * ax + s * ay, c * ay - s * ax
        size = np.hypot(tx, ty)
        with np.errstate(all="ignore"):
            change = inward_speed(self.tool, place, np.stack([vx, vy, w]))[1]
            faster = tx * (ay - w * vx + aw * px) - ty * (ax + w * vy - aw * py)
            moves = -faster / change
            turn = (tx * ry - ty * rx) / (size * size)
            reach = self.tool.side * self.tool.reach
            qx, qy = px - reach * ty / size, py + reach * tx / size
            speed = (tx * (vx - w * qy) + ty * (vy + w * qx)) / size
            speed = speed + moves * ((tx * dx + ty * dy) / size - reach * turn)
            return np.asarray(self.tool.side * (w + turn * moves) / speed)

    # --- from instant to instant

    def onward(self, all_: _CutInstants, ones: IntArray, others: IntArray) -> IntArray:
        """(P,): for each point of the instants ``ones`` which it is at the instants ``others``; -1: none."""
        found = np.full(len(all_.place), -1)
        before, after = all_.counts[ones], all_.counts[others]
        for n, m in set(zip(before.tolist(), after.tolist(), strict=True)):
            if not n or not m:
                continue
            alike = (before == n) & (after == m)
            here, there = all_.each(ones[alike], n), all_.each(others[alike], m)
            one, other = here[:, :, None], there[:, None]
            off = all_.place[one] - all_.place[other]
            if self.tool.closed:
                off = within_half(off, self.tool.period)
            apart = all_.points[one] - all_.points[other]
            far = np.hypot(apart[..., 0], apart[..., 1]) > CUT_MATCHED * self.size
            off = np.where(far | (all_.rising[one] != all_.rising[other]), np.inf, abs(off))
            to, back, least = np.argmin(off, axis=2), np.argmin(off, axis=1), off.min(axis=2)
            row = np.arange(len(to))[:, None]
            good = np.equal(back[row, to], np.arange(len(here[0]))) & np.isfinite(least)
            found[here[good]] = there[row, to][good]
        return found

    def known(self, all_: _CutInstants, middles: IntArray) -> BoolArray:
        """(M,): whether the curves from the instants before ``middles`` to those after them say where these are."""
        counts = all_.counts
        to, onward = self.onward(all_, middles - 1, middles), self.onward(all_, middles, middles + 1)
        alike = (counts[middles - 1] == counts[middles]) & (counts[middles] == counts[middles + 1])
        owner = np.repeat(np.arange(len(middles)), counts[middles - 1])
        one = all_.rows(middles - 1)
        middle = to[one]
        other = np.where(middle >= 0, onward[middle], -1)
        alike[owner[other < 0]] = False
        every = alike[owner]
        one, middle, other, owner = one[every], middle[every], other[every], owner[every]
        points, along = all_.points, all_.along
        across = cubic_offsets(points[one], along[one], points[other], along[other], points[middle], along[middle])
        worst = np.zeros(len(middles))
        np.maximum.at(worst, owner, across)
        return alike & (worst <= CUT_EXACT * self.size)

    def runs(self, strand: _CutInstants) -> list[EnvelopeRun]:
        """The branches of a part of the film, cut where they turn back."""
        one = np.arange(len(strand) - 1)
        onward = self.onward(strand, one, one + 1)
        first = np.ones(len(onward), dtype=bool)
        first[onward[onward >= 0]] = False
        branches: list[list[int]] = []
        after = onward.tolist()
        for k in np.flatnonzero(first).tolist():
            branch = [k]
            while (k := after[k]) >= 0:
                branch.append(k)
            branches.append(branch)
        times = np.repeat(strand.times, strand.counts)
        branches.sort(key=lambda branch: branch[-1])
        return [run for branch in branches for run in self._turned(strand, times, branch)]

    def _turned(self, strand: _CutInstants, times: FloatArray, branch: list[int]) -> list[EnvelopeRun]:
        points, along, bend = strand.points[branch], strand.along[branch], strand.bend[branch]
        times = times[branch]
        self.branches += 1
        number = self.branches
        moved = np.append(True, np.hypot(*np.diff(points, axis=0).T) > CUT_EXACT * self.size)
        points, along, bend, times = points[moved], along[moved], bend[moved], times[moved]
        if len(points) < 2:
            return []
        forward = np.sum(np.diff(points, axis=0) * (along[1:] + along[:-1]), axis=1) > 0.0
        changes = np.nonzero(forward[1:] != forward[:-1])[0] + 1
        found: list[EnvelopeRun] = []
        rising = bool(strand.rising[branch[0]])
        for begin, end in zip([0, *changes], [*changes, len(forward)], strict=True):
            if bool(forward[begin]) != rising:
                continue  # between two cusps the tool goes over it just before and just after
            part = slice(begin, end + 1)
            part = part if forward[begin] else slice(end, begin - 1 if begin else None, -1)
            found.append(EnvelopeRun(points[part], along[part], bend[part], times[part], number))
        return found

    # --- where it rests, or goes another way at once

    def standing(self, moving: _CutInstants) -> list[int]:
        """After which of these instants the pose is still the same in the next one."""
        x, y, c, s = np.diff(moving.poses[:4], axis=1)
        off = np.hypot(x, y) + self.tool.size * np.hypot(c, s)
        return np.flatnonzero(off <= CUT_ALONG * self.size).tolist()

    def turns(self, moving: _CutInstants, k: int) -> bool:
        """Whether the motion has another direction after an instant than before, at one pose."""
        own = slice(moving.begins[k], moving.begins[k + 1])
        onward = self.onward(moving, np.array([k]), np.array([k + 1]))[own]
        if (onward < 0).any() or len(onward) < moving.counts[k + 1]:
            return True
        return bool((np.hypot(*(moving.points[own] - moving.points[onward]).T) > CUT_ALONG * self.size).any())

    def caps(self, moving: _CutInstants, k: int) -> list[EnvelopeRun]:
        """The parts of the outline that went ahead before, and do not after."""
        tool = self.tool
        place = np.unique(tool.inside(moving.place[moving.begins[k] : moving.begins[k + 2]]))
        if len(place) < 2:
            return []
        before, after = moving.poses[:, k], moving.poses[:, k + 1]
        ends = np.append(place[1:], place[0] + tool.period) if tool.closed else place[1:]
        found: list[EnvelopeRun] = []
        for begin, end in zip(place[: len(ends)], ends, strict=True):
            middle = np.array([(begin + end) / 2.0])
            if outward_speed(tool, middle, before)[0] > 0.0 > outward_speed(tool, middle, after)[0]:
                inner = np.concatenate([tool.samples, tool.samples + tool.period])
                inner = np.concatenate([[begin], inner[(inner > begin) & (inner < end)], [end]])
                fine = np.interp(
                    np.arange(CAP_POINTS * (len(inner) - 1) + 1) / CAP_POINTS, np.arange(len(inner)), inner
                )
                points, along = self.laid(fine, np.repeat(before[:4, None], len(fine), axis=1))
                bend = self._own_bends(fine)
                if tool.side < 0.0:  # counter-clockwise, and the tool is to be on the right
                    points, along, bend = points[::-1], along[::-1], bend[::-1]
                moved = np.append(True, np.hypot(*np.diff(points, axis=0).T) > CUT_EXACT * self.size)
                if moved.sum() > 1:
                    times = np.full(int(moved.sum()), float(moving.times[k]))
                    found.append(EnvelopeRun(points[moved], along[moved], bend[moved], times, -1))
        return found

    def _own_bends(self, place: FloatArray) -> FloatArray:
        """The curvatures of the tool."""
        _, _, tx, ty, dx, dy, rx, ry = self.tool.values(place)
        size, reach = np.hypot(tx, ty), self.tool.side * self.tool.reach
        turn = (tx * ry - ty * rx) / (size * size)
        with np.errstate(all="ignore"):
            return np.asarray(self.tool.side * turn / ((tx * dx + ty * dy) / size - reach * turn))
