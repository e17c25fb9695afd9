"""Cords about wheels, against tangents and arcs by another way: complex numbers, and a thread that is pulled tight."""

from __future__ import annotations

import cmath
import itertools
import math
import random

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad

Stop = tuple[complex, float]
"""A centre, and a radius that is positive where the wheel is on the right."""


def tangent(a: Stop, b: Stop) -> tuple[complex, complex]:
    """Where the common tangent touches both, by turning the line of centres."""
    (p, r), (q, s) = a, b
    away = q - p
    unit = away / abs(away)
    # the normal n on the left of the way has Re(away conj(n)) = r - s
    lean = math.acos((r - s) / abs(away))
    normal = unit * cmath.exp(1j * lean)
    return p + r * normal, q + s * normal


def length(stops: list[Stop]) -> float:
    """Of a cord between two points."""
    parts = [tangent(a, b) for a, b in itertools.pairwise(stops)]
    total = sum(abs(end - begin) for begin, end in parts)
    for (centre, radius), (_, came), (left, _) in zip(stops[1:-1], parts, parts[1:], strict=False):
        if radius:
            turn = cmath.phase((came - centre) / (left - centre)) * math.copysign(1.0, radius)
            total += abs(radius) * (turn % (2.0 * math.pi))
    return total


def scene(rng: random.Random, wheels: int) -> tuple[str, list[Stop]]:
    """Wheels from left to right, at random heights and sides, a hook at the left and a load at the right."""
    text, stops, names = [], [(complex(0.0, rng.uniform(-50, 50)), 0.0)], []
    for n in range(wheels):
        centre = complex(120.0 * (n + 1), rng.uniform(-40, 40))
        radius = rng.uniform(5, 40)
        side = rng.choice([1, -1])
        text.append(f"W{n} : .disc({radius!r}) O = [{centre.real!r},{centre.imag!r}];")
        names.append(f"{'-' * (side < 0)}W{n}")
        stops.append((centre, side * radius))
    hook = stops[0][0]
    text.append("Load : .disc(3) P = [0,0];")
    fixed = " ".join(f"W{n}.O = [{c.real!r},{c.imag!r}]; W{n}.angle = 0;" for n, (c, _) in enumerate(stops[1:]))
    text.append(f"@0 {fixed} Load.angle = 0;")
    return "\n".join(
        text
    ) + f"\n    HERE\n    .let_cord([{hook.real!r},{hook.imag!r}], {', '.join(names)}, Load.P)", stops


@pytest.mark.parametrize("seed", range(4))
def test_the_length_is_that_of_tangents_and_arcs(seed: int) -> None:
    rng = random.Random(seed)
    text, stops = scene(rng, rng.randint(1, 4))
    right = 120.0 * len(stops)
    place = f"Load.P = [{right}, 100*.sin(90*.t)];"
    script = mv.loads(text.replace("HERE", place).replace(".let_cord(", "c = .cord(") + ";\n@4")
    motion = script.solve(fps=5)
    y = motion["Load.P"][:, 1]
    truth = [length([*stops, (complex(right, each), 0.0)]) for each in y]
    turns = np.subtract(motion["c"], truth) / (2.0 * math.pi)
    # an arc that passes 0 is followed, and the truth begins again at a whole turn
    radii = [abs(radius) for _, radius in stops if radius]
    whole = [sum(radius for n, radius in enumerate(radii) if chosen >> n & 1) for chosen in range(2 ** len(radii))]
    for turn in turns:
        assert min(abs(turn - sign * each) for each in whole for sign in (1, -1)) < 1e-10 * max(1.0, abs(turn))
    assert abs(turns[0]) < 1e-10


