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

import itertools
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, within_half
from movimentum.outlines.contour import Contour
from movimentum.outlines.cubics import between
from movimentum.records import dataclass
from movimentum.tolerances import CUT_ALONG, CUT_EXACT, CUT_MATCHED, CUT_RESTS, PLACE_FOUND

Course = Callable[[Sequence[Fraction]], FloatArray]
"""From N instants to (10, N): x, y, c, s, vx, vy and w of the tool in the frame that is cut, and the rates of the last
three, nan where there are none; nan without a solution.
"""

INSTANTS = 720
"""Of a film, to begin with; half a degree of a turn."""
ROUNDS = 12
"""How often an interval is halved."""
MOST_INSTANTS = 20_000
BETWEEN = 4
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


@dataclass(slots=True, eq=False)
class _Instant:
    time: Fraction
    pose: FloatArray
    place: FloatArray
    rising: Any
    points: FloatArray
    along: FloatArray
    bend: FloatArray


def envelope(
    tool: Contour, parts: Sequence[tuple[Fraction, Fraction]], course: Course, branches: int = 0
) -> tuple[list[EnvelopeRun], FloatArray]:
    """The runs that ``tool`` cuts while it moves as ``course`` says, and the poses (10, N) in order of time. ``parts``:
    from when to when the motion is smooth; ``branches``: so many have numbers already.
    """
    cut = _Cut(tool, course, branches)
    strands = [cut.strand(begin, end) for begin, end in parts if end > begin]
    strands = [strand for strand in strands if strand]
    runs: list[EnvelopeRun] = []
    for strand in strands:
        runs += cut.runs(strand)
    everything = [each for strand in strands for each in strand]
    moving = [each for each in everything if len(each.place)]
    for k in cut.standing(moving):
        before, after = moving[k], moving[k + 1]
        if cut.turns(before, after):
            runs += cut.caps(before, after)
    poses = np.stack([each.pose for each in everything], axis=-1) if everything else np.empty((10, 0))
    return runs, poses


