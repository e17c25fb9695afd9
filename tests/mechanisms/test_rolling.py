"""Outlines that roll on each other, and rollers on curves with waves and cusps, against what SciPy and shapely say."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, fsolve
from scipy.special import ellipeinc

import movimentum
from movimentum.outlines.arc_lengths import arc_length_table
from tests.broad import broad

HEAD = ".config({fps}, 400, 400);\n"


def solved(text, fps=10):
    return movimentum.loads(HEAD.format(fps=fps) + text).solve()


class Ellipse:
    """By its half axes, with arc lengths by quadrature."""

    def __init__(self, a, b):
        self.a, self.b = a, b

    def point(self, u):
        return np.array([self.a * math.cos(u), self.b * math.sin(u)])

    def tangent(self, u):
        return np.array([-self.a * math.sin(u), self.b * math.cos(u)])

    def arc(self, u, v):
        return quad(lambda w: math.hypot(*self.tangent(w)), u, v, epsabs=1e-12, epsrel=1e-12)[0]

    @property
    def text(self):
        return f".param(u, [{self.a}*.cos(u), {self.b}*.sin(u)])"


def turned(angle, vector):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


@broad("seed", range(8), first=1)
def test_an_ellipse_rolls_along_a_road_by_its_arc_length(seed):
    """Through more than a turn: the height of its centre in closed form, its way by elliptic integrals."""
    random = np.random.default_rng(seed)
    own = Ellipse(*np.round(random.uniform(15.0, 60.0, 2), 3).tolist())
    motion = solved(f"""Road : .bar A = [-200,0] B = [1200,0];   E : .curve C = [100,{own.b + 20}] {own.text};
@0 Road.A = [-200,0]; Road.angle = 0; E.angle = -180*.t; E.C.y > 0; .gap(E, Road) = 0; .roll(E, Road) = 0;
@2.5""")
    angles = np.radians(-18.0 * np.arange(26))
    assert motion["E.C.y"] == pytest.approx(np.hypot(own.a * np.sin(angles), own.b * np.cos(angles)), abs=1e-10)
    # the lowest place looks down, and its parameter is followed
    low = np.unwrap([math.atan2(-own.b * math.cos(angle), -own.a * math.sin(angle)) for angle in angles])
    way = np.cumsum([0.0, *(own.arc(u, v) for u, v in pairwise(low))])
    ahead = np.array([turned(angle, own.point(u))[0] for angle, u in zip(angles, low, strict=True)])
    assert motion["E.C.x"] + ahead - motion["E.C.x"][0] - ahead[0] == pytest.approx(way, abs=1e-8)


@broad("seed", range(6), first=1)
def test_an_ellipse_rolls_around_another(seed):
    random = np.random.default_rng(seed)
    a, b, c, d = np.round(random.uniform(20.0, 50.0, 4), 3).tolist()
    one, other = Ellipse(a, b), Ellipse(c, d)
    motion = solved(f"""A : .curve C = [200,200] {one.text};   B : .curve C = [{203 + a + c},200] {other.text};
@0 A.C = [200,200]; A.angle = 0; B.angle = 60*.t; B.C.x > 200; .gap(A, B) = 0; .roll(A, B) = 0;
@0.001 B.C.x > _;
@2""")
    u, v, here, there = 0.0, math.pi, 0.0, 0.0
    for (x, y), angle in zip(motion["B.C"], np.radians(motion["B.angle"]), strict=True):

        def apart(places, at=(x - 200.0, y - 200.0), angle=angle):
            return turned(angle, other.point(places[1])) + at - one.point(places[0])

        def rows(places, apart=apart, angle=angle):
            t, w = one.tangent(places[0]), turned(angle, other.tangent(places[1]))
            return [t[0] * w[1] - t[1] * w[0], apart(places) @ t]

        near = min(
            ((p, q) for p in u + np.linspace(-0.5, 0.5, 41) for q in v + np.linspace(-0.5, 0.5, 41)),
            key=lambda places: math.hypot(*apart(places)),
        )
        places = fsolve(rows, near, xtol=1e-13, full_output=True)[0]  # says nothing where rounding ends it sooner
        assert math.hypot(*apart(places)) < 1e-9
        here, there = here + one.arc(u, places[0]), there + other.arc(v, places[1])
        u, v = places
        assert here + there == pytest.approx(0.0, abs=1e-8)  # they go round the other way


@broad(("height", "waves"), [(0.005, 60), (0.02, 30), (0.2, 9)], first=1)
def test_a_roller_on_tiny_waves(height, waves):
    """On the highest of the places where the parallel curve is above the axle."""
    motion = solved(f"""Cam : .curve C = [200,100] .polar(th, 40 + {height}*.cos({waves}*th));
