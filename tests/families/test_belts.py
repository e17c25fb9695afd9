"""Belts of given length, capstans and slack cords, against closed forms and against tangents by complex numbers."""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad
from tests.families.test_cords import tangent

HEAD = ".config(4, 600, 400);\n"


def loaded(text):
    return mv.loads(HEAD + text)


def open_belt(far, one, other):
    lean = math.asin((one - other) / far)
    return 2.0 * math.sqrt(far**2 - (one - other) ** 2) + math.pi * (one + other) + 2.0 * (one - other) * lean


def crossed_belt(far, one, other):
    lean = math.asin((one + other) / far)
    return 2.0 * math.sqrt(far**2 - (one + other) ** 2) + (one + other) * (math.pi + 2.0 * lean)


def round_trip(stops):
    """The length of a cord that goes round all of these wheels (centre, signed radius) and back to the first."""
    parts = [tangent(a, b) for a, b in itertools.pairwise([*stops, stops[0]])]
    total = sum(abs(end - begin) for begin, end in parts)
    for (centre, radius), (_, came), (left, _) in zip(stops, [parts[-1], *parts[:-1]], parts, strict=True):
        turn = cmath.phase((came - centre) / (left - centre)) * math.copysign(1.0, radius)
        total += abs(radius) * (turn % (2.0 * math.pi))
    return total


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("sign", "length"), [("", open_belt), ("-", crossed_belt)])
def test_a_belt_about_two_wheels_is_as_long_as_its_closed_form(seed, sign, length):
    random = np.random.default_rng(seed)
    one, other = np.round(random.uniform(5.0, 40.0, 2), 3).tolist()
    far = round(float(random.uniform(one + other + 5.0, 300.0)), 3)
    turn = round(float(random.uniform(0.0, 360.0)), 3)
    motion = loaded(f"""A : .disc({one}) O = [100,100];   B : .disc({other}) O = [{100 + far},100];
@0 A.O = [100,100]; A.angle = 0; B.angle = 0; B.O = [100,100] + [{far} + 10*.t, 0].r({turn} + 50*.t);
   c = .cord(A, {sign}B, A);
@20""").solve()
    truth = [length(far + 10.0 * t, one, other) for t in motion.times]
    assert motion["c"] == pytest.approx(truth, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("sign", "length"), [("", open_belt), ("-", crossed_belt)])
def test_a_belt_of_given_length_says_how_far_its_wheels_are_apart(seed, sign, length):
    random = np.random.default_rng(50 + seed)
    one, other = np.round(random.uniform(5.0, 40.0, 2), 3).tolist()
    far = round(float(random.uniform(one + other + 20.0, 300.0)), 3)
    total = length(far, one, other)
    motion = loaded(f"""A : .disc({one}) O = [100,100];   B : .disc({other}) O = [{100 + far + 15},100];
@0 A.O = [100,100]; A.angle = 0; B.angle = 0; B.O.y = 100; B.O.x > 100; .cord(A, {sign}B, A) = {total!r} + 5*.t;
@4""").solve()
    apart = motion["B.O.x"] - 100.0
    assert apart[0] == pytest.approx(far, abs=1e-9)
    assert [length(d, one, other) for d in apart] == pytest.approx(total + 5.0 * motion.times, abs=1e-9)


@broad(("seed", "scale"), [(seed, (1.0, 0.01, 1000.0)[seed % 3]) for seed in range(30)], first=3)
def test_a_belt_about_any_wheels_and_idlers_is_as_long_as_its_parts(seed, scale):
    """Wheels about a circle, in the order of the clock, some with an idler between that presses inward; all of it turns
    and grows.
    """
    random = np.random.default_rng(700 + seed)
    count = int(random.integers(2, 6))
    round_ = 200.0 * scale
    stops, things, names = [], [], []
    for k in range(count):
        at = round_ * cmath.exp(-2j * math.pi * (k + float(random.uniform(-0.15, 0.15))) / count)
        stops.append((at, float(random.uniform(15.0, 35.0)) * scale))
        if random.random() < 0.4 and count > 2:
            middle = round_ * 0.5 * cmath.exp(-2j * math.pi * (k + 0.5) / count)
            stops.append((middle, -float(random.uniform(5.0, 10.0)) * scale))
    for n, (_, radius) in enumerate(stops):
        things.append(f"W{n} : .disc({abs(radius)!r}) O = [0,0];")
        names.append(f"{'-' * (radius < 0)}W{n}")
    x, y = np.round(random.uniform(-100.0, 100.0, 2) * scale, 4).tolist()
    fixed = " ".join(
        f"W{n}.angle = 0; W{n}.O = [{x!r},{y!r}] + ([{at.real!r},{at.imag!r}]*(1 + .t/10)).r(77*.t);"
        for n, (at, _) in enumerate(stops)
    )
    motion = loaded(f"{' '.join(things)}\n@0 {fixed} c = .cord({', '.join([*names, names[0]])});\n@5").solve()
    for t, told in zip(motion.times, motion["c"], strict=True):
        moved = [(at * (1.0 + t / 10.0), radius) for at, radius in stops]
        off = told - round_trip(moved)
        # an idler that the belt leaves has less than no wrap, where the truth begins again at a whole turn
        left = [0.0, *(2.0 * math.pi * radius for _, radius in stops if radius < 0.0 < t)]
        assert min(abs(off - each) for each in left) < 1e-9 * round_


