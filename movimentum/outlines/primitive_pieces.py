"""The lines, arcs and corners among the pieces of an outline as numbers, computed all at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import Expr
from movimentum.expressions.arrays import sincosd
from movimentum.expressions.tables import Table
from movimentum.tolerances import EDGE_IS_ARC, LEAST_DIVISOR


def primitives_of(
    functions: Sequence[Callable[[FloatArray], list[FloatArray]]], breaks: Sequence[float]
) -> tuple[FloatArray, BoolArray]:
    """(11, N) numbers c (2), v (2), r, t, k (2), a, f, w of N pieces: s after its beginning, a piece is at
    c + v s + r e(t + w s), where e(u) is (cos u, sin u), in the direction k + a e(f + w s). (N,): whether it is so.

    ``functions``: from places to position, direction and velocity of each; ``breaks``: from where to where they go.
    """
    forms = np.zeros((11, len(functions)))
    known = np.zeros(len(functions), dtype=np.bool_)
    for k, (begin, end) in enumerate(pairwise(breaks)):
        places = np.linspace(begin, end, 7)
        x, y, tx, ty, dx, dy = np.stack(functions[k](places))[:6]
        turns = np.unwrap(np.arctan2(ty, tx))
        w = (turns[-1] - turns[0]) / (end - begin)
        if not np.isfinite(w):
            continue
        speed = float(np.hypot(tx, ty)[0])
        if max(np.ptp(tx), np.ptp(ty)) == 0.0:
            forms[:, k] = x[0], y[0], dx[0], dy[0], 0.0, 0.0, tx[0], ty[0], 0.0, 0.0, 0.0
        else:
            r = float(np.hypot(dx, dy)[0]) / w if w else 0.0
            t = turns[0] - np.pi / 2.0
            forms[:, k] = x[0] - r * np.cos(t), y[0] - r * np.sin(t), 0, 0, r, t, 0, 0, speed, turns[0], w
        found = primitive_values(np.repeat(forms[:, k : k + 1], len(places), axis=1), places - begin)
        extent = max(float(np.abs([x, y]).max()), LEAST_DIVISOR)
        off = np.abs(found[:4] - [x, y, tx, ty]).max(axis=1)
        known[k] = max(off[:2]) <= EDGE_IS_ARC * extent and max(off[2:]) <= EDGE_IS_ARC * speed
    return forms, known


def primitives_of_edges(
    position: tuple[Expr, Expr], direction: tuple[Expr, Expr], breaks: FloatArray
) -> FloatArray | None:
    """The same of straight edges and the corners between them, from the tables (of straight pieces from break to break)
    that say where they are and where they lead; None where no tables say it.
    """
    angle = direction[0].args[0] if direction[0].op == "cosd" else None
    if angle is None or direction[1].op != "sind" or direction[1].args[0] != angle:
        return None
    rows: list[FloatArray] = []
    for each in (*position, angle):
        table = each.payload
        if each.value is not None:
            rows.append(np.full(len(breaks), float(each.value)))
        elif each.op == "table" and isinstance(table, Table) and np.array_equal(table.x, breaks) and not table.order:
            rows.append(table.y)
        else:
            return None
    x, y, turned = rows
    (vx, vy, turns), zero = (np.diff(each) / np.diff(breaks) for each in rows), np.zeros(len(breaks) - 1)
    still = (turns == 0.0).astype(np.float64)
    s, c = sincosd(turned[:-1])
    return np.stack([
        x[:-1], y[:-1], vx, vy, zero, zero, still * c, still * s,
        1.0 - still, np.radians(turned[:-1]), np.radians(turns),
    ])  # fmt: skip


def primitive_values(forms: FloatArray, s: FloatArray) -> FloatArray:
    """(8, K): position, direction, velocity and change of the direction, for forms (11, K) of as many places."""
    cx, cy, vx, vy, r, t, kx, ky, a, f, w = forms
    c, n = np.cos(t + w * s), np.sin(t + w * s)
    p, q = np.cos(f + w * s), np.sin(f + w * s)
    return np.stack([
        cx + vx * s + r * c, cy + vy * s + r * n, kx + a * p, ky + a * q,
        vx - r * w * n, vy + r * w * c, -a * w * q, a * w * p,
    ])  # fmt: skip
