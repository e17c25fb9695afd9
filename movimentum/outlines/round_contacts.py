"""Candidate contacts of straight and round parts of two skins: knobs, edges and bowls (see `outlines.skin`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.outlines.skin import Skin
from movimentum.tolerances import LEAST_DIVISOR

Pose = Sequence[FloatArray | float]
"""x, y, cosine and sine: of one pose, or (M,) each, of the M places that are asked about."""

KNOBS, EDGES, BOWLS, BENDS = range(4)
KINDS = (
    (KNOBS, EDGES), (EDGES, KNOBS), (KNOBS, KNOBS), (KNOBS, BOWLS), (BOWLS, KNOBS), (KNOBS, BENDS), (BENDS, KNOBS),
    (EDGES, BENDS), (BENDS, EDGES), (BOWLS, BENDS), (BENDS, BOWLS), (BENDS, BENDS),
)  # fmt: skip
"""Which parts of two skins may touch each other."""
ContactValues = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
"""(F, M) each: value, along, fan, point (x, y) and normal (x, y); see `skin_contacts.SkinContacts`."""
ContactMeasure = Callable[[FloatArray, FloatArray], ContactValues]
"""Of the poses (4, F, M) of those that have the first of two parts, and of those that have the second."""


def in_pose(pose: Pose | FloatArray, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where places of a thing's own are, in its pose."""
    px, py, c, s = pose
    return px + c * x - s * y, py + s * x + c * y


def in_frame(pose: Pose, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where places are in the thing's own frame."""
    px, py, c, s = pose
    return c * (x - px) + s * (y - py), c * (y - py) - s * (x - px)


class NormalFan:
    """How far directions are inside the fans of M knobs or bowls."""

    def __init__(self, part: FloatArray) -> None:
        self.c, self.s, self.half = np.cos(part[:, 3]), np.sin(part[:, 3]), part[:, 4]
        self.round = self.half >= math.pi
        self.all_round, self.some_round = bool(self.round.all()), bool(self.round.any())

    def inside(self, pose: Pose | FloatArray, dx: FloatArray, dy: FloatArray) -> FloatArray:
        """For directions (dx, dy), with the parts in these poses."""
        if self.all_round:
            return np.full(dx.shape, math.pi)
        c, s = pose[2] * self.c - pose[3] * self.s, pose[3] * self.c + pose[2] * self.s
        found = self.half - np.abs(np.arctan2(c * dy - s * dx, c * dx + s * dy))
        return np.where(self.round, math.pi, found) if self.some_round else found


def knob_against_edge(skin: Skin, kind: IntArray, i: IntArray, j: IntArray) -> ContactMeasure:
    """A knob against an edge."""
    knob, edge = skin.knobs[i], skin.edges[j]
    kx, ky, px, py = knob[:, 0], knob[:, 1], edge[:, 0], edge[:, 1]
    wide = np.hypot(edge[:, 2] - px, edge[:, 3] - py)
    wx, wy = (edge[:, 2] - px) / wide, (edge[:, 3] - py) / wide
    reach, fan = knob[:, 2] + edge[:, 4], NormalFan(knob)

    def measure(pose: FloatArray, there: FloatArray) -> ContactValues:
        x, y = in_pose(pose, kx, ky)
        bx, by = in_pose(there, px, py)
        _, _, c, s = there
        size = np.hypot(c, s)
        tx, ty = (c * wx - s * wy) / size, (s * wx + c * wy) / size
        dx, dy = x - bx, y - by
        along = tx * dx + ty * dy
        value = ty * dx - tx * dy - reach
        return value, np.minimum(along, wide * size - along), fan.inside(pose, -ty, tx), x, y, ty, -tx

    return measure


def round_against_round(skin: Skin, kind: IntArray, i: IntArray, j: IntArray) -> ContactMeasure:
    """A knob against a knob, or in a bowl."""
    hollow = kind != KINDS.index((KNOBS, KNOBS))
    a, b = skin.knobs[i], np.empty((len(j), 5))
    b[hollow], b[~hollow] = skin.bowls[j[hollow]], skin.knobs[j[~hollow]]
    ax, ay, bx, by = a[:, 0], a[:, 1], b[:, 0], b[:, 1]
    way = np.where(hollow, -1.0, 1.0)
    reach, fits = a[:, 2] + way * b[:, 2], ~hollow | (b[:, 2] > a[:, 2])
    one, other = NormalFan(a), NormalFan(b)

    def measure(pose: FloatArray, there: FloatArray) -> ContactValues:
        x, y = in_pose(pose, ax, ay)
        u, v = in_pose(there, bx, by)
        dx, dy = x - u, y - v
        far = np.hypot(dx, dy)
        size = np.maximum(far, LEAST_DIVISOR)
        dx, dy = dx / size, dy / size
        nx, ny = way * dx, way * dy
        fan = np.minimum(one.inside(pose, -nx, -ny), other.inside(there, dx, dy))
        fan = np.where(fits & (far > LEAST_DIVISOR), fan, -np.inf)
        return way * far - reach, np.full(far.shape, np.inf), fan, x, y, nx, ny

    return measure
