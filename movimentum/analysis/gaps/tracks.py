"""Positions of bodies at any instants of one piece of a path, from polynomials through a few of its poses.

A path is smooth between its nodes, so a few poses give all others to rounding, with far less work than solving each
one. Where the path is not smooth (a kink, a thing that appears), poses are solved.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.analysis.gaps.bodies import GapBody
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.records import dataclass
from movimentum.solver.basis.instants import distinct
from movimentum.solver.motion import PathMotion
from movimentum.tolerances import TRACK_FOLLOWS, TRACK_NOISE

DEGREE = 8
"""Of the polynomials."""
LEAST_IMPROVEMENT = 0.2
"""Of how far off a polynomial is: two for its halves that are no nearer are off by noise."""
LEVELS = 5
"""How often intervals are halved in which they do not follow."""
_LOBATTO = -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
_TO_COEFFICIENTS = np.linalg.inv(np.cos(np.outer(np.arccos(_LOBATTO), np.arange(DEGREE + 1))))
_PROBES = np.array([-0.62, 0.31])
"""Where it is looked whether they follow, between -1 and 1."""


@dataclass(frozen=True, slots=True, eq=False)
class PairPoses:
    """Where both bodies of K pairs are: ``at`` (2, K, 2), ``turn`` (2, K, 2) cosine and sine, ``angle`` (2, K) in
    radians, ``seen`` (K,): both are.
    """

    at: FloatArray
    turn: FloatArray
    angle: FloatArray
    seen: BoolArray

    def some(self, which: BoolArray | IntArray) -> PairPoses:
        """Those of ``which``."""
        return PairPoses(self.at[:, which], self.turn[:, which], self.angle[:, which], self.seen[which])

    @property
    def relative(self) -> FloatArray:
        """(4, K): how the second body is placed in the frame of the first."""
        c, s = self.turn[0].T
        dx, dy = (self.at[1] - self.at[0]).T
        oc, os_ = self.turn[1].T
        return np.stack([c * dx + s * dy, c * dy - s * dx, c * oc + s * os_, c * os_ - s * oc])


class Tracks:
    """Of ``bodies`` in the piece ``place`` of a motion, from the first to the last of its ``nodes`` (T,). ``at``
    (N, T, 2): where they are at these.
    """

    def __init__(self, motion: PathMotion, place: int, bodies: Sequence[GapBody], nodes: FloatArray) -> None:
        self.motion, self.place, self.bodies, self.nodes = motion, place, bodies, nodes
        self.numbers = [body.thing.number for body in bodies]
        self.far = np.array([body.far for body in bodies])
        self.at, self._turn, self._angle, self._seen = self._solved(nodes)
        self._row = np.zeros(len(bodies), dtype=np.int64)
        self._begin = self._end = nodes[:1]
        self._smooth = np.zeros(1, dtype=np.bool_)
        self._first, self._coefficients = np.zeros((1, 1, 6)), np.zeros((1, 1, DEGREE + 1, 3))

    def _solved(self, tau: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
        poses = self.motion.poses_in(self.place, tau)
        at = np.stack([body.world(poses) for body in self.bodies])
        turn, angle = np.ascontiguousarray(poses.direction[self.numbers]), np.radians(poses.angle[self.numbers])
        return at, turn, angle, poses.visible[self.numbers] & poses.solved

    def at_nodes(self, one: IntArray, other: IntArray, when: IntArray) -> PairPoses:
        """Pairs at nodes number ``when`` (K,)."""
        both = np.stack([one, other])
        seen = np.asarray(self._seen[both, when].all(axis=0), dtype=np.bool_)
        return PairPoses(self.at[both, when], self._turn[both, when], self._angle[both, when], seen)

    def follow(self, intervals: IntArray, some: IntArray) -> None:
        """Make ready to tell where the bodies ``some`` are in intervals between two nodes, by their numbers."""
        self._row[some] = np.arange(len(some))
        begin, end = self.nodes[intervals], self.nodes[intervals + 1]
        before = np.full(len(begin), np.inf)
        cells: list[tuple[FloatArray, ...]] = []
        for level in range(LEVELS + 1):
            wide, count = end - begin, len(begin)
            parts = 0.5 + 0.5 * np.concatenate([_LOBATTO, _PROBES])
            times = np.minimum(begin[:, None] + wide[:, None] * parts, end[:, None])
            tau = distinct(times)
            index = np.searchsorted(tau, times)
            at, turn, angle, seen = (each[some] for each in self._solved(tau))
            values = np.concatenate([at, angle[..., None]], axis=2)[:, index]  # (N, C, D + 3, 3)
            off = values - values[:, :, :1]
            coefficients = np.einsum("kd,ncdx->cnkx", _TO_COEFFICIENTS, off[:, :, : DEGREE + 1])
            missed = np.abs(np.einsum("pk,cnkx->ncpx", _chebyshev(_PROBES), coefficients) - off[:, :, DEGREE + 1 :])
            missed[..., 2] *= self.far[some][:, None, None]
            worst = missed.max(axis=(0, 2, 3), initial=0.0) / self.motion.size
            shown = seen[:, index]
            same = (shown == shown[:, :, :1]).all(axis=(0, 2))
            # a kink is in one half only
            halves = np.tile(worst.reshape(2, -1).min(axis=0), 2) if level else worst
            noise = (worst <= TRACK_NOISE) & (halves > LEAST_IMPROVEMENT * before)
            smooth = same & ((worst <= TRACK_FOLLOWS) | noise)
            kept: BoolArray = smooth if level < LEVELS else np.ones(count, dtype=np.bool_)
            first = np.moveaxis(np.concatenate([values[:, :, 0], turn[:, index[:, 0]], shown[:, :, :1]], axis=2), 0, 1)
            cells.append((begin[kept], end[kept], smooth[kept], coefficients[kept], first[kept]))
            begin, end, before = begin[~kept], end[~kept], np.tile(worst[~kept], 2)
            middle = 0.5 * (begin + end)
            begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
            if not len(begin):
                break
        joined = [np.concatenate(each) for each in zip(*cells, strict=True)]
        order = np.argsort(joined[0], kind="stable")
        self._begin, self._end, smooth, self._coefficients, self._first = (each[order] for each in joined)
        self._smooth = smooth.astype(np.bool_)

    def poses(self, one: IntArray, other: IntArray, tau: FloatArray) -> PairPoses:
        """Pairs (K,) at offsets ``tau`` (K,) that lie in what is followed."""
        cell = np.maximum(np.searchsorted(self._begin, tau, side="right") - 1, 0)
        count = len(tau)
        found = PairPoses(
            np.empty((2, count, 2)), np.empty((2, count, 2)), np.empty((2, count)), np.ones(count, dtype=np.bool_)
        )
        smooth = self._smooth[cell] & (tau <= self._end[cell])
        some = np.nonzero(smooth)[0]
        within = cell[some]
        begin, end = self._begin[within], self._end[within]
        weights = _chebyshev((2.0 * tau[some] - begin - end) / (end - begin))
        for which, body in enumerate((one, other)):
            row = self._row[body[some]]
            first = self._first[within, row]
            off = np.einsum("kd,kdx->kx", weights, self._coefficients[within, row])
            c, s = np.cos(off[:, 2]), np.sin(off[:, 2])
            found.at[which, some] = first[:, :2] + off[:, :2]
            found.angle[which, some] = first[:, 2] + off[:, 2]
            u, v = first[:, 3], first[:, 4]
            found.turn[which, some] = np.stack([c * u - s * v, s * u + c * v], axis=-1)
            found.seen[some] &= first[:, 5] > 0.0
        rest = np.nonzero(~smooth)[0]
        if len(rest):
            instants = distinct(tau[rest])
            when, both = np.searchsorted(instants, tau[rest]), np.stack([one[rest], other[rest]])
            at, turn, angle, seen = self._solved(instants)
            found.at[:, rest], found.turn[:, rest] = at[both, when], turn[both, when]
            found.angle[:, rest], found.seen[rest] = angle[both, when], seen[both, when].all(axis=0)
        return found


def _chebyshev(u: FloatArray) -> FloatArray:
    """(K, DEGREE + 1): the polynomials of Chebyshev at u (K,)."""
    found = [np.ones_like(u), u]
    for _ in range(DEGREE - 1):
        found.append(2.0 * u * found[-1] - found[-2])
    return np.stack(found, axis=-1)
