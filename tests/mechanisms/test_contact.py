"""Outlines that touch, against closed forms from random laws: cams, slots, rolling, distances of pairs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import movimentum
from movimentum import stages
from movimentum.errors import ScriptError
from movimentum.outlines.lines import polygon, there_and_back
from movimentum.outlines.nearest import Nearest
from tests.broad import broad
from tests.understand import timeline_of

HEAD = ".config({fps}, 400, 400);\n"


def solved(text, fps=10):
    return movimentum.loads(HEAD.format(fps=fps) + text).solve()


def law(seed):
    """A cam's radius as text and as a function of radians, with its derivative: a + b cos(n th - p)."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 4))
    a, p = random.uniform(38, 50), random.uniform(-180, 180)
    b = random.uniform(0.2, 0.5) * a / (2 + n * n)
    text = f"{a:.6f} + {b:.6f}*.cos({n}*th - ({p:.6f}))"
    a, b, p = (float(f"{v:.6f}") for v in (a, b, p))

    def radius(u):
        w = n * u - math.radians(p)
        return a + b * np.cos(w), -b * n * np.sin(w), -b * n * n * np.cos(w)

    return text, radius


def point_and_normal(radius, u):
    r, d, _ = radius(u)
    c, s = math.cos(u), math.sin(u)
    dx, dy = d * c - r * s, d * s + r * c
    size = math.hypot(dx, dy)
    return (r * c, r * s), (dy / size, -dx / size)


def lift(radius, size, angle, side=0.0):
    """How high a roller is above the axle of a cam turned by ``angle``, ``side`` beside it."""

    def off(u):
        (x, y), (nx, ny) = point_and_normal(radius, u)
        x, y = x + size * nx, y + size * ny
        return math.cos(angle) * x - math.sin(angle) * y - side, math.sin(angle) * x + math.cos(angle) * y

    grid = math.pi / 2 - angle + np.linspace(-0.9, 0.9, 61)
    values = [off(u)[0] for u in grid]
    k = next(k for k in range(60) if values[k] * values[k + 1] <= 0)
    return off(brentq(lambda u: off(u)[0], grid[k], grid[k + 1], xtol=1e-15, rtol=1e-15))[1]


@pytest.mark.parametrize("seed", range(4))
def test_rollers_on_random_laws_are_where_the_offset_curve_says(seed):
    text, radius = law(seed)
    side, size = float(np.random.default_rng(seed + 9).integers(-8, 9)), 6.0 + seed
    start = 260 if seed % 2 else 165  # off the contact, and far from it
    script = f"""Cam : .curve C = [200,100] .polar(th, {text});
R : .disc({size}) C = [{200 + side},{start}];
@0 Cam.C = [200,100]; Cam.angle = 60*.t; R.C.x = {200 + side}; R.C.y > 100; .gap(R, Cam) = 0;
   .claim .gap(R, Cam) = 0;
@6"""
    motion = solved(script)
    heights = motion["R.C.y"]
    truth = [100 + lift(radius, size, math.radians(6 * k), side) for k in range(61)]
    assert heights == pytest.approx(truth, abs=1e-9)
    assert solved(script, fps=2)["R.C.y"] == pytest.approx(heights[::5], abs=1e-9)


@broad("seed", range(3), first=1)
def test_flat_faces_on_random_laws_are_at_the_support(seed):
    text, radius = law(seed)
    motion = solved(f"""Cam : .curve C = [200,100] .polar(th, {text});
F : .bar A = [100,200] B = [300,200];
@0 Cam.C = [200,100]; Cam.angle = 60*.t; F.A.x = 100; F.angle = 0; F.A.y > 100; .gap(Cam, F) = 0;
   v = .d(F.A.y);
@6""")

    def foot(angle):  # where the normal points up
        def across(u):
            _, (nx, ny) = point_and_normal(radius, u)
            return math.cos(angle) * nx - math.sin(angle) * ny

        near = math.pi / 2 - angle
        u = brentq(across, near - 1.2, near + 1.2, xtol=1e-15)
        (x, y), _ = point_and_normal(radius, u)
        return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y

    feet = [foot(math.radians(6 * k)) for k in range(61)]
    assert motion["F.A.y"] == pytest.approx([100 + y for _, y in feet], abs=1e-9)
    # the lift's rate by the angle is how far the contact is beside the axle
    assert motion["v"] == pytest.approx([math.radians(60) * x for x, _ in feet], abs=1e-8)


