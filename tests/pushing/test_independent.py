"""Films in which convex things push each other freely, against another solver: quadratic programs in tiny steps.

The other one knows nothing of phases, events or features: in each step the poses change as little as the gaps, seen
from the last pose, let them; a gap is the largest of the distances along both outlines' normals. Its error falls with
the step, so two steps tell where it goes.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.optimize import minimize

import movimentum as mv
from tests.broad import broad


def box(x: float, y: float, w: float, h: float, turn: float) -> np.ndarray:
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    corners = np.array([[-w, -h], [w, -h], [w, h], [-w, h]]) / 2.0
    return corners @ np.array([[c, s], [-s, c]]) + [x, y]


def rows_of_gaps(one: np.ndarray, other: np.ndarray, near: float) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """The best separating edge's distances: (gap, normal away from the edge, point) of each corner near it."""
    best: tuple[float, list[tuple[float, np.ndarray, np.ndarray, int]]] = (-np.inf, [])
    for owner, (a, b) in enumerate(((one, other), (other, one))):
        for p, q in zip(a, np.roll(a, -1, axis=0), strict=True):
            way = (q - p) / np.hypot(*(q - p))
            normal = np.array([way[1], -way[0]])
            gaps = (b - p) @ normal
            if gaps.min() > best[0]:
                best = (
                    gaps.min(),
                    [(g, normal, c, owner) for g, c in zip(gaps, b, strict=True) if g < gaps.min() + near],
                )
    return best[1]


def stepped(start: list[tuple[float, ...]], drive: float, end: float, h: float) -> np.ndarray:
    """The poses (x, y, turn in radians) of boxes, the first of which moves by ``drive`` a time unit, at the end."""
    sizes = [(w, t) for _, _, w, t, _ in start]
    poses = np.array([[x, y, np.radians(turn)] for x, y, _, _, turn in start])
    masses = np.array([[w * t, w * t, w * t * (w * w + t * t) / 12.0] for w, t in sizes])
    for _ in range(round(end / h)):
        poses[0, 0] += drive * h
        n = 3 * (len(poses) - 1)
        rows, least = [], []
        shapes = [box(x, y, *size, np.degrees(a)) for (x, y, a), size in zip(poses, sizes, strict=True)]
        for i in range(len(poses)):
            for j in range(i + 1, len(poses)):
                for gap, normal, point, owner in rows_of_gaps(shapes[i], shapes[j], 5.0):
                    row = np.zeros(n)
                    on, by = (i, j) if owner == 0 else (j, i)  # the edge is on's, the corner by's
                    for k, sign in ((by, 1.0), (on, -1.0)):
                        if k:
                            r = point - poses[k, :2]
                            row[3 * k - 3 : 3 * k] = sign * np.array([*normal, normal[1] * r[0] - normal[0] * r[1]])
                    rows.append(row)
                    least.append(-gap)
        matrix, wanted = np.array(rows), np.array(least)
        if (wanted <= 0.0).all():
            continue
        weight = np.sqrt(masses[1:].ravel())
        scaled = matrix / weight
        found = minimize(
            lambda y: 0.5 * y @ y,
            np.zeros(n),
            jac=lambda y: y,
            constraints={"type": "ineq", "fun": partial(_above, scaled, wanted), "jac": lambda _, rows=scaled: rows},
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 200},
        )
        poses[1:] += (found.x / weight).reshape(-1, 3)
    return poses


def _above(rows: np.ndarray, least: np.ndarray, y: np.ndarray) -> np.ndarray:
    return rows @ y - least


def film(start: list[tuple[float, ...]], drive: float, end: float) -> mv.Motion:
    things = []
    for k, each in enumerate(start):
        corners = box(*each)
        middle = corners.mean(axis=0)
        anchors = " ".join(f"P{i} = [{x:.15g}, {y:.15g}]" for i, (x, y) in enumerate(corners))
        things.append(f"B{k} : .polygon O = [{middle[0]:.15g}, {middle[1]:.15g}] {anchors} .through(P0, P1, P2, P3);")
    pushes = " ".join(f".gap(B{i}, B{j}) >= 0 .pushes;" for i in range(len(start)) for j in range(i + 1, len(start)))
    pushes += " ".join(f" B{k}.O = [_, _];" for k in range(1, len(start)))
    x, y = start[0][:2]
    return mv.loads(
        f".config(10, 400, 300); {' '.join(things)} @0 B0.O = [{x} + {drive}*.t, {y}]; B0.angle = 0; {pushes} @{end}"
    ).solve()


@broad("seed", range(12), first=2)
def test_boxes_go_as_another_solver_says(seed: int) -> None:
    random = np.random.default_rng(seed)
    count = 2 + seed % 2
    start = [(50.0, 100.0, 30.0, 24.0, float(random.uniform(-30, 30)))]
    start += [
        (
            96.0 + 42.0 * k,
            100.0 + float(random.uniform(-11, 11)),
            float(random.uniform(18, 28)),
            float(random.uniform(14, 26)),
            float(random.uniform(0, 90)),
        )
        for k in range(count)
    ]
    motion = film(start, 40.0, 1.0)
    coarse, fine = (stepped(start, 40.0, 1.0, h) for h in (2e-3, 1e-3))
    for k in range(1, len(start)):
        exact = 2.0 * fine[k] - coarse[k]
        off = np.abs(fine[k] - coarse[k]) + 2e-3
        assert (np.abs(motion[f"B{k}.O"][-1] - exact[:2]) <= off[:2]).all()
        turned = np.radians(motion[f"B{k}.angle"][-1] + start[k][4])
        assert abs(turned - exact[2]) <= off[2]
    assert pytest.approx(90.0) == motion["B0.O"][-1, 0]
