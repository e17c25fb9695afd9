"""Candidate contacts on curves that are neither straight nor arcs: the bends of two skins."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, IntArray
from movimentum.outlines.nearest_search import newton_step
from movimentum.outlines.round_contacts import ContactMeasure, ContactValues, NormalFan, Pose, in_frame, in_pose
from movimentum.outlines.skin import Bends, Skin
from movimentum.tolerances import BENDS_MET, LEAST_DIVISOR, PLACE_FOUND, PLACES_MEET


class _BendContact(NamedTuple):
    """Of N places with curves: (N,), (N,), (N,), (N, 2) and (N, 2); see `skin_contacts.SkinContacts`."""

    value: FloatArray
    along: FloatArray
    fan: FloatArray
    point: FloatArray
    normal: FloatArray


def _some_poses(pose: Pose, places: IntArray) -> Pose:
    """That of some of the places."""
    return tuple(each[places] if isinstance(each, np.ndarray) and each.ndim else each for each in pose)


def _fan(part: FloatArray, pose: Pose, dx: FloatArray, dy: FloatArray) -> FloatArray:
    return NormalFan(part).inside(pose, dx, dy)


def curve_measure(
    measured: Callable[[Skin, Pose, Pose, IntArray, IntArray], _BendContact],
) -> Callable[[Skin, IntArray, IntArray, IntArray], ContactMeasure]:
    """Of N places, as one of M pairs in F poses."""

    def family(skin: Skin, kind: IntArray, i: IntArray, j: IntArray) -> ContactMeasure:
        def measure(pose: FloatArray, there: FloatArray) -> ContactValues:
            shape = pose.shape[1:]
            every = np.tile(i, shape[0]), np.tile(j, shape[0])
            found = measured(skin, tuple(pose.reshape(4, -1)), tuple(there.reshape(4, -1)), *every)
            flat = (*found[:3], *found.point.T, *found.normal.T)
            value, along, fan, x, y, nx, ny = (each.reshape(shape) for each in flat)
            return value, along, fan, x, y, nx, ny

        return measure

    return family


_Ahead = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def _per_curve(
    skin: Skin, j: IntArray, work: Callable[[Bends, IntArray, IntArray], _BendContact], count: int
) -> _BendContact:
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
    return _BendContact(value, along, fan, point, normal)


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


def _points_and_normals(bend: Bends, at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The points (x, y) and the outward normals of values (8, M)."""
    x, y, tx, ty = at[:4]
    size = np.hypot(tx, ty)
    return x, y, -bend.side * ty / size, bend.side * tx / size


def _is_convex(bend: Bends, at: FloatArray) -> NDArray[np.bool_]:
    """Whether it is convex there."""
    _, _, tx, ty, _, _, rx, ry = at
    return (tx * ry - ty * rx) * bend.side < 0.0


