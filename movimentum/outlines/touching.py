"""Where two skins may touch: the distance of each of their parts, whether it is there that they would, and which way.

A distance is that of an edge's whole line, of a whole circle, of a curve along its normal: a smooth function of both
poses. It is a distance of the outlines only where the place is on both parts, and within their fans: where its *slack*
is not negative.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

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


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """M places where two skins may touch: ``value`` (M,), ``along`` (M,) how far it is inside the parts (px), ``fan``
    (M,) and inside the fans (radians), a ``point`` (M, 2) on the line of contact, and the ``normal`` (M, 2), along
    which the first one moves away.
    """

    value: FloatArray
    along: FloatArray
    fan: FloatArray
    point: FloatArray
    normal: FloatArray

    def there(self, within: float) -> NDArray[np.bool_]:
        """(M,) whether the outlines are that near to each other there."""
        return (self.along >= -within) & (self.fan >= -OUTLINE_FAN)

    def first(self) -> Touch:
        """The first of F poses, where there are (F, M) places."""
        return Touch(self.value[0], self.along[0], self.fan[0], self.point[0], self.normal[0])

    def turned_round(self) -> Touch:
        """The same, of the second and the first."""
        return Touch(self.value, self.along, self.fan, self.point, -self.normal)


def measured(kind: int, skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    """The places of the parts ``i`` in one pose each and ``j`` in another (both (M,)), as ``KINDS[kind]`` says."""
    first, second = KINDS[kind]
    if (first, second) in _MEASURE:
        return _MEASURE[first, second](skin, pose, there, i, j)
    return _MEASURE[second, first](skin, there, pose, j, i).turned_round()


def _moved(pose: Pose, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    px, py, c, s = pose
    return px + c * x - s * y, py + s * x + c * y


def _inside(pose: Pose, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    px, py, c, s = pose
    return c * (x - px) + s * (y - py), c * (y - py) - s * (x - px)


def _some(pose: Pose, places: IntArray) -> Pose:
    """That of some of the places."""
    return tuple(each[places] if isinstance(each, np.ndarray) and each.ndim else each for each in pose)


def _fan(part: FloatArray, pose: Pose, dx: FloatArray, dy: FloatArray) -> FloatArray:
    """How far inside its fan a direction is."""
    turn = part[:, 3] + np.arctan2(pose[3], pose[2])
    c, s = np.cos(turn), np.sin(turn)
    return np.where(part[:, 4] >= math.pi, math.pi, part[:, 4] - np.abs(np.arctan2(c * dy - s * dx, c * dx + s * dy)))


def _knob_edge(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    knob, edge = skin.knobs[i], skin.edges[j]
    x, y = _moved(pose, knob[:, 0], knob[:, 1])
    px, py = _moved(there, edge[:, 0], edge[:, 1])
    qx, qy = _moved(there, edge[:, 2], edge[:, 3])
    length = np.hypot(qx - px, qy - py)
    tx, ty = (qx - px) / length, (qy - py) / length
    nx, ny = ty, -tx
    value = nx * (x - px) + ny * (y - py) - knob[:, 2] - edge[:, 4]
    s = tx * (x - px) + ty * (y - py)
    return Touch(
        value, np.minimum(s, length - s), _fan(knob, pose, -nx, -ny), np.stack([x, y], 1), np.stack([nx, ny], 1)
    )


def _knob_knob(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    a, b = skin.knobs[i], skin.knobs[j]
    x, y = _moved(pose, a[:, 0], a[:, 1])
    u, v = _moved(there, b[:, 0], b[:, 1])
    far = np.hypot(x - u, y - v)
    dx, dy = (x - u) / np.maximum(far, LEAST_DIVISOR), (y - v) / np.maximum(far, LEAST_DIVISOR)
    fan = np.minimum(_fan(a, pose, -dx, -dy), _fan(b, there, dx, dy))
    fan = np.where(far <= LEAST_DIVISOR, -np.inf, fan)
    return Touch(far - a[:, 2] - b[:, 2], np.full(len(far), np.inf), fan, np.stack([x, y], 1), np.stack([dx, dy], 1))


def _knob_bowl(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    a, b = skin.knobs[i], skin.bowls[j]
    x, y = _moved(pose, a[:, 0], a[:, 1])
    u, v = _moved(there, b[:, 0], b[:, 1])
    far = np.hypot(x - u, y - v)
    dx, dy = (x - u) / np.maximum(far, LEAST_DIVISOR), (y - v) / np.maximum(far, LEAST_DIVISOR)
    fan = np.minimum(_fan(a, pose, dx, dy), _fan(b, there, dx, dy))
    fits = (b[:, 2] > a[:, 2]) & (far > LEAST_DIVISOR)
    return Touch(
        b[:, 2] - far - a[:, 2],
        np.full(len(far), np.inf),
        np.where(fits, fan, -np.inf),
        np.stack([x, y], 1),
        np.stack([-dx, -dy], 1),
    )


# --- curves

_Ahead = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def _per_curve(skin: Skin, j: IntArray, work: Callable[[Bends, IntArray, IntArray], Touch], count: int) -> Touch:
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
    return Touch(value, along, fan, point, normal)


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


def _knob_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    def work(bend: Bends, k: IntArray, places: IntArray) -> Touch:
        knob, mine, their = skin.knobs[i[places]], _some(pose, places), _some(there, places)
        wx, wy = _moved(mine, knob[:, 0], knob[:, 1])
        x, y = _inside(their, wx, wy)

        _, slack, at = _root(bend, k, _along_from(x, y))
        px, py, nx, ny = _bent(bend, at)
        value = nx * (x - px) + ny * (y - py) - knob[:, 2] - bend.reach
        c, s = their[2:]
        dx, dy = c * nx - s * ny, s * nx + c * ny
        return Touch(value, slack, _fan(knob, mine, -dx, -dy), np.stack([wx, wy], 1), np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _edge_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    def work(bend: Bends, k: IntArray, places: IntArray) -> Touch:
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
        return Touch(value, along, np.where(faces, np.inf, -np.inf), point, np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _bowl_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    def work(bend: Bends, k: IntArray, places: IntArray) -> Touch:
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
        return Touch(bowl[:, 2] - far - bend.reach, slack, fan, point, np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _bend_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> Touch:
    def work(bend: Bends, k: IntArray, places: IntArray) -> Touch:
        def inner(mine: Bends, m: IntArray, own: IntArray) -> Touch:
            some = places[own]
            return _two_bends(mine, m, _some(pose, some), bend, k[own], _some(there, some))

        return _per_curve(skin, i[places], inner, len(places))

    return _per_curve(skin, j, work, len(i))


def _two_bends(one: Bends, i: IntArray, pose: Pose, other: Bends, j: IntArray, there: Pose) -> Touch:
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
    return Touch(
        value,
        inside * wide * speed,
        np.where(met, np.inf, -np.inf),
        np.stack([wx, wy], 1),
        np.stack([dx, dy], 1),
    )


_MEASURE = {
    (KNOBS, EDGES): _knob_edge,
    (KNOBS, KNOBS): _knob_knob,
    (KNOBS, BOWLS): _knob_bowl,
    (KNOBS, BENDS): _knob_bend,
    (EDGES, BENDS): _edge_bend,
    (BOWLS, BENDS): _bowl_bend,
    (BENDS, BENDS): _bend_bend,
}


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
