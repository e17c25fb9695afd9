"""Poles: where a body has no velocity at a moment, and where two bodies have the same.

With the velocity v of a point A of a body and its angular velocity w (radians per time unit), the velocity at P is
v + w J (P - A), J a quarter turn. Where two bodies' are equal, (w1 - w2) P = w1 A1 - w2 A2 - J (v2 - v1): a pole in
homogeneous coordinates, which is at infinity where the bodies turn alike. The inflection circle has its centre at
P + a / (2 w^2), where a is the acceleration of the body's point at its pole P, and goes through P (Bottema and Roth,
Theoretical Kinematics, 1979). All rates are exact (`solver.rates`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, symbol
from movimentum.scene.model import AnchorCoordinate, ThingAngle
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.tolerances import LEAST_DIVISOR


def pole_of(
    motion: PathMotion, bodies: Sequence[int], poses: Poses, times: Sequence[Fraction]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(F,) each, (x w, y w, w): the pole of a body, or that of the first body relative to the second, at ``times``,
    whose poses are ``poses``. ``w`` is 0 where it is at infinity; nan where there is no velocity.
    """
    x, y, w = _moment(motion, bodies[0], poses, times)
    if len(bodies) > 1:
        u, v, other = _moment(motion, bodies[1], poses, times)
        x, y, w = x - u, y - v, w - other
    return x, y, w


def place_of(pole: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
    """(F, 2) the pole in the world; nan where it is at infinity."""
    x, y, w = pole
    with np.errstate(all="ignore"):
        found = np.stack([x, y], axis=-1) / w[:, None]
    return np.where(np.isfinite(found), found, np.nan)


def inflection_circle(
    motion: PathMotion, body: int, poses: Poses, times: Sequence[Fraction]
) -> tuple[FloatArray, FloatArray]:
    """(F, 2) centres and (F,) radii of the inflection circle; nan where there is none."""
    place, w = place_of(pole := pole_of(motion, (body,), poses, times)), pole[2]
    where = _anchor(motion, body, poses)
    ax, ay, alpha = _rates(motion, body, 2, times)
    away = place - where
    turned = np.stack([-away[:, 1], away[:, 0]], axis=-1)
    there = np.stack([ax, ay], axis=-1) + alpha[:, None] * turned - (w**2)[:, None] * away
    with np.errstate(all="ignore"):
        half = there / (2.0 * np.where(np.abs(w) > LEAST_DIVISOR, w, np.nan) ** 2)[:, None]
    return place + half, np.hypot(half[:, 0], half[:, 1])


def _moment(
    motion: PathMotion, body: int, poses: Poses, times: Sequence[Fraction]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """w A - J^-1 v, and w: where J^-1 (a, b) = (b, -a) and v + w J (P - A) = 0."""
    place = _anchor(motion, body, poses)
    vx, vy, w = _rates(motion, body, 1, times)
    return w * place[:, 0] - vy, w * place[:, 1] + vx, w


def _anchor(motion: PathMotion, body: int, poses: Poses) -> FloatArray:
    return poses.world(body, motion.timeline.scene.things[body].anchors[0].local)


def _rates(motion: PathMotion, body: int, order: int, times: Sequence[Fraction]) -> FloatArray:
    """(3, F): of x and y of a body's first anchor, and of its angle in radians."""
    from movimentum.solver.rates.rates import UndefinedRate, rates_at

    asked: list[Expr] = [symbol(AnchorCoordinate(body, 0, axis)) for axis in (0, 1)]
    try:
        found = rates_at(motion, [*asked, symbol(ThingAngle(body))], order, times)
    except UndefinedRate:
        return np.full((3, len(times)), np.nan)
    found[2] *= math.pi / 180.0
    return found
