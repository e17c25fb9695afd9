"""Where two skins may touch: the distance of each of their parts, whether it is there that they would, and which way.

A distance is that of an edge's whole line, of a whole circle, of a curve along its normal: a smooth function of both
poses. It is a distance of the outlines only where the place is on both parts, and within their fans: where its *slack*
is not negative.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, IntArray
from movimentum.outlines.search import newton_step
from movimentum.outlines.skin import Bends, Skin
from movimentum.records import dataclass
from movimentum.tolerances import BENDS_MET, LEAST_DIVISOR, OUTLINE_FAN, PLACE_FOUND, PLACES_MEET

Pose = Sequence[FloatArray | float]
"""x, y, cosine and sine: of one pose, or (M,) each, of the M places that are asked about."""

KNOBS, EDGES, BOWLS, BENDS = range(4)
KINDS = (
    (KNOBS, EDGES), (EDGES, KNOBS), (KNOBS, KNOBS), (KNOBS, BOWLS), (BOWLS, KNOBS), (KNOBS, BENDS), (BENDS, KNOBS),
    (EDGES, BENDS), (BENDS, EDGES), (BOWLS, BENDS), (BENDS, BOWLS), (BENDS, BENDS),
)  # fmt: skip
"""Which parts of two skins may touch each other."""
_FAMILY = np.array([0, 0, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5])
"""By which of `_MEASURES` each is measured,"""
_SWAPPED = np.array([(second, first) in KINDS[:k] for k, (first, second) in enumerate(KINDS)]) & (
    np.array(KINDS)[:, 0] != np.array(KINDS)[:, 1]
)
"""and whether its parts are taken the other way round."""


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """Places where two skins may touch, M in each of F poses (F, M): their ``value``, how far each is ``along`` inside
    the parts (px), and inside the ``fan`` (radians), a ``point`` (2, F, M) on the line of contact, and the ``normal``
    (2, F, M), along which the first one moves away.
    """

    value: FloatArray
    along: FloatArray
    fan: FloatArray
    point: FloatArray
    normal: FloatArray

    def there(self, within: float) -> NDArray[np.bool_]:
        """Whether the outlines are that near to each other there."""
        return (self.along >= -within) & (self.fan >= -OUTLINE_FAN)


class Places:
    """M pairs of parts ``i`` and ``j`` of the ``skin`` of many bodies, as their ``kind`` says (see `KINDS`; in order),
    of the bodies ``first`` and ``second``: all that does not depend on where these are.
    """

    def __init__(self, skin: Skin, kind: IntArray, i: IntArray, j: IntArray, first: IntArray, second: IntArray) -> None:
        self.count = len(kind)
        swapped = _SWAPPED[kind]
        one, other = np.where(swapped, j, i), np.where(swapped, i, j)
        a, b = np.where(swapped, second, first), np.where(swapped, first, second)
        sign = np.where(swapped, -1.0, 1.0)
        families = _FAMILY[kind]
        cuts = [0, *(np.nonzero(np.diff(families))[0] + 1).tolist(), self.count]
        self._parts: list[tuple[slice, IntArray, IntArray, FloatArray, Measure]] = []
        for low, high in pairwise(cuts):
            part = slice(low, high)
            if low < high:
                measure = _MEASURES[int(families[low])](skin, kind[part], one[part], other[part])
                self._parts.append((part, a[part], b[part], sign[part], measure))

    def touch(self, poses: FloatArray) -> Touch:
        """The places in poses (4, F, B) of the bodies."""
        shape = poses.shape[1], self.count
        found = [(part, sign, measure(poses[:, :, a], poses[:, :, b])) for part, a, b, sign, measure in self._parts]
        if len(found) == 1:
            ((_, sign, (value, along, fan, x, y, nx, ny)),) = found
            return Touch(value, along, fan, np.stack([x, y]), np.stack([nx * sign, ny * sign]))
        value, along, fan = np.empty(shape), np.empty(shape), np.empty(shape)
        point, normal = np.empty((2, *shape)), np.empty((2, *shape))
        for part, sign, (v, inside, turned, x, y, nx, ny) in found:
            value[:, part], along[:, part], fan[:, part] = v, inside, turned
            point[0, :, part], point[1, :, part] = x, y
            normal[0, :, part], normal[1, :, part] = nx * sign, ny * sign
        return Touch(value, along, fan, point, normal)


Found = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
"""(F, M) each: value, along, fan, point (x, y) and normal (x, y); see `Touch`."""
Measure = Callable[[FloatArray, FloatArray], Found]
"""Of the poses (4, F, M) of those that have the first of two parts, and of those that have the second."""


def _moved(pose: Pose, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    px, py, c, s = pose
    return px + c * x - s * y, py + s * x + c * y


def _inside(pose: Pose, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    px, py, c, s = pose
    return c * (x - px) + s * (y - py), c * (y - py) - s * (x - px)


def _some(pose: Pose, places: IntArray) -> Pose:
    """That of some of the places."""
    return tuple(each[places] if isinstance(each, np.ndarray) and each.ndim else each for each in pose)


class _Fan:
    """How far directions are inside the fans of M knobs or bowls."""

    def __init__(self, part: FloatArray) -> None:
        self.c, self.s, self.half = np.cos(part[:, 3]), np.sin(part[:, 3]), part[:, 4]
        self.round = self.half >= math.pi
        self.all_round, self.some_round = bool(self.round.all()), bool(self.round.any())

    def inside(self, pose: Pose, dx: FloatArray, dy: FloatArray) -> FloatArray:
        """For directions (dx, dy), with the parts in these poses."""
        if self.all_round:
            return np.full(dx.shape, math.pi)
        c, s = pose[2] * self.c - pose[3] * self.s, pose[3] * self.c + pose[2] * self.s
        found = self.half - np.abs(np.arctan2(c * dy - s * dx, c * dx + s * dy))
        return np.where(self.round, math.pi, found) if self.some_round else found


def _fan(part: FloatArray, pose: Pose, dx: FloatArray, dy: FloatArray) -> FloatArray:
    return _Fan(part).inside(pose, dx, dy)


def _knob_edge(skin: Skin, kind: IntArray, i: IntArray, j: IntArray) -> Measure:
    knob, edge = skin.knobs[i], skin.edges[j]
    kx, ky, px, py = knob[:, 0], knob[:, 1], edge[:, 0], edge[:, 1]
    wide = np.hypot(edge[:, 2] - px, edge[:, 3] - py)
    wx, wy = (edge[:, 2] - px) / wide, (edge[:, 3] - py) / wide
    reach, fan = knob[:, 2] + edge[:, 4], _Fan(knob)

    def measure(pose: FloatArray, there: FloatArray) -> Found:
        x, y = _moved(pose, kx, ky)
        bx, by = _moved(there, px, py)
        _, _, c, s = there
        size = np.hypot(c, s)
        tx, ty = (c * wx - s * wy) / size, (s * wx + c * wy) / size
        dx, dy = x - bx, y - by
        along = tx * dx + ty * dy
        value = ty * dx - tx * dy - reach
        return value, np.minimum(along, wide * size - along), fan.inside(pose, -ty, tx), x, y, ty, -tx

    return measure


def _round_round(skin: Skin, kind: IntArray, i: IntArray, j: IntArray) -> Measure:
    """A knob against a knob, or in a bowl."""
    hollow = kind != KINDS.index((KNOBS, KNOBS))
    a, b = skin.knobs[i], np.empty((len(j), 5))
    b[hollow], b[~hollow] = skin.bowls[j[hollow]], skin.knobs[j[~hollow]]
    ax, ay, bx, by = a[:, 0], a[:, 1], b[:, 0], b[:, 1]
    way = np.where(hollow, -1.0, 1.0)
    reach, fits = a[:, 2] + way * b[:, 2], ~hollow | (b[:, 2] > a[:, 2])
    one, other = _Fan(a), _Fan(b)

    def measure(pose: FloatArray, there: FloatArray) -> Found:
        x, y = _moved(pose, ax, ay)
        u, v = _moved(there, bx, by)
        dx, dy = x - u, y - v
        far = np.hypot(dx, dy)
        size = np.maximum(far, LEAST_DIVISOR)
        dx, dy = dx / size, dy / size
        nx, ny = way * dx, way * dy
        fan = np.minimum(one.inside(pose, -nx, -ny), other.inside(there, dx, dy))
        fan = np.where(fits & (far > LEAST_DIVISOR), fan, -np.inf)
        return way * far - reach, np.full(far.shape, np.inf), fan, x, y, nx, ny

    return measure


# --- curves


class _Bent(NamedTuple):
    """Of N places with curves: (N,), (N,), (N,), (N, 2) and (N, 2); see `Touch`."""

    value: FloatArray
    along: FloatArray
    fan: FloatArray
    point: FloatArray
    normal: FloatArray


def _curved(
    measured: Callable[[Skin, Pose, Pose, IntArray, IntArray], _Bent],
) -> Callable[[Skin, IntArray, IntArray, IntArray], Measure]:
    """Of N places, as one of M pairs in F poses."""

    def family(skin: Skin, kind: IntArray, i: IntArray, j: IntArray) -> Measure:
        def measure(pose: FloatArray, there: FloatArray) -> Found:
            shape = pose.shape[1:]
            every = np.tile(i, shape[0]), np.tile(j, shape[0])
            found = measured(skin, tuple(pose.reshape(4, -1)), tuple(there.reshape(4, -1)), *every)
            flat = (*found[:3], *found.point.T, *found.normal.T)
            value, along, fan, x, y, nx, ny = (each.reshape(shape) for each in flat)
            return value, along, fan, x, y, nx, ny

        return measure

    return family


_Ahead = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def _per_curve(skin: Skin, j: IntArray, work: Callable[[Bends, IntArray, IntArray], _Bent], count: int) -> _Bent:
    """``work`` for the bends of each contour among ``j``: with their numbers, and their places in j."""
    value, along, fan = np.full(count, np.inf), np.full(count, -np.inf), np.full(count, -np.inf)
    point, normal = np.zeros((count, 2)), np.zeros((count, 2))
    ends = np.cumsum([len(bend.first) for bend in skin.bends])
    which = np.searchsorted(ends, j, side="right")
    numbers: list[int] = np.unique(which).tolist()
    for k in numbers:
        bend, places = skin.bends[k], np.nonzero(which == k)[0]
        begin = int(ends[k]) - len(bend.first)
        found = work(bend, j[places] - begin, places)
        value[places], along[places], fan[places] = found.value, found.along, found.fan
        point[places], normal[places] = found.point, found.normal
    return _Bent(value, along, fan, point, normal)


def _root(bend: Bends, k: IntArray, ahead: _Ahead) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where ``ahead`` (of the contour's values (8, M); with its derivative by the parameter) changes its sign on bends
    ``k``; by how much it does so at least: what is negative says that it does not; and the contour's values there.
    """
    low, high = bend.first[k], bend.last[k]
    inner = high if not bend.contour.closed else np.nextafter(high, low)
    ends = bend.values(np.concatenate([low, inner]))
    (at_low, _), (at_high, _) = ahead(ends[:, : len(k)]), ahead(ends[:, len(k) :])
    sign = np.where(at_low >= at_high, 1.0, -1.0)
    slack = np.minimum(sign * at_low, -sign * at_high)
    good = slack >= 0.0
    fall = sign * (at_low - at_high)
    place = low + (high - low) * np.clip(sign * at_low / np.where(fall > 0.0, fall, 1.0), 0.0, 1.0)
    place = np.where(good, place, np.where(np.abs(at_low) < np.abs(at_high), low, inner))
    at = bend.values(place)
    if not good.any():
        return place, slack, at
    a, b = low, high
    for _ in range(60):  # Newton's method, between the ends
        value, rate = ahead(at)
        a, b = np.where(sign * value > 0.0, place, a), np.where(sign * value > 0.0, b, place)
        with np.errstate(all="ignore"):
            new = place - value / rate
        new = np.where((new >= a) & (new <= b), new, 0.5 * (a + b))
        new = np.where(good & (value != 0.0), new, place)
        moved = np.abs(new - place)
        place = new
        at = bend.values(place)
        if (moved <= PLACE_FOUND * bend.contour.period).all():
            break
    return place, slack, at


