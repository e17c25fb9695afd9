"""How a path leaves a change point that it begins at: two paths cross there, and the Jacobian tells no speeds.

The speeds are v + a w, with any v that the linear equations allow, w the vector that the Jacobian takes to zero, and a
root a of the quadratic that the equations of second order leave (the algebraic bifurcation equation: Keller, *Lectures
on Numerical Methods in Bifurcation Problems*, ch. 5).
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.solver.block.local import Local
from movimentum.solver.block.scaling import scaled

ASIDE = 1e-4
"""Of the unknowns' scale: how far along a speed the equations are looked at."""


def branch_rate(local: Local, tau: float, x: FloatArray, scale: FloatArray, rate: FloatArray) -> FloatArray:
    """Of the speeds (n,) with which paths leave core values ``x`` (n,) at ``tau``, the one that turns things least;
    ``rate``, the least that the linear equations allow, where there are no such speeds.
    """
    block = local.block
    rows, lengths = scaled(local.probe(np.array([tau])).jacobian(x[None]), scale)
    if block.rows != len(x) or not (np.isfinite(rows).all() and np.isfinite(rate).all()):
        return rate
    left, singular, right = np.linalg.svd(rows[0])
    # the fastest unknown's speed, or one unit of its scale over the stretch
    largest = max(float(np.max(np.abs(rate) / scale)), 1.0 / max(local.high - local.low, 1e-300))
    if len(singular) < 2 or singular[-2] < 1e-6 * singular[0]:
        return rate
    step = ASIDE / largest
    units = np.array([-1.0, 0.0, 1.0])
    points = x + step * (rate + (units * largest)[:, None] * right[-1] * scale)
    bent = (local.probe(np.full(3, tau + step)).residual(points) / lengths[0]) @ left[:, -1]
    a, b, c = 0.5 * (bent[0] + bent[2]) - bent[1], 0.5 * (bent[2] - bent[0]), bent[1]
    square = b * b - 4.0 * a * c
    # a fold, where one solution more is lost, has no such speeds: what is left is not of second order
    if not (a != 0.0 and square >= 0.0 and abs(c) <= 1e3 * ASIDE**2):
        return rate
    roots = (-b + np.array([1.0, -1.0]) * np.sqrt(square)) / (2.0 * a)
    found = [rate + float(root) * largest * right[-1] * scale for root in roots]
    return min(found, key=lambda speed: _moved(local, tau, x, scale, speed * step, step))


def _moved(local: Local, tau: float, x: FloatArray, scale: FloatArray, way: FloatArray, step: float) -> float:
    """How far all of a block's unknowns move on the ``way`` (n,) of its core in a time ``step`` (sum of squares)."""
    sizes = local.sizes
    if sizes is None:
        return float(np.sum((way / scale) ** 2))
    values: list[FloatArray] = []
    for time, core in ((tau, x), (tau + step, x + way)):
        there = local.probe(np.array([time])).completed(core[None])
        values.append(np.array([first_of(there[n]) for n in local.block.unknowns]))
    return float(np.sum(((values[1] - values[0]) / sizes) ** 2))
