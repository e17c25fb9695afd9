"""What overlaps in a film: against closed forms."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import movimentum
from movimentum.errors import ScriptError
from tests.broad import broad

HEAD = ".config({fps}, 600, 600);\n"


def overlaps(text, fps=10, **more):
    return movimentum.loads(HEAD.format(fps=fps) + text).solve().overlaps(**more)


ARM = """Arm : .bar O = [200,200] P = [300,200] .width(10);
Dot : .disc({r}) C = [{x},{y}];
@0 Arm.O = [200,200]; Arm.angle = {speed}*.t; Dot.C = [{x},{y}];
@4"""


@pytest.mark.parametrize("seed", range(6))
def test_an_arm_touches_a_disc_when_the_closed_form_says_at_any_rate_of_frames(seed):
    random = np.random.default_rng(seed)
    far, turn, r = round(random.uniform(50, 90)), round(random.uniform(30, 200)), round(random.uniform(2, 12))
    x, y = 200 + far * math.cos(math.radians(turn)), 200 + far * math.sin(math.radians(turn))
    own = ARM.format(r=r, x=f"{x:.9f}", y=f"{y:.9f}", speed=80)
    half = math.degrees(math.asin((r + 5) / far))
    for fps in (1, 30):
        (one,) = overlaps(own, fps)
        assert one.things == ("Arm", "Dot")
        assert one.begin == pytest.approx((turn - half) / 80, abs=4e-9)
        assert one.end == pytest.approx((turn + half) / 80, abs=4e-9)
        assert one.deepest == pytest.approx(turn / 80, abs=1e-5)
        assert one.depth == pytest.approx(r + 5, abs=1e-8)


def test_what_passes_between_two_frames_is_found():
    text = """A : .disc(3) C = [0,100]; W : .disc(3) C = [301,100];
@0 A.C = [600*.t,100]; W.C = [301,100];
@1"""
    (one,) = overlaps(text, 1)
    assert (one.begin, one.end) == pytest.approx((295 / 600, 307 / 600), abs=1e-9)
    assert one.depth == pytest.approx(6, abs=1e-9)


def test_touching_is_no_overlap():
    assert not overlaps("""Road : .bar A = [0,100] B = [500,100]; Wheel : .disc(30) C = [60,130] P = [80,130];
@0 Road.A = [0,100]; Road.angle = 0; Wheel.C = [60 + 100*.t, 130]; Wheel.angle = -90*.t;
@2""")
    assert not overlaps("""A : .disc(10) C = [100,100]; B : .disc(10) C = [0,0];
@0 A.C = [100,100]; B.C = [100 + 100*.t - 200, 120];
@4""")


def test_pins_meshes_contacts_and_layers_are_excepted():
    text = """A : .bar O = [100,100] P = [200,100] .width(8){a}; B : .bar P = [200,100] Q = [100,180] .width(8){b};
C : .bar M = [150,60] N = [150,140] .width(8){c};
@0 A.O = [100,100]; A.angle = 10*.t; A.P = B.P; B.angle = 0; C.M = [150,60]; C.angle = 0;
@1"""
    found = overlaps(text.format(a="", b="", c=""))
    assert {each.things for each in found} == {("A", "C"), ("B", "C")} or {each.things for each in found} == {
        ("A", "C")
    }
    layered = text.format(a=" .layer(1)", b=" .layer(1)", c=" .layer(2)")
    assert overlaps(layered) == []
    assert overlaps(layered, all_layers=True) == found
    assert overlaps(text.format(a=" .layer(1)", b="", c=" .layer(1)")) == found
    gears = """G : .gear(20, 5) C = [100,100]; H : .gear(30, 5) C = [225,100];
@0 G.C = [100,100]; H.C = [225,100]; G.angle = 40*.t; {how}
@2"""
    assert overlaps(gears.format(how=".mesh(G, H) = 0;")) == []
    assert overlaps(gears.format(how="H.angle = -20*.t;"))


@pytest.mark.parametrize(("held", "excused"), [(".on(Arm.P, Plate) = 0;", True), ("g = .on(Arm.P, Plate);", False)])
def test_a_pin_about_a_point_that_is_held_to_an_outline_is_excepted(held, excused):
    text = f"""Plate : .curve C = [100,100] .polar(th, 60 + 9*.cos(2*th));   Pin : .disc(6) C = [160,100];
Arm : .bar P = [160,100] Q = [260,100] .width(8);   Post : .disc(5) C = [95,100];
@0 Plate.C = [100,100]; Plate.angle = 40*.t; Arm.P.y = 100; Arm.angle = 0; {held}
   {"" if excused else "Arm.P.x = 165;"} Arm.P.x > 100; Pin.C = Arm.P; Post.C = [95,100];
@1"""
    found = {each.things for each in overlaps(text)}
    assert (("Plate", "Pin") in found) is not excused
    assert ("Plate", "Post") in found


@pytest.mark.parametrize("place", [95, 110, 130, 155])
@pytest.mark.parametrize("shape", [".polar(th, 60)", ".param(u, [60*.cos(u), 60*.sin(u)])"])
def test_a_disc_deep_in_a_convex_curve_overlaps_as_in_a_disc(place, shape):
    (found,) = overlaps(f"""Plate : .curve C = [100,100] {shape};   Post : .disc(5) C = [{place},100];