def _bent(bend: Bends, at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The points (x, y) and the outward normals of values (8, M)."""
    x, y, tx, ty = at[:4]
    size = np.hypot(tx, ty)
    return x, y, -bend.side * ty / size, bend.side * tx / size


def _bulges(bend: Bends, at: FloatArray) -> NDArray[np.bool_]:
    """Whether it is convex there."""
    _, _, tx, ty, _, _, rx, ry = at
    return (tx * ry - ty * rx) * bend.side < 0.0


def _along_from(x: FloatArray, y: FloatArray) -> _Ahead:
    """How far ahead along the tangent points (x, y) are, which are seen square where that is 0; with its rate."""

    def ahead(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        px, py, tx, ty, dx, dy, rx, ry = at
        size = np.hypot(tx, ty)
        along = (x - px) * tx + (y - py) * ty
        rate = (x - px) * rx + (y - py) * ry - dx * tx - dy * ty
        return along / size, rate / size - along * (tx * rx + ty * ry) / size**3

    return ahead


def _knob_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _Bent:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _Bent:
        knob, mine, their = skin.knobs[i[places]], _some(pose, places), _some(there, places)
        wx, wy = _moved(mine, knob[:, 0], knob[:, 1])
        x, y = _inside(their, wx, wy)

        _, slack, at = _root(bend, k, _along_from(x, y))
        px, py, nx, ny = _bent(bend, at)
        value = nx * (x - px) + ny * (y - py) - knob[:, 2] - bend.reach
        c, s = their[2:]
        dx, dy = c * nx - s * ny, s * nx + c * ny
        return _Bent(value, slack, _fan(knob, mine, -dx, -dy), np.stack([wx, wy], 1), np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _edge_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _Bent:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _Bent:
        edge, mine, their = skin.edges[i[places]], _some(pose, places), _some(there, places)
        px, py = _inside(their, *_moved(mine, edge[:, 0], edge[:, 1]))
        qx, qy = _inside(their, *_moved(mine, edge[:, 2], edge[:, 3]))
        length = np.hypot(qx - px, qy - py)
        tx, ty = (qx - px) / length, (qy - py) / length
        ex, ey = ty, -tx

        def ahead(at: FloatArray) -> tuple[FloatArray, FloatArray]:
            tx, ty, rx, ry = at[2], at[3], at[6], at[7]
            size = np.hypot(tx, ty)
            along = ex * tx + ey * ty
            return along / size, (ex * rx + ey * ry) / size - along * (tx * rx + ty * ry) / size**3

        _, slack, at = _root(bend, k, ahead)
        x, y, nx, ny = _bent(bend, at)
        value = ex * (x - px) + ey * (y - py) - edge[:, 4] - bend.reach
        s = tx * (x - px) + ty * (y - py)
        faces = (nx * ex + ny * ey < 0.0) & _bulges(bend, at)
        c, sine = their[2:]
        dx, dy = -(c * ex - sine * ey), -(sine * ex + c * ey)
        point = np.stack(_moved(their, x, y), 1)
        along = np.minimum(np.minimum(s, length - s), np.where(slack >= 0.0, np.inf, slack * length))
        return _Bent(value, along, np.where(faces, np.inf, -np.inf), point, np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _bowl_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _Bent:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _Bent:
        bowl, mine, their = skin.bowls[i[places]], _some(pose, places), _some(there, places)
        cx, cy = _inside(their, *_moved(mine, bowl[:, 0], bowl[:, 1]))

        _, slack, at = _root(bend, k, _along_from(cx, cy))
        x, y, nx, ny = _bent(bend, at)
        far = np.hypot(x - cx, y - cy)
        ux, uy = (x - cx) / np.maximum(far, LEAST_DIVISOR), (y - cy) / np.maximum(far, LEAST_DIVISOR)
        c, s = their[2:]
        dx, dy = c * ux - s * uy, s * ux + c * uy
        fits = (nx * ux + ny * uy > 0.0) & _bulges(bend, at)
        fan = np.where(fits, _fan(bowl, mine, dx, dy), -np.inf)
        point = np.stack(_moved(their, x, y), 1)
        return _Bent(bowl[:, 2] - far - bend.reach, slack, fan, point, np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _bend_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _Bent:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _Bent:
        def inner(mine: Bends, m: IntArray, own: IntArray) -> _Bent:
            some = places[own]
            return _two_bends(mine, m, _some(pose, some), bend, k[own], _some(there, some))

        return _per_curve(skin, i[places], inner, len(places))

    return _per_curve(skin, j, work, len(i))


def _two_bends(one: Bends, i: IntArray, pose: Pose, other: Bends, j: IntArray, there: Pose) -> _Bent:
    """By Newton's method from the middle of both."""
    u, v = 0.5 * (one.first[i] + one.last[i]), 0.5 * (other.first[j] + other.last[j])
    wide, far = one.last[i] - one.first[i], other.last[j] - other.first[j]
    c, s = pose[2] * there[2] + pose[3] * there[3], pose[2] * there[3] - pose[3] * there[2]
    ox, oy = _inside(pose, np.asarray(there[0]), np.asarray(there[1]))
    moved = np.full(len(u), np.inf)
    for _ in range(40):
        du, dv = newton_step(one.values(u), other.values(v), (ox, oy, c, s))
        most = np.maximum(np.maximum(np.abs(du) / (0.5 * wide), np.abs(dv) / (0.5 * far)), 1.0)
        u = np.clip(u - du / most, one.first[i] - wide, one.last[i] + wide)
        v = np.clip(v - dv / most, other.first[j] - far, other.last[j] + far)
        moved = np.maximum(np.abs(du) / wide, np.abs(dv) / far)
        if (moved <= BENDS_MET).all():
            break
    x, y, nx, ny = _bent(one, one.values(u))
    p, q, mx, my = _bent(other, other.values(v))
    p, q = ox + c * p - s * q, oy + s * p + c * q
    mx, my = c * mx - s * my, s * mx + c * my
    value = nx * (p - x) + ny * (q - y) - one.reach - other.reach
    speed = np.hypot(*one.values(u)[4:6])
    inside = np.minimum(
        np.minimum(u - one.first[i], one.last[i] - u) / wide, np.minimum(v - other.first[j], other.last[j] - v) / far
    )
    met = (moved <= PLACES_MEET) & (nx * mx + ny * my < 0.0)
    wx, wy = _moved(pose, x, y)
    dx, dy = -(pose[2] * nx - pose[3] * ny), -(pose[3] * nx + pose[2] * ny)
    return _Bent(
        value,
        inside * wide * speed,
        np.where(met, np.inf, -np.inf),
        np.stack([wx, wy], 1),
        np.stack([dx, dy], 1),
    )


_MEASURES = (
    _knob_edge, _round_round, _curved(_knob_bend), _curved(_edge_bend), _curved(_bowl_bend), _curved(_bend_bend),
)  # fmt: skip


# --- which parts are near


def circles(skin: Skin, part: int) -> FloatArray:
    """(N, 3): circles (x, y, radius) about the parts of a kind, in the skin's own frame."""
    if part == KNOBS:
        return skin.knobs[:, :3]
    if part == BOWLS:  # its arc, and not all within
        return _about_bowls(skin)
    if part == EDGES:
        middle = 0.5 * (skin.edges[:, :2] + skin.edges[:, 2:4])
        half = 0.5 * np.hypot(*(skin.edges[:, 2:4] - skin.edges[:, :2]).T)
        return np.column_stack([middle, half + skin.edges[:, 4]])
    found: list[FloatArray] = [np.zeros((0, 3))]
    for bend in skin.bends:
        places = bend.first[:, None] + (bend.last - bend.first)[:, None] * np.linspace(0.0, 1.0, 9)
        x, y = bend.values(places)[:2]
        middle = np.stack([0.5 * (x.min(1) + x.max(1)), 0.5 * (y.min(1) + y.max(1))], 1)
        radius = np.max(np.hypot(x - middle[:, :1], y - middle[:, 1:]), axis=1) * 1.05
        found.append(np.column_stack([middle, radius + bend.reach]))
    return np.concatenate(found)


def _about_bowls(skin: Skin) -> FloatArray:
    x, y, radius, turn, half = skin.bowls.T
    small = half < math.pi / 2.0
    some = np.minimum(half, math.pi / 2.0)
    out: FloatArray = radius * np.cos(some) * small
    reach: FloatArray = radius * np.maximum(np.sin(some) + (1.0 - np.cos(some)) * small, ~small)
    return np.column_stack([x + out * np.cos(turn), y + out * np.sin(turn), reach])