R : .disc(6) C = [200,190];
@0 Cam.C = [200,100]; Cam.angle = 20*.t; R.C.x = 200; R.C.y > 100; .gap(R, Cam) = 0;
@3""")

    def centre(u, angle):
        r, d = 40.0 + height * math.cos(waves * u), -height * waves * math.sin(waves * u)
        c, s = math.cos(u), math.sin(u)
        dx, dy = d * c - r * s, d * s + r * c
        size = math.hypot(dx, dy)
        return turned(angle, (r * c + 6.0 * dy / size, r * s - 6.0 * dx / size))

    for k, y in enumerate(motion["R.C.y"]):
        angle = math.radians(2.0 * k)
        grid = math.pi / 2.0 - angle + np.linspace(-0.05, 0.05, 400)
        off = [centre(u, angle)[0] for u in grid]
        found = [
            centre(brentq(lambda u, angle=angle: centre(u, angle)[0], p, q, xtol=1e-15), angle)[1]
            for p, q, one, other in zip(grid[:-1], grid[1:], off[:-1], off[1:], strict=True)
            if one * other <= 0.0
        ]
        assert y - 100.0 == pytest.approx(max(found), abs=1e-9)


def test_a_roller_on_a_heart_rests_on_the_sides_of_its_cusp():
    shapely = pytest.importorskip("shapely")
    from shapely import affinity

    motion = solved("""Cam : .curve C = [200,100] .polar(th, 30*(1 + .cos(th)));
R : .disc(8) C = [200,190];
@0 Cam.C = [200,100]; Cam.angle = 20*.t; R.C.x = 200; R.C.y > 100; .gap(R, Cam) = 0;
@4""")
    turns = np.linspace(0.0, 2.0 * np.pi, 20001)[:-1]
    far = 30.0 * (1.0 + np.cos(turns))
    heart = shapely.Polygon(np.stack([far * np.cos(turns), far * np.sin(turns)], axis=1))
    for k, centre in enumerate(motion["R.C"]):
        placed = affinity.translate(affinity.rotate(heart, 2 * k, origin=(0, 0)), 200, 100)
        assert placed.distance(shapely.Point(*centre)) == pytest.approx(8.0, abs=3e-6)


def test_a_circle_through_ten_thousand_points_is_one(tmp_path):
    turns = np.linspace(0.0, 2.0 * np.pi, 10001)[:-1]
    rows = (f"{40 * math.cos(turn):.9f},{40 * math.sin(turn):.9f}" for turn in turns)
    (tmp_path / "circle.csv").write_text("x,y\n" + "\n".join(rows))
    motion = solved(f"""E : .curve C = [200,100] .points('{tmp_path / "circle.csv"}');   R : .disc(6) C = [200,190];
@0 E.C = [200,100]; E.angle = 30*.t; R.C.x = 203; R.C.y > 100; .gap(R, E) = 0;
@2""")
    assert motion["R.C.y"] == pytest.approx(100.0 + math.sqrt(46.0**2 - 9.0), abs=2e-9)


def test_a_roller_on_a_circle_whose_parameter_stands_still_for_a_while():
    motion = solved("""E : .curve C = [200,100] .param(u, [40,0].r({ u < 90 : 0; u < 180 : 4*(u - 90); 360 }));
