"""When pairs of things overlap, on the continuous motion: frames have no part in it.

Between two instants no distance changes by more than the things move; so most intervals are free without a further
look. Others are halved until a distance bends too little to hide a root in them, and roots are then found to the last
digits of the time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from movimentum.analysis.gaps.between import LONGER_WAY, GapPairs, GapPoses
from movimentum.analysis.gaps.bodies import bodies_of, excused
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.cancellation import look
from movimentum.records import dataclass, replace
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import GAP_CLOSED, GAP_FLAT, GAP_TOUCHES, INSTANT_ROUNDS, OVERLAP_TOLD

HALVINGS = 14
ROOT_STEPS, FALSE_POSITIONS = 64, 20
ZOOMS = 20
LOOKS = 5
BESIDE = np.array([-0.01, 0.0, 0.01])
ROUGH_ZOOMS = 2
"""Of outlines that are not convex, of which the shortest way out is another measure."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Two things, by name, that overlap from ``begin`` to ``end``; they are deepest, by ``depth`` pixels, at
    ``deepest``. `Motion.overlaps` lists them.

    >>> import movimentum as mv
    >>> two = "A : .disc(3) C=[0,0]; B : .disc(3) C=[50,0]; @0 A.C=[100*.t,0]; B.C=[50,0]; @1"
    >>> (found,) = mv.loads(two).solve().overlaps()
    >>> found.things, round(found.begin, 9), round(found.end, 9), round(found.depth, 6), round(found.deepest, 6)
    (('A', 'B'), 0.44, 0.56, 6.0, 0.5)
    """

    things: tuple[str, str]
    begin: float
    end: float
    depth: float
    deepest: float

    def as_data(self) -> dict[str, Any]:
        """For JSON."""
        data = {"from": self.begin, "to": self.end, "depth": self.depth, "deepest": self.deepest}
        return {"things": list(self.things), **data}


def overlaps(motion: PathMotion, *, all_layers: bool = False) -> list[Overlap]:
    """Every overlap of a film, by pairs in the order of definition and then by time."""
    bodies = bodies_of(motion.timeline.scene)
    found: dict[tuple[int, int], list[Overlap]] = {}
    if len(bodies) < 2:
        return []
    for place, tau in _pieces(motion):
        look()
        segment = motion.segments[place].segment
        poses = motion.poses_in(place, tau)
        free = excused(motion.timeline.scene, segment, bodies, poses, all_layers=all_layers)
        one, other = np.nonzero(~np.triu(np.ones_like(free)) & ~free)
        one, other = other, one  # the one that is defined first
        for pair, overlap in _in_piece(GapPairs(motion, place, bodies, np.stack([one, other])), tau):
            earlier = found.setdefault(pair, [])
            near = GAP_TOUCHES * max(1.0, abs(overlap.begin))
            if earlier and overlap.begin - earlier[-1].end <= near:
                last = earlier.pop()
                best = last if last.depth >= overlap.depth else overlap
                overlap = replace(best, begin=last.begin, end=overlap.end)
            earlier.append(overlap)
    return [overlap for pair in sorted(found) for overlap in found[pair]]


def _pieces(motion: PathMotion) -> Iterator[tuple[int, FloatArray]]:
    """The number of the segment and the offsets of the nodes of each piece of the path."""
    for place, part in enumerate(motion.segments):
        length = float(part.segment.end - part.segment.start)
        last = place + 1 == len(motion.segments)
        for piece in part.pieces:
            if not isinstance(piece, Piece):
                continue
            end = min(piece.end, length) if last else float(np.nextafter(min(piece.end, length), 0.0))
            if end >= piece.begin:
                inner = piece.nodes[(piece.nodes > piece.begin) & (piece.nodes < end)]
                yield place, np.unique(np.concatenate([[piece.begin, end], inner]))


@dataclass(frozen=True, slots=True, eq=False)
class _Ends:
    """K intervals of ``pair``s: their ends, and the distances there."""

    pair: IntArray
    begin: FloatArray
    end: FloatArray
    first: FloatArray
    last: FloatArray

    def some(self, which: BoolArray | IntArray) -> _Ends:
        return _Ends(self.pair[which], self.begin[which], self.end[which], self.first[which], self.last[which])

    def __len__(self) -> int:
        return len(self.pair)


def _in_piece(pairs: GapPairs, tau: FloatArray) -> Iterator[tuple[tuple[int, int], Overlap]]:
    placed = pairs.placed(tau)
    near = _near(pairs, placed)
    start = float(pairs.motion.segments[pairs.place].segment.start)
    if not len(near):
        return
    if len(tau) == 1:
        seen = pairs.at(near, placed, np.zeros_like(near))
        under = seen < -GAP_TOUCHES * pairs.motion.size
        only, empty = np.full(int(under.sum()), tau[0]), np.zeros(0)
        halves = _Ends(near[under], only, only, seen[under], seen[under])
        roots = _Ends(np.zeros(0, dtype=np.int64), empty, empty, empty, empty)
    else:
        halves, roots = _settled(pairs, _close(pairs, placed, near))
    touch = GAP_TOUCHES * pairs.motion.size
    times = _roots(pairs, roots)
    stretches: list[tuple[int, float, float]] = []
    order = np.argsort(halves.pair, kind="stable")
    halves = halves.some(order)
    for number in np.unique(np.concatenate([halves.pair[halves.first < -touch], roots.pair])).tolist():
        mine = roots.pair == number
        leaves = (roots.last > roots.first)[mine]
        edges = sorted(zip(times[mine].tolist(), leaves.tolist(), strict=True))
        if not edges or edges[0][1]:
            edges.insert(0, (float(tau[0]), False))
        if not edges[-1][1]:
            edges.append((float(tau[-1]), True))
        stretches += [(number, a, b) for (a, _), (b, _) in zip(edges[::2], edges[1::2], strict=False)]
    when, deep = _deepest(pairs, stretches, halves)
    for (number, a, b), time, depth in zip(stretches, when.tolist(), deep, strict=True):
        one, other = int(pairs.one[number]), int(pairs.other[number])
        names = pairs.bodies[one].thing.name, pairs.bodies[other].thing.name
        yield (one, other), Overlap(names, start + a, start + b, depth, start + time)


def _near(pairs: GapPairs, placed: GapPoses) -> IntArray:
    """The pairs whose boxes over the whole piece meet."""
    wide = pairs.far[:, None] + OVERLAP_TOLD * pairs.motion.size + 0.5 * pairs.below
    step = np.hypot(*np.moveaxis(np.diff(placed.at, axis=1), -1, 0)).max(axis=1, initial=0.0)[:, None]
    low, high = placed.at.min(axis=1) - wide - 0.1 * step, placed.at.max(axis=1) + wide + 0.1 * step
    a, b = pairs.one, pairs.other
    return np.nonzero(((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1))[0]


def _close(pairs: GapPairs, placed: GapPoses, near: IntArray) -> _Ends:
    """The intervals of the grid in which pairs could touch, as far as circles about them and convex covers tell."""
    count = len(placed.tau)
    found: list[tuple[IntArray, IntArray]] = []
    rows = max(1, 2_000_000 // count)
    for begin in range(0, len(near), rows):
        some = near[begin : begin + rows]
        a, b = pairs.one[some], pairs.other[some]
        apart = placed.at[b] - placed.at[a]
        free = np.hypot(apart[..., 0], apart[..., 1]) - (pairs.far[a] + pairs.far[b])[:, None] - pairs.below
        moved = np.diff(apart, axis=1)
        way = LONGER_WAY * np.hypot(moved[..., 0], moved[..., 1])
        close = free[:, :-1] + free[:, 1:] <= way
        row, k = np.nonzero(close)
        found.append((some[row], k))
    pair, k = (np.concatenate(each) for each in zip(*found, strict=True))
    ends = [_once(pairs.covers, pair, placed, k + n, count) - pairs.below for n in (0, 1)]
    holes = [pairs.holes(pair, placed, k + n) - pairs.below for n in (0, 1)]
    way = pairs.travel(pair, placed, k, placed, k + 1)
    keep = np.array((ends[0] + ends[1] <= way) & (holes[0] + holes[1] <= way))
    pair, k = pair[keep], k[keep]
    first, last = (_once(pairs.at, pair, placed, k + n, count) for n in (0, 1))
    return _Ends(pair, placed.tau[k], placed.tau[k + 1], first, last)


def _once(
    function: Callable[[IntArray, GapPoses, IntArray], FloatArray],
    pair: IntArray,
    placed: GapPoses,
    when: IntArray,
    count: int,
) -> FloatArray:
    """Each pair at each instant once."""
    keys, back = np.unique(pair * count + when, return_inverse=True)
    return function(keys // count, placed, keys % count)[back]


def _settled(pairs: GapPairs, ends: _Ends) -> tuple[_Ends, _Ends]:
    """Intervals in which distances keep their sign, and those that have one root."""
    touch = GAP_TOUCHES * pairs.motion.size
    whole: list[_Ends] = []
    roots: list[_Ends] = []
    for level in range(HALVINGS):
        if not len(ends):
            break
        tau, back = np.unique(
            np.concatenate([ends.begin, ends.end, 0.5 * (ends.begin + ends.end)]), return_inverse=True
        )
        here = pairs.placed(tau)
        k, m, n = back.reshape(3, -1)
        way = pairs.travel(ends.pair, here, k, here, m)
        # no distance goes through 0 on such a way
        sure = (ends.first * ends.last > 0.0) & (np.abs(ends.first + ends.last) > way)
        whole.append(ends.some(sure))
        ends, k, m, n, way = ends.some(~sure), k[~sure], m[~sure], n[~sure], way[~sure]
        if not len(ends):
            break
        value = pairs.at(ends.pair, here, n)
        a, b = ends.first, ends.last
        bend = np.abs(a - 2.0 * value + b)
        crossed: BoolArray = (a < -touch) ^ (b < -touch)
        same: BoolArray = ~crossed & ~((a < -touch) ^ (value < -touch))
        least = np.abs(np.stack([a, value, b])).min(axis=0)
        fine = pairs.exact[ends.pair] | (way <= pairs.spacing[ends.pair])
        quiet = (np.abs(np.stack([a, value, b])).max(axis=0) <= touch) & (bend <= touch)
        still = (least > bend) | quiet | (way <= touch)
        done = same & still & fine
        once = crossed & (bend < 0.3 * np.abs(b - a)) & fine
        if level == HALVINGS - 1:
            done, once = same, crossed
        middle = here.tau[n]
        halves = [
            _Ends(ends.pair, ends.begin, middle, a, value),
            _Ends(ends.pair, middle, ends.end, value, b),
        ]
        whole += [half.some(done) for half in halves]
        roots.append(ends.some(once))
        going = ~(done | once)
        ends = _joined([half.some(np.nonzero(going)[0]) for half in halves])
    return _joined(whole), _joined(roots)


def _joined(parts: list[_Ends]) -> _Ends:
    if not parts:
        return _Ends(np.zeros(0, dtype=np.int64), *(np.zeros(0) for _ in range(4)))
    names = ("pair", "begin", "end", "first", "last")
    return _Ends(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _roots(pairs: GapPairs, ends: _Ends) -> FloatArray:
    """When the distance is 0 in each interval: false position (Illinois), kept between the ends."""
    a, b, fa, fb = ends.begin.copy(), ends.end.copy(), ends.first.copy(), ends.last.copy()
    root = np.where(np.abs(fa) < np.abs(fb), a, b)
    alive = np.asarray((fa * fb < 0.0), dtype=np.bool_)
    side = np.zeros(len(a))
    for step in range(ROOT_STEPS):
        alive &= b - a > INSTANT_ROUNDS * np.maximum(1.0, np.abs(b))
        if not alive.any():
            break
        some = np.nonzero(alive)[0]
        with np.errstate(all="ignore"):
            guess = b[some] - fb[some] * (b[some] - a[some]) / (fb[some] - fa[some])
        guess = guess if step < FALSE_POSITIONS and step % 4 != 3 else 0.5 * (a[some] + b[some])
        guess = np.where((guess > a[some]) & (guess < b[some]), guess, 0.5 * (a[some] + b[some]))
        value = _exactly(pairs, ends.pair[some], guess)
        root[some] = guess
        left = (value > 0.0) == (ends.first[some] > 0.0)
        a[some], b[some] = np.where(left, guess, a[some]), np.where(left, b[some], guess)
        half = np.where(left & (side[some] > 0.0), 0.5, 1.0)
        other = np.where(~left & (side[some] < 0.0), 0.5, 1.0)
        fb[some], fa[some] = np.where(left, fb[some] * half, value), np.where(left, value, fa[some] * other)
        side[some] = np.where(left, 1.0, -1.0)
        alive[some[np.abs(value) <= GAP_CLOSED * pairs.motion.size]] = False
    return root


def _exactly(pairs: GapPairs, pair: IntArray, tau: FloatArray) -> FloatArray:
    """(K,): distances of the outlines themselves at offsets."""
    instants, when = np.unique(tau, return_inverse=True)
    placed = pairs.placed(instants)
    found = pairs.at(pair, placed, when)
    for number in np.unique(pair[~pairs.exact[pair]]).tolist():
        own = np.nonzero((pair == number) & (np.abs(found) <= CURVED * pairs.size[pair]))[0]
        if len(own):
            pose = placed.pose(pairs.one[number], pairs.other[number], when[own])
            found[own] = pairs.outlines(number, pose, found[own])
    return found


CURVED = 0.05
"""Of the smaller one's size: distances that are less are those of the curves themselves."""


