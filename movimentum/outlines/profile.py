"""The profile cut by a moving outline: its envelope, in order, less what the outline passes over at other times."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.expressions import call, const
from movimentum.expressions.tables import Ends, Table
from movimentum.outlines.contour import PLACE, Contour, derivative_by
from movimentum.outlines.cubics import arc_length
from movimentum.outlines.envelope import EnvelopeRun
from movimentum.outlines.expression_outlines import CurvePiece, chained_pieces, corner_piece
from movimentum.outlines.swept_regions import SweptOutlines
from movimentum.records import dataclass
from movimentum.tolerances import (
    CUT_ALONG,
    CUT_AS_NEAR,
    CUT_BESIDE,
    CUT_CROSSED,
    CUT_CROSSES,
    CUT_EXACT,
    CUT_LINKED,
    CUT_SMOOTH,
    CUT_TURNS,
)


@dataclass(frozen=True, slots=True, eq=False)
class Corner:
    """Where the profile crosses itself: so deep that a part of it is cut away. ``time``: when that begins."""

    time: float
    place: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """``outline`` in the frame that is cut, counter-clockwise about what is left if it is closed; ``points`` (M, 2) of
    it that are exact. ``corners``: where it crosses itself. ``outer``: it is the outermost edge.
    """

    outline: Contour
    points: FloatArray
    corners: tuple[Corner, ...]
    outer: bool = False


def cut_profile(runs: Sequence[EnvelopeRun], swept: SweptOutlines, *, outer: bool = False) -> Profile | None:
    """What the runs of an envelope leave: the edge nearest to the frame's origin, or if the tool comes over that, or
    ``outer``, the outermost. None if nothing is left.
    """
    if not runs:
        return None
    size = max(float(np.ptp(np.concatenate([run.points for run in runs]), axis=0).max()), swept.size)
    stretches = _uncovered_parts(runs, swept, CUT_BESIDE * size)
    if not stretches:
        return None
    outer = outer or bool(swept.covers(np.zeros((1, 2)))[0])
    chain, closed = _chain(stretches, size, outer)
    chain, corners = _trimmed_at_crossings(chain, closed, size)
    points = np.concatenate([each.points for each in chain])
    new = np.append(True, np.hypot(*np.diff(points, axis=0).T) > CUT_EXACT * size)
    return Profile(_contour(chain, closed), points[new], tuple(corners), outer)


@dataclass(frozen=True, slots=True, eq=False)
class _RunPart:
    """A part of a run that is left, with a point beyond each end that is not, if there is one (``over``)."""

    run: EnvelopeRun
    begin: int
    end: int
    over: tuple[bool, bool]

    @property
    def first(self) -> FloatArray:
        return self.run.points[self.begin]

    @property
    def last(self) -> FloatArray:
        return self.run.points[self.end]


def _uncovered_parts(runs: Sequence[EnvelopeRun], swept: SweptOutlines, beside: float) -> list[_RunPart]:
    """What of the runs the tool does not go over; where it goes over a part is found by halving, of all at once."""
    points = np.concatenate([run.points for run in runs])
    along = np.concatenate([run.along for run in runs])
    off = points + beside * np.stack([-along[:, 1], along[:, 0]], axis=-1)  # where something is left, if it is
    firsts = np.cumsum([0, *(len(run.points) for run in runs)])
    asked = np.concatenate([_probed(begin, end) for begin, end in pairwise(firsts.tolist())])
    covered = np.zeros(len(points), dtype=bool)
    covered[asked] = swept.covers(off[asked])
    low, high = asked[:-1].copy(), asked[1:].copy()
    inner = ~np.isin(high, firsts)
    low, high = low[inner], high[inner]
    for a, b in zip(low.tolist(), high.tolist(), strict=True):
        covered[a:b] = covered[a]
    change = covered[low] != covered[high]
    low, high = low[change], high[change]
    while (wide := high - low > 1).any():
        middle = (low[wide] + high[wide]) // 2
        found = swept.covers(off[middle])
        as_low = found == covered[low[wide]]
        for a, m, b, same in zip(
            low[wide].tolist(), middle.tolist(), high[wide].tolist(), as_low.tolist(), strict=True
        ):
            covered[a + 1 : m + 1] = covered[a] if same else covered[m]
            covered[m:b] = covered[a] if same else covered[b]
        low[wide], high[wide] = np.where(as_low, middle, low[wide]), np.where(as_low, high[wide], middle)
    return [each for k, run in enumerate(runs) for each in _run_parts(run, covered[firsts[k] : firsts[k + 1]])]


def _probed(begin: int, end: int) -> IntArray:
    count = end - begin
    return np.unique(np.linspace(begin, end - 1, min(count, max(16, count // 4))).round().astype(np.int64))


def _run_parts(run: EnvelopeRun, covered: FloatArray) -> list[_RunPart]:
    count = len(covered)
    edges = np.nonzero(np.diff(np.concatenate([[True], covered, [True]]).astype(int)))[0]
    found: list[_RunPart] = []
    for begin, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        low, high = max(begin - 1, 0), min(stop, count - 1)
        if high > low:
            found.append(_RunPart(run, low, high, (begin > 0, stop < count)))
    return found


# --- one after the other


def _chain(stretches: list[_RunPart], size: float, outer: bool) -> tuple[list[_RunPart], bool]:
    """The stretches of one edge in order, and whether it is closed."""

    def reach(each: _RunPart) -> float:
        far = np.hypot(*each.run.points[each.begin : each.end + 1].T)
        return -float(far.max()) if outer else float(far.min())

    start = min(
        range(len(stretches)), key=lambda k: (round(reach(stretches[k]) / (CUT_ALONG * size)), -_extent(stretches[k]))
    )
    if (whole := _closed_part(stretches[start], size)) is not None:
        return [whole], True
    firsts = np.array([each.first for each in stretches])
    lasts = np.array([each.last for each in stretches])
    begun, ended = (np.array([each.over[k] for each in stretches]) for k in (0, 1))
    apart = CUT_CROSSED * size  # what is cut off is crossed by what is cut off, and what is not goes on as another
    order = [start]
    while True:
        off = np.hypot(*(firsts - lasts[order[-1]]).T) + apart * (begun != ended[order[-1]])
        off[order[1:]] = np.inf
        if len(order) == 1 and _extent(stretches[start]) <= 2.0 * off[start]:
            off[start] = np.inf
        best = _nearest_part(off, stretches)
        if off[best] > CUT_LINKED * size:
            break
        if best == start:
            return [stretches[k] for k in order], True
        order.append(best)
    while True:
        off = np.hypot(*(lasts - firsts[order[0]]).T) + apart * (ended != begun[order[0]])
        off[order] = np.inf
        best = _nearest_part(off, stretches)
        if off[best] > CUT_LINKED * size:
            return [stretches[k] for k in order], False
        order.insert(0, best)


def _nearest_part(off: FloatArray, stretches: Sequence[_RunPart]) -> int:
    """The nearest; of several that are as near the longest."""
    near = float(off.min())
    if not np.isfinite(near):
        return 0
    some = np.nonzero(off <= near * 1.01 + CUT_AS_NEAR)[0].tolist()
    return max(some, key=lambda k: _extent(stretches[k]))


def _extent(each: _RunPart) -> float:
    return float(np.hypot(*np.diff(each.run.points[each.begin : each.end + 1], axis=0).T).sum())


def _closed_part(each: _RunPart, size: float) -> _RunPart | None:
    """A stretch that comes to its own beginning again, up to there."""
    run, part = each.run, slice(each.begin, each.end + 1)
    points, along, bend = run.points[part], run.along[part], run.bend[part]
    off = points - points[0]
    ahead, across = off @ along[0], off @ np.array([-along[0][1], along[0][0]])
    comes = (ahead[:-1] < -CUT_ALONG * size) & (ahead[1:] >= -CUT_ALONG * size)
    comes &= (abs(across[1:]) <= CUT_ALONG * size) & (along[1:] @ along[0] > 0.0)
    comes &= np.hypot(*off[1:].T) <= CUT_LINKED * size
    found = np.nonzero(comes)[0]
    if each.over != (False, False) or not len(found):
        return None
    k = int(found[0]) + 1
    again = [np.concatenate([own[:k], own[:1]]) for own in (points, along, bend)]
    run = EnvelopeRun(
        again[0], again[1], again[2], each.run.times[each.begin : each.begin + k + 1], each.run.branch,
    )  # fmt: skip
    return _RunPart(run, 0, k, (False, False))


# --- where they meet


@dataclass(frozen=True, slots=True, eq=False)
class _Cubic:
    """Points, unit directions and curvatures there."""

    points: FloatArray
    along: FloatArray
    bend: FloatArray

    def some(self, which: slice | BoolArray) -> _Cubic:
        return _Cubic(self.points[which], self.along[which], self.bend[which])

    def joined(self, *parts: _Cubic) -> _Cubic:
        every = (self, *parts)
        return _Cubic(
            *(np.concatenate([getattr(each, name) for each in every]) for name in ("points", "along", "bend"))
        )


def _trimmed_at_crossings(chain: list[_RunPart], closed: bool, size: float) -> tuple[list[_Cubic], list[Corner]]:
    """The stretches cut off where each crosses the next; one that is alone may cross itself, where its ends go on."""
    parts = [
        _Cubic(each.run.points, each.run.along, each.run.bend).some(slice(each.begin, each.end + 1)) for each in chain
    ]
    corners: list[Corner] = []
    count = len(chain)
    for k in range(count if closed and (count > 1 or all(chain[0].over)) else count - 1):
        n = (k + 1) % count
        one, other = chain[k], chain[n]
        crossing = _crossing(parts[k], parts[n])
        if crossing is None:
            continue
        (i, _), (j, _), place, directions = crossing
        ends = [_Cubic(place[None], way[None], np.array([np.nan])) for way in directions]
        parts[k] = parts[k].some(slice(i + 1)).joined(ends[0])
        parts[n] = ends[1].joined(parts[n].some(slice(j + 1, None)))
        turn = directions[0][0] * directions[1][1] - directions[0][1] * directions[1][0]
        if one.run.branch == other.run.branch >= 0 and abs(turn) > CUT_SMOOTH:
            when = [float(one.run.times[one.end]), float(other.run.times[other.begin])]
            corners.append(Corner(min(when), (float(place[0]), float(place[1]))))
    return [_without_end_noise(part, size) for part in parts], corners


def _without_end_noise(part: _Cubic, size: float) -> _Cubic:
    keep = np.append(True, np.hypot(*np.diff(part.points, axis=0).T) > CUT_EXACT * size)
    if not keep[-1] and keep.sum() > 1:
        keep[np.nonzero(keep)[0][-1]] = False
        keep[-1] = True
    keep[0] = True
    return part.some(keep)


def _crossing(one: _Cubic, other: _Cubic) -> tuple[tuple[int, float], tuple[int, float], FloatArray, FloatArray] | None:
    """Where the last crossing of one near its end is with the beginning of the other: (piece, share of it) of both,
    the place, and both directions.
    """
    last, first = max(0, len(one.points) - 24), min(len(other.points), 24)
    p, q = one.points[last:], other.points[:first]
    d, e = np.diff(p, axis=0)[:, None], np.diff(q, axis=0)[None]
    w = q[None, :-1] - p[:-1, None]
    det = d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0]
    with np.errstate(all="ignore"):
        u = (w[..., 0] * e[..., 1] - w[..., 1] * e[..., 0]) / det
        v = (w[..., 0] * d[..., 1] - w[..., 1] * d[..., 0]) / det
    inside = (abs(u - 0.5) < 0.5 + CUT_CROSSES) & (abs(v - 0.5) < 0.5 + CUT_CROSSES)
    hits = np.argwhere(inside)
    if not len(hits):
        return None
    i, j = (int(each) for each in hits[-1])
    a, b = float(u[i, j]), float(v[i, j])
    for _ in range(8):
        at, rate = _cubic(one, last + i, a)
        to, other_rate = _cubic(other, j, b)
        matrix = np.stack([rate, -other_rate], axis=-1)
        if abs(np.linalg.det(matrix)) <= CUT_SMOOTH * np.hypot(*rate) * np.hypot(*other_rate):
            return None  # they go on as each other
        step = np.linalg.solve(matrix, to - at)
        a, b = a + float(step[0]), b + float(step[1])
    at, rate = _cubic(one, last + i, a)
    _, other_rate = _cubic(other, j, b)
    directions = np.stack([rate / np.hypot(*rate), other_rate / np.hypot(*other_rate)])
    return (last + i, a), (j, b), at, directions


def _cubic(part: _Cubic, k: int, u: float) -> tuple[FloatArray, FloatArray]:
    p, q = part.points[k : k + 1], part.points[k + 1 : k + 2]
    d, e = part.along[k : k + 1], part.along[k + 1 : k + 2]
    size = arc_length(p, d, q, e)
    d, e, chord = d[0] * size, e[0] * size, (q - p)[0]
    at = p[0] + u * (d + u * (3.0 * chord - 2.0 * d - e + u * (d + e - 2.0 * chord)))
    return at, d + u * (2.0 * (3.0 * chord - 2.0 * d - e) + 3.0 * u * (d + e - 2.0 * chord))


# --- as an outline


def _bends(part: _Cubic, lengths: FloatArray) -> FloatArray:
    """(M, 2): halves of the second derivatives by the length; where the curvature is not known, or turns far from one
    point to the next, those of cubics.
    """
    known = 0.5 * part.bend[:, None] * np.stack([-part.along[:, 1], part.along[:, 0]], axis=-1)
    chord = np.diff(part.points, axis=0) / lengths[:, None]
    left, right = part.along[:-1], part.along[1:]
    first = (3.0 * chord - 2.0 * left - right) / lengths[:, None]
    last = (left + 2.0 * right - 3.0 * chord) / lengths[:, None]
    cubic = np.concatenate([first[:1], (first[1:] + last[:-1]) / 2.0, last[-1:]])
    wide = np.maximum(np.append(lengths, 0.0), np.append(0.0, lengths))
    with np.errstate(all="ignore"):
        good = np.abs(part.bend) * wide < CUT_TURNS
    return np.where(good[:, None], known, cubic)


def _contour(chain: Sequence[_Cubic], closed: bool) -> Contour:
    pieces: list[CurvePiece] = []
    count = len(chain)
    # a turn may be rounded up to a whole one, where the last polynomial still tells how it runs
    ends = Ends.NOTHING if closed and count == 1 else Ends.STRAIGHT
    for k, part in enumerate(chain):
        lengths = arc_length(part.points[:-1], part.along[:-1], part.points[1:], part.along[1:])
        grid = np.concatenate([[0.0], np.cumsum(lengths)])
        bends = _bends(part, lengths)
        x, y = (
            call("table", PLACE, payload=Table(
                grid, np.ascontiguousarray(part.points[:, axis]), smooth=True, ends=ends,
                slopes=np.ascontiguousarray(part.along[:, axis]), bends=np.ascontiguousarray(bends[:, axis]),
            ))
            for axis in (0, 1)
        )  # fmt: skip
        pieces.append(CurvePiece((x, y), 0.0, float(grid[-1]), (derivative_by(x), derivative_by(y))))
        if closed or k + 1 < count:
            after = chain[(k + 1) % count]
            ways = [math.degrees(math.atan2(way[1], way[0])) for way in (part.along[-1], after.along[0])]
            if abs(math.remainder(ways[1] - ways[0], 360.0)) > math.degrees(CUT_SMOOTH):
                at = const(float(part.points[-1][0])), const(float(part.points[-1][1]))
                pieces += corner_piece(at, *ways)
    return chained_pieces(pieces, closed=closed)
