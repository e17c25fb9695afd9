"""Pins that go along curves with corners and cusps, begin on them and go round and round, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum
from movimentum.expressions import add, call, const, mul
from movimentum.outlines.contour import PLACE, numeric
from movimentum.outlines.expression_outlines import curve_of_expressions
from movimentum.outlines.lines import polygon

HEAD = ".config({fps}, 400, 400);\n"


def loaded(text, fps=10):
    return movimentum.loads(HEAD.format(fps=fps) + text)


def star(seed):
    """The corners of a random polygon about the origin, counter-clockwise."""
    random = np.random.default_rng(seed)
    count = int(random.integers(3, 9))
    angles = np.sort(random.uniform(0.0, 2.0 * np.pi / count, count) + 2.0 * np.pi / count * np.arange(count))
    far = random.uniform(30.0, 90.0, count)
    return np.round(np.stack([far * np.cos(angles), far * np.sin(angles)], axis=1), 3)


def along(corners, share):
    """(N, 2) where a polygon is so far along (in rounds)."""
    ends = np.vstack([corners, corners[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ends, axis=0).T))])
    at = np.mod(share, 1.0) * way[-1]
    return np.stack([np.interp(at, way, ends[:, axis]) for axis in (0, 1)], axis=1)


def heart(share):
    """(N, 2) where 30 (1 + cos) is so far along: its length is 240, and 120 sin(th/2) up to th = 180°."""
    share = np.mod(share, 1.0)
    half = np.where(share <= 0.5, np.arcsin(np.minimum(2.0 * share, 1.0)), 0.0)
    half = np.where(share > 0.5, np.pi - np.arcsin(np.minimum(2.0 * (1.0 - share), 1.0)), half)
    far = 30.0 * (1.0 + np.cos(2.0 * half))
    return np.stack([far * np.cos(2.0 * half), far * np.sin(2.0 * half)], axis=1)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("fps", [7, 30])
def test_a_pin_goes_round_a_polygon_at_a_steady_speed(seed, fps):
    corners = star(seed)
    begin = [0.0, 0.3][seed % 2]  # on a corner, and between
    x, y = 200.0 + along(corners, np.array([begin]))[0]
    anchors = " ".join(f"K{k} = [{200 + x},{200 + y}]" for k, (x, y) in enumerate(corners))
    speed = [0.4, -0.7, 1.0, 2.5][seed]
    motion = loaded(
        f"""S : .polygon O = [200,200] {anchors} .through({", ".join(f"K{k}" for k in range(len(corners)))});
P : .disc(4) P = [{x},{y}];
@0 S.O = [200,200]; S.angle = 40*.t;
   .on(P.P, S) = 0; .where(P.P, S) = {begin} + {speed}*.t; w = .where(P.P, S);
   .claim .where(P.P, S) = {begin} + {speed}*.t;
@3""",
        fps,
    ).solve()
    turn = np.radians(40.0 * motion.times)
    local = along(corners, begin + speed * motion.times)
    c, s = np.cos(turn), np.sin(turn)
    truth = np.stack([c * local[:, 0] - s * local[:, 1], s * local[:, 0] + c * local[:, 1]], axis=1) + 200.0
    assert motion["P.P"] == pytest.approx(truth, abs=1e-9)
    assert motion["w"] == pytest.approx(begin + speed * motion.times, abs=1e-12)


@pytest.mark.parametrize("begin", [0.5, 0.2, 0.0])
@pytest.mark.parametrize("speed", [0.25, -0.4])
def test_a_pin_goes_through_the_cusp_of_a_heart(begin, speed):
    x, y = 200.0 + heart(np.array([begin]))[0]
    motion = loaded(f"""E : .curve C = [200,200] .polar(th, 30*(1 + .cos(th)));   P : .disc(4) P = [{x},{y}];
@0 E.C = [200,200]; E.angle = 0; .on(P.P, E) = 0; .where(P.P, E) = {begin} + {speed}*.t;
@9""").solve()
    assert motion["P.P"] - 200.0 == pytest.approx(heart(begin + speed * motion.times), abs=1e-8)


@pytest.mark.parametrize(
    ("drive", "truth"),
    [
        ("P.P.y = 200 + 10*.t", lambda t: 10.0 * t),
        ("P.P.y = 200 - 10*.t", lambda t: -10.0 * t),
        ("P.P.y = 200 + 10*.sin(85*.t)", lambda t: 10.0 * np.sin(np.radians(85.0 * t))),
    ],
)
@pytest.mark.parametrize("fps", [7, 10])
def test_a_pin_that_is_pulled_off_a_cusp_goes(drive, truth, fps):
    """On y² = x³ / k, from where it turns back."""
    motion = loaded(
        f"""E : .curve C = [200,200] .param(u, [20*(u/180 - 1)^2, 30*(u/180 - 1)^3]) .open;
P : .disc(4) P = [200,200];
@0 E.C = [200,200]; E.angle = 0; .on(P.P, E) = 0; {drive};
@2""",
        fps,
    ).solve()
    y = truth(motion.times)
    assert motion["P.P.y"] - 200.0 == pytest.approx(y, abs=1e-9)
    assert motion["P.P.x"] - 200.0 == pytest.approx(20.0 * np.cbrt(y / 30.0) ** 2, abs=1e-9)


def test_a_bead_goes_round_corners_where_its_share_says():
    corners = star(11)
    outline = polygon([tuple(each) for each in corners.tolist()])
    share = np.random.default_rng(4).uniform(0.0, 1.0, 20_000)
    place = numeric([outline.place_along])(share)[0]
    assert outline.points(place) == pytest.approx(along(corners, share), abs=1e-11)
    assert numeric([outline.arc_length])(place)[0] / outline.length == pytest.approx(share, abs=1e-13)


def test_lengths_of_curves_with_corners_and_cusps_are_exact():
    share = np.random.default_rng(5).uniform(0.0, 1.0, 20_000)
    radius = mul(const(30.0), add(const(1.0), call("cosd", PLACE)))
    cusped = curve_of_expressions(
        mul(radius, call("cosd", PLACE)), mul(radius, call("sind", PLACE)), 0.0, 360.0, closed=True
    )
    assert cusped.length == pytest.approx(240.0, abs=1e-10)
    place = numeric([cusped.place_along])(share)[0]
    assert cusped.points(place) == pytest.approx(heart(share), abs=1e-8)
    # half an ellipse and its chord
    x, y = mul(const(80.0), call("cosd", PLACE)), call("max", const(0.0), mul(const(50.0), call("sind", PLACE)))
    half = curve_of_expressions(x, y, 0.0, 360.0, closed=True)
    from scipy.special import ellipeinc

    m = 1.0 - (50.0 / 80.0) ** 2
    turns = np.random.default_rng(6).uniform(0.0, 180.0, 1000)
    arc = 80.0 * (ellipeinc(np.radians(turns) - math.pi / 2.0, m) - ellipeinc(-math.pi / 2.0, m))
    assert numeric([half.arc_length])(turns)[0] == pytest.approx(arc, abs=1e-9)