def _deepest(
    pairs: GapPairs, stretches: list[tuple[int, float, float]], known: _Ends
) -> tuple[FloatArray, list[float]]:
    """When the things of each stretch (pair, from, to) are nearest or overlap most, and by how much."""
    if not stretches:
        return np.zeros(0), []
    low, high = (np.array([each[k] for each in stretches]) for k in (1, 2))
    number = np.array([each[0] for each in stretches], dtype=np.int64)
    best = _seeds(known, number, low, high)
    found = np.full(len(stretches), np.inf)
    alive = np.arange(len(stretches))
    parts = np.linspace(0.0, 1.0, LOOKS + 2)
    vertex = best.copy()
    for step in range(ZOOMS):
        wide = high[alive] - low[alive]
        if step % 2:  # beside where a parabola has its vertex
            times = vertex[alive, None] + wide[:, None] * BESIDE
        else:
            times = low[alive, None] + wide[:, None] * parts
        times = np.concatenate([times, best[alive, None], low[alive, None], high[alive, None]], axis=1)
        times = np.sort(np.clip(times, low[alive, None], high[alive, None]), axis=1)
        tau, back = np.unique(times, return_inverse=True)
        pair = np.repeat(number[alive], times.shape[1])
        value = pairs.at(pair, pairs.placed(tau), back.ravel()).reshape(times.shape)
        k, rows, last = np.argmin(value, axis=1), np.arange(len(times)), times.shape[1] - 1
        best[alive], found[alive] = times[rows, k], value[rows, k]
        before = np.maximum((times < best[alive, None]).sum(axis=1) - 1, 0)
        after = np.minimum(last + 1 - (times > best[alive, None]).sum(axis=1), last)
        low[alive], high[alive] = times[rows, before], times[rows, after]
        a, b = best[alive] - low[alive], high[alive] - best[alive]
        rise, fall = value[rows, before] - value[rows, k], value[rows, after] - value[rows, k]
        with np.errstate(all="ignore"):
            moved = 0.5 * (rise * b * b - fall * a * a) / (rise * b + fall * a)
        vertex[alive] = best[alive] + np.where(np.isfinite(moved), moved, 0.0)
        flat = np.maximum(rise, fall) <= GAP_FLAT * pairs.motion.size
        alive = alive[~flat & (pairs.exact[number[alive]] | (step < ROUGH_ZOOMS))]
        if not len(alive):
            break
    deep = (-found).tolist()
    if pairs.below == 0.0:
        for k in np.nonzero(~pairs.exact[number])[0].tolist():
            pose = pairs.placed(best[k : k + 1]).pose(pairs.one[number[k]], pairs.other[number[k]], np.zeros(1, int))
            deep[k] = pairs.depth(int(number[k]), pose[:, 0])
    return best, deep


def _seeds(known: _Ends, number: IntArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Where pairs are nearest at instants that have been looked at; the times before and after become ``low`` and
    ``high``.
    """
    first, stop = (np.searchsorted(known.pair, number, side=side) for side in ("left", "right"))
    best = 0.5 * (low + high)
    for k in range(len(number)):
        own = slice(first[k], stop[k])
        tau = np.concatenate([known.begin[own], known.end[own]])
        value = np.concatenate([known.first[own], known.last[own]])
        inside = (tau >= low[k]) & (tau <= high[k])
        if inside.any():
            tau, value = tau[inside], value[inside]
            best[k] = tau[np.argmin(value)]
            low[k] = max(low[k], tau[tau < best[k]].max(initial=low[k]))
            high[k] = min(high[k], tau[tau > best[k]].min(initial=high[k]))
    return best
