"""Values that statements keep from earlier times, and belts and gears that come together while something turns them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum
from movimentum.errors import ScriptError

HEAD = ".config({fps}, 400, 400);\n"


def loaded(text, fps=10):
    return movimentum.loads(HEAD.format(fps=fps) + text)


def four_bar(times):
    """The angle of the rocker of a four-bar linkage with a crank of 20, coupler of 80 and rocker of 60, 90 apart."""
    angles = np.radians(90.0 * times)
    px, py = 20.0 * np.cos(angles), 20.0 * np.sin(angles)
    dx, dy = 90.0 - px, -py
    far = np.hypot(dx, dy)
    along = (80.0**2 - 60.0**2 + far**2) / (2.0 * far)
    across = np.sqrt(80.0**2 - along**2)
    x, y = px + (along * dx - across * dy) / far, py + (along * dy + across * dx) / far
    return np.degrees(np.unwrap(np.arctan2(y, x - 90.0)))


MACHINE = """Crank : .bar O = [100,100] P = [120,100];   Link : .bar P = [0,0] Q = [80,0];
Rocker : .bar O = [190,100] Q = [190,160];
Wheel : .{kind} C = [190,100] M = [195,100];   Other : .{other} C = [{x},100] M = [{more},100];
@0  Crank.O = [100,100];   Crank.angle = 90*.t;   Link.P = Crank.P;   Link.Q = Rocker.Q;   Rocker.O = [190,100];
    Link.Q.y > 100;
    Wheel.C = [190,100];   Wheel.M = Rocker.O + [5,0].r(Rocker.angle);   Other.C = [{x},100];   Other.angle = {kept};
@{when}  Other.angle = _;   {joins} = 0;
@6
"""


def machine(joins, when, kind="disc(20)", other="disc(30)", x=300, kept=0):
    """A wheel that a linkage turns, and another that it takes along from some time on."""
    return MACHINE.format(kind=kind, other=other, x=x, more=x + 5, when=when, joins=joins, kept=kept)


@pytest.mark.parametrize("when", [0.7, 1.9, 3])
@pytest.mark.parametrize(("crossed", "sign"), [("", 1.0), (".crossed", -1.0)])
@pytest.mark.parametrize("fps", [7, 10])
def test_a_belt_takes_over_from_how_a_linkage_has_turned_its_wheel(when, crossed, sign, fps):
    motion = loaded(machine(f".belt(Wheel, Other) {crossed}", when, kept=25), fps).solve()
    turned = four_bar(motion.times)
    assert motion["Wheel.angle"] - motion["Wheel.angle"][0] == pytest.approx(turned - turned[0], abs=1e-9)
    there = four_bar(np.array([0.0, when]))[1]
    here = turned - turned[0] + four_bar(np.array([0.0]))[0]
    truth = np.where(motion.times < when, 25.0, 25.0 + sign * 20.0 / 30.0 * (here - there))
    assert motion["Other.angle"] == pytest.approx(truth, abs=1e-9)


@pytest.mark.parametrize("when", [0.7, 1.9, 3])
def test_gears_find_the_next_gap_of_what_a_linkage_has_turned(when):
    text = machine(".mesh(Wheel, Other)", when, "gear(20, 4)", "gear(30, 4)", 290, kept=7)
    motion = loaded(text, 20).solve()
    turned = motion["Wheel.angle"]
    joined = motion.times >= when
    # teeth fit where 20 (0 - a) + 30 (180 - b) - 180 is a whole number of turns
    phase = (20.0 * -turned + 30.0 * (180.0 - motion["Other.angle"]) - 180.0)[joined] / 360.0
    assert phase == pytest.approx(np.rint(phase), abs=1e-9)
    assert np.ptp(phase) < 1e-9
    assert abs(motion["Other.angle"][joined][0] - 7.0) <= 6.0 + 1.0  # half a tooth, and what a frame turns


@pytest.mark.parametrize("speed", [30, -50])
def test_a_belt_on_a_carrier_does_not_jump_in_steps_about_something_else(speed):
    text = f"""A : .disc(10) P = [150,200] Q = [160,200];   B : .disc(20) P = [250,200] Q = [270,200];
