"""Linkage files by the seed, and how free they are by a rigidity matrix of our own."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

RANK = 1e-9
"""Of the largest singular value (rows of length 1): what counts as one. Random places are generic by far."""


@dataclass
class Framework:
    """Vertices, rods, fixed vertices and fixed angles (i; from j to k), as a linkage file lists them."""

    vertices: list[tuple[float, float]] = field(default_factory=list)
    rods: list[tuple[int, int]] = field(default_factory=list)
    fixed: list[int] = field(default_factory=list)
    angles: list[tuple[int, int, int]] = field(default_factory=list)

    def text(self, choose: random.Random) -> str:
        """As a file: its sections in any order and in parts, under other headers, with any system's line ends."""
        parts = {
            "v": _cut([f"{x!r} {y!r}" for x, y in self.vertices], choose),
            "e": _cut([f"{i} {j}" for i, j in self.rods], choose),
            "f": _cut([f"{i}" for i in self.fixed], choose),
            "a": _cut([f"{i} {j} {k}" for i, j, k in self.angles], choose),
        }
        words = {"v": "vertices", "e": "edges 7", "f": "fixed", "a": "angles:"}
        lines: list[str] = []
        order = list(parts) * 2
        choose.shuffle(order)
        for kind in order:
            lines += [choose.choice([kind, words[kind]]), *parts[kind].pop(0)]
        return choose.choice(["\n", "\r\n", "\r"]).join([*lines, ""])

    def freedom(self) -> int:
        """Degrees of freedom: twice the vertices, less the rank of the rigidity matrix at the places drawn."""
        rows = self.rows()
        if not len(rows):
            return 2 * len(self.vertices)
        values = np.linalg.svd(rows, compute_uv=False)
        return 2 * len(self.vertices) - int(np.sum(values > RANK * values[0]))

    def rows(self) -> NDArray[np.float64]:
        """(rows, 2 vertices): how lengths, places and angles change with the vertices, rows of length 1."""
        found: list[NDArray[np.float64]] = []
        place = np.array(self.vertices, dtype=float)
        for i, j in self.rods:
            row = np.zeros_like(place)
            row[i], row[j] = place[i] - place[j], place[j] - place[i]
            found.append(row)
        for i in self.fixed:
            for axis in (0, 1):
                row = np.zeros_like(place)
                row[i, axis] = 1.0
                found.append(row)
        for i, j, k in self.angles:
            row = np.zeros_like(place)
            for end, sign in ((j, -1.0), (k, 1.0)):
                x, y = place[end] - place[i]
                turn = sign * np.array([-y, x]) / (x * x + y * y)
                row[end] += turn
                row[i] -= turn
            found.append(row)
        if not found:
            return np.zeros((0, place.size))
        rows = np.stack(found).reshape(len(found), -1)
        return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _cut(lines: list[str], choose: random.Random) -> list[list[str]]:
    cut = choose.randint(0, len(lines))
    return [lines[:cut], lines[cut:]]


def framework(seed: int, largest: int = 9) -> Framework:
    """A framework in general position: parts of any density, vertices without rods, fixed ones, fixed angles."""
    choose = random.Random(seed)
    made = Framework()
    for _ in range(choose.choice([1, 1, 2, 3])):
        first, count = len(made.vertices), choose.randint(1, max(1, largest // 2))
        made.vertices += [(round(choose.uniform(0, 300), 6), round(choose.uniform(0, 300), 6)) for _ in range(count)]
        numbers = range(first, first + count)
        pairs = [(i, j) if choose.random() < 0.5 else (j, i) for i, j in combinations(numbers, 2)]
        density = choose.choice([0.0, 0.3, 0.6, 1.0])
        made.rods += [pair for pair in pairs if choose.random() < density]
        if choose.random() < 0.5:
            made.fixed += choose.sample(numbers, min(count, choose.choice([0, 1, 1, 2])))
        for _ in range(choose.choice([0, 0, 1, 2]) if count > 2 else 0):
            i, j, k = choose.sample(numbers, 3)
            known = {frozenset(corner) for corner in made.angles}
            if frozenset((i, j, k)) not in known and math.dist(made.vertices[j], made.vertices[k]) > 5:
                made.angles.append((i, j, k))
    choose.shuffle(made.rods)
    return made
