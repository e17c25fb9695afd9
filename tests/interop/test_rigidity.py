"""Rigidity matrices over vertices: the figures of the page that they come from, and derivatives by differences."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from movimentum.interop.linkage_export import rigidity_rows
from movimentum.interop.linkages import Linkage, turn
from movimentum.repl.session import opened
from movimentum.repl.shell import answer
from movimentum.workflow.choices import Choices

# "Rigidity Theory" of the page "Mechanical Linkages in Python" (2007): vertices at (0,0), (1,0) and (0,1)
ROD = Linkage(((0, 0), (1, 0)), ((0, 1),))
ONE_FIXED = Linkage(((0, 0), (1, 0)), ((0, 1),), (0,))
BOTH_FIXED = Linkage(((0, 0), (1, 0)), ((0, 1),), (0, 1))
RIGHT_ANGLE = Linkage(((0, 0), (1, 0), (0, 1)), ((0, 1), (0, 2)), (0,), ((0, 1, 2),), (90.0,))


@pytest.mark.parametrize(
    ("linkage", "rows"),
    [
        (ROD, ["1 0 -1 0"]),
        (ONE_FIXED, ["1 0 0 0", "0 1 0 0", "1 0 -1 0"]),
        (BOTH_FIXED, ["1 0 0 0", "0 1 0 0", "0 0 1 0", "0 0 0 1", "1 0 -1 0"]),
        (RIGHT_ANGLE, ["1 0 0 0 0 0", "0 1 0 0 0 0", "1 0 -1 0 0 0", "0 1 0 0 0 -1", "0 0 0 1 1 0"]),
    ],
)
def test_the_matrices_of_the_page(linkage: Linkage, rows: list[str]) -> None:
    assert [" ".join(f"{value:g}" for value in row) for row in rigidity_rows(linkage)[1].tolist()] == rows


@pytest.mark.parametrize("seed", range(20))
def test_rows_are_rates(seed: int) -> None:
    made = random.Random(seed)
    places = [(made.uniform(-200, 200), made.uniform(-200, 200)) for _ in range(5)]
    rods = tuple(made.sample([(i, j) for i in range(5) for j in range(i)], 5))
    angles = tuple(tuple(made.sample(range(5), 3)) for _ in range(3))
    linkage = Linkage(tuple(places), rods, (), angles, tuple(turn(places, angle) for angle in angles))
    velocity = np.array([[made.gauss(0, 1), made.gauss(0, 1)] for _ in places])
    names, matrix = rigidity_rows(linkage)
    assert names[:5] == tuple(f"rod {i} {j}" for i, j in rods)
    step = 1e-4

    def moved(sign: int) -> list[tuple[float, float]]:
        return [tuple(p + sign * step * v) for p, v in zip(np.array(places), velocity, strict=True)]

    def rate(values: list[float]) -> float:
        return (values[1] - values[0]) / (2.0 * step)

    for row, (i, j) in zip(matrix[:5], rods, strict=True):
        length = [math.dist(p[i], p[j]) ** 2 / 2.0 for p in (moved(-1), moved(1))]
        assert -(row @ velocity.ravel()) == pytest.approx(rate(length), rel=1e-6, abs=1e-6)
    for row, (i, j, k) in zip(matrix[5:], angles, strict=True):
        degrees = [turn(p, (i, j, k)) for p in (moved(-1), moved(1))]
        if abs(degrees[1] - degrees[0]) < 180.0:
            sides = math.dist(places[i], places[j]) * math.dist(places[i], places[k])
            truth = -math.radians(rate(degrees)) * sides
            assert row @ velocity.ravel() == pytest.approx(truth, rel=1e-5, abs=1e-4)


def test_in_the_debugger(tmp_path) -> None:
    path = tmp_path / "angle.mov"
    path.write_text(
        "A : .bar P = [0,0] Q = [1,0];  B : .bar P = [0,0] R = [0,1];\n"
        "@0 A.P = [0,0]; B.P = A.P; .a(A.Q - A.P, B.R - B.P) = 90; x = A.Q.x;\n"
    )
    text = answer(opened(str(path), Choices()), "free --matrix --vertices")[1]
    assert [line.split()[-6:] for line in text.splitlines() if line.startswith("angle")] == [list("000110")]
    assert "vertex 0: A.P = B.P" in text
    assert "not in it: line 2: x = A.Q.x" in text
    assert "rank 5: 1 free motion" in text
    assert [line.split() for line in text.splitlines()[-2:]] == [["y1", "1"], ["x2", "-1"]]