@pytest.mark.parametrize("seed", range(6))
def test_an_idler_is_where_the_belt_is_tight(seed):
    """It slides along a line; its height is compared with the length by another way."""
    random = np.random.default_rng(100 + seed)
    one, other, idle = np.round(random.uniform(10.0, 35.0, 3), 3).tolist()
    inside = bool(seed % 2)  # it presses from outside, or carries the belt
    wheels = [(complex(100, 200), one), (complex(400, 200), other)]
    height = 110.0 if inside else 255.0
    stops = [wheels[0], (complex(250, height), -idle if not inside else idle), wheels[1]]
    stops = stops if not inside else [wheels[0], wheels[1], stops[1]]
    names = ["A", "B", "I"] if inside else ["A", "-I", "B"]
    total = round_trip(stops)
    motion = loaded(f"""A : .disc({one}) O = [100,200];   B : .disc({other}) O = [400,200];
I : .disc({idle}) O = [250,{height}];
@0 A.O = [100,200]; A.angle = 0; B.O = [400,200]; B.angle = 0; I.angle = 0; I.O.x = 250;
   .cord({", ".join(names)}, A) = {total!r} + 6*.t;
@3""").solve()
    assert motion["I.O.y"][0] == pytest.approx(height, abs=1e-8)
    for t, y in zip(motion.times, motion["I.O.y"], strict=True):
        k = 1 if not inside else 2
        moved = [*stops]
        moved[k] = (complex(250, y), stops[k][1])
        assert round_trip(moved) == pytest.approx(total + 6.0 * t, abs=1e-9)


@broad("turns", [1, 2.5, 7, 100], first=1)
@pytest.mark.parametrize("fps", [3, 8])
def test_a_capstan_takes_up_as_many_rounds_as_its_hauler_goes(turns, fps):
    """The free end is led round a fixed drum; the load comes up by what is wound."""
    around = 170 * max(0, turns - 7)
    motion = mv.loads(f"""W : .disc(25) O = [300,200];   Hand : .disc(3) P = [450,200];
L : .disc(5) P = [275,{-900 - around}];
@0 W.O = [300,200]; W.angle = 0; Hand.angle = 0; L.angle = 0;
   Hand.P = [300,200] + [150,0].r(-{360 * turns}*.t);   L.P.x = 275;   L.P.y < 200;
   .cord(L.P, W, Hand.P) = {1600 + around};
@1""").solve(fps=fps)
    # the tangent to the hand turns with it, so each radian winds a radius
    wound = 25.0 * np.radians(360.0 * turns * motion.times)
    assert motion["L.P.y"] - motion["L.P.y"][0] == pytest.approx(wound, abs=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_a_cord_that_would_have_to_push_is_told(seed):
    """A wheel comes off its cord where the straight line between its ends leaves it."""
    random = np.random.default_rng(seed)
    radius = round(float(random.uniform(10.0, 40.0)), 3)
    text = f"""W : .disc({radius}) O = [200,100];   P : .disc(3) P = [300,100];
@0 W.O = [200, 100 - 20*.t]; W.angle = 0; P.angle = 0; P.P = [300,100]; .claim .cord([100,100], W, P.P) > 0;
   c = .cord([100,100], W, P.P);
@6"""
    found = [item for item in loaded(text).diagnostics if item.code == "cord/slack"]
    assert len(found) == 1
    # its top is at the line when it has sunk by its radius
    when = radius / 20.0
    if when < 6.0:
        assert f"t = {when:.4g}"[:6] in found[0].message
