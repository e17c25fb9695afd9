"""Distances between many pairs of things, at many instants of one piece of a path at once."""

from __future__ import annotations

import numpy as np

from movimentum.analysis.gaps.bodies import GapBody
from movimentum.analysis.gaps.tracks import PairPoses, Tracks
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.outlines.cores import padded_corners, signed_distances
from movimentum.outlines.dense_polygons import DensePolygon, distances_and_places, exact_distances, overlap_depths
from movimentum.records import dataclass
from movimentum.solver.basis.instants import distinct


class GapPairs:
    """Pairs of bodies in one piece of a motion. ``one`` and ``other`` (P,): their numbers."""

    def __init__(self, tracks: Tracks, pairs: IntArray) -> None:
        self.tracks, self.bodies = tracks, tracks.bodies
        self.scale = tracks.motion.size
        self.one, self.other = pairs
        exact = np.array([body.core.exact for body in self.bodies])
        self.exact: BoolArray = exact[self.one] & exact[self.other]
        self.corners = padded_corners([body.core for body in self.bodies])
        self.reach = np.array([body.core.reach for body in self.bodies])
        # what is solid for certain: a disc in a gear, all of what is exact
        self.certain = np.array([body.core.reach if body.core.exact else body.solid or np.nan for body in self.bodies])
        self.hole = np.array([np.nan if body.hole is None else body.hole for body in self.bodies])
        self.far = tracks.far
        # a disc is the same however it is turned
        self.counts = np.array([len(body.core.points) for body in self.bodies])
        self.swings = np.where((self.counts == 1) & exact, 0.0, self.far)
        self.size = np.minimum(self.far[self.one], self.far[self.other])
        spacing = np.array([body.spacing for body in self.bodies])
        self.spacing = np.minimum(spacing[self.one], spacing[self.other])

    def placed(self, pair: IntArray, tau: FloatArray) -> PairPoses:
        """Where pairs (K,) are at offsets (K,)."""
        return self.tracks.poses(self.one[pair], self.other[pair], tau)

    def at_nodes(self, pair: IntArray, when: IntArray) -> PairPoses:
        """Where pairs (K,) are at nodes of the path, by their numbers."""
        return self.tracks.at_nodes(self.one[pair], self.other[pair], when)

    def travel(self, pair: IntArray, here: PairPoses, there: PairPoses) -> FloatArray:
        """(K,): by how much the distance of pairs may change from one pose to the other."""
        found = np.full(len(pair), np.inf)
        for one, other, b in ((0, 1, self.other[pair]), (1, 0, self.one[pair])):
            a = (self.one, self.other)[one][pair]
            ways: list[FloatArray] = []
            for placed in (here, there):
                c, s = placed.turn[one].T
                dx, dy = (placed.at[other] - placed.at[one]).T
                ways.append(np.stack([c * dx + s * dy, c * dy - s * dx]))
            around = there.angle[other] - here.angle[other]
            turned = around - (there.angle[one] - here.angle[one])
            # in the frame of one of them, the other's points go no farther
            found = np.minimum(found, LONGER_WAY * np.hypot(*(ways[1] - ways[0])) + self.swings[b] * np.abs(turned))
            still = self.swings[a] == 0.0  # a disc does not turn: only its centre moves
            apart = (there.at[other] - there.at[one]) - (here.at[other] - here.at[one])
            straight = LONGER_WAY * np.hypot(*apart.T) + self.swings[b] * np.abs(around)
            found = np.where(still, np.minimum(found, straight), found)
        return found

    def covers(self, pair: IntArray, placed: PairPoses) -> FloatArray:
        """(K,): distances of the covers; of exact ones those of the outlines."""
        return self._cores(pair, placed) - self.reach[self.one[pair]] - self.reach[self.other[pair]]

    def _cores(self, pair: IntArray, placed: PairPoses) -> FloatArray:
        one, other = self.one[pair], self.other[pair]
        found = np.empty(len(pair))
        kinds = self.counts[one] * (self.corners.shape[1] + 1) + self.counts[other]
        for kind in distinct(kinds).tolist():
            some = np.nonzero(kinds == kind)[0]
            n, m = divmod(kind, self.corners.shape[1] + 1)
            bodies = (one[some], n), (other[some], m)
            p, q = (self._world(placed, which, some, body, count) for which, (body, count) in enumerate(bodies))
            found[some] = signed_distances(p, q)
        return found

    def _world(self, placed: PairPoses, which: int, some: IntArray, body: IntArray, count: int) -> FloatArray:
        (c, s), (x, y) = placed.turn[which, some].T[:, :, None], placed.at[which, some].T[:, :, None]
        u, v = self.corners[body, :count, 0], self.corners[body, :count, 1]
        return np.stack([x + c * u - s * v, y + s * u + c * v], axis=-1)

    def holes(self, pair: IntArray, placed: PairPoses) -> FloatArray:
        """(K,): how far one is from the edge of a free disc of the other, that it is in; -inf where there is none."""
        one, other = self.one[pair], self.other[pair]
        apart = np.hypot(*(placed.at[0] - placed.at[1]).T)
        in_one, in_other = self.hole[one] - apart - self.far[other], self.hole[other] - apart - self.far[one]
        return np.fmax(np.fmax(in_one, in_other), -np.inf)

    def pair(self, number: int) -> tuple[GapBody, GapBody]:
        """The bodies of a pair."""
        return self.bodies[int(self.one[number])], self.bodies[int(self.other[number])]

    def at(self, pair: IntArray, placed: PairPoses, *, curves: bool = False) -> FloatArray:
        """(K,): how far apart pairs are; negative where they overlap. ``curves``: near 0 those of the curves themselves
        and not of the polygons that stand for them.
        """
        cores, one, other = self._cores(pair, placed), self.one[pair], self.other[pair]
        found = cores - self.reach[one] - self.reach[other]
        rough = ~self.exact[pair]
        if rough.any():
            found = np.where(rough, np.maximum(found, self.holes(pair, placed)), found)
            certain = cores - self.certain[one] - self.certain[other]
            inside = rough & (certain < 0.0)
            found[inside] = certain[inside]
            unsure = rough & placed.seen & ((found <= 0.0) & ~inside)
            if curves:
                unsure |= rough & placed.seen & (np.abs(found) <= CURVE_DISTANCE * self.size[pair])
            some = np.nonzero(unsure)[0]
            relative = placed.some(some).relative
            for number in distinct(pair[some]).tolist():
                own = pair[some] == number
                distances = self._outlines if curves else self._facets
                found[some[own]] = distances(number, relative[:, own])
        return np.where(placed.seen, found, UNSEEN_DISTANCE * self.size[pair])

    def _facets(self, number: int, pose: FloatArray) -> FloatArray:
        return self.fine(number, pose)[0]

    def fine(
        self, number: int, pose: FloatArray
    ) -> tuple[FloatArray, list[tuple[DensePolygon, DensePolygon]], FloatArray]:
        """(K,) distances by many corners for poses (4, K); which outlines decide, and at which places (2, K)."""
        one, other = self.pair(number)
        best = np.full(pose.shape[1], -np.inf)
        places = np.zeros((2, pose.shape[1]))
        which: list[tuple[DensePolygon, DensePolygon]] = [(one.fine[0], other.fine[0])] * pose.shape[1]
        for first, group in enumerate(_rings(one, other)):
            own, own_places, own_which = np.full(pose.shape[1], -np.inf), places, which
            for pair in group:
                value, u, v = distances_and_places(*pair, pose)
                better = value > own
                own, own_places = np.where(better, value, own), np.where(better, np.stack([u, v]), own_places)
                own_which = [pair if new else old for new, old in zip(better.tolist(), own_which, strict=True)]
            nearer = np.ones(len(own), dtype=np.bool_) if first == 0 else own < best
            best, places = np.where(nearer, own, best), np.where(nearer, own_places, places)
            which = [new if near else old for near, new, old in zip(nearer.tolist(), own_which, which, strict=True)]
        return best, which, places

    def _outlines(self, number: int, pose: FloatArray) -> FloatArray:
        """(K,): distances of the curves themselves where they are near 0."""
        rough, which, places = self.fine(number, pose)
        found = rough.copy()
        small = np.abs(rough) <= CURVE_DISTANCE * self.size[number]
        for pair in dict.fromkeys(which):
            curved = any(each.contour is not None and not each.contour.straight for each in pair)
            own = small & np.array([each is pair for each in which])
            if curved and own.any():
                exact = exact_distances(*pair, pose[:, own], *places[:, own])
                near = np.abs(exact - rough[own]) <= POLYGON_ERROR * self.size[number]
                found[own] = np.where(near, exact, rough[own])
        return found

    def depths(self, pair: IntArray, tau: FloatArray, *, whole: bool = False) -> FloatArray:
        """(K,): how far one must move to be free of the other, at offsets (K,); 0 or less where they are apart.
        ``whole``: as of `dense_polygons.overlap_depths`.
        """
        placed = self.placed(pair, tau)
        reach = self.reach[self.one[pair]] + self.reach[self.other[pair]]
        found = reach - self._cores(pair, placed)
        rough = np.nonzero(~self.exact[pair])[0]
        relative = placed.some(rough).relative
        for number in distinct(pair[rough]).tolist():
            own = pair[rough] == number
            found[rough[own]] = self._depths(number, relative[:, own], whole)
        return np.where(placed.seen, found, -UNSEEN_DISTANCE * self.size[pair])

    def _depths(self, number: int, pose: FloatArray, whole: bool) -> FloatArray:
        """The same of one pair for poses (4, K); gears that reach beyond their teeth count as the circle about them."""
        one, other = self.pair(number)
        if one.single and other.single and (one.teeth > 1 or other.teeth > 1):
            filled = [own.filled if own.teeth > 1 else own.fine[0] for own in (one, other)]
            found = overlap_depths(filled[0], filled[1], pose)
            height = max(own.core.reach - own.solid for own in (one, other) if own.teeth > 1)
            toothed = (found <= height) & ((one.teeth == 1) | (other.teeth == 1))
            if toothed.any():
                found[toothed] = overlap_depths(one.fine[0], other.fine[0], pose[:, toothed])
            return found
        groups = _rings(one, other)
        return np.max(
            [np.min([overlap_depths(*pair, pose, whole=whole) for pair in group], axis=0) for group in groups], axis=0
        )


