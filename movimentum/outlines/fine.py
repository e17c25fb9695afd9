"""Outlines as polygons of many corners, for distances of any two of them: the teeth of a gear, bent bars, holes.

Distances are those of the polygons; where outlines are curves these are off by what `samples` are. `touching` finds
the places of the curves themselves, from those of the polygons.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.outlines.contour import Contour
from movimentum.outlines.facets import Facets, deepest, inside, overlap, to_edges
from movimentum.outlines.search import refined
from movimentum.records import dataclass
from movimentum.tolerances import EDGES_CROSS, OUTLINE_SAMPLED

OF_TOOTH = 4
"""Corners of each piece of a tooth."""
SMALL = 4000
"""Pairs of corners and edges that are compared without leaving out any."""
SLACK = 0.25
"""Of the smaller one's size: what else is looked at."""
NEWTON = 6
"""Steps of Newton's method from places of polygons to those of curves."""


@dataclass(frozen=True, slots=True, eq=False)
class Fine:
    """``facets``: the corners; ``places``: where on ``contour`` they are, of a circle (a point with its ``reach``)
    nothing; ``radius``: of the circle about the origin of its frame that contains all that is solid (of a hole: that
    is in the hole's edge).
    """

    facets: Facets
    reach: float
    contour: Contour | None
    places: FloatArray
    radius: float

    @staticmethod
    def disc(radius: float) -> Fine:
        """A circle about the origin."""
        return Fine(Facets.of(np.zeros((1, 2))), radius, None, np.zeros(1), radius)

    @staticmethod
    def of(contour: Contour) -> Fine:
        """That of an outline."""
        if contour.times > 1:
            points, places = _toothed(contour)
        else:
            points, places, _ = contour.corners
        if not contour.closed:
            points, places = (np.concatenate([each, each[-2:0:-1]]) for each in (points, places))
        elif contour.side > 0.0:
            points, places = points[::-1], places[::-1]
        facets = Facets.of(points, hollow=contour.hollow)
        return Fine(facets, contour.reach, contour, places, float(np.hypot(*points.T).max()) + contour.reach)


