"""Finds where two outlines are nearest, in floats: samples over the whole of both, then Newton's method."""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.outlines.bracketed_roots import bracketed_roots
from movimentum.outlines.contour import Contour
from movimentum.outlines.facets import Feature, overlaps
from movimentum.outlines.penetration import shortest_ways_out, signed_feature
from movimentum.tolerances import OUTLINE_CLOSES, OUTLINE_SAMPLED, PLACE_FOUND, PLACE_ROUNDS, PLACES_MEET

MOST_PAIRS = 500_000
"""Pairs of samples that are compared at once."""
CANDIDATES = 4
"""Pairs of samples from which the nearest places are looked for."""
MORE_CANDIDATES = 100
"""The same where the nearest ones have led nowhere."""
LOWEST_SAMPLES = 4
"""Of the distances of a point from the samples: from so many of the lowest the nearest place is looked for."""
FACING_SINE = 0.4
"""How far, as a sine, samples may look away from each other where the outlines face each other."""

# --- a point and an outline


def nearest_to_points(contour: Contour, q: FloatArray) -> FloatArray:
    """Places (2, F), both the same, where an outline is nearest to F points (2, F) in its frame."""
    points = contour.stations[0]
    off = (q[0][:, None] - points[:, 0]) ** 2 + (q[1][:, None] - points[:, 1]) ** 2
    n, every = len(points), np.arange(len(off))
    # the lowest valleys: samples do not tell which of two that are nearly as low is lower
    low = (off <= np.roll(off, 1, axis=1)) & (off <= np.roll(off, -1, axis=1))
    if not contour.closed:
        low[:, 0], low[:, -1] = off[:, 0] <= off[:, 1], off[:, -1] <= off[:, -2]
    heights = np.where(low, off, np.inf)
    valleys: list[IntArray] = []
    found: list[BoolArray] = []
    for _ in range(LOWEST_SAMPLES):
        k = np.argmin(heights, axis=1)
        found.append(np.isfinite(heights[every, k]))
        valleys.append(k)
        for shift in (-1, 0, 1):
            heights[every, (k + shift) % n] = np.inf
    which, point = np.nonzero(np.array(found))
    q, before_and_after = q[:, point], _neighbours(contour, np.array(valleys)[which, point])
    place = _across_from(contour, q, *before_and_after)
    x, y, tx, ty = contour.values(place)[:4]
    distance: FloatArray = np.hypot(q[0] - x, q[1] - y)
    if contour.doubled:  # of both sides, the one that the point is on
        behind = tx * (q[1] - y) - ty * (q[0] - x) > 0.0
        distance = np.where(behind, distance + OUTLINE_CLOSES * contour.size, distance)
    places, distances = np.zeros((2, *off.shape[:1], LOWEST_SAMPLES))
    distances[:] = np.inf
    places[point, which], distances[point, which] = place, distance
    best = places[every, np.argmin(distances, axis=1)]
    return np.stack([best, best, np.ones_like(best)])


