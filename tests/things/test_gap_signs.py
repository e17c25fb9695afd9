"""The gap of outlines with hollow corners, against shapely: its sign, and that no shorter way frees."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import Polygon

import movimentum as mv
from tests.broad import broad

Points = list[tuple[float, float]]


def saw(teeth: int, lean: float) -> Points:
    """A rack with teeth on its left."""
    left = [(-14.0 * (k % 2), 18.0 * (k // 2) + lean * (1 - k % 2)) for k in range(2 * teeth)]
    return [*left, (0.0, 18.0 * teeth), (40.0, 18.0 * teeth), (40.0, 0.0)]


def star(points: int, inner: float) -> Points:
    radii = [40.0, inner]
    angles = [math.pi * k / points for k in range(2 * points)]
    return [(radii[k % 2] * math.cos(a), radii[k % 2] * math.sin(a)) for k, a in enumerate(angles)]


def hook(width: float) -> Points:
    return [(0.0, 0.0), (60.0, 0.0), (60.0, 26.0), (60.0 - width, 8.0), (0.0, 8.0)]


def said(name: str, points: Points) -> str:
    anchors = " ".join(f"P{k} = [{x:.12g},{y:.12g}]" for k, (x, y) in enumerate(points))
    return f"{name} : .polygon O = [0,0] {anchors} .through({', '.join(f'P{k}' for k in range(len(points)))});"


def told(one: Points, other: Points, poses: list[tuple[float, float, float]]) -> np.ndarray:
    """The gaps with the second one at (x, y, degrees)."""
    steps = " ".join(
        f"@{k} B.O = [{x:.12g},{y:.12g}]; B.angle = {turned:.12g};" for k, (x, y, turned) in enumerate(poses)
    )
    things = f"{said('A', one)} {said('B', other)}"
    text = f".config(1, 100, 100); {things} @0 A.O = [0,0]; A.angle = 0; g = .gap(A, B); {steps} @{len(poses)}"
    return mv.loads(text).solve()["g"][: len(poses)]


SHAPES = [
    (shape, other)
    for shape in (saw(7, 2.0), star(6, 20.0), saw(4, 0.0))
    for other in (hook(14.0), star(5, 12.0), saw(3, 3.0))
]


@broad(("one", "other"), SHAPES, every=4)
def test_the_sign_and_the_shortest_way(one: Points, other: Points) -> None:
    chooser = random.Random(len(one) * 100 + len(other))
    box = np.array(one)
    low, high = box.min(axis=0) - 30.0, box.max(axis=0) + 30.0
    poses = [
        (chooser.uniform(low[0], high[0]), chooser.uniform(low[1], high[1]), chooser.uniform(-180.0, 180.0))
        for _ in range(40)
    ]
    values = told(one, other, poses)
    first, second = Polygon(one), Polygon(other)
    seen = 0
    for value, (x, y, turned) in zip(values.tolist(), poses, strict=True):
        placed = affinity.translate(affinity.rotate(second, turned, origin=(0, 0)), x, y)
        if first.intersection(placed).area < 1e-6:
            assert value == pytest.approx(first.distance(placed), abs=1e-9)
            continue
        seen += 1
        assert value < 0.0, (x, y, turned)
        for k in range(24):
            a = math.radians(15.0 * k)
            moved = affinity.translate(placed, -0.97 * value * math.cos(a), -0.97 * value * math.sin(a))
            assert first.intersection(moved).area > 0.0, (x, y, turned, 15 * k)
    assert seen >= 10