class _Cut:
    def __init__(self, tool: Contour, course: Course, branches: int) -> None:
        self.tool, self.course = tool, course
        self.fast = 0.0
        self.size = tool.size
        self.branches = branches
        self.paired: dict[tuple[int, int], list[tuple[int, int]]] = {}

    # --- instants

    def strand(self, begin: Fraction, end: Fraction) -> list[_Instant]:
        """The instants of one part of the film, so many that curves between them are known."""
        last = end - (end - begin) * JUST_BEFORE
        count = INSTANTS
        times = [begin + (last - begin) * Fraction(k, count) for k in range(count + 1)]
        found = self.instants(times)
        found = found[: next((k for k, each in enumerate(found) if not np.isfinite(each.pose[:7]).all()), len(found))]
        if not found:
            return []
        xy = np.array([each.pose[:2] for each in found])
        self.size = max(self.size, float(np.ptp(xy, axis=0).max()))
        open_ = set(range(len(found) - 1))
        for _ in range(ROUNDS):
            if not open_ or len(found) + len(open_) > MOST_INSTANTS:
                break
            found, open_ = self.halved(found, open_)
        return found

    def halved(self, found: list[_Instant], open_: set[int]) -> tuple[list[_Instant], set[int]]:
        order = sorted(open_)
        middles = dict(zip(order, self.instants([(found[k].time + found[k + 1].time) / 2 for k in order]), strict=True))
        middles = {k: each for k, each in middles.items() if np.isfinite(each.pose[:7]).all()}
        known = dict(zip(middles, self.known([(found[k], middles[k], found[k + 1]) for k in middles]), strict=True))
        made: list[_Instant] = []
        wanted: set[int] = set()
        for k, each in enumerate(found):
            made.append(each)
            if k in middles:
                if not known[k]:
                    wanted |= {len(made) - 1, len(made)}
                made.append(middles[k])
        return made, wanted

    def instants(self, times: Sequence[Fraction]) -> list[_Instant]:
        """What is cut at some instants."""
        poses = self.course(times)
        _x, _y, c, s, vx, vy, w = poses[:7]
        speed = np.hypot(vx, vy) + abs(w) * self.tool.size
        self.fast = max(self.fast, float(np.nanmax(speed, initial=0.0)))
        inward = np.stack([c * vx + s * vy, c * vy - s * vx, w])  # the velocity in the tool's frame
        moves = np.isfinite(poses[:7]).all(axis=0) & (speed > CUT_RESTS * self.fast)
        number, place, rising = roots(self.tool, inward, moves)
        points, along = self.laid(place, poses[:4, number])
        bend = self.bends(place, poses[:, number])
        ends = np.searchsorted(number, np.arange(len(times) + 1))
        return [
            _Instant(time, poses[:, k], *(each[ends[k] : ends[k + 1]] for each in (place, rising, points, along, bend)))
            for k, time in enumerate(times)
        ]

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
            change = _across(self.tool, place, np.stack([vx, vy, w]))[1]
            faster = tx * (ay - w * vx + aw * px) - ty * (ax + w * vy - aw * py)
            moves = -faster / change
            turn = (tx * ry - ty * rx) / (size * size)
            reach = self.tool.side * self.tool.reach
            qx, qy = px - reach * ty / size, py + reach * tx / size
            speed = (tx * (vx - w * qy) + ty * (vy + w * qx)) / size
            speed = speed + moves * ((tx * dx + ty * dy) / size - reach * turn)
            return np.asarray(self.tool.side * (w + turn * moves) / speed)

    # --- from instant to instant

    def pairs(self, one: _Instant, other: _Instant) -> list[tuple[int, int]]:
        """Which of the points of an instant are which of the next."""
        self.match([(one, other)])
        return self.paired[id(one), id(other)]

    def match(self, couples: Sequence[tuple[_Instant, _Instant]]) -> None:
        """Find the pairs of all of these at once, those with as many points together."""
        alike: dict[tuple[int, int], list[tuple[_Instant, _Instant]]] = {}
        for one, other in couples:
            if (id(one), id(other)) not in self.paired:
                alike.setdefault((len(one.place), len(other.place)), []).append((one, other))
        for (n, m), some in alike.items():
            if not n or not m:
                self.paired |= {(id(one), id(other)): [] for one, other in some}
                continue
            ones, others = zip(*some, strict=True)
            off = (
                np.array([each.place for each in ones])[:, :, None] - np.array([each.place for each in others])[:, None]
            )
            if self.tool.closed:
                off = within_half(off, self.tool.period)
            apart = (
                np.array([each.points for each in ones])[:, :, None]
                - np.array([each.points for each in others])[:, None]
            )
            turned = (
                np.array([each.rising for each in ones])[:, :, None]
                != np.array([each.rising for each in others])[:, None]
            )
            far = np.hypot(apart[..., 0], apart[..., 1]) > CUT_MATCHED * self.size
            off = np.where(turned | far, np.inf, abs(off))
            to, back, least = np.argmin(off, axis=2), np.argmin(off, axis=1), off.min(axis=2)
            good = (np.take_along_axis(back, to, axis=1) == np.arange(n)) & np.isfinite(least)
            for (one, other), own, kept in zip(some, to.tolist(), good.tolist(), strict=True):
                self.paired[id(one), id(other)] = [(i, own[i]) for i in range(n) if kept[i]]

    def known(self, triples: Sequence[tuple[_Instant, _Instant, _Instant]]) -> list[bool]:
        """Whether the curves between the first and the last of each three instants say where the middle one is."""
        self.match([couple for one, middle, other in triples for couple in ((one, middle), (middle, other))])
        found = [False] * len(triples)
        owners: list[int] = []
        parts: list[tuple[FloatArray, ...]] = []
        for number, (one, middle, other) in enumerate(triples):
            count = len(middle.place)
            if not len(one.place) and not count and not len(other.place):
                found[number] = True
                continue
            first, second = self.pairs(one, middle), dict(self.pairs(middle, other))
            if not len(one.place) == count == len(other.place) == len(first) == len(second):
                continue
            i, j = [i for i, _ in first], [j for _, j in first]
            k = [second[each] for each in j]
            owners += [number] * count
            parts.append(
                (one.points[i], one.along[i], other.points[k], other.along[k], middle.points[j], middle.along[j])
            )
        if parts:
            p, d, q, e, m, along = (np.concatenate(column) for column in zip(*parts, strict=True))
            worst = np.zeros(len(triples))
            np.maximum.at(worst, owners, between(p, d, q, e, m, along))
            for number in dict.fromkeys(owners):
                found[number] = bool(worst[number] <= CUT_EXACT * self.size)
        return found

    def runs(self, strand: list[_Instant]) -> list[EnvelopeRun]:
        """The branches of a part of the film, cut where they turn back."""
        found: list[EnvelopeRun] = []
        growing: dict[int, list[tuple[_Instant, int]]] = {}
        self.match(list(itertools.pairwise(strand)))
        for number, each in enumerate(strand):
            pairs = dict(self.pairs(strand[number - 1], each)) if number else {}
            kept = {pairs[i]: branch for i, branch in growing.items() if i in pairs}
            for i, branch in growing.items():
                if i not in pairs:
                    found += self._turned(branch)
            growing = {k: [*kept.get(k, []), (each, k)] if k not in kept else _grown(kept[k], (each, k))
                       for k in range(len(each.place))}  # fmt: skip
        for branch in growing.values():
            found += self._turned(branch)
        return found

    def _turned(self, branch: list[tuple[_Instant, int]]) -> list[EnvelopeRun]:
        points = np.array([each.points[k] for each, k in branch])
        along = np.array([each.along[k] for each, k in branch])
        bend = np.array([each.bend[k] for each, k in branch])
        times = np.array([float(each.time) for each, _ in branch])
        self.branches += 1
        number = self.branches
        moved = np.append(True, np.hypot(*np.diff(points, axis=0).T) > CUT_EXACT * self.size)
        points, along, bend, times = points[moved], along[moved], bend[moved], times[moved]
        if len(points) < 2:
            return []
        forward = np.sum(np.diff(points, axis=0) * (along[1:] + along[:-1]), axis=1) > 0.0
        changes = np.nonzero(forward[1:] != forward[:-1])[0] + 1
        found: list[EnvelopeRun] = []
        rising = bool(branch[0][0].rising[branch[0][1]])
        for begin, end in zip([0, *changes], [*changes, len(forward)], strict=True):
            if bool(forward[begin]) != rising:
                continue  # between two cusps the tool goes over it just before and just after
            part = slice(begin, end + 1)
            part = part if forward[begin] else slice(end, begin - 1 if begin else None, -1)
            found.append(EnvelopeRun(points[part], along[part], bend[part], times[part], number))
        return found

    # --- where it rests, or goes another way at once

    def standing(self, moving: Sequence[_Instant]) -> list[int]:
        """After which of these instants the pose is still the same in the next one."""
        if not moving:
            return []
        x, y, c, s = np.diff(np.stack([each.pose[:4] for each in moving], axis=-1), axis=1)
        off = np.hypot(x, y) + self.tool.size * np.hypot(c, s)
        return [int(k) for k in np.nonzero(off <= CUT_ALONG * self.size)[0]]

    def turns(self, before: _Instant, after: _Instant) -> bool:
        """Whether the motion has another direction after an instant than before, at one pose."""
        matched = self.pairs(before, after)
        if len(matched) < max(len(before.place), len(after.place)):
            return True
        return any(np.hypot(*(before.points[i] - after.points[k])) > CUT_ALONG * self.size for i, k in matched)

    def caps(self, before: _Instant, after: _Instant) -> list[EnvelopeRun]:
        """The parts of the outline that went ahead before, and do not after."""
        tool = self.tool
        place = np.unique(np.concatenate([tool.inside(before.place), tool.inside(after.place)]))
        if len(place) < 2:
            return []
        ends = np.append(place[1:], place[0] + tool.period) if tool.closed else place[1:]
        found: list[EnvelopeRun] = []
        for begin, end in zip(place[: len(ends)], ends, strict=True):
            middle = np.array([(begin + end) / 2.0])
            if ahead(tool, middle, before.pose)[0] > 0.0 > ahead(tool, middle, after.pose)[0]:
                inner = np.concatenate([tool.samples, tool.samples + tool.period])
                inner = np.concatenate([[begin], inner[(inner > begin) & (inner < end)], [end]])
                fine = np.interp(np.arange(BETWEEN * (len(inner) - 1) + 1) / BETWEEN, np.arange(len(inner)), inner)
                points, along = self.laid(fine, np.repeat(before.pose[:4, None], len(fine), axis=1))
                bend = self._own_bends(fine)
                if tool.side < 0.0:  # counter-clockwise, and the tool is to be on the right
                    points, along, bend = points[::-1], along[::-1], bend[::-1]
                moved = np.append(True, np.hypot(*np.diff(points, axis=0).T) > CUT_EXACT * self.size)
                if moved.sum() > 1:
                    times = np.full(int(moved.sum()), float(before.time))
                    found.append(EnvelopeRun(points[moved], along[moved], bend[moved], times, -1))
        return found

    def _own_bends(self, place: FloatArray) -> FloatArray:
        """The curvatures of the tool."""
        _, _, tx, ty, dx, dy, rx, ry = self.tool.values(place)
        size, reach = np.hypot(tx, ty), self.tool.side * self.tool.reach
        turn = (tx * ry - ty * rx) / (size * size)
        with np.errstate(all="ignore"):
            return np.asarray(self.tool.side * turn / ((tx * dx + ty * dy) / size - reach * turn))


