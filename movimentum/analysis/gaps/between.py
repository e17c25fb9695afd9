"""How far pairs of things are apart at instants of one piece of a path: many pairs and many instants at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.analysis.gaps.bodies import GapBody
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.outlines.cores import padded, signed_distances
from movimentum.outlines.fine import Fine, depth, touching, values
from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses


@dataclass(frozen=True, slots=True, eq=False)
class GapPoses:
    """Where bodies are at T instants ``tau``: ``at`` (N, T, 2), ``turn`` (N, T, 2) cosine and sine, ``angle`` (N, T) in
    radians, ``seen`` (N, T).
    """

    tau: FloatArray
    at: FloatArray
    turn: FloatArray
    angle: FloatArray
    seen: BoolArray

    def pose(self, one: int, other: int, when: IntArray) -> FloatArray:
        """(4, K): how the second body is placed in the frame of the first at instants number ``when``."""
        c, s = self.turn[one, when].T
        dx, dy = (self.at[other, when] - self.at[one, when]).T
        oc, os_ = self.turn[other, when].T
        return np.stack([c * dx + s * dy, c * dy - s * dx, c * oc + s * os_, c * os_ - s * oc])


class GapPairs:
    """Pairs of bodies in piece ``place`` of a motion. ``one`` and ``other`` (P,): their numbers; ``below``: what the
    distance is compared with.
    """

    def __init__(
        self, motion: PathMotion, place: int, bodies: Sequence[GapBody], pairs: IntArray, below: float = 0.0
    ) -> None:
        self.motion, self.place, self.bodies, self.below = motion, place, bodies, below
        self.one, self.other = pairs
        exact = np.array([body.core.exact for body in bodies])
        self.exact: BoolArray = exact[self.one] & exact[self.other]
        self.corners = padded([body.core for body in bodies])
        self.reach = np.array([body.core.reach for body in bodies])
        # what is solid for certain: a disc in a gear, all of what is exact
        self.certain = np.array([body.core.reach if body.core.exact else body.solid or np.nan for body in bodies])
        self.far = np.array([np.hypot(*body.core.points.T).max() + body.core.reach for body in bodies])
        # a disc is the same however it is turned
        self.counts = np.array([len(body.core.points) for body in bodies])
        self.swings = np.where((self.counts == 1) & exact, 0.0, self.far)
        self.size = np.minimum(self.far[self.one], self.far[self.other])
        spacing = np.array([body.spacing for body in bodies])
        self.spacing = np.minimum(spacing[self.one], spacing[self.other])

    def placed(self, tau: FloatArray) -> GapPoses:
        """Where bodies are at ascending offsets."""
        return placed_in(self.bodies, self.motion.poses_in(self.place, tau), tau)

    def travel(self, pair: IntArray, here: GapPoses, k: IntArray, there: GapPoses, m: IntArray) -> FloatArray:
        """(K,): by how much the distance of pairs may change from instants k of ``here`` to m of ``there``."""
        found = np.full(len(pair), np.inf)
        for a, b in ((self.one[pair], self.other[pair]), (self.other[pair], self.one[pair])):
            ways: list[FloatArray] = []
            for placed, n in ((here, k), (there, m)):
                c, s = placed.turn[a, n].T
                dx, dy = (placed.at[b, n] - placed.at[a, n]).T
                ways.append(np.stack([c * dx + s * dy, c * dy - s * dx]))
            turned = (there.angle[b, m] - there.angle[a, m]) - (here.angle[b, k] - here.angle[a, k])
            # in the frame of one of them, the other's points go no farther
            found = np.minimum(found, LONGER_WAY * np.hypot(*(ways[1] - ways[0])) + self.swings[b] * np.abs(turned))
            still = self.swings[a] == 0.0  # a disc does not turn: only its centre moves
            apart = (there.at[b, m] - there.at[a, m]) - (here.at[b, k] - here.at[a, k])
            around = self.swings[b] * np.abs(there.angle[b, m] - here.angle[b, k])
            found = np.where(still, np.minimum(found, LONGER_WAY * np.hypot(*apart.T) + around), found)
        return found

    def covers(self, pair: IntArray, placed: GapPoses, when: IntArray) -> FloatArray:
        """(K,): distances of the covers; of exact ones those of the outlines."""
        return self._cores(pair, placed, when) - self.reach[self.one[pair]] - self.reach[self.other[pair]]

    def _cores(self, pair: IntArray, placed: GapPoses, when: IntArray) -> FloatArray:
        one, other = self.one[pair], self.other[pair]
        found = np.empty(len(pair))
        kinds = self.counts[one] * (self.corners.shape[1] + 1) + self.counts[other]
        for kind in np.unique(kinds).tolist():
            some = np.nonzero(kinds == kind)[0]
            n, m = divmod(kind, self.corners.shape[1] + 1)
            a, b, k = one[some], other[some], when[some]
            p, q = (self._world(placed, own, count, k) for own, count in ((a, n), (b, m)))
            found[some] = signed_distances(p, q)
        return found

    def _world(self, placed: GapPoses, body: IntArray, count: int, when: IntArray) -> FloatArray:
        (c, s), (x, y) = placed.turn[body, when].T[:, :, None], placed.at[body, when].T[:, :, None]
        u, v = self.corners[body, :count, 0], self.corners[body, :count, 1]
        return np.stack([x + c * u - s * v, y + s * u + c * v], axis=-1)

    def holes(self, pair: IntArray, placed: GapPoses, when: IntArray) -> FloatArray:
        """(K,): how far one is from the edge of a free disc of the other, that it is in; -inf where there is none."""
        found = np.full(len(pair), -np.inf)
        hole = np.array([np.nan if body.hole is None else body.hole for body in self.bodies])
        if np.isnan(hole).all():
            return found
        one, other = self.one[pair], self.other[pair]
        apart = np.hypot(*(placed.at[one, when] - placed.at[other, when]).T)
        for a, b in ((one, other), (other, one)):
            found = np.fmax(found, hole[a] - apart - self.far[b])
        return found

    def pair(self, number: int) -> tuple[GapBody, GapBody]:
        """The bodies of a pair."""
        return self.bodies[int(self.one[number])], self.bodies[int(self.other[number])]

    def at(self, pair: IntArray, placed: GapPoses, when: IntArray) -> FloatArray:
        """(K,): how much farther apart than ``below`` pairs are; less than 0 where they are nearer."""
        cores, one, other = self._cores(pair, placed, when), self.one[pair], self.other[pair]
        found = cores - self.reach[one] - self.reach[other]
        rough = ~self.exact[pair]
        if rough.any():
            found = np.maximum(found, self.holes(pair, placed, when))
            certain = cores - self.certain[one] - self.certain[other]
            inside = rough & (certain < self.below)
            found[inside] = certain[inside]
            some = np.nonzero(rough & ~inside & (found <= self.below))[0]
            for number in np.unique(pair[some]).tolist():
                own = some[pair[some] == number]
                found[own] = self.fine(number, placed.pose(self.one[number], self.other[number], when[own]))[0]
        unseen = ~(placed.seen[self.one[pair], when] & placed.seen[self.other[pair], when])
        return np.where(unseen, UNSEEN * self.size[pair], found - self.below)

    def fine(self, number: int, pose: FloatArray) -> tuple[FloatArray, list[tuple[Fine, Fine]], FloatArray]:
        """(K,) distances by many corners for poses (4, K); which outlines decide, and at which places (2, K)."""
        one, other = self.pair(number)
        best = np.full(pose.shape[1], -np.inf)
        places = np.zeros((2, pose.shape[1]))
        which: list[tuple[Fine, Fine]] = [(one.fine[0], other.fine[0])] * pose.shape[1]
        for first, group in enumerate(_rings(one, other)):
            own, own_places, own_which = np.full(pose.shape[1], -np.inf), places, which
            for pair in group:
                value, u, v = values(*pair, pose)
                better = value > own
                own, own_places = np.where(better, value, own), np.where(better, np.stack([u, v]), own_places)
                own_which = [pair if new else old for new, old in zip(better.tolist(), own_which, strict=True)]
            nearer = np.ones(len(own), dtype=np.bool_) if first == 0 else own < best
            best, places = np.where(nearer, own, best), np.where(nearer, own_places, places)
            which = [new if near else old for near, new, old in zip(nearer.tolist(), own_which, which, strict=True)]
        return best, which, places

    def outlines(self, number: int, pose: FloatArray, value: FloatArray) -> FloatArray:
        """(K,): distances of the curves themselves, where `fine` has found ``value`` for them."""
        rough, which, places = self.fine(number, pose)
        found = rough.copy()
        for pair in dict.fromkeys(which):
            curved = any(each.contour is not None and not each.contour.straight for each in pair)
            own = np.array([each is pair for each in which])
            if curved and own.any():
                exact = touching(*pair, pose[:, own], *places[:, own])
                near = np.abs(exact - rough[own]) <= NEAR_CURVES * self.size[number]
                found[own] = np.where(near, exact, rough[own])
        return found - self.below

    def depth(self, number: int, pose: FloatArray) -> float:
        """How far one must move to be free of the other, for one pose (4,); gears that reach beyond their teeth count
        with the circle about them.
        """
        one, other = self.pair(number)
        groups = _rings(one, other)
        if len(groups) == len(groups[0]) == 1 and (one.teeth > 1 or other.teeth > 1):
            whole = [own.filled if own.teeth > 1 else own.fine[0] for own in (one, other)]
            filled = depth(whole[0], whole[1], pose)
            height = max(own.core.reach - own.solid for own in (one, other) if own.teeth > 1)
            if filled > height or (one.teeth > 1 and other.teeth > 1):
                return filled
        return max(min(depth(*pair, pose) for pair in group) for group in groups)


LONGER_WAY = 1.05
"""How much longer a way is than the straight line between its ends, at most, in an interval of the path's own grid."""
UNSEEN = 2.0
"""Of the smaller one's size: how far apart things count as that are not both seen."""
NEAR_CURVES = 0.02
"""Of the smaller one's size: how far curves may be from the polygons that stand for them."""


def _rings(one: GapBody, other: GapBody) -> list[list[tuple[Fine, Fine]]]:
    """The outlines that are compared, for each two connected pieces; of a hole what is outside is solid, and two holes
    are not.
    """
    both = ((p, q) for p in one.pieces for q in other.pieces)
    return [[(a, b) for a in p for b in q if not (a.facets.hollow and b.facets.hollow)] for p, q in both]


def placed_in(bodies: Sequence[GapBody], poses: Poses, tau: FloatArray) -> GapPoses:
    """Where bodies are in poses at offsets ``tau``."""
    numbers = [body.thing.number for body in bodies]
    return GapPoses(
        tau,
        np.stack([body.world(poses) for body in bodies]),
        np.ascontiguousarray(poses.direction[numbers]),
        np.radians(poses.angle[numbers]),
        poses.visible[numbers] & poses.solved,
    )
