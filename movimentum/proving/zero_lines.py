"""The zero set of a polynomial in x and y, as lines to draw."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import product
from math import comb
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray

CELLS = 200
"""Of the grid on which signs are looked at, along the longer side."""
DIGITS = 400
"""With which coefficients are moved to the middle of the picture, where a float is enough."""

Spot = tuple[float, float]
Box = tuple[float, float, float, float]
_Edge = tuple[int, int, int]


def values_on(equation: Any, across: FloatArray, up: FloatArray) -> FloatArray:
    """(len(up), len(across)) values of a form in SymPy's x and y, but for a factor."""
    import sympy as library
    from mpmath import mp

    sympy: Any = library
    context: Any = mp
    x0, y0 = (0.5 * float(each[0] + each[-1]) for each in (across, up))
    size = max(float(across[-1] - across[0]), float(up[-1] - up[0])) or 1.0
    x, y = sympy.symbols("x y")
    with mp.workdps(DIGITS):
        terms = [
            (i, j, context.mpf(sympy.N(c, DIGITS))) for (i, j), c in sympy.Poly(equation, x, y, domain="EX").terms()
        ]
        moved: defaultdict[tuple[int, int], Any] = defaultdict(int)
        for i, j, c in terms:
            for p, q in product(range(i + 1), range(j + 1)):
                moved[p, q] += c * comb(i, p) * comb(j, q) * context.mpf(x0) ** (i - p) * context.mpf(y0) ** (j - q)
        scaled: dict[tuple[int, int], Any] = {(p, q): c * context.mpf(size) ** (p + q) for (p, q), c in moved.items()}
        largest: Any = max(abs(each) for each in scaled.values())
        matrix = np.zeros([max(each[k] for each in scaled) + 1 for k in (0, 1)])
        for (p, q), c in scaled.items():
            matrix[p, q] = float(c / largest)
    polynomial: Any = np.polynomial.polynomial
    return polynomial.polygrid2d((across - x0) / size, (up - y0) / size, matrix).T


def zero_lines(equation: Any, box: Box) -> list[list[Spot]]:
    """The lines in ``box`` (left, bottom, right, top) on which a form is zero, each as points; by marching
    squares (Lorensen & Cline 1987, in the plane).
    """
    left, bottom, right, top = box
    step = max(right - left, top - bottom) / CELLS
    across = np.arange(left, right + step, step)
    up = np.arange(bottom, top + step, step)
    z = values_on(equation, across, up)
    above = z > 0.0
    joined: defaultdict[_Edge, list[_Edge]] = defaultdict(list)
    beside, over = above[:, :-1] != above[:, 1:], above[:-1] != above[1:]
    mixed = beside[:-1] | beside[1:] | over[:, :-1]
    for j, i in zip(*np.nonzero(mixed), strict=True):
        edges = [(0, int(j), int(i)), (1, int(j), int(i) + 1), (0, int(j) + 1, int(i)), (1, int(j), int(i))]
        crossed = [edge for edge in edges if _crossed(above, edge)]
        for a, b in zip(crossed[::2], crossed[1::2], strict=False):
            joined[a].append(b)
            joined[b].append(a)

    def spot(edge: _Edge) -> Spot:
        upright, j, i = edge
        a, b = z[j, i], z[j + upright, i + 1 - upright]
        share = float(a / (a - b))
        return float(across[i]) + step * share * (1 - upright), float(up[j]) + step * share * upright

    return [[spot(edge) for edge in line] for line in _chained(joined)]


def _crossed(above: Any, edge: _Edge) -> bool:
    upright, j, i = edge
    return bool(above[j, i] != above[j + upright, i + 1 - upright])


def _chained(joined: dict[_Edge, list[_Edge]]) -> Iterator[list[_Edge]]:
    """Lines through joined edges, open ones first, then loops."""
    left = {edge: list(others) for edge, others in joined.items()}
    for ends in (1, 2):
        for start in joined:
            while len(left[start]) == ends or (ends == 2 and left[start]):
                line, here = [start], start
                while left[here]:
                    there = left[here].pop()
                    left[there].remove(here)
                    line.append(there)
                    here = there
                yield line