def _tangent_distance(x: FloatArray, y: FloatArray) -> _Ahead:
    """How far ahead along the tangent points (x, y) are, which are seen square where that is 0; with its rate."""

    def ahead(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        px, py, tx, ty, dx, dy, rx, ry = at
        size = np.hypot(tx, ty)
        along = (x - px) * tx + (y - py) * ty
        rate = (x - px) * rx + (y - py) * ry - dx * tx - dy * ty
        return along / size, rate / size - along * (tx * rx + ty * ry) / size**3

    return ahead


def _knob_against_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _BendContact:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _BendContact:
        knob, mine, their = skin.knobs[i[places]], _some_poses(pose, places), _some_poses(there, places)
        wx, wy = in_pose(mine, knob[:, 0], knob[:, 1])
        x, y = in_frame(their, wx, wy)

        _, slack, at = _root(bend, k, _tangent_distance(x, y))
        px, py, nx, ny = _points_and_normals(bend, at)
        value = nx * (x - px) + ny * (y - py) - knob[:, 2] - bend.reach
        c, s = their[2:]
        dx, dy = c * nx - s * ny, s * nx + c * ny
        return _BendContact(value, slack, _fan(knob, mine, -dx, -dy), np.stack([wx, wy], 1), np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _edge_against_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _BendContact:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _BendContact:
        edge, mine, their = skin.edges[i[places]], _some_poses(pose, places), _some_poses(there, places)
        px, py = in_frame(their, *in_pose(mine, edge[:, 0], edge[:, 1]))
        qx, qy = in_frame(their, *in_pose(mine, edge[:, 2], edge[:, 3]))
        length = np.hypot(qx - px, qy - py)
        tx, ty = (qx - px) / length, (qy - py) / length
        ex, ey = ty, -tx

        def ahead(at: FloatArray) -> tuple[FloatArray, FloatArray]:
            tx, ty, rx, ry = at[2], at[3], at[6], at[7]
            size = np.hypot(tx, ty)
            along = ex * tx + ey * ty
            return along / size, (ex * rx + ey * ry) / size - along * (tx * rx + ty * ry) / size**3

        _, slack, at = _root(bend, k, ahead)
        x, y, nx, ny = _points_and_normals(bend, at)
        value = ex * (x - px) + ey * (y - py) - edge[:, 4] - bend.reach
        s = tx * (x - px) + ty * (y - py)
        faces = (nx * ex + ny * ey < 0.0) & _is_convex(bend, at)
        c, sine = their[2:]
        dx, dy = -(c * ex - sine * ey), -(sine * ex + c * ey)
        point = np.stack(in_pose(their, x, y), 1)
        along = np.minimum(np.minimum(s, length - s), np.where(slack >= 0.0, np.inf, slack * length))
        return _BendContact(value, along, np.where(faces, np.inf, -np.inf), point, np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _bowl_against_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _BendContact:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _BendContact:
        bowl, mine, their = skin.bowls[i[places]], _some_poses(pose, places), _some_poses(there, places)
        cx, cy = in_frame(their, *in_pose(mine, bowl[:, 0], bowl[:, 1]))

        _, slack, at = _root(bend, k, _tangent_distance(cx, cy))
        x, y, nx, ny = _points_and_normals(bend, at)
        far = np.hypot(x - cx, y - cy)
        ux, uy = (x - cx) / np.maximum(far, LEAST_DIVISOR), (y - cy) / np.maximum(far, LEAST_DIVISOR)
        c, s = their[2:]
        dx, dy = c * ux - s * uy, s * ux + c * uy
        fits = (nx * ux + ny * uy > 0.0) & _is_convex(bend, at)
        fan = np.where(fits, _fan(bowl, mine, dx, dy), -np.inf)
        point = np.stack(in_pose(their, x, y), 1)
        return _BendContact(bowl[:, 2] - far - bend.reach, slack, fan, point, np.stack([dx, dy], 1))

    return _per_curve(skin, j, work, len(i))


def _bend_against_bend(skin: Skin, pose: Pose, there: Pose, i: IntArray, j: IntArray) -> _BendContact:
    def work(bend: Bends, k: IntArray, places: IntArray) -> _BendContact:
        def inner(mine: Bends, m: IntArray, own: IntArray) -> _BendContact:
            some = places[own]
            return _nearest_of_two_bends(mine, m, _some_poses(pose, some), bend, k[own], _some_poses(there, some))

        return _per_curve(skin, i[places], inner, len(places))

    return _per_curve(skin, j, work, len(i))


def _nearest_of_two_bends(one: Bends, i: IntArray, pose: Pose, other: Bends, j: IntArray, there: Pose) -> _BendContact:
    """By Newton's method from the middle of both."""
    u, v = 0.5 * (one.first[i] + one.last[i]), 0.5 * (other.first[j] + other.last[j])
    wide, far = one.last[i] - one.first[i], other.last[j] - other.first[j]
    c, s = pose[2] * there[2] + pose[3] * there[3], pose[2] * there[3] - pose[3] * there[2]
    ox, oy = in_frame(pose, np.asarray(there[0]), np.asarray(there[1]))
    moved = np.full(len(u), np.inf)
    for _ in range(40):
        du, dv = newton_step(one.values(u), other.values(v), (ox, oy, c, s))
        most = np.maximum(np.maximum(np.abs(du) / (0.5 * wide), np.abs(dv) / (0.5 * far)), 1.0)
        u = np.clip(u - du / most, one.first[i] - wide, one.last[i] + wide)
        v = np.clip(v - dv / most, other.first[j] - far, other.last[j] + far)
        moved = np.maximum(np.abs(du) / wide, np.abs(dv) / far)
        if (moved <= BENDS_MET).all():
            break
    x, y, nx, ny = _points_and_normals(one, one.values(u))
    p, q, mx, my = _points_and_normals(other, other.values(v))
    p, q = ox + c * p - s * q, oy + s * p + c * q
    mx, my = c * mx - s * my, s * mx + c * my
    value = nx * (p - x) + ny * (q - y) - one.reach - other.reach
    speed = np.hypot(*one.values(u)[4:6])
    inside = np.minimum(
        np.minimum(u - one.first[i], one.last[i] - u) / wide, np.minimum(v - other.first[j], other.last[j] - v) / far
    )
    met = (moved <= PLACES_MEET) & (nx * mx + ny * my < 0.0)
    wx, wy = in_pose(pose, x, y)
    dx, dy = -(pose[2] * nx - pose[3] * ny), -(pose[3] * nx + pose[2] * ny)
    return _BendContact(
        value,
        inside * wide * speed,
        np.where(met, np.inf, -np.inf),
        np.stack([wx, wy], 1),
        np.stack([dx, dy], 1),
    )


MEASURES = (
    curve_measure(_knob_against_bend),
    curve_measure(_edge_against_bend),
    curve_measure(_bowl_against_bend),
    curve_measure(_bend_against_bend),
)
"""A knob, an edge, a bowl, and a bend against a bend."""
