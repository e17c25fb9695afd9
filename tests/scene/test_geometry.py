"""What scripts say of points, lines, angles and arcs, against complex numbers and circles."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from movimentum.scene.outlines import rings_of
from tests.timeline.test_leaves import valued
from tests.understand import scene_of

BODIES = "A : .bar P = [1,2] Q = [31,12]; B : .bar S = [0,0] T = [5,40];"


def said(text, places, turns=None):
    """What a statement ``v = …`` says, componentwise, where anchors are at these places."""
    scene = scene_of(f"{BODIES} @0 v = {text}; @1")
    (item,) = [each for each in scene.constraints() if "v" in repr(each.left[0].payload)]
    return [valued(each, places, turns or {}) for each in item.right]


@pytest.mark.parametrize("scale", [1e-2, 1.0, 1e4])
@pytest.mark.parametrize("seed", range(4))
def test_values_of_points_are_those_of_complex_numbers(seed, scale):
    random = np.random.default_rng(seed)
    p, q, s, t = (complex(*each) for each in scale * random.normal(size=(4, 2)))
    places = {(0, 0): (p.real, p.imag), (0, 1): (q.real, q.imag), (1, 0): (s.real, s.imag), (1, 1): (t.real, t.imag)}
    turn = float(random.uniform(-500.0, 500.0))
    vectors = {
        "A.P + B.S - A.Q": p + s - q,
        f"(A.Q - A.P).r({turn!r})": (q - p) * cmath.exp(1j * math.radians(turn)),
        "A.P*2 - B.T/4": 2.0 * p - t / 4.0,
        "-A.P": -p,
    }
    for text, truth in vectors.items():
        assert complex(*said(text, places)) == pytest.approx(truth, rel=1e-12, abs=1e-12 * scale)
    numbers = {
        "(B.S - A.P).l": abs(s - p),
        "A.P.x + A.Q.y": p.real + q.imag,
        ".along([1, 2], A.P, B.S)": ((1 + 2j - p) * (s - p).conjugate()).real / abs(s - p),
        ".across([1, 2], A.P, B.S)": ((1 + 2j - p) * (s - p).conjugate()).imag / abs(s - p),
        ".min(A.P.x, B.S.x)": min(p.real, s.real),
        ".max(A.P.y, .abs(B.S.y))": max(p.imag, abs(s.imag)),
    }
    for text, truth in numbers.items():
        (found,) = said(text, places)
        assert found == pytest.approx(truth, rel=1e-9, abs=1e-9 * scale)
    (angle,) = said(".a(A.Q - A.P, B.T - B.S)", places)
    assert abs(cmath.exp(1j * math.radians(angle)) - cmath.exp(1j * cmath.phase((t - s) / (q - p)))) < 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_lines_through_anchors_of_a_thing_are_where_the_thing_is(seed):
    """Wherever a thing has been moved and turned, `.along` and `.across` are those of the line through its anchors."""
    random = np.random.default_rng(seed)
    turn = float(random.uniform(-400.0, 400.0))
    way = cmath.exp(1j * math.radians(turn))
    p, s = (complex(*each) for each in random.normal(size=(2, 2)) * 50.0)
    q = p + way * (30 + 10j)
    places = {(0, 0): (p.real, p.imag), (0, 1): (q.real, q.imag), (1, 0): (s.real, s.imag)}
    off = (s - p) * (q - p).conjugate() / abs(q - p)
    assert said(".along(B.S, A.P, A.Q)", places, {0: turn}) == [pytest.approx(off.real, abs=1e-9)]
    assert said(".across(B.S, A.P, A.Q)", places, {0: turn}) == [pytest.approx(off.imag, abs=1e-9)]
    back = (s - q) * (p - q).conjugate() / abs(q - p)
    assert said(".across(B.S, A.Q, A.P)", places, {0: turn}) == [pytest.approx(back.imag, abs=1e-9)]


# --- arcs


@pytest.mark.parametrize(("radius", "side"), [(26.0, 1.0), (-26.0, -1.0), (200.0, 1.0), (25.0, 1.0)])
def test_an_edge_that_is_an_arc_has_its_radius_and_bulges_to_its_side(radius, side):
    """The chord is 50 long; a positive radius bulges to the right of the way."""
    scene = scene_of(f"K : .polygon P = [0,0] Q = [30,40] R = [-60,70] .arcto(Q, {radius}); @0 K.P = [0,0]; @1")
    (outline,) = rings_of(scene.things[0])
    points = outline.points(np.linspace(outline.first, outline.last, 4001)[:-1]) @ np.array([1.0, 1j])
    local = points / (30 + 40j) * 50.0  # along the chord, and to its left; P is at the outline's origin
    bulge = abs(radius) - math.sqrt(radius**2 - 625.0)
    middle = complex(25.0, side * (abs(radius) - bulge))
    on = local[(np.abs(np.abs(local - middle) - abs(radius)) < 1e-9) & (local.imag * -side > 1e-9)]
    assert len(on) > 50
    assert (-side * on.imag).max() == pytest.approx(bulge, abs=0.02)


def test_an_arc_through_a_point_is_on_the_circle_of_three():
    scene = scene_of("K : .polygon P = [0,0] M = [25,-10] Q = [50,0] R = [25,80] .arcto(M, Q); @0 K.P = [0,0]; @1")
    (outline,) = rings_of(scene.things[0])
    points = outline.points(np.linspace(outline.first, outline.last, 2001))
    below = points[points[:, 1] < -1e-6]
    # through (0,0), (25,-10) and (50,0): the middle is (25, h) with 25² + h² = (h + 10)²
    h = (625.0 - 100.0) / 20.0
    assert len(below) > 100
    assert np.hypot(*(below - (25.0, h)).T) == pytest.approx(np.full(len(below), h + 10.0), rel=1e-9)
    assert below[:, 1].min() == pytest.approx(-10.0, abs=1e-3)
