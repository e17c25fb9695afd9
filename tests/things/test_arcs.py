"""Rings, sectors, arcs as edges and Bézier curves, against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import movimentum as mv
from movimentum.drawing.beziers import bezier
from movimentum.drawing.figures import body_parts, drawn_points
from movimentum.scene.model import Thing


def things(text: str) -> dict[str, Thing]:
    scene = mv.loads(f"{text}\n@0").solve().timeline.scene
    return {thing.name: thing for thing in scene.things}


def area(points: tuple[tuple[float, float], ...]) -> float:
    return sum(x * v - u * y for (x, y), (u, v) in pairwise([*points, points[0]])) / 2.0


@pytest.mark.parametrize(("begin", "end", "turn"), [(30, 120, 90), (120, 30, 270), (0, 360, 360), (-20, 700, 360)])
def test_a_sector_is_its_part_of_a_disc(begin: float, end: float, turn: float) -> None:
    (part, *_) = body_parts(things(f"S : .sector(40, {begin}, {end}) C = [7,9];")["S"], frozenset())
    assert area(part.points) == pytest.approx(800.0 * math.radians(turn), rel=1e-3)


def test_a_ring_is_the_difference_of_two_discs() -> None:
    (part, *_) = body_parts(things("R : .ring(50, 30) C = [70,20];")["R"], frozenset())
    assert area(part.points) + area(part.holes[0]) == pytest.approx(math.pi * 1600.0, rel=1e-3)


@pytest.mark.parametrize("radius", [25.0, 26.0, 80.0, -25.0, -40.0])
def test_an_arc_has_its_radius_and_its_side(radius: float) -> None:
    said = f"A = [10,10] B = A + [30,40] .arcto(B, {radius});"
    found = np.array(drawn_points(things(f"L : .bar {said}")["L"]))
    side, height = math.copysign(1.0, radius), abs(radius) - math.sqrt(radius**2 - 625.0)
    away = side * ((found - 10.0) @ [0.8, -0.6])  # to the right of a way that turns left
    assert len(found) > 8
    assert away.max() == pytest.approx(height, abs=0.02)
    centre = np.array([25.0, 30.0]) - side * (abs(radius) - height) * np.array([0.8, -0.6])
    assert np.hypot(*(found - centre).T) == pytest.approx(abs(radius), abs=1e-6)
    mirrored = things(f".part P {{ L : .bar {said} }} M : P() .mirrored .at([100,0]);")["M.L"]
    assert np.array(drawn_points(mirrored)) == pytest.approx(found * [-1, 1] + [100, 0])
    x, y = found[len(found) // 2].tolist()
    through = np.array(
        drawn_points(things(f"L : .bar A = [10,10] B = A + [30,40] M = [{x!r},{y!r}] .arcto(M, B);")["L"])
    )
    assert np.hypot(*(through - centre).T) == pytest.approx(abs(radius), abs=1e-6)
    assert (side * ((through - 10.0) @ [0.8, -0.6])).max() == pytest.approx(height, abs=0.02)


def test_a_bezier_curve_is_that_of_de_casteljau() -> None:
    points = np.random.default_rng(5).normal(size=(2, 7, 2))
    found = bezier(points)
    for count, pieces in ((4, 2), (3, 1)):
        for place in range(33 * pieces):
            piece, step = divmod(place, 33)
            left = points[:, (count - 1) * piece :][:, :count]
            while left.shape[1] > 1:
                left = left[:, :-1] + (left[:, 1:] - left[:, :-1]) * (step / 32)
            made = found if count == 4 else bezier(points[:, :3])
            assert np.allclose(made[:, 32 * piece + step], left[:, 0])


@pytest.mark.parametrize(
    ("definition", "code", "help_"),
    [
        ("R : .ring(30, 50) C = [0,0];", "kind/out-of-range", ".ring(50, 30)"),
        ("R : .ring(30, 30) C = [0,0];", "kind/out-of-range", ""),
        ("R : .ring(30, 0) C = [0,0];", "kind/out-of-range", ""),
        ("S : .sector(30, 90, 90) C = [0,0];", "kind/out-of-range", "450"),
        ("S : .sector(-30, 0, 90) C = [0,0];", "kind/out-of-range", ""),
        ("B : .bezier A = [0,0] B = [9,0];", "kind/anchors", ""),
        ("B : .bezier [0,0] [9,0];", "kind/anchors", ""),
        ("B : .bezier A = [0,0] B = [9,0] C = [9,9] D = [0,9] E = [5,5];", "kind/anchors", "three points"),
        ("L : .bar A = [0,0] B = [50,0] .arcto(B, 10);", "kind/out-of-range", "25"),
        ("L : .bar A = [0,0] B = [50,0] .arcto(Q, 30);", "name/unknown-anchor", ""),
        ("L : .bar A = [0,0] B = [50,0] .arcto(A, 30);", "kind/mismatch", "leads to"),
        ("L : .bar A = [0,0] B = [50,0] .arcto(30, B);", "kind/mismatch", ".arcto(M, B)"),
        ("L : .bar A = [0,0] B = [50,0] .arcto(B);", "syntax/arguments", ""),
        ("D : .disc(5) A = [0,0] .arcto(A, 5);", "syntax/misplaced-option", ""),
    ],
)
def test_shapes_that_there_are_not_are_told(definition: str, code: str, help_: str) -> None:
    with pytest.raises(mv.ScriptError) as error:
        mv.loads(f"{definition}\n@0").solve()
    first = error.value.diagnostics[0]
    assert first.code == code
    assert help_ in " ".join(str(each) for each in first.helps)