def nearest_sample(contour: Contour, q: FloatArray) -> FloatArray:
    """Places (F,) near the nearest samples to F points (2, F), at which an outline is across the line to the point."""
    points = contour.stations[0]
    k = np.empty(q.shape[1], dtype=np.intp)
    step = max(1, MOST_PAIRS // len(points))
    for first in range(0, len(k), step):
        some = slice(first, first + step)
        off = (q[0][some, None] - points[:, 0]) ** 2 + (q[1][some, None] - points[:, 1]) ** 2
        k[some] = np.argmin(off, axis=1)
    return _across_from(contour, q, *_neighbours(contour, k))


def _neighbours(contour: Contour, k: Any) -> tuple[FloatArray, FloatArray]:
    """The places around station k between which the nearest one is; beyond the ends of a closed outline too."""
    _, begin, end = contour.stations
    if not contour.closed:
        return np.append(begin[0], end[:-1])[k], np.append(begin[1:], end[-1])[k]
    period = contour.period
    return np.append(end[-1] - period, end[:-1])[k], np.append(begin[1:], begin[0] + period)[k]


def _across_from(contour: Contour, q: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Where the line to a point is across the outline: it is ahead at ``low``, and behind at ``high``."""

    def ahead(place: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        x, y, tx, ty, dx, dy, rx, ry = contour.values(place)
        value = (q[0] - x) * tx + (q[1] - y) * ty
        return value, (q[0] - x) * rx + (q[1] - y) * ry - dx * tx - dy * ty, value > 0.0

    return bracketed_roots(ahead, low, high, PLACE_FOUND * contour.period)


# --- two outlines


def nearest_of_two(first: Contour, second: Contour, pose: FloatArray) -> FloatArray:
    """(3, F): places on two outlines for F poses (4, F) of the second (x, y, cosine and sine), and how much longer the
    way between them is than across the first: 1, but where two places together stop the shortest way out.
    """
    if second.radius is not None:
        return _nearest_to_circle(first, pose)
    if first.radius is not None:
        x, y, c, s = pose
        u, v, longer = _nearest_to_circle(second, np.stack([-c * x - s * y, s * x - c * y, c, -s]))
        return np.stack([v, u, longer])
    if first.straight and second.straight:
        return _nearest_of_straight(first, second, pose)
    u, v = first.samples[:-1], second.samples[:-1]
    count = pose.shape[1]
    step = max(1, MOST_PAIRS // (len(u) * len(v)))
    found = np.ones((3, count))
    for begin in range(0, count, step):
        some = slice(begin, min(begin + step, count))
        found[:, some] = _nearest_of_some(first, second, pose[:, some], u, v)
    return found


def _nearest_to_circle(first: Contour, pose: FloatArray) -> FloatArray:
    """The same where the second is a circle about its origin, by its angle: the line goes through its centre."""
    place = nearest_to_points(first, pose[:2])[0]
    tx, ty = first.values(place)[2:4]
    inwards = np.arctan2(-first.side * tx, first.side * ty)  # against the outward normal
    angle = np.degrees(inwards - np.arctan2(pose[3], pose[2]))
    return np.stack([place, angle - 360.0 * np.floor(angle / 360.0), np.ones_like(place)])


def _nearest_of_straight(first: Contour, second: Contour, pose: FloatArray) -> FloatArray:
    a, b = first.facets, second.facets
    return np.stack(
        [_placed(first, second, here, signed_feature(a, b, q)) for here, q in zip(pose.T, b.moved(pose), strict=True)],
        axis=1,
    )


def _placed(first: Contour, second: Contour, pose: FloatArray, found: Feature) -> tuple[float, float, float]:
    """The places of a feature, and how much longer the way is than across the first."""
    (i, s), (j, r) = found.here, found.there
    p, q = first.facets.points, second.facets.moved(pose[:, None])[0]
    edge = (p, i) if 0.0 < s < 1.0 else (q, j) if 0.0 < r < 1.0 else None
    here, there = _on_edge(p, i, s), _on_edge(q, j, r)
    if edge is not None:
        ex, ey = _on_edge(*edge, 1.0) - _on_edge(*edge, 0.0)
        normal = np.array([ey, -ex]) / np.hypot(ex, ey) * (1.0 if edge[0] is p else -1.0)
        if found.value > 0.0 and normal @ (there - here) < 0.0:  # a line has two sides
            normal = -normal
    else:
        way = (there - here) * (1.0 if found.value > 0.0 else -1.0)
        size = np.hypot(*way)
        normal = way / size if size > 0.0 else -np.array(_side_of(q, j)) if len(q) > 1 else np.array([1.0, 0.0])
    c, sine = pose[2:]
    back = -np.array([c * normal[0] + sine * normal[1], c * normal[1] - sine * normal[0]])
    across = float(normal @ (there - here))
    longer = -found.value / -across if found.value < 0.0 and across < 0.0 else 1.0
    return _place(first, i, s, normal), _place(second, j, r, back), max(1.0, longer)


def _on_edge(points: FloatArray, k: int, part: float) -> FloatArray:
    return points[k] + part * (points[(k + 1) % len(points)] - points[k])


def _side_of(points: FloatArray, k: int) -> tuple[float, float]:
    """What is outwards at a corner."""
    out = [
        (p[1] - q[1], q[0] - p[0]) for p, q in ((points[k], points[k - 1]), (points[(k + 1) % len(points)], points[k]))
    ]
    x, y = -(out[0][0] + out[1][0]), -(out[0][1] + out[1][1])
    size = float(np.hypot(x, y))
    return (x / size, y / size) if size > 0.0 else (1.0, 0.0)


def _place(contour: Contour, k: int, part: float, normal: FloatArray) -> float:
    """The place of a part of an edge of the facets, or of a corner seen from outside along ``normal``."""
    points, begin, end = contour.corners
    count = len(points)
    if not contour.closed:
        turns = 2 * (count - 1)
        k, part = (k, part) if k < count - 1 else (turns - 1 - k, 1.0 - part)
        return float(end[k] + part * (begin[k + 1] - end[k]))
    # the direction in which it runs where its outside is there
    tx, ty = (-normal[1], normal[0]) if contour.side < 0.0 else (normal[1], -normal[0])
    if 0.0 < part < 1.0:
        if contour.side > 0.0:
            k, part = (count - 2 - k) % count, 1.0 - part
        ex, ey = points[(k + 1) % count] - points[k]
        if contour.doubled and ex * tx + ey * ty < 0.0:
            k, part = count - 1 - k, 1.0 - part
        far = begin[(k + 1) % count] + (contour.period if k + 1 == count else 0.0)
        return float(end[k] + part * (far - end[k]))
    k = (k + round(part)) % count
    k = k if contour.side < 0.0 else count - 1 - k
    best = None
    for n in {k, -k % count} if contour.doubled else {k}:
        x, y = contour.values(np.array([begin[n], (begin[n] + end[n]) / 2.0]))[2:4]
        half = np.arctan2(x[0] * y[1] - y[0] * x[1], x[0] * x[1] + y[0] * y[1])
        if half == 0.0:
            best = best or (np.inf, float(begin[n]))
            continue
        turn = np.arctan2(x[0] * ty - y[0] * tx, x[0] * tx + y[0] * ty)
        share = min((turn / (2.0 * half), (turn + 2.0 * np.pi) / (2.0 * half), (turn - 2.0 * np.pi) / (2.0 * half)),
                    key=lambda each: abs(each - 0.5))  # fmt: skip
        off = abs(share - 0.5)
        if best is None or off < best[0]:
            best = off, float(begin[n] + min(max(share, 0.0), 1.0) * (end[n] - begin[n]))
    assert best is not None
    return best[1]


def _nearest_of_some(first: Contour, second: Contour, pose: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    x, y, c, s = (each[:, None] for each in pose)
    px, py, tx, ty = first.values(u)[:4]
    qx, qy, gx, gy = second.values(v)[:4]
    bx, by = x + c * qx - s * qy, y + s * qx + c * qy  # (F, M)
    gx, gy = c * gx - s * gy, s * gx + c * gy
    dx, dy = bx[:, None, :] - px[:, None], by[:, None, :] - py[:, None]  # (F, N, M)
    off = np.hypot(dx, dy)
    size, other = np.hypot(tx, ty), np.hypot(gx, gy)
    here = first.side * (tx[:, None] * dy - ty[:, None] * dx) / size[:, None]
    there = -second.side * (gx[:, None, :] * dy - gy[:, None, :] * dx) / other[:, None, :]
    faces = (here >= -FACING_SINE * off) & (there >= -FACING_SINE * off)
    low = faces.copy()
    for axis, closed in ((1, first.closed), (2, second.closed)):
        for way in (-1, 1):
            beside = np.roll(off, way, axis=axis)
            if not closed:
                edge = [slice(None)] * 3
                edge[axis] = slice(-1, None) if way < 0 else slice(0, 1)
                beside[tuple(edge)] = np.inf
            low &= off <= beside
    flat = np.where(low, off, np.inf).reshape(len(off), -1)
    few = min(CANDIDATES, flat.shape[1])
    chosen = np.argpartition(flat, few - 1, axis=1)[:, :few]
    i, j = np.unravel_index(chosen, off.shape[1:])
    poses = np.repeat(pose, few, axis=1)
    a, b, value = refined_contact(first, second, poses, u[i.reshape(-1)], v[j.reshape(-1)])
    value = np.where(np.isfinite(np.take_along_axis(flat, chosen, axis=1)), value.reshape(-1, few), np.inf)
    near = off.min(axis=(1, 2)) <= first.largest_spacing + second.largest_spacing  # else no edge crosses another
    touching = PLACES_MEET + np.where(near, 2.0 * OUTLINE_SAMPLED, 0.0)[:, None]  # as deep as samples do not see
    value = np.where(value >= -touching * (first.size + second.size), value, np.inf)
    best = np.argmin(value, axis=1)
    rows_ = np.arange(len(best))
    found = np.stack([a.reshape(-1, few)[rows_, best], b.reshape(-1, few)[rows_, best], np.ones(len(best))])
    for n, q in enumerate(second.facets.moved(pose)):
        if overlaps(first.facets, second.facets, q):
            found[:, n] = _inside_each_other(
                first, second, pose[:, n], shortest_ways_out(first.facets, second.facets, q[None])[0]
            )
        elif not np.isfinite(value[n, best[n]]):
            found[:2, n] = _nearest_anywhere(first, second, pose[:, n], (u, v), np.where(faces[n], off[n], np.inf))
    return found


def _nearest_anywhere(
    first: Contour, second: Contour, pose: FloatArray, places: tuple[FloatArray, FloatArray], off: FloatArray
) -> tuple[float, float]:
    """Where two outlines are nearest that no valley of the samples has shown."""
    order = np.argsort(off, axis=None, kind="stable")[:MORE_CANDIDATES]
    i, j = np.unravel_index(order, off.shape)
    u, v, value = refined_contact(first, second, np.repeat(pose[:, None], len(i), axis=1), places[0][i], places[1][j])
    good = np.where(value >= -PLACES_MEET * (first.size + second.size), value, np.inf)
    best = int(np.argmin(good))
    if not np.isfinite(good[best]):
        return float(places[0][i[0]]), float(places[1][j[0]])
    return float(u[best]), float(v[best])


def _inside_each_other(first: Contour, second: Contour, pose: FloatArray, found: Feature) -> tuple[float, float, float]:
    """Places between which a translation frees one of the other, the shortest one."""
    u, v, longer = _placed(first, second, pose, found)
    if longer > 1.0 + OUTLINE_SAMPLED:
        return u, v, longer
    a, b, value = refined_contact(first, second, pose[:, None], np.array([u]), np.array([v]))
    within = 4.0 * OUTLINE_SAMPLED * (first.size + second.size)
    if abs(value[0] - found.value) <= within:
        return float(a[0]), float(b[0]), 1.0
    return u, v, longer


def newton_step(first: Any, second: Any, pose: Any) -> tuple[FloatArray, FloatArray]:
    """Newton's step on the rows of a contact, for K pairs of places; 0 where it is singular. ``first``, ``second``:
    x, y and their derivatives there. ``pose``: x, y, cosine and sine of the second one in the frame of the first.
    """
    x, y, c, s = pose
    ax, ay, tx, ty, dx, dy, rx, ry = first
    px, py, gx, gy, ex, ey, hx, hy = second
    bx, by = x + c * px - s * py - ax, y + s * px + c * py - ay
    gx, gy = c * gx - s * gy, s * gx + c * gy
    ex, ey = c * ex - s * ey, s * ex + c * ey
    hx, hy = c * hx - s * hy, s * hx + c * hy
    f, g = tx * gy - ty * gx, bx * tx + by * ty
    j11, j12 = rx * gy - ry * gx, tx * hy - ty * hx
    j21, j22 = bx * rx + by * ry - dx * tx - dy * ty, ex * tx + ey * ty
    det = j11 * j22 - j12 * j21
    with np.errstate(all="ignore"):
        du, dv = (f * j22 - g * j12) / det, (g * j11 - f * j21) / det
    return np.where(np.isfinite(du), du, 0.0), np.where(np.isfinite(dv), dv, 0.0)


def refined_contact(
    first: Contour, second: Contour, pose: FloatArray, u: FloatArray, v: FloatArray, steps: int = 30
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Newton's method on the rows of the contact, for K poses, with so many ``steps`` at most; the places, and the
    distance there; nan where that is not where two outlines face each other.
    """
    x, y, c, s = pose
    periods = first.period, second.period
    u, v = np.array(u, dtype=np.float64), np.array(v, dtype=np.float64)
    going: IntArray = np.arange(len(u))
    before = np.full(len(u), np.inf)
    with np.errstate(all="ignore"):
        for _ in range(steps):
            here, there = u[going], v[going]
            du, dv = newton_step(first.values(here), second.values(there), pose[:, going])
            far = np.maximum(abs(du) / periods[0], abs(dv) / periods[1])
            most = np.maximum(far / 0.05, 1.0)
            u[going], v[going] = here - du / most, there - dv / most
            # found, or as near as rounding lets it come
            still = (far <= PLACE_FOUND) | ((far <= PLACE_ROUNDS) & (far >= 0.5 * before))
            going, before = going[~still], far[~still]
            if not len(going):
                break
        ax, ay, tx, ty = first.values(u)[:4]
        px, py, gx, gy = second.values(v)[:4]
        bx, by = x + c * px - s * py - ax, y + s * px + c * py - ay
        gx, gy = c * gx - s * gy, s * gx + c * gy
        size, other = np.hypot(tx, ty), np.hypot(gx, gy)
        value = first.side * (tx * by - ty * bx) / size
        against = first.side * second.side * (tx * gx + ty * gy) < 0.0
        met = (abs(tx * gy - ty * gx) <= PLACES_MEET * size * other) & (
            abs(bx * tx + by * ty) <= PLACES_MEET * size * max(first.size, second.size)
        )
    return u, v, np.where(against & met, value, np.nan)