R : .disc(6) C = [200,190];
@0 E.C = [200,100]; E.angle = 90*.t; R.C.x = 203; R.C.y > 100; .gap(R, E) = 0;
@4""")
    assert motion["R.C.y"] == pytest.approx(100.0 + math.sqrt(46.0**2 - 9.0), abs=1e-9)


@pytest.mark.parametrize(("a", "b"), [(75.0, 64.95), (50.0, 20.0), (50.0, 5.0), (50.0, 1.0)])
def test_lengths_of_an_ellipse_are_elliptic_integrals(a, b):
    def along(place):
        m = 1.0 - (b / a) ** 2
        return a * (ellipeinc(place - math.pi / 2.0, m) - ellipeinc(-math.pi / 2.0, m))

    found = arc_length_table(lambda place: np.hypot(a * np.sin(place), b * np.cos(place)), (0.0, math.tau), closed=True)
    length = found.along[-1]
    rate, share = length / math.tau, np.random.default_rng(3).uniform(0.0, 1.0, 500)
    there = math.tau * share
    exact = 1e-11 if b > 0.05 * a else 1e-6  # nearly a cusp: a spline
    assert found.beyond(rate).at(there) + rate * there == pytest.approx(along(there), abs=exact * length)
    assert along(found.back(length, math.tau).at(share) + there) == pytest.approx(share * length, abs=exact * length)


def gears(lobes, others, e, p):
    """The distance of centres, and ``e`` and ``p`` of the other wheel, of a pair of elliptical gears of any order:
    r = p/(1 - e cos n th) rolls on p'/(1 + e' cos n' th').
    """
    # a lobe of the one turns the other by a lobe: the integral of r/(C - r) over one is 2 pi over the other's number
    a, b, c = 1.0 - e * e, -2.0 * p, p * p * (1.0 - (others / lobes) ** 2)
    between = (-b + math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    low, high = between - p / (1.0 - e), between - p / (1.0 + e)
    e = (high - low) / (high + low)
    return between, e, low * (1.0 + e)


@broad("seed", range(24), first=2)
def test_gears_with_any_numbers_of_lobes_roll_on_each_other(seed):
    """Where they are drawn touching, two places far from each other fulfil the same equations: they overlap."""
    random = np.random.default_rng(seed)
    lobes, others = (2, 2) if seed == 0 else random.integers(1, 6, 2).tolist()
    # hollow ones, too
    e, p, line = random.uniform(0.05, 0.5), random.uniform(20.0, 60.0) * lobes / 2.0, random.uniform(0.0, 360.0)
    between, e2, p2 = gears(lobes, others, e, p)
    x, y = between * math.cos(math.radians(line)), between * math.sin(math.radians(line))
    way = 1 if seed % 2 else -1
    right = f"{p2}/(1 + {e2}*.cos({others}*(th - {180 + line})))"
    things = [f"Left : .curve C = [0,0] .polar(th, {p}/(1 - {e}*.cos({lobes}*(th - {line}))));",
              f"Right : .curve C = [{x},{y}] .polar(th, {right});"]  # fmt: skip
    statements = ["Left.C = [0,0];", f"Right.C = [{x},{y}];", f"Left.angle = {90 * way}*.t;"]
    statements.append(".roll(Left, Right) = 0;")
    random.shuffle(things)
    random.shuffle(statements)
    motion = solved("\n".join(things) + "\n@0 " + " ".join(statements) + "\n@4", fps=7)
    one, other = np.radians(motion["Left.angle"]), np.radians(motion["Right.angle"])
    far = p / (1.0 - e * np.cos(lobes * one)) + p2 / (1.0 + e2 * np.cos(others * other))
    assert far == pytest.approx(between, rel=1e-9)
    assert motion["Right.angle"][-1] == pytest.approx(-way * 360.0 * lobes / others, abs=1e-8)
