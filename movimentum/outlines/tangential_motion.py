"""Where the velocity of a moving outline lies along the outline, and where it points outwards."""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.outlines.bracketed_roots import bracketed_roots
from movimentum.outlines.contour import Contour
from movimentum.tolerances import CUT_RESTS, PLACE_FOUND


def inward_speed(tool: Contour, place: FloatArray, inward: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How fast the outline goes to its left, times the length of its direction; and how that changes with the place."""
    px, py, tx, ty, dx, dy, rx, ry = tool.values(place)
    vx, vy, w = inward
    ux, uy = vx - w * py, vy + w * px
    return tx * uy - ty * ux, rx * uy - ry * ux + w * (tx * dx + ty * dy)


def outward_speed(tool: Contour, place: FloatArray, pose: FloatArray) -> FloatArray:
    """How fast places of the outline go outwards."""
    _, _, c, s, vx, vy, w = pose[:7]
    tx, ty = tool.values(place)[2:4]
    value = inward_speed(tool, place, np.stack([c * vx + s * vy, c * vy - s * vx, w])[:, None])[0]
    found: FloatArray = tool.side * value / np.hypot(tx, ty)
    return found


def tangential_places(tool: Contour, inward: FloatArray, moves: Any) -> tuple[Any, FloatArray, Any]:
    """Where the outline goes along itself, for velocities (3, N) in its frame: which of the N, the place, and whether
    it goes inwards before that place and outwards behind it, sorted by N and place.
    """
    if tool.radius is not None and not inward[2].any():
        return _tangential_places_of_circle(tool, inward, moves)
    samples = tool.samples
    grid = samples[None, :]
    value = np.where(moves[:, None], inward_speed(tool, grid, inward[:, :, None])[0], 1.0)
    tx, ty = tool.values(samples)[2:4]
    speed = np.hypot(inward[0], inward[1]) + abs(inward[2]) * tool.size
    value[abs(value) <= CUT_RESTS * speed[:, None] * np.hypot(tx, ty)] = 0.0
    positive = value >= 0.0
    number, k = np.nonzero(positive[:, 1:] != positive[:, :-1])
    rising, flow = positive[number, k + 1], inward[:, number]

    def at(place: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        value, change = inward_speed(tool, place, flow)
        return value, change, (value >= 0.0) != rising

    place = bracketed_roots(at, samples[k], samples[k + 1], PLACE_FOUND * tool.period)
    return number, place, rising


def _tangential_places_of_circle(tool: Contour, inward: FloatArray, moves: Any) -> tuple[Any, FloatArray, Any]:
    """The same of a circle by its angle that does not turn: on both sides of its way."""
    number = np.repeat(np.nonzero(moves)[0], 2)
    ahead: FloatArray = np.degrees(np.arctan2(inward[1], inward[0]))[number]
    rising = np.arange(len(number)) % 2 == 0
    place = tool.inside(ahead + np.where(rising, 90.0, -90.0))
    order = np.lexsort([place, number])
    return number, place[order], rising[order]