@dataclass(frozen=True, slots=True, eq=False)
class GapIntervals:
    """K intervals of ``pair``s: their ends, and the distances there."""

    pair: IntArray
    begin: FloatArray
    end: FloatArray
    first: FloatArray
    last: FloatArray

    def some(self, which: BoolArray | IntArray) -> GapIntervals:
        """Those of ``which``."""
        return GapIntervals(self.pair[which], self.begin[which], self.end[which], self.first[which], self.last[which])

    @staticmethod
    def joined(parts: list[GapIntervals]) -> GapIntervals:
        """All of them as one."""
        if not parts:
            return GapIntervals(np.zeros(0, dtype=np.int64), *(np.zeros(0) for _ in range(4)))
        names = ("pair", "begin", "end", "first", "last")
        return GapIntervals(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def __len__(self) -> int:
        return len(self.pair)


LONGER_WAY = 1.05
"""How much longer a way is than the straight line between its ends, at most, in an interval of the path's own grid."""
UNSEEN_DISTANCE = 2.0
"""Of the smaller one's size: how far apart things count as that are not both seen."""
CURVE_DISTANCE = 0.05
"""Of the smaller one's size: distances that are less are those of the curves themselves."""
POLYGON_ERROR = 0.02
"""Of the smaller one's size: how far curves may be from the polygons that stand for them."""


def _rings(one: GapBody, other: GapBody) -> list[list[tuple[DensePolygon, DensePolygon]]]:
    """The outlines that are compared, for each two connected pieces; of a hole what is outside is solid, and two holes
    are not.
    """
    both = ((p, q) for p in one.pieces for q in other.pieces)
    return [[(a, b) for a in p for b in q if not (a.facets.hollow and b.facets.hollow)] for p, q in both]
