"""When expressions have a value, and their extremes: against closed forms, to 1e-12, whatever the frames are."""

import math
from fractions import Fraction

import pytest

from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine
from movimentum.workflow.inspector import Inspector, extremes, when
from tests.broad import broad

CRANK = """.config({fps}, 400, 300);
Crank : .bar C=[100,100] P=C+[{r},0];
Rod : .bar A=[0,0] B=A+[{l},0];
@0 Crank.C=[100,100]; Crank.angle={w}*.t; Rod.A=Crank.P; Rod.B=[x,100]; x > Crank.P.x;
@{end}
"""
ONCE = 1e-12


def asked(text):
    revision = Engine(Choices()).revise(SourceText("scene.mov", text))
    return Inspector(revision, Fraction(0))


def times(inspector, condition):
    found = when(inspector, condition)
    return [(float(item.time), item.way.name) for item in found.crossings]


def compare(found, expected):
    assert len(found) == len(expected)
    for (time, way), (right, direction) in zip(found, sorted(expected), strict=True):
        assert abs(time - right) <= ONCE * max(1.0, right)
        assert way == direction


@pytest.mark.parametrize(("fps", "w", "end"), [(20, 90, 8), (1, 360, 3), (0.5, -1234.5, 4), (7, 31, 40)])
@broad("level", [0.0, 13.7, -39.9], every=2)
def test_a_crank_pin_passes_a_height_at_the_times_of_the_sine(fps, w, end, level):
    inspector = asked(CRANK.format(fps=Fraction(fps), r=40, l=120, w=w, end=end))
    expected = []
    base = math.degrees(math.asin(level / 40))
    for turn in range(-20, 20):
        for angle, rising in ((base + 360 * turn, True), (180 - base + 360 * turn, False)):
            if 1e-9 < angle / w < end - 1e-9:
                expected.append((angle / w, "RISING" if rising == (w > 0) else "FALLING"))
    found = [item for item in times(inspector, f"Crank.P.y = 100 + {level}") if 1e-9 < item[0] < end - 1e-9]
    compare(found, expected)


@pytest.mark.parametrize("x", [151.0, 200.0, 163.0, 221.5])
def test_a_slider_passes_a_place(x):
    r, rod, w, end = 40, 90, 77, 11
    inspector = asked(CRANK.format(fps=3, r=r, l=rod, w=w, end=end))
    reach = x - 100
    cosine = (reach**2 + r**2 - rod**2) / (2 * reach * r)
    angle = math.degrees(math.acos(cosine))
    expected = [
        (a / w, "FALLING" if way < 0 else "RISING")
        for k in range(4)
        for a, way in ((angle + 360 * k, -1), (360 - angle + 360 * k, 1))
        if 0 < a / w < end
    ]
    compare(times(inspector, f"x = {x}"), expected)


def test_touches_are_found_with_their_side_between_frames():
    inspector = asked(CRANK.format(fps=1, r=40, l=120, w=100, end=8))
    compare(times(inspector, "Crank.P.y = 140"), [((90 + 360 * k) / 100, "TOUCHES_BELOW") for k in range(2)])
    compare(times(inspector, "x = 180"), [((180 + 360 * k) / 100, "TOUCHES_ABOVE") for k in range(2)])
    assert times(inspector, "Crank.P.y = 140.000001") == []


@pytest.mark.slow
def test_extremes_are_those_of_the_closed_form():
    inspector = asked(CRANK.format(fps=1, r=40, l=120, w=77, end=6))
    for expression, largest, value, angle in (
        ("Crank.P.y", True, 140, 90),
        ("Crank.P.y", False, 60, 270),
        ("x", False, 180, 180),
        ("Rod.angle", True, math.degrees(math.asin(1 / 3)), 270),
        ("3*Crank.P.x - 7", True, 3 * 140 - 7, 0),
    ):
        (found,) = extremes(inspector, expression, largest=largest)
        assert found is not None
        assert found.value == pytest.approx(value, abs=1e-10)
        assert float(found.time) == pytest.approx(angle / 77, abs=1e-9)


def test_gears_and_what_rests():
    gears = """.config(2, 400, 300);
A : .gear(20, 2) C=[100,100];  B : .gear(40, 2) C=[160,100];
@0 A.C=[100,100]; B.C=[160,100]; A.angle = 90*.t; .mesh(A, B);
@2 A.angle = 180;
@5
"""
    text = gears if not errors(gears) else gears.replace(".mesh(A, B)", "B.angle = -A.angle/2")
    inspector = asked(text)
    compare(times(inspector, "A.angle = 120"), [(120 / 90, "RISING")])
    found = when(inspector, "A.angle = 180").crossings
    assert [(item.way.name, float(item.until)) for item in found][-1] == ("STAYS", 5.0)
    (holding,) = when(inspector, "A.angle < 90").holding
    assert holding[0] == 0
    assert abs(holding[1] - 1) <= ONCE


def errors(text):
    found = Engine(Choices()).revise(SourceText("scene.mov", text)).diagnostics
    return [item for item in found if item.severity.value == "error"]


def test_a_free_oscillator_passes_zero_at_its_periods():
    """x'' = -4 x from 50: x = 50 cos(2 t)."""
    inspector = asked(
        """.config(5, 400, 300);
Mass : .disc(5) C=[0,0];
@0 Mass.C = [200 + x, 100];  v = -4*.i(x);  x = 50 + .i(v);
@6
"""
    )
    found = times(inspector, "x = 0")
    expected = [math.pi / 4 * k for k in (1, 3, 5, 7)]
    assert len(found) == len(expected)
    for (time, _), right in zip(found, expected, strict=True):
        assert abs(time - right) < 1e-10


def test_jumps_and_full_turns():
    inspector = asked(CRANK.format(fps=9, r=40, l=120, w=100, end=8).replace("@8", "@4 Crank.angle = 30;\n@8"))
    (jump,) = [item for item in when(inspector, "Crank.angle = 200").crossings if item.way.name == "JUMPS"]
    assert jump.time == 4
    compare(
        [item for item in times(inspector, ".a(Crank.P - Crank.C, [1,0]) = 170") if item[0] < 4],
        [(1.9, "FALLING")],
    )
    assert [item.way.name for item in when(inspector, "Crank.P = [100,140]").crossings] == ["MEETS"]
