"""Curves: what they are, where they run, and how they are drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum
from movimentum.errors import ScriptError
from movimentum.scene.outlines import curve_of
from tests.understand import scene_of

PI = math.pi


def outline(text):
    scene = scene_of(f"C : .curve {text};\n@0")
    found = curve_of(scene.things[0])
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("text", "area", "length"),
    [
        ("A = [3,4] .polar(th, 40)", PI * 1600, 80 * PI),
        ("A = [0,0] .polar(th, 100*.cos(th)) .range(-90, 90)", PI * 2500, 100 * PI),
        ("A = [0,0] .param(u, [80*.cos(u), 80*.sin(u)]) .range(0, 180)", PI * 3200, 80 * PI + 160),
        ("A = [0,0] .polar(a, 20 + a/9) .range(0, 360)", None, None),
        ("A = [0,0] .param(u, [.max(-30, .min(30, 60*.cos(u))), .max(-30, .min(30, 60*.sin(u)))])", 3600, 240),
        ("A = [0,0] .polar(th, 40) .range(0, 720)", None, 160 * PI),
        ("A = [9,9] .param(v, [v, { v : 0 > 30 : 20 > 60 : 0 }]) .range(0, 90)", None, 90 + 40 + 90),
    ],
)
def test_areas_and_lengths_are_those_of_closed_forms(text, area, length):
    found = outline(text)
    if area is not None:
        drawn = np.array(found.polyline)
        x, y = drawn.T
        polygon = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2
        assert polygon == pytest.approx(area, rel=2e-4)
    if length is not None:
        assert found.length == pytest.approx(length, rel=1e-10)


def test_a_jump_is_a_straight_piece_with_two_corners():
    snail = outline("A = [0,0] .polar(a, 20 + a/9)")
    assert len(snail.breaks) == 5  # the curve, a corner, the step, a corner
    place = (snail.breaks[2] + snail.breaks[3]) / 2
    assert snail.points(np.array(place)).tolist() == pytest.approx([40, 0], abs=1e-9)
    assert snail.curvature(place) == 0.0
    # the direction is continuous all the way round
    for at in snail.breaks[:-1]:
        x, y = (snail.values(np.array([at - 1e-9, at + 1e-9]))[2:4]).reshape(2, 2)
        turn = math.atan2(x[0] * y[1] - y[0] * x[1], x[0] * x[1] + y[0] * y[1])
        assert abs(turn) < 1e-6


@pytest.mark.parametrize("seed", range(6))
def test_random_laws_have_the_curvature_of_the_textbook(seed):
    random = np.random.default_rng(seed)
    a, b, n, p = random.uniform(30, 60), random.uniform(-6, 6), int(random.integers(1, 5)), random.uniform(0, 360)
    found = outline(f"A = [0,0] .polar(th, {a} + {b}*.cos({n}*th - {p}))")
    degrees = random.uniform(0, 360, 20)
    w = np.radians(n * degrees - p)
    r, d, dd = a + b * np.cos(w), -b * n * np.sin(w), -b * n * n * np.cos(w)
    truth = (r * r + 2 * d * d - r * dd) / (r * r + d * d) ** 1.5
    assert [found.curvature(at) for at in degrees] == pytest.approx(truth, rel=1e-9)


@pytest.mark.parametrize("closed", [True, False])
def test_a_curve_through_points_has_no_jump_in_its_curvature(closed):
    points = [[0, 0], [40, 10], [90, 0], [110, 50], [30, 70]]
    found = outline(f"A = [5,6] .through({', '.join(map(str, points))}){'' if closed else ' .open'}")
    knots = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    assert found.points(knots) == pytest.approx(np.add(points, [5, 6]), abs=1e-10)
    for knot in knots[1:-1]:
        assert found.curvature(knot - 1e-7) == pytest.approx(found.curvature(knot + 1e-7), rel=1e-4, abs=1e-7)


def test_what_is_drawn_is_within_a_fiftieth_of_a_pixel():
    found = outline("A = [0,0] .polar(th, 300 + 40*.cos(5*th) + .abs(th - 180))")
    drawn = np.array([*found.polyline, found.polyline[0]])
    fine = found.points(np.linspace(found.first, found.last, 40_001))
    a, b = drawn[:-1], drawn[1:]
    for point in fine[::97]:
        along = np.clip(np.sum((point - a) * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0, 1)
        assert np.hypot(*(a + along[:, None] * (b - a) - point).T).min() < 0.02


def test_a_copy_turns_and_mirrors_its_curve():
    part = ".part P() { C : .curve A = [10,0] .through([0,0], [40,0], [0,20]); }"
    scene = scene_of(f"{part} Q : P() .at([100,0]) .turned(90) .mirrored; @0")
    found = curve_of(scene.things[0])
    assert found is not None
    at = found.points(np.array(found.first))
    other = found.points(np.array(40.0))
    # mirrored first: (x, y) -> (-x, y), then turned by 90 degrees, then moved
    assert at.tolist() == pytest.approx([100, -10])
    assert (other - at).tolist() == pytest.approx([0, -40])


def test_the_path_of_a_drawing(tmp_path):
    (tmp_path / "plate.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="200" height="100">'
        '<g transform="translate(10,5)"><path id="lobe" d="M50,50 a30,20 0 1,0 60,0 30,20 0 1 0-60,0z"/></g>'
        '<path id="line" d="m10 90h40v-30l20-10q20 0 20 20t20 20"/><circle id="axle" cx="100" cy="50" r="5"/></svg>'
    )
    script = tmp_path / "a.mov"
    script.write_text("A : .curve 'plate.svg#lobe' O = #axle;  B : .curve 'plate.svg#line' O = [100,0];\n@0")
    lobe, line = movimentum.load(script).scene.things
    ellipse = curve_of(lobe)
    assert ellipse is not None
    assert ellipse.closed
    x, y = (ellipse.points(ellipse.samples) - [90, 45]).T
    assert np.hypot(x / 30, y / 20) == pytest.approx(1, abs=1e-6)
    path = curve_of(line)
    assert path is not None
    assert not path.closed
    assert path.points(np.array([path.first, path.last])) == pytest.approx(np.array([[10, 10], [110, 10]]), abs=1e-9)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("A = [0,0]", "curve/shape"),
        ("A = [0,0] .polar(th, 4) .param(u, [u, u])", "curve/shape"),
        ("A = [0,0] .polar(4, 4)", "kind/mismatch"),
        ("A = [0,0] .polar(th, x)", "name/unknown-constant"),
        ("A = [0,0] .polar(th, [th, 1])", "kind/mismatch"),
        ("A = [0,0] .polar(th, .t)", "kind/not-constant"),
        ("A = [0,0] .polar(th, .ln(th))", "kind/not-finite"),
        ("A = [0,0] .polar(th, 1/(th - 180))", "kind/not-finite"),
        ("A = [0,0] .polar(th, 0*th)", "curve/points"),
        ("A = [0,0] .through([0,0], [1,1])", "curve/points"),
        ("A = [0,0] .through([0,0], [1,1], [1,1]) .open", "curve/points"),
        ("A = [0,0] .param(u, [u, u/2])", "curve/points"),
        ("A = [0,0] .param(u, [40*.cos(u), 20*.cos(u)])", "curve/points"),
        ("A = [0,0] .through([-40,0], [40,0], [0,0])", "curve/points"),
        ("A = [0,0] .polar(th, 40) .range(5, 5)", "kind/out-of-range"),
        ("A = [0,0] .through([0,0], [1,1]) .range(0, 1) .open", "syntax/misplaced-option"),
    ],
)
def test_bad_curves_are_told(text, code):
    with pytest.raises(ScriptError) as caught:
        scene_of(f"C : .curve {text};\n@0")
    assert [item.code for item in caught.value.diagnostics] == [code]
