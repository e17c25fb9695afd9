"""Penrose's rhombus tilings, and the linkages that open and close them.

A tiling is inflated from a sun of five thick rhombuses by Robinson triangles (half rhombuses; Grünbaum & Shephard,
*Tilings and Patterns*, 10.3), completed to whole rhombuses after every step. In the transformable linkage every edge is
two rods with a pivot at its middle, and the half edges around a vertex are one rigid star. Turning every star by
±theta, neighbours against each other, brings all vertices to C + cos(theta) (P - C): edges stay parallel, and the whole
tiling shrinks.
"""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

from movimentum.interop.linkages import Linkage, turn

GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0
Triangle = tuple[bool, complex, complex, complex]
"""Thick or thin, apex, and the ends of the diagonal across which the other half lies."""


def _key(z: complex) -> tuple[int, int]:
    return round(z.real * 1e6), round(z.imag * 1e6)


def _whole(triangles: list[Triangle]) -> list[Triangle]:
    """With every missing half added."""
    found: dict[tuple[object, ...], Triangle] = {}
    for thick, a, b, c in triangles:
        for apex in (a, b + c - a):
            found.setdefault((_key(apex), frozenset((_key(b), _key(c)))), (thick, apex, b, c))
    return list(found.values())


def _inflated(triangles: list[Triangle]) -> list[Triangle]:
    """Every half rhombus cut into smaller ones, scaled so that edges keep their length."""
    result: list[Triangle] = []
    for thick, a, b, c in triangles:
        if thick:
            q, r = b + (a - b) / GOLDEN, b + (c - b) / GOLDEN
            result += [(True, r, c, a), (True, q, r, b), (False, r, q, a)]
        else:
            p = a + (b - a) / GOLDEN
            result += [(False, c, p, b), (True, p, c, a)]
    return [(thick, GOLDEN * a, GOLDEN * b, GOLDEN * c) for thick, a, b, c in result]


def tiling(order: int, edge: float = 60.0) -> tuple[list[complex], list[tuple[int, int]]]:
    """Vertices and edges (pairs of vertex numbers) of the tiling of an order from 1; its middle is at 0."""
    sun: list[Triangle] = []
    for k in range(5):
        ahead = cmath.rect(1.0, math.radians(72.0 * k))
        left, right = (ahead * cmath.rect(1.0, math.radians(turned)) for turned in (36.0, -36.0))
        sun += [(True, left, left + right, 0j), (True, right, left + right, 0j)]
    triangles = sun
    for _ in range(order - 1):
        triangles = _whole(_inflated(triangles))
    place: dict[tuple[int, int], int] = {}
    vertices: list[complex] = []
    edges: dict[frozenset[int], tuple[int, int]] = {}

    def number(z: complex) -> int:
        if _key(z) not in place:
            place[_key(z)] = len(vertices)
            vertices.append(edge * z)
        return place[_key(z)]

    for _, a, b, c in triangles:
        for end in (b, c):
            i, j = number(a), number(end)
            edges.setdefault(frozenset((i, j)), (min(i, j), max(i, j)))
    return vertices, sorted(edges.values())


def rhombuses(order: int, middle: complex = 300 + 300j, edge: float = 60.0) -> Linkage:
    """The tiling's edges as rods, pivoted at its vertices."""
    vertices, edges = tiling(order, edge)
    return Linkage(tuple(((z + middle).real, (z + middle).imag) for z in vertices), tuple(edges))


def transformable(order: int, middle: complex = 300 + 300j, edge: float = 60.0) -> Linkage:
    """The linkage that opens and closes the tiling: its first vertices are the tiling's, then the edges' middles."""
    vertices, edges = tiling(order, edge)
    points = [*vertices, *((vertices[i] + vertices[j]) / 2.0 for i, j in edges)]
    places = tuple(((z + middle).real, (z + middle).imag) for z in points)
    rods: list[tuple[int, int]] = []
    halves: list[list[int]] = [[] for _ in vertices]
    for k, ends in enumerate(edges, start=len(vertices)):
        for i in ends:
            rods.append((i, k))
            halves[i].append(k)
    angles: list[tuple[int, int, int]] = []
    for i, around in enumerate(halves):
        around.sort(key=lambda k, i=i: cmath.phase(points[k] - points[i]))
        angles += [(i, a, b) for a, b in pairwise(around)]
    degrees = tuple(36.0 * round(turn(places, corner) / 36.0) for corner in angles)
    return Linkage(places, tuple(rods), (), tuple(angles), degrees)
