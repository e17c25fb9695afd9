"""Tables are enclosed: by mpmath with many digits, of splines that this file computes from their definition."""

from __future__ import annotations

import random
from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from movimentum.certifying.forms import Forms, TimeForm
from movimentum.expressions.tables import Ends, Table

COUNT = 40


def slopes_of(x: list[Any], y: list[Any], periodic: bool) -> list[Any]:
    """The slopes of the cubic spline whose second derivative does not jump; not-a-knot, or periodic, at its ends."""
    n = len(x)
    h = [b - a for a, b in pairwise(x)]
    d = [(b - a) / w for (a, b), w in zip(pairwise(y), h, strict=True)]
    matrix, right = mp.zeros(n), mp.zeros(n, 1)

    def second(i: int, at_end: bool) -> dict[int, Any]:  # of piece i, by m_i, m_(i+1) and (-1) a number
        a, b = (2, 4) if at_end else (-4, -2)
        return {i: a / h[i], i + 1: b / h[i], -1: (-6 if at_end else 6) * d[i] / h[i]}

    def third(i: int) -> dict[int, Any]:
        return {i: 6 / h[i] ** 2, i + 1: 6 / h[i] ** 2, -1: -12 * d[i] / h[i] ** 2}

    def equal(row: int, one: dict[int, Any], other: dict[int, Any]) -> None:
        for sign, side in ((1, one), (-1, other)):
            for k, value in side.items():
                if k < 0:
                    right[row] -= sign * value
                else:
                    matrix[row, k] += sign * value

    for i in range(1, n - 1):
        equal(i, second(i - 1, True), second(i, False))
    if periodic:
        equal(0, second(n - 2, True), second(0, False))
        matrix[n - 1, 0], matrix[n - 1, n - 1] = 1, -1
    else:
        equal(0, third(0), third(1))
        equal(n - 1, third(n - 3), third(n - 2))
    return list(mp.lu_solve(matrix, right))


def truth(table: Table) -> Callable[[Any], Any]:
    """The table as a function of a number, from its rows; None where it says nothing."""
    x, y = ([mpf(repr(value)) for value in row.tolist()] for row in (table.x, table.y))
    periodic = table.ends is Ends.PERIODIC
    m: list[Any] = []
    if table.smooth:
        m = slopes_of(x, y, periodic) if table.slopes is None else [mpf(repr(v)) for v in table.slopes.tolist()]

    def value(u: Any) -> Any:
        if periodic:
            u = u - (x[-1] - x[0]) * mp.floor((u - x[0]) / (x[-1] - x[0]))
        elif not x[0] <= u <= x[-1]:
            if table.ends is not Ends.HELD:
                return None
            return (y[0] if u < x[0] else y[-1]) if table.order == 0 else mpf(0)
        i = min(max(bisect_right(x, u) - 1, 0), len(x) - 2)
        h, d, t = x[i + 1] - x[i], (y[i + 1] - y[i]) / (x[i + 1] - x[i]), u - x[i]
        if not table.smooth:
            return y[i] + d * t if table.order == 0 else d
        a, b = m[i], m[i + 1]
        c2, c3 = (3 * d - 2 * a - b) / h, (a + b - 2 * d) / h**2
        whole = [y[i] + t * (a + t * (c2 + t * c3)), a + t * (2 * c2 + 3 * t * c3), 2 * c2 + 6 * t * c3, 6 * c3]
        return whole[table.order]

    return value


def tables(rng: random.Random) -> list[Table]:
    rows = rng.randrange(4, 9)
    x = np.round(np.cumsum([rng.uniform(0.2, 3.0) for _ in range(rows)]) - rng.uniform(0, 9), 3)
    y = np.round([rng.uniform(-5, 5) for _ in range(rows)], 2)
    round_trip = np.append(y[:-1], y[0])
    slopes = np.round([rng.uniform(-2, 2) for _ in range(rows)], 2)
    return [
        Table(x, y),
        Table(x, y, ends=Ends.HELD),
        Table(x, round_trip, ends=Ends.PERIODIC),
        Table(x, y, smooth=True),
        Table(x, round_trip, smooth=True, ends=Ends.PERIODIC),
        Table(x, y, smooth=True, slopes=slopes, ends=Ends.HELD),
    ]


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 12))])
def test_tables_and_their_derivatives_are_held(seed: int) -> None:
    rng = random.Random(seed)
    held = 0
    with mp.workdps(40), np.errstate(all="ignore"):
        for stated in tables(rng):
            table: Table | None = stated
            while table is not None:
                low, high = table.span
                exact = truth(table)
                width = 10.0 ** rng.uniform(-8, 0)
                c = np.array([rng.uniform(low - 1, high + 1) for _ in range(COUNT)])
                c[:8] = rng.choices(table.x.tolist(), k=8)
                s = width * np.array([rng.uniform(-1, 1) for _ in range(COUNT)])
                r = 0.1 * width * np.array([rng.uniform(0, 1) for _ in range(COUNT)])
                forms = Forms()
                found = forms.call("table", table, [TimeForm(c, s, r)])
                jumps = np.broadcast_to(forms.jump, COUNT)
                for k in range(COUNT):
                    if not np.isfinite(found.r[k]):
                        continue
                    for u in (mpf(-1), mpf(1), mpf(0), mpf(rng.uniform(-1, 1))):
                        at = mpf(float(c[k])) + mpf(float(s[k])) * u + mpf(float(r[k])) * rng.choice([-1, 1])
                        true = exact(at)
                        if true is None:  # just beyond its end, where it is taken for the end
                            continue
                        middle, radius = (mpf(float(each[k])) for each in (found.c, found.r))
                        assert abs(true - middle - mpf(float(found.s[k])) * u) <= radius
                        held += 1
                    if table.order == 0:
                        assert jumps[k] == 0.0
                table = table.derived()
    assert held > 1500


def test_a_short_range_is_enclosed_to_second_order() -> None:
    table = Table(np.array([0.0, 1.0, 2.0, 3.5]), np.array([0.0, 2.0, 1.0, 4.0]), smooth=True)
    wide, narrow = (
        Forms().call("table", table, [TimeForm(np.array([0.4]), np.array([s]), np.zeros(1))]) for s in (1e-2, 1e-3)
    )
    assert narrow.r[0] < 0.02 * wide.r[0] < 1e-4
