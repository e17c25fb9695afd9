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
from movimentum.tolerances import AT_REST, LEAST_DIVISOR


def pole_of(
    motion: PathMotion, bodies: Sequence[int], poses: Poses, times: Sequence[Fraction]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(F,) each, (x w, y w, w): the pole of a body, or that of the first body relative to the second, at ``times``,
    whose poses are ``poses``. ``w`` is 0 where it is at infinity; nan where there is no velocity. Where the bodies are
    at rest for a moment, it is where the pole comes from and goes to: the ratio of the derivatives (l'Hôpital).
    """
    found = _between(motion, bodies, poses, times, 1)
    speed = np.abs(found).max(axis=0)
    still = np.flatnonzero(speed <= AT_REST * motion.size**2)
    if len(still):
        some = [times[number] for number in still.tolist()]
        slopes = _between(motion, bodies, poses.select(still), some, 2)
        begins = np.abs(slopes).max(axis=0) * AT_REST > speed[still]
        found[:, still[begins]] = slopes[:, begins]
    x, y, w = found
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


def _between(
    motion: PathMotion, bodies: Sequence[int], poses: Poses, times: Sequence[Fraction], order: int
) -> FloatArray:
    """(3, F): the `_moment` of the first body, less that of the second."""
    first, *others = (_moment(motion, body, poses, times, order) for body in bodies)
    return first - others[0] if others else first


def _moment(motion: PathMotion, body: int, poses: Poses, times: Sequence[Fraction], order: int) -> FloatArray:
    """(3, F): w A - J^-1 v, and w, where J^-1 (a, b) = (b, -a) and v + w J (P - A) = 0; of ``order`` 2 its rate."""
    x, y = _anchor(motion, body, poses).T
    vx, vy, w = _rates(motion, body, 1, times)
    if order == 1:
        return np.stack([w * x - vy, w * y + vx, w])
    ax, ay, alpha = _rates(motion, body, 2, times)
    return np.stack([alpha * x + w * vx - ay, alpha * y + w * vy + ax, alpha])


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