@pytest.mark.parametrize("seed", range(3))
def test_a_load_hangs_where_the_length_lets_it(seed: int) -> None:
    rng = random.Random(100 + seed)
    text, stops = scene(rng, 1)
    (hook, _), (centre, radius) = stops
    stops[1] = centre, abs(radius)
    text = text.replace("-W0", "W0")
    x = centre.real + abs(radius)
    total = length([*stops, (complex(x, -200.0), 0.0)])
    place = f"Load.P.x = {x!r}; Load.P.y < {centre.imag!r};"
    made = text.replace("HERE", place).replace(".let_cord(", ".cord(") + f" = {total!r} + 20*.t;\n@4"
    motion = mv.loads(made).solve(fps=3)
    assert motion["Load.P"][:, 1] == pytest.approx([-200.0 - 20.0 * t for t in motion.times], abs=1e-9)
    assert hook.real == 0.0


@broad("seed", range(28), every=4)
def test_a_tackle_lifts_by_a_part_of_what_is_pulled(seed: int) -> None:
    """With n vertical parts of cord at the block, it rises by the n-th part of what is pulled; also mirrored."""
    rng = random.Random(seed)
    parts, scale, way = 2 + seed % 7, (1.0, 0.001, 30.0, 1000.0)[seed % 4], -1 if seed >= 14 else 1
    top, low, hand = 500.0 * scale, 100.0 * scale, 200.0 * scale
    begins_at_block = parts % 2 == 1
    lines, fixed, names, right = [], ["Block.P.x = 0;"], [], 0.0
    total, height = 0.0, low if begins_at_block else top
    for n in range(parts):
        above = (n % 2 == 0) == begins_at_block
        r, off = rng.uniform(8.0, 25.0) * scale, rng.uniform(-30.0, 30.0) * scale
        x, y = way * (right + r), (top if above else low) + off
        lines.append(f"W{n} : .disc({r!r}) O = [{x!r},{y!r}];")
        fixed.append(f"W{n}.O = [{x!r}, {repr(y) if above else f'Block.P.y + {off!r}'}]; W{n}.angle = 0;")
        names.append(f"{'' if above == (way > 0) else '-'}W{n}")
        total, height, right = total + abs(y - height) + math.pi * r, y, right + 2.0 * r
    total += abs(height - hand)
    start = "Block.P" if begins_at_block else f"[0,{top!r}]"
    text = "\n".join(
        [
            *lines,
            f"Block : .bar P = [0,{low!r}] Q = [{scale!r},{low!r}];",
            f"Hand : .disc({scale!r}) P = [{way * right!r},{hand!r}];",
            f"@0 {' '.join(fixed)} Block.angle = 0; Hand.P = [{way * right!r}, {hand!r} - {30.0 * scale!r}*.t];",
            f"   .cord({start}, {', '.join(names)}, Hand.P) = {total!r};",
            "@3",
        ]
    )
    motion = mv.loads(text).solve(fps=4)
    risen = (motion["Block.P"][:, 1] - low) / scale
    assert risen == pytest.approx([30.0 * t / parts for t in motion.times], abs=1e-10)


def test_drums_wind_and_gripped_wheels_turn() -> None:
    """A drum of 30 winds 30 rad for each radian; a wheel of 20 that is gripped turns by the cord that passes."""
    text = """
    Drum : .disc(30) O = [0,0];   W : .disc(20) O = [200,10];   Load : .disc(3) P = [220,-300];
    @0 Drum.O = [0,0];  W.O = [200,10];  Load.P.x = 220;  Load.P.y < 0;  Load.angle = 0;  Drum.angle = 100*.t;
       .cord(Drum, W, Load.P) = 600 .grips;
    @3
    """
    motion = mv.loads(text).solve(fps=4)
    wound = [30.0 * math.radians(100.0 * t) for t in motion.times]
    y = motion["Load.P"][:, 1]
    assert y - y[0] == pytest.approx(wound, abs=1e-9)
    turned = motion["W.angle"]
    # the cord runs to the left over the wheel, which turns with the sun's sense reversed
    assert turned - turned[0] == pytest.approx([math.degrees(each / 20.0) for each in wound], abs=1e-9)