def test_a_knife_edge_follows_the_radius_and_another_curve_its_offset():
    motion = solved("""Cam : .curve C = [200,100] .polar(th, 40 + 9*.cos(2*th));
K : .bar A = [200,150] B = [200,200];
@0 Cam.C = [200,100]; Cam.angle = 60*.t; K.A.x = 200; K.angle = 0; K.A.y > 100; .on(K.A, Cam) = 0;
@6""")
    angles = np.radians(90 - 6 * np.arange(61))
    assert motion["K.A.y"] == pytest.approx(140 + 9 * np.cos(2 * angles), abs=1e-9)


def test_places_on_closed_curves_count_turns():
    motion = solved("""E : .curve C = [200,100] .param(u, [80*.cos(u), 50*.sin(u)]);
P : .disc(4) P = [280,100];
@0 E.C = [200,100]; E.angle = 0; .on(P.P, E) = 0; .where(P.P, E) = .t/2; w = .where(P.P, E);
@7""")
    assert motion["w"][-1] == pytest.approx(3.5)
    assert motion["P.P"][::10] == pytest.approx(np.array([[280, 100], [120, 100]] * 4), abs=1e-8)
    assert np.hypot((motion["P.P.x"] - 200) / 80, (motion["P.P.y"] - 100) / 50) == pytest.approx(1, abs=1e-12)


def test_a_place_that_is_only_read_is_the_nearest_one():
    """Inside an ellipse, across the line on which two places are as near."""
    motion = solved("""E : .curve C = [200,200] .param(u, [80*.cos(u), 50*.sin(u)]);
P : .disc(4) P = [250,200];
@0 E.C = [200,200]; E.angle = 0; P.P = [200 + 60*.cos(45*.t), 201 + 23*.sin(90*.t)]; w = .where(P.P, E);
@8""")
    turns = np.linspace(0.0, 2.0 * np.pi, 40001)
    x, y = 200.0 + 80.0 * np.cos(turns), 200.0 + 50.0 * np.sin(turns)
    along = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
    for (px, py), place in zip(motion["P.P"], motion["w"], strict=True):
        off = np.hypot(x - px, y - py)
        near = off <= off.min() + 1e-6  # both, where they are as near
        apart = np.abs(along[near] / along[-1] - place)
        assert np.minimum(apart, 1.0 - apart).min() < 1e-4


@broad(("a", "b"), [(80, 50), (60, 55), (70, 30)], first=1)
def test_ellipses_roll_about_their_foci(a, b):
    c = math.sqrt(a * a - b * b)
    ellipse = f".param(u, [{c} + {a}*.cos(u), {b}*.sin(u)])"
    motion = solved(f"""A : .curve F = [{200 - c},200] G = [{200 + c},200] {ellipse};
B : .curve F = [{200 + 2 * a - c},200] G = [{200 + 2 * a + c},200] {ellipse};
@0 A.F = [{200 - c},200]; A.angle = 90*.t; B.F = [{200 + 2 * a - c},200]; .roll(A, B) = 0;
@8""")
    assert motion["(A.G - B.G).l"] == pytest.approx(2 * a, abs=1e-9)
    assert motion["B.angle"][-1] == pytest.approx(-720, abs=1e-8)
    assert abs(motion[".gap(A, B)"]).max() < 1e-9


def test_a_wheel_rolls_along_a_road():
    motion = solved("""R : .bar A = [20,50] B = [380,50];   W : .disc(30) C = [100,80] P = [110,80];
@0 R.A = [20,50]; R.angle = 0; W.angle = -90*.t; .gap(W, R) = 0; .roll(W, R) = 0;
@2""")
    assert motion["W.C.x"] == pytest.approx(100 + 30 * math.pi / 2 * np.arange(21) / 10, abs=1e-9)


def test_a_gap_that_is_read_is_the_least_over_both():
    shapely = pytest.importorskip("shapely")
    motion = solved("""A : .bar P = [50,50] Q = [150,50] .width(10);
B : .polygon P = [200,50] Q = [240,50] R = [220,90];
D : .disc(12) C = [100,100];
@0 A.P = [50,50]; A.angle = 20*.t; B.P = [200 - 10*.t, 50]; B.angle = 5*.t; D.C = [100,100]; g = .gap(A, B);
@4""", fps=5)  # fmt: skip
    from shapely import affinity

    for k in range(21):
        t = k / 5
        bar = affinity.rotate(shapely.LineString([(50, 50), (150, 50)]), 20 * t, origin=(50, 50))
        corner = affinity.translate(shapely.Polygon([(200, 50), (240, 50), (220, 90)]), -10 * t, 0)
        corner = affinity.rotate(corner, 5 * t, origin=(200 - 10 * t, 50))
        assert motion["g"][k] == pytest.approx(bar.distance(corner) - 5, abs=1e-9)
        assert motion[".gap(D, A)"][k] == pytest.approx(bar.distance(shapely.Point(100, 100)) - 17, abs=1e-9)