def _toothed(contour: Contour) -> tuple[FloatArray, FloatArray]:
    """One tooth after the other, with fewer corners than `samples` have."""
    once = np.array(contour.breaks[: (len(contour.breaks) - 1) // contour.times + 1])
    parts = np.arange(OF_TOOTH) / OF_TOOTH
    places = (once[:-1, None] + np.diff(once)[:, None] * parts).ravel()
    own = contour.points(places)
    apart = np.append(True, np.hypot(*np.diff(own, axis=0).T) > OUTLINE_SAMPLED * OUTLINE_SAMPLED)
    own, places = own[apart], places[apart]
    turn = np.arange(contour.times) * (2.0 * np.pi / contour.times)
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    points = np.stack([c * own[:, 0] - s * own[:, 1], s * own[:, 0] + c * own[:, 1]], axis=-1).reshape(-1, 2)
    period = contour.period / contour.times
    return points, (np.arange(contour.times)[:, None] * period + places).ravel()


def values(a: Fine, b: Fine, pose: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """For poses (4, K) of b in a's frame: (K,) the distances, negative where they overlap (by how far a corner is in
    the other one); and the places on both where they are nearest.
    """
    found = np.empty((3, pose.shape[1]))
    q = b.facets.moved(pose)
    for k in range(len(q)):
        found[:, k] = _value(a, b, q[k], pose[:2, k])
    return found[0], found[1], found[2]


def _near(points: FloatArray, centre: FloatArray, radius: float) -> IntArray:
    """The edges of which something is within a circle: their numbers; at least the nearest."""
    off = np.hypot(*(points - centre).T)
    near = off <= radius
    near |= np.roll(near, -1)
    long = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
    near |= off - long <= radius
    return np.asarray(np.nonzero(near)[0] if near.any() else [np.argmin(off)], dtype=np.int64)


def _value(a: Fine, b: Fine, q: FloatArray, at: FloatArray) -> tuple[float, float, float]:
    p = a.facets.points
    here: IntArray = np.arange(len(p))
    there: IntArray = np.arange(len(q))
    if len(p) * len(q) > SMALL:  # only what is near the other one; holes contain everything
        lowest = max(float(np.hypot(*at)) - a.radius - b.radius, 0.0) + SLACK * min(a.radius, b.radius)
        here = _near(p, at, b.radius + lowest)
        there = _near(q, np.zeros(2), a.radius + lowest)
    reach = a.reach + b.reach
    p1, q1 = p[here], q[there]
    p2, q2 = p[(here + 1) % len(p)], q[(there + 1) % len(q)]
    off, part = to_edges(q1, p1, p2)
    other, also = to_edges(p1, q1, q2)
    j, i = np.unravel_index(int(np.argmin(off)), off.shape)
    m, n = np.unravel_index(int(np.argmin(other)), other.shape)
    if off[j, i] <= other[m, n]:
        value, u, v = float(off[j, i]), _along(a, int(here[i]), float(part[j, i])), float(b.places[there[j]])
    else:
        value, u, v = float(other[m, n]), float(a.places[here[m]]), _along(b, int(there[n]), float(also[m, n]))
    value = float(np.sqrt(value))
    deep = 0.0
    for points, solid, near in ((q1, a, off), (p1, b, other)):
        corners = p if solid is a else q
        if len(corners) > 2:
            within = inside(points, corners) != solid.facets.hollow
            if within.any():
                deepest_in = np.where(within, near.min(axis=1), -1.0)
                k = int(np.argmax(deepest_in))
                deep = max(deep, float(np.sqrt(deepest_in[k])))
    if deep > 0.0:
        return -deep - reach, u, v
    if _cross(p1, p2, q1, q2):
        return -reach - EDGES_CROSS * min(a.radius, b.radius), u, v
    return value - reach, u, v


def _along(own: Fine, k: int, part: float) -> float:
    """The place at a part of edge k."""
    if own.contour is None or len(own.places) == 1:
        return 0.0
    begin, end = own.places[k], own.places[(k + 1) % len(own.places)]
    period = own.contour.period
    step = end - begin
    if own.contour.closed:
        step -= period * np.rint(step / period)
    return float(begin + part * step)


def _cross(p1: FloatArray, p2: FloatArray, q1: FloatArray, q2: FloatArray) -> bool:
    def beyond(a: FloatArray, b: FloatArray, x: FloatArray) -> FloatArray:
        e = b - a
        return e[:, 0, None] * (x[:, 1] - a[:, 1, None]) - e[:, 1, None] * (x[:, 0] - a[:, 0, None])

    one = beyond(p1, p2, q1) * beyond(p1, p2, q2) < 0.0
    return bool((one & (beyond(q1, q2, p1) * beyond(q1, q2, p2) < 0.0).T).any())


def depth(a: Fine, b: Fine, pose: FloatArray) -> float:
    """How far one must move to be free of the other, for one pose (4,); 0 or less where they are apart."""
    q = b.facets.moved(pose[:, None])[0]
    reach = a.reach + b.reach
    if len(q) == 1 or len(a.facets.points) == 1:
        return -float(values(a, b, pose[:, None])[0][0])
    if overlap(a.facets, b.facets, q):
        return reach - deepest(a.facets, b.facets, q).value
    return -float(values(a, b, pose[:, None])[0][0])


def touching(a: Fine, b: Fine, pose: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    """(K,): signed distances of the outlines themselves near places u and v (K,), for poses (4, K); nan where nothing
    is found there.
    """
    if a.contour is None or b.contour is None:
        return _of_circle(a, b, pose, u, v)
    return refined(a.contour, b.contour, pose, u, v)[2] - a.reach - b.reach


def _of_circle(a: Fine, b: Fine, pose: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    """The same of a circle and an outline."""
    x, y, c, s = pose
    if a.contour is None:
        contour, place, point = b.contour, v, (-c * x - s * y, s * x - c * y)
    else:
        contour, place, point = a.contour, u, (x, y)
    assert contour is not None
    for _ in range(NEWTON):
        px, py, tx, ty, dx, dy, rx, ry = contour.values(place)
        wx, wy = point[0] - px, point[1] - py
        with np.errstate(all="ignore"):
            step = (wx * tx + wy * ty) / (wx * rx + wy * ry - dx * tx - dy * ty)
        place = place - np.where(np.isfinite(step), np.clip(step, -0.05 * contour.period, 0.05 * contour.period), 0.0)
    px, py, tx, ty = contour.values(place)[:4]
    value = contour.side * (tx * (point[1] - py) - ty * (point[0] - px)) / np.hypot(tx, ty)
    return np.asarray(value - a.reach - b.reach, dtype=np.float64)