@pytest.mark.parametrize("length", ["600", "200 + 400", "300*2", "1200/2", "700 - L", "L*6", "-L + 700", "10^2*6"])
def test_the_word_may_stand_behind_any_length(length: str) -> None:
    """It is not taken for an option of the last number."""
    text = f"""
    .let L = 100;
    W : .disc(20) O = [200,10];   Load : .disc(3) P = [220,-300];   Hand : .disc(3) P = [180,-200];
    @0 W.O = [200,10];  Load.P.x = 220;  Load.P.y < 0;  Load.angle = 0;  Hand.P = [180, -200 - 20*.t];
       .cord(Load.P, -W, Hand.P) = {length} .grips;
    @3
    """
    turned = mv.loads(text).solve(fps=4)["W.angle"]
    assert turned[-1] - turned[0] == pytest.approx(math.degrees(60.0 / 20.0), abs=1e-9)


def test_a_belt_of_given_length_puts_its_idler_where_it_is_tight() -> None:
    """Open belt over two equal pulleys: twice the distance, and the circumference."""
    text = """
    A : .disc(25) O = [0,0];   B : .disc(25) O = [150,0];
    @0 A.O = [0,0];  B.O.y = 0;  B.O.x > 50;  A.angle = 0;  B.angle = 0;
       .cord(A, B, A) = 500 + 20*.t;
    @3
    """
    motion = mv.loads(text).solve(fps=4)
    truth = [(500.0 + 20.0 * t - 50.0 * math.pi) / 2.0 for t in motion.times]
    assert motion["B.O"][:, 0] == pytest.approx(truth, abs=1e-9)


def test_wraps_count_turns() -> None:
    """A point that circles a fixed sheave winds the cord round and round it."""
    text = """
    W : .disc(20) O = [0,0];   P : .disc(3) P = [100,0];
    @0 W.O = [0,0];  W.angle = 0;  P.angle = 0;  P.P = [100,0].r(-90*.t);
       c = .cord([0,100], W, P.P);
    @12
    """
    motion = mv.loads(text).solve(fps=2)
    grown = motion["c"] - motion["c"][0]
    assert grown == pytest.approx([20.0 * math.radians(90.0 * t) for t in motion.times], abs=1e-9)
    assert {item.code for item in mv.loads(text).diagnostics} <= {"loop/possible"}


@pytest.mark.parametrize(
    ("cord", "code"),
    [
        (".cord(W, W)", "kind/mismatch"),
        (".cord(W, W.O)", "kind/mismatch"),
        (".cord(W, 3)", "kind/mismatch"),
        (".cord(Bar, P.P)", "kind/mismatch"),
        (".cord(W, Nobody)", "kind/mismatch"),
        (".cord(P.P)", "syntax/arguments"),
        (".cord(P.P, 2*P.P)", "kind/mismatch"),
    ],
)
def test_what_is_no_cord_is_refused(cord: str, code: str) -> None:
    text = f"""
    W : .disc(20) O = [0,0];   P : .disc(3) P = [100,0];   Bar : .bar A = [0,0] B = [50,0];
    @0 W.O = [0,0];  {cord} = 100;
    @1
    """
    with pytest.raises(mv.ScriptError) as raised:
        mv.loads(text)
    assert raised.value.diagnostics[0].code == code


def test_a_cord_is_no_constant() -> None:
    with pytest.raises(mv.ScriptError) as raised:
        mv.loads(".let c = .cord([0,0], [3,4]);\nA : .bar P = [c,0];\n@0 A.P = [0,0];")
    assert [item.code for item in raised.value.diagnostics][:1] == ["kind/not-constant"]


def test_a_cord_walked_backwards_has_the_same_key() -> None:
    text = """
    W : .disc(20) O = [0,0];   V : .disc(20) O = [100,0];   P : .disc(3) P = [200,-90];
    @0 W.O = [0,0];  W.angle = 0;  V.O = [100,0];  V.angle = 0;  P.angle = 0;  P.P.x = 200;  P.P.y < 0;
       .cord([-100,0], W, -V, P.P) = 500;
    @1 .cord(P.P, V, -W, [-100,0]) = _;   P.P.y = -90;
    @2
    """
    script = mv.loads(text)
    assert [item for item in script.diagnostics if item.code == "timeline/nothing-to-end"] == []