@0 Plate.C = [100,100]; Plate.angle = 40*.t; Post.C = [{place},100];
@1""")
    assert found.things == ("Plate", "Post")
    assert found.depth == pytest.approx(65 - abs(place - 100), rel=0.005)  # so deep, that of a polygon in place of it


@broad("seed", range(8), first=2)
def test_scaled_moved_and_mirrored_scenes_overlap_at_the_same_times(seed):
    random = np.random.default_rng(seed)
    x, y = random.uniform(30, 90, size=2)
    scale, dx, dy = random.uniform(0.2, 3), *random.uniform(-50, 50, size=2)

    def scene(scale, dx, dy, flip):
        at = lambda u, v: f"[{dx + scale * u:.12f}, {dy + flip * scale * v:.12f}]"  # noqa: E731
        return f"""Arm : .polygon O = {at(0, 0)} P = {at(100, -4)} Q = {at(100, 6)} R = {at(50, 3)};
Box : .polygon A = {at(x, y)} B = {at(x + 30, y)} C = {at(x + 10, y + 9)} D = {at(x + 12, y + 30)};
@0 Arm.O = {at(0, 0)}; Arm.angle = {flip}*90*.t; Box.A = {at(x, y)}; Box.angle = 0;
@2"""

    first = overlaps(scene(1, 0, 0, 1))
    for case in ((scale, 0, 0, 1), (1, dx, dy, 1), (scale, dx, dy, -1)):
        other = overlaps(scene(*case))
        assert [each.things for each in other] == [each.things for each in first]
        for a, b in zip(first, other, strict=True):
            assert (a.begin, a.end) == pytest.approx((b.begin, b.end), abs=1e-8)
            assert b.depth == pytest.approx(case[0] * a.depth, rel=1e-2)


@pytest.mark.parametrize("bound", [0.999, 1.001])
def test_claims_about_gaps_hold_between_frames_too(bound):
    text = f"""A : .disc(3) C = [0,100]; W : .disc(3) C = [301,107];
@0 A.C = [600*.t,100]; W.C = [301,107];
   .claim .gap(A, W) > {bound};
@1"""
    script = movimentum.loads(HEAD.format(fps=1) + text)
    if bound < 1:
        script.solve()
        return
    with pytest.raises(ScriptError) as caught:
        script.solve()
    assert caught.value.diagnostics[0].code == "claim/broken"
    begin = float(re.search(r"from t = ([\d.]+)", caught.value.diagnostics[0].message)[1])
    assert begin == pytest.approx((301 - math.sqrt(7.001**2 - 49)) / 600, abs=1e-8)


def test_what_is_round_does_not_leave_through_a_narrow_notch():
    """Its middle would, but all of it must: up, by the depth below the edge and its radius."""
    text = """Block : .polygon A = [100,100] B = [300,100] D = [300,300] E = [201,300] F = [201,150] G = [199,150]
    H = [199,300] I = [100,300];
Disc : .disc(10) C = [200,{y}];
@0 Block.A = [100,100]; Block.angle = 0; Disc.C = [200,{y} + 5*.t];
@1"""
    for y in (200, 260):  # between the corners it is a little lower
        (found,) = overlaps(text.format(y=y))
        assert found.deepest == pytest.approx(0.0, abs=1e-6)
        assert found.depth == pytest.approx(300 + math.sqrt(99) - y, rel=1e-3)


@broad("seed", range(10), first=2)
def test_the_round_end_of_a_bar_touches_a_curve_when_its_distance_says(seed):
    random = np.random.default_rng(300 + seed)
    a, b = (float(v) for v in random.uniform(25.0, 60.0, 2))
    width, way = float(random.uniform(4.0, 12.0)), float(random.uniform(-25.0, 25.0))
    text = f"""
Egg : .curve C = [0,0] .param(u, [{a!r}*.cos(u), {b!r}*.sin(u)]);
Bar : .bar P = [100,{way!r}] Q = [200,{way!r}] .width({width!r});
@0 Egg.C = [0,0];   Egg.angle = 0;   Bar.P = [100 - 80*.t, {way!r}];   Bar.angle = 0;
@1
"""
    (found,) = movimentum.loads(text).solve(fps=3).overlaps()
    u = np.linspace(-1.5, 1.5, 4001)
    low, high = 0.0, 1.0
    for _ in range(60):
        t = 0.5 * (low + high)

        def apart(u, x=100.0 - 80.0 * t):
            return np.hypot(x - a * np.cos(u), way - b * np.sin(u)) - width / 2.0

        near = float(u[np.argmin(apart(u))])
        one, other = near - 1e-3, near + 1e-3
        for _ in range(80):
            p, q = one + (other - one) / 3.0, other - (other - one) / 3.0
            one, other = (one, q) if apart(p) < apart(q) else (p, other)
        inside = ((100.0 - 80.0 * t) / a) ** 2 + (way / b) ** 2 < 1.0
        low, high = (low, t) if inside or apart(0.5 * (one + other)) <= 0.0 else (t, high)
    assert found.begin == pytest.approx(low, abs=1e-9)