@0 A.P = [150,200]; B.P = A.P + [100,0].r({speed}*.t); A.angle = 100*.t; .belt(A, B) = 0; .claim .belt(A, B) = 0;
@1.3 x = 3;
@2 y = 4;
@30"""
    script = loaded(text)
    assert [item.code for item in script.diagnostics if item.code == "solve/jump"] == []
    motion = script.solve()
    # r1 (t1 - f) = r2 (t2 - f)
    truth = 0.5 * (100.0 - speed) * motion.times + speed * motion.times
    assert motion["B.angle"] == pytest.approx(truth, abs=1e-8)


@pytest.mark.parametrize("fps", [7, 25])
def test_statements_keep_values_from_earlier_times(fps):
    motion = loaded("""A : .bar P = [50,100] Q = [90,100];   B : .disc(10) P = [150,100] Q = [160,100];
@0 A.P = [50,100]; A.angle = 30*.t; B.P = [150,100]; B.angle = 10*.t;
@2 B.angle = A.angle.at(1) + 5*.t;  x = A.Q.at(3/2);
@3 B.P = A.Q.at(0) + [100*.t, 0];   y = A.Q.x.at(2) + x.y.at(3);
@4""", fps).solve()  # fmt: skip
    t = motion.times
    assert motion["B.angle"] == pytest.approx(np.where(t < 2, 10 * t, 30 + 5 * (t - 2)), abs=1e-9)
    late = t >= 3
    assert motion["B.P"][late] == pytest.approx(np.stack([90 + 100 * (t[late] - 3), 100 + 0 * t[late]], 1), abs=1e-9)
    here = math.radians(45.0)
    assert motion["x"][late][0] == pytest.approx([50 + 40 * math.cos(here), 100 + 40 * math.sin(here)], abs=1e-9)
    assert motion["y"][-1] == pytest.approx(50 + 40 * 0.5 + 100 + 40 * math.sin(here), abs=1e-9)


def test_a_load_is_dropped_where_the_linkage_has_carried_it():
    text = machine(".belt(Wheel, Other)", 1).replace("@6", "@2 Load = Rocker.Q.at(2) - [0, 40*.t^2];\n@6")
    motion = loaded(text).solve()
    late = motion.times >= 2
    angle = math.radians(four_bar(np.array([0.0, 2.0]))[1])
    start = np.array([190.0 + 60.0 * math.cos(angle), 100.0 + 60.0 * math.sin(angle)])
    fall = np.stack([np.zeros(late.sum()), 40.0 * (motion.times[late] - 2.0) ** 2], axis=1)
    assert motion["Load"][late] == pytest.approx(start - fall, abs=1e-9)


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("y = A.angle.at(5)", "timeline/outside"),
        ("y = A.angle.at(-1)", "timeline/outside"),
        ("z = .d(A.angle).at(1)", "kind/mismatch"),
        ("z = .i(A.angle).at(1)", "kind/mismatch"),
        ("w = A.angle.at(x)", "kind/not-constant"),
        ("w = .max(A.angle).at(1)", None),
        ("w = .mean(A.angle)", "kind/reduction"),
    ],
)
def test_what_cannot_be_kept_is_told(statement, code):
    text = f"A : .bar P = [50,100] Q = [90,100];\n@0 A.P = [50,100]; A.angle = 30*.t; x = 1;\n@2 {statement};\n@3"
    try:
        found = [item.code for item in loaded(text).diagnostics if item.severity == "error"]
    except ScriptError as error:
        found = [item.code for item in error.diagnostics]
    assert found == ([code] if code else [])


def test_nothing_is_kept_before_the_film_begins():
    with pytest.raises(ScriptError) as caught:
        loaded("A : .bar P = [50,100] Q = [90,100];\n@0 A.P = [50,100]; x = A.angle.at(0);\n@2")
    assert [item.code for item in caught.value.diagnostics] == ["timeline/outside"]


def test_a_sweep_solves_what_keeps_values_variant_by_variant():
    text = """.let v = 30 .range(10, 50);
A : .bar P = [50,100] Q = [90,100];   B : .bar P = [150,100] Q = [190,100];
@0 A.P = [50,100]; A.angle = v*.t; B.P = [150,100]; B.angle = 0;
@2 B.angle = A.angle.at(2);
@3"""
    found = loaded(text).sweep(v=[10, 20, 50], measure={"last": ".last(B.angle)"})
    assert found["last"] == pytest.approx([20.0, 40.0, 100.0])
