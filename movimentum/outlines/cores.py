"""Convex outlines, and convex covers of others: many pairs at many poses at once.

A core is a convex polygon of few corners with a radius about it: a disc is a point with its radius, a bar a line with
half its width. Any other outline has a core that covers it: where the covers are apart, the outlines are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray, nexts
from movimentum.outlines.contour import Contour
from movimentum.outlines.facets import Facets
from movimentum.records import dataclass
from movimentum.tolerances import FACETS_TOUCH, LEAST_DIVISOR, OUTLINE_CLOSES, OUTLINE_SAMPLED

MOST_CORNERS = 12
"""Of a core; outlines with more have a cover of so many."""
PAIRS_AT_A_TIME = 100_000
"""Pairs of a corner and an edge that are compared at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Core:
    """``points`` (N, 2): counter-clockwise, those of a line there and back; ``reach``: everything within so much of
    them; ``exact``: it is the outline itself.
    """

    points: FloatArray
    reach: float
    exact: bool

    @property
    def middle(self) -> FloatArray:
        """(2,): where a circle about it may have its centre."""
        return (self.points.min(axis=0) + self.points.max(axis=0)) / 2.0

    @property
    def radius(self) -> float:
        """That of a circle about `middle` that contains it."""
        return float(np.hypot(*(self.points - self.middle).T).max()) + self.reach


def core_of(contour: Contour, facets: Facets, *, simple: bool = True) -> Core:
    """The core of an outline that is no hole, with the corners ``facets``; not ``simple``: these only contain it."""
    points = facets.points
    if facets.convex and len(points) <= MOST_CORNERS:
        return Core(points, contour.reach, contour.straight and simple)
    turns = np.arange(MOST_CORNERS) * (2.0 * np.pi / MOST_CORNERS)
    normals = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    far = (points @ normals.T).max(axis=0) + (0.0 if contour.straight else 2.0 * OUTLINE_SAMPLED * facets.size)
    beyond = np.roll(far, -1)
    sine, cosine = np.sin(turns[1]), np.cos(turns[1])
    along = (beyond - far * cosine) / sine  # from where a tangent touches its circle to the next one
    corners = far[:, None] * normals + along[:, None] * np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    return Core(corners, contour.reach, exact=False)


def padded_corners(cores: Sequence[Core]) -> FloatArray:
    """(K, N, 2): the corners of each, the last one again and again where others have more."""
    most = max(len(core.points) for core in cores)
    return np.stack([np.pad(core.points, ((0, most - len(core.points)), (0, 0)), mode="edge") for core in cores])


def signed_distances(p: FloatArray, q: FloatArray) -> FloatArray:
    """(K,): of convex p (K, N, 2) and q (K, M, 2), as `padded_corners` has them: negative by how far one must move to
    be free of the other.
    """
    found = np.empty(len(p))
    step = max(1, PAIRS_AT_A_TIME // (p.shape[1] * q.shape[1]))
    for begin in range(0, len(p), step):
        found[begin : begin + step] = _some_cores(p[begin : begin + step], q[begin : begin + step])
    return found


def _some_cores(p: FloatArray, q: FloatArray) -> FloatArray:
    depth = np.maximum(_edge_separation(p, q), _edge_separation(q, p))
    size = np.ptp(p, axis=1).max(axis=1) + np.ptp(q, axis=1).max(axis=1)
    apart = ~(depth < -FACETS_TOUCH * size)
    apart |= np.isneginf(depth)
    if apart.any():
        some, other = p[apart], q[apart]
        depth[apart] = np.sqrt(np.minimum(_squared(some, other), _squared(other, some)))
    return depth


def _edge_separation(p: FloatArray, q: FloatArray) -> FloatArray:
    """How far the best of the edges of p keeps q apart; -inf if it has none."""
    if p.shape[1] == 1:
        return np.full(len(p), -np.inf)
    e = nexts(p) - p
    size = np.hypot(e[..., 0], e[..., 1])
    some = np.maximum(size, LEAST_DIVISOR)
    nx, ny = e[..., 1] / some, -e[..., 0] / some
    far = nx[..., None] * q[:, None, :, 0] + ny[..., None] * q[:, None, :, 1]
    off = far.min(axis=2) - (nx * p[..., 0] + ny * p[..., 1])
    long = size > OUTLINE_CLOSES * size.max(axis=1)[:, None]  # else its direction is rounding
    return np.asarray(np.where(long, off, -np.inf).max(axis=1), dtype=np.float64)


def _squared(p: FloatArray, q: FloatArray) -> FloatArray:
    """(K,): the least squared distance of a corner of p from an edge of q."""
    e = nexts(q) - q
    size = np.maximum(np.sum(e * e, axis=2), LEAST_DIVISOR)
    wx, wy = (p[:, :, None, k] - q[:, None, :, k] for k in (0, 1))
    part = np.clip((wx * e[:, None, :, 0] + wy * e[:, None, :, 1]) / size[:, None], 0.0, 1.0)
    wx, wy = wx - part * e[:, None, :, 0], wy - part * e[:, None, :, 1]
    return np.asarray((wx * wx + wy * wy).min(axis=(1, 2)), dtype=np.float64)
