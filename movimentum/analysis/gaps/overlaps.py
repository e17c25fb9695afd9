"""When pairs of things overlap, found on the continuous motion, without regard to frames.

Between two instants no distance changes by more than the things move, so most intervals need no further look. Others
are halved until a distance bends too little to hide a root. Roots are then found to the last digits of the time.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from movimentum.analysis.gaps.bodies import allowed_overlaps, bodies_of
from movimentum.analysis.gaps.overlap_depths import deepest_overlaps
from movimentum.analysis.gaps.pair_distances import CURVE_DISTANCE, LONGER_WAY, GapIntervals, GapPairs
from movimentum.analysis.gaps.tracks import Tracks
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.cancellation import look
from movimentum.records import dataclass, replace
from movimentum.solver.basis.instants import distinct
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import GAP_CLOSED, GAP_TOUCHES, INSTANT_ROUNDS, OVERLAP_REPORTED

HALVINGS = 14
ROOT_STEPS, FALSE_POSITIONS = 64, 20
WIDENINGS = 6
"""How often an interval with a root is made wider, in which the curves have none."""


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
        free = allowed_overlaps(motion.timeline.scene, segment, bodies, poses, all_layers=all_layers)
        one, other = np.nonzero(~np.triu(np.ones_like(free)) & ~free)
        one, other = other, one  # the one that is defined first
        pairs = GapPairs(Tracks(motion, place, bodies, tau), np.stack([one, other]))
        for pair, overlap in _in_piece(pairs, float(segment.start)):
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
                kinks = [track.kinks for track in piece.tracks if isinstance(track, NodeTrack)]
                inner = np.concatenate([piece.nodes, *kinks])
                inner = inner[(inner > piece.begin) & (inner < end)]
                yield place, distinct(np.concatenate([[piece.begin, end], inner]))


def _in_piece(pairs: GapPairs, start: float) -> Iterator[tuple[tuple[int, int], Overlap]]:
    tau = pairs.tracks.nodes
    near = _near(pairs)
    if not len(near):
        return
    touch = GAP_TOUCHES * pairs.scale
    if len(tau) == 1:
        seen = pairs.at(near, pairs.at_nodes(near, np.zeros_like(near)))
        under = seen < -touch
        only = np.full(int(under.sum()), tau[0])
        halves, roots = GapIntervals(near[under], only, only, seen[under], seen[under]), GapIntervals.joined([])
    else:
        halves, roots = _settled(pairs, _close(pairs, near))
    times = _roots(pairs, roots)
    intervals: list[tuple[int, float, float]] = []
    order = np.argsort(halves.pair, kind="stable")
    halves = halves.some(order)
    for number in distinct(np.concatenate([halves.pair[halves.first < -touch], roots.pair])).tolist():
        mine = roots.pair == number
        leaves = (roots.last > roots.first)[mine]
        edges = sorted(zip(times[mine].tolist(), leaves.tolist(), strict=True))
        if not edges or edges[0][1]:
            edges.insert(0, (float(tau[0]), False))
        if not edges[-1][1]:
            edges.append((float(tau[-1]), True))
        intervals += [(number, a, b) for (a, _), (b, _) in zip(edges[::2], edges[1::2], strict=False)]
    when, deep = deepest_overlaps(pairs, intervals, halves)
    overlapping = deep > touch  # others only touch: a distance that stays at 0 changes its sign by rounding
    owner = np.array([each[0] for each in intervals], dtype=np.int64)
    overlapping[overlapping] = ~_only_facets(pairs, owner[overlapping], when[overlapping], deep[overlapping])
    for k in np.nonzero(overlapping)[0].tolist():
        (number, a, b), time, depth = intervals[k], float(when[k]), float(deep[k])
        one, other = int(pairs.one[number]), int(pairs.other[number])
        names = pairs.bodies[one].thing.name, pairs.bodies[other].thing.name
        yield (one, other), Overlap(names, start + a, start + b, depth, start + time)


def _near(pairs: GapPairs) -> IntArray:
    """The pairs whose boxes over the whole piece meet."""
    at = pairs.tracks.at
    wide = pairs.far[:, None] + OVERLAP_REPORTED * pairs.scale
    step = np.hypot(*np.moveaxis(np.diff(at, axis=1), -1, 0)).max(axis=1, initial=0.0)[:, None]
    low, high = at.min(axis=1) - wide - 0.1 * step, at.max(axis=1) + wide + 0.1 * step
    a, b = pairs.one, pairs.other
    return np.nonzero(((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1))[0]


def _close(pairs: GapPairs, near: IntArray) -> GapIntervals:
    """The intervals of the grid in which pairs could touch, as far as circles about them and convex covers tell."""
    at, nodes = pairs.tracks.at, pairs.tracks.nodes
    found: list[tuple[IntArray, IntArray]] = []
    rows = max(1, 2_000_000 // len(nodes))
    for begin in range(0, len(near), rows):
        some = near[begin : begin + rows]
        a, b = pairs.one[some], pairs.other[some]
        apart = at[b] - at[a]
        free = np.hypot(apart[..., 0], apart[..., 1]) - (pairs.far[a] + pairs.far[b])[:, None]
        moved = np.diff(apart, axis=1)
        way = LONGER_WAY * np.hypot(moved[..., 0], moved[..., 1])
        row, k = np.nonzero(free[:, :-1] + free[:, 1:] <= way)
        found.append((some[row], k))
    pair, k = (np.concatenate(each) for each in zip(*found, strict=True))
    # each pair at each node once
    keys = np.concatenate([pair * len(nodes) + k, pair * len(nodes) + k + 1])
    known = distinct(keys)
    index = np.searchsorted(known, keys).reshape(2, -1)
    owner = known // len(nodes)
    placed = pairs.at_nodes(owner, known % len(nodes))
    free = np.maximum(pairs.covers(owner, placed), pairs.holes(owner, placed))
    way = pairs.travel(pair, placed.some(index[0]), placed.some(index[1]))
    keep = free[index[0]] + free[index[1]] <= way
    pair, k, index = pair[keep], k[keep], index[:, keep]
    needed = distinct(index)
    value = np.zeros(len(known))
    value[needed] = pairs.at(owner[needed], placed.some(needed))
    if len(pair):
        pairs.tracks.follow(distinct(k), distinct(np.concatenate([pairs.one[pair], pairs.other[pair]])))
    return GapIntervals(pair, nodes[k], nodes[k + 1], value[index[0]], value[index[1]])


def _settled(pairs: GapPairs, ends: GapIntervals) -> tuple[GapIntervals, GapIntervals]:
    """Intervals in which distances keep their sign, and those that have one root."""
    touch = GAP_TOUCHES * pairs.scale
    whole: list[GapIntervals] = []
    roots: list[GapIntervals] = []
    for level in range(HALVINGS):
        if not len(ends):
            break
        way = pairs.travel(ends.pair, pairs.placed(ends.pair, ends.begin), pairs.placed(ends.pair, ends.end))
        # no distance goes through 0 on such a way
        sure = (ends.first * ends.last > 0.0) & (np.abs(ends.first + ends.last) > way)
        whole.append(ends.some(sure))
        ends, way = ends.some(~sure), way[~sure]
        if not len(ends):
            break
        middle = 0.5 * (ends.begin + ends.end)
        value = pairs.at(ends.pair, pairs.placed(ends.pair, middle))
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
        halves = [
            GapIntervals(ends.pair, ends.begin, middle, a, value),
            GapIntervals(ends.pair, middle, ends.end, value, b),
        ]
        whole += [half.some(done) for half in halves]
        roots.append(ends.some(once))
        going = ~(done | once)
        ends = GapIntervals.joined([half.some(going) for half in halves])
    return GapIntervals.joined(whole), GapIntervals.joined(roots)


def _roots(pairs: GapPairs, ends: GapIntervals) -> FloatArray:
    """When the distance is 0 in each interval: false position (Illinois), kept between the ends."""
    a, b, fa, fb = ends.begin.copy(), ends.end.copy(), ends.first.copy(), ends.last.copy()
    _widen(pairs, ends, a, fa, -1.0)
    _widen(pairs, ends, b, fb, 1.0)
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
        alive[some[np.abs(value) <= GAP_CLOSED * pairs.scale]] = False
    return root


def _widen(pairs: GapPairs, ends: GapIntervals, at: FloatArray, value: FloatArray, way: float) -> None:
    """Take the distances of the curves themselves at one end of each interval, and move that end on where it is not on
    the side of 0 on which the polygons are: the curves touch before or after.
    """
    rough = np.nonzero(~pairs.exact[ends.pair])[0]
    positive = value > 0.0
    for step in range(WIDENINGS):
        if not len(rough):
            return
        value[rough] = _exactly(pairs, ends.pair[rough], at[rough])
        rough = rough[(value[rough] > 0.0) != positive[rough]]
        wide = (ends.end - ends.begin)[rough] * 2.0**step
        first, last = pairs.tracks.nodes[0], pairs.tracks.nodes[-1]
        at[rough] = np.clip(at[rough] + way * wide, first, last)


def _exactly(pairs: GapPairs, pair: IntArray, tau: FloatArray) -> FloatArray:
    """(K,): distances of the outlines themselves at offsets."""
    return pairs.at(pair, pairs.placed(pair, tau), curves=True)


def _only_facets(pairs: GapPairs, pair: IntArray, tau: FloatArray, depth: FloatArray) -> BoolArray:
    """(K,): whether it is the polygons in place of curves that overlap, where they are deepest, and not the curves."""
    found = np.zeros(len(pair), dtype=np.bool_)
    some = np.nonzero(~pairs.exact[pair] & (depth <= CURVE_DISTANCE * pairs.size[pair]))[0]
    found[some] = _exactly(pairs, pair[some], tau[some]) >= -GAP_TOUCHES * pairs.scale
    return found