@pytest.mark.parametrize("corners", [[(0, 0), (100, 0), (50, 60)], [(0, 0), (100, 0), (100, 100), (50, 20), (0, 100)]])
def test_a_point_sees_edges_and_corners_from_both_sides(corners):
    shapely = pytest.importorskip("shapely")
    x, y = np.random.default_rng(3).uniform(-60, 160, (2, 500))
    for outline, shape in ((polygon(corners), shapely.Polygon(corners)),
                           (there_and_back(corners), shapely.LineString(corners))):  # fmt: skip
        found = Nearest(outline)
        place = found.at(x, y)
        px, py, tx, ty = outline.values(place)[:4]
        value = outline.side * (tx * (y - py) - ty * (x - px)) / np.hypot(tx, ty)
        points = [shapely.Point(*each) for each in zip(x, y, strict=True)]
        truth = [shape.distance(each) or -shape.exterior.distance(each) for each in points]
        assert value == pytest.approx(truth, abs=1e-9)


@broad(("size", "codes"), [(2.4, []), (12, ["contact/undercut"])], first=1)
def test_a_roller_that_is_larger_than_a_hollow_is_told(size, codes):
    text = f"""Cam : .curve C = [200,100] .polar(th, 40 + 20*.cos(3*th));   R : .disc({size}) C = [200,190];
@0 Cam.C = [200,100]; Cam.angle = 90*.t; R.C.x = 200; R.C.y > 100; .gap(R, Cam) = 0;
@4"""
    motion = stages.solve(timeline_of(HEAD.format(fps=10) + text))
    found = stages.examine(motion).diagnostics
    assert [item.code for item in found if item.code.startswith("contact/")] == codes


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        (".gap(D, Nope) = 0", "name/unknown-thing"),
        (".gap(D, D) = 0", "kind/mismatch"),
        (".gap(D.C, C.A) = 0", "kind/mismatch"),
        (".gap(D, L) = 0", "contact/outline"),
        (".on(D, C) = 0", "kind/mismatch"),
        (".on(3, C) = 0", "kind/mismatch"),
        (".on(D.C) = 0", "syntax/arguments"),
        (".roll(D.C, C) = 0", "kind/mismatch"),
        (".where(D.C, C) = D.C", "kind/mismatch"),
    ],
)
def test_bad_contacts_are_told(statement, code):
    things = "C : .curve A = [9,9] .polar(th, 40);  D : .disc(5) C = [60,9];  L : .label('x') at = [1,1];"
    with pytest.raises(ScriptError) as caught:
        solved(f"{things}\n@0 {statement};\n@1")
    assert [item.code for item in caught.value.diagnostics] == [code]


def test_values_of_a_curve_at_a_place():
    motion = solved("""K : .curve C = [150,100] .polar(th, 40 + 9*.cos(2*th));   Q : .disc(3) P = [199,100];
@0 K.C = [150,100]; K.angle = 30; Q.P = .point(K, .t/4); k = .curvature(K, 0); l = .length(K);
   g = .on(Q.P, K); slope = .a([1,0], .tangent(K, 0.25));
@3""")
    radius = np.array([40 + 9 * math.cos(2 * u) for u in np.linspace(0, 2 * math.pi, 20_001)])
    turn = np.array([-18 * math.sin(2 * u) for u in np.linspace(0, 2 * math.pi, 20_001)])
    assert motion["l"][0] == pytest.approx(np.mean(np.hypot(radius, turn)[:-1]) * 2 * math.pi, rel=1e-10)
    assert motion["k"][0] == pytest.approx((49 * 49 + 49 * 36) / 49**3, rel=1e-9)
    assert motion["g"] == pytest.approx(0, abs=1e-9)
    assert motion["slope"][0] == pytest.approx(-150, abs=1e-7)  # a quarter of the way round, the top, turned by 30
    assert motion[".where(Q.P, K)"] == pytest.approx(np.arange(31) / 40, abs=1e-9)