def _grown(branch: list[tuple[_Instant, int]], more: tuple[_Instant, int]) -> list[tuple[_Instant, int]]:
    branch.append(more)
    return branch


def _across(tool: Contour, place: FloatArray, inward: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How fast the outline goes to its left, times the length of its direction; and how that changes with the place."""
    px, py, tx, ty, dx, dy, rx, ry = tool.values(place)
    vx, vy, w = inward
    ux, uy = vx - w * py, vy + w * px
    return tx * uy - ty * ux, rx * uy - ry * ux + w * (tx * dx + ty * dy)


def ahead(tool: Contour, place: FloatArray, pose: FloatArray) -> FloatArray:
    """How fast places of the outline go outwards."""
    _, _, c, s, vx, vy, w = pose[:7]
    tx, ty = tool.values(place)[2:4]
    value = _across(tool, place, np.stack([c * vx + s * vy, c * vy - s * vx, w])[:, None])[0]
    found: FloatArray = tool.side * value / np.hypot(tx, ty)
    return found


def roots(tool: Contour, inward: FloatArray, moves: Any) -> tuple[Any, FloatArray, Any]:
    """Where the outline goes along itself, for velocities (3, N) in its frame: which of the N, the place, and whether
    it goes inwards before that place and outwards behind it, sorted by N and place.
    """
    if tool.radius is not None and not inward[2].any():
        return _roots_of_a_circle(tool, inward, moves)
    samples = tool.samples
    grid = samples[None, :]
    value = np.where(moves[:, None], _across(tool, grid, inward[:, :, None])[0], 1.0)
    tx, ty = tool.values(samples)[2:4]
    speed = np.hypot(inward[0], inward[1]) + abs(inward[2]) * tool.size
    value[abs(value) <= CUT_RESTS * speed[:, None] * np.hypot(tx, ty)] = 0.0
    positive = value >= 0.0
    number, k = np.nonzero(positive[:, 1:] != positive[:, :-1])
    low, high, rising = samples[k].copy(), samples[k + 1].copy(), positive[number, k + 1]
    flow = inward[:, number]
    place = (low + high) / 2.0
    for _ in range(60):
        at, change = _across(tool, place, flow)
        below = (at >= 0.0) != rising
        low, high = np.where(below, place, low), np.where(below, high, place)
        with np.errstate(all="ignore"):
            step = place - at / change
        moved = np.where((step > low) & (step < high), step, (low + high) / 2.0)
        done = abs(moved - place) <= PLACE_FOUND * tool.period
        place = moved
        if done.all():
            break
    return number, place, rising


def _roots_of_a_circle(tool: Contour, inward: FloatArray, moves: Any) -> tuple[Any, FloatArray, Any]:
    """The same of a circle by its angle that does not turn: on both sides of its way."""
    number = np.repeat(np.nonzero(moves)[0], 2)
    ahead: FloatArray = np.degrees(np.arctan2(inward[1], inward[0]))[number]
    rising = np.arange(len(number)) % 2 == 0
    place = tool.inside(ahead + np.where(rising, 90.0, -90.0))
    order = np.lexsort([place, number])
    return number, place[order], rising[order]
