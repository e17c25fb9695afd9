"""Candidate contacts between two skins: the distance of each pair of parts, its direction, and whether it is valid.

A distance is that of an edge's whole line, of a whole circle, of a curve along its normal: a smooth function of both
poses. It is a distance of the outlines only where the place is on both parts and within their fans, that is, where its
*slack* is not negative.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, IntArray
from movimentum.outlines.curve_contacts import MEASURES
from movimentum.outlines.round_contacts import (
    BOWLS,
    EDGES,
    KINDS,
    KNOBS,
    ContactMeasure,
    knob_against_edge,
    round_against_round,
)
from movimentum.outlines.skin import Skin
from movimentum.records import dataclass
from movimentum.tolerances import OUTLINE_FAN

_FAMILY = np.array([0, 0, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5])
"""By which of `_MEASURES` each is measured,"""
_SWAPPED = np.array([(second, first) in KINDS[:k] for k, (first, second) in enumerate(KINDS)]) & (
    np.array(KINDS)[:, 0] != np.array(KINDS)[:, 1]
)
"""and whether its parts are taken the other way round."""


@dataclass(frozen=True, slots=True, eq=False)
class SkinContacts:
    """Places where two skins may touch, M in each of F poses (F, M): their ``value``, how far each is ``along`` inside
    the parts (px), and inside the ``fan`` (radians), a ``point`` (2, F, M) on the line of contact, and the ``normal``
    (2, F, M), along which the first one moves away.
    """

    value: FloatArray
    along: FloatArray
    fan: FloatArray
    point: FloatArray
    normal: FloatArray

    def is_near(self, within: float) -> NDArray[np.bool_]:
        """Whether the outlines are that near to each other there."""
        return (self.along >= -within) & (self.fan >= -OUTLINE_FAN)


class ContactPairs:
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
        self._parts: list[tuple[slice, IntArray, IntArray, FloatArray, ContactMeasure]] = []
        for low, high in pairwise(cuts):
            part = slice(low, high)
            if low < high:
                measure = _MEASURES[int(families[low])](skin, kind[part], one[part], other[part])
                self._parts.append((part, a[part], b[part], sign[part], measure))

    def touch(self, poses: FloatArray) -> SkinContacts:
        """The places in poses (4, F, B) of the bodies."""
        shape = poses.shape[1], self.count
        found = [(part, sign, measure(poses[:, :, a], poses[:, :, b])) for part, a, b, sign, measure in self._parts]
        if len(found) == 1:
            ((_, sign, (value, along, fan, x, y, nx, ny)),) = found
            return SkinContacts(value, along, fan, np.stack([x, y]), np.stack([nx * sign, ny * sign]))
        value, along, fan = np.empty(shape), np.empty(shape), np.empty(shape)
        point, normal = np.empty((2, *shape)), np.empty((2, *shape))
        for part, sign, (v, inside, turned, x, y, nx, ny) in found:
            value[:, part], along[:, part], fan[:, part] = v, inside, turned
            point[0, :, part], point[1, :, part] = x, y
            normal[0, :, part], normal[1, :, part] = nx * sign, ny * sign
        return SkinContacts(value, along, fan, point, normal)


_MEASURES = knob_against_edge, round_against_round, *MEASURES


# --- which parts are near


def circles(skin: Skin, part: int) -> FloatArray:
    """(N, 3): circles (x, y, radius) about the parts of a kind, in the skin's own frame."""
    if part == KNOBS:
        return skin.knobs[:, :3]
    if part == BOWLS:  # its arc, and not all within
        return _circles_about_bowls(skin)
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


def _circles_about_bowls(skin: Skin) -> FloatArray:
    x, y, radius, turn, half = skin.bowls.T
    small = half < math.pi / 2.0
    some = np.minimum(half, math.pi / 2.0)
    out: FloatArray = radius * np.cos(some) * small
    reach: FloatArray = radius * np.maximum(np.sin(some) + (1.0 - np.cos(some)) * small, ~small)
    return np.column_stack([x + out * np.cos(turn), y + out * np.sin(turn), reach])
