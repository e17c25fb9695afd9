"""Lowered expressions have the values that mathematics gives them."""

from __future__ import annotations

import math

import pytest

from tests.understand import value

P, Q = (3.0, 4.0), (-5.0, 12.0)

SCALARS = [
    ("-2^2", -4.0),
    ("(-2)^2", 4.0),
    ("2^-1", 0.5),
    ("2^3^2", 512.0),
    ("8 - 3 - 2", 3.0),
    ("16 / 4 / 2", 2.0),
    ("1 + 2*3 - 4/8", 6.5),
    ("Bar.P.l", 5.0),
    ("Bar.P.length^2", 25.0),
    ("(Bar.P - Bar.Q).l", math.hypot(8, 8)),
    ("[3,4].l", 5.0),
    ("Bar.Q.x + Bar.Q.y", 7.0),
    ("Bar.Q.z", 0.0),
    ("[1,2,0].z", 0.0),
    (".a([1,0], [0,2])", 90.0),
    (".a([0,2], [1,0])", -90.0),
    (".a([1,0], [-3,0])", 180.0),
    (".a([2,1], [4,2])", 0.0),
    (".angle([1,0], [1,1])", 45.0),
    (".sin(30)", 0.5),
    (".cos(90)", 0.0),
    (".cos(-270)", 0.0),
    (".tan(45)", 1.0),
    (".asin(0.5)", 30.0),
    (".acos(-1)", 180.0),
    (".atan(1)", 45.0),
    (".atan2(1, -1)", 135.0),
    (".abs(-3)", 3.0),
    (".min(3, 1, 2)", 1.0),
    (".max(3, 1, 2, 7, 5)", 7.0),
    (".min(3)", 3.0),
    (".floor(-0.5)", -1.0),
    (".mod(-30, 360)", 330.0),
    (".exp(1)", math.e),
    (".ln(.exp(3))", 3.0),
    (".q(2)", math.sqrt(2)),
    (".sqrt(16)", 4.0),
    (".ease(0.5)", 0.5),
    (".ease(2)", 1.0),
    (".pi", math.pi),
    ("2*v.r(90).y", 2.0),
    ("-v.r(90).l", -1.0),
    ("x*_ + y", 7 * 10 + 20.0),
    ("{ 1 : 10 > 1 : 20 > 2 : 30 }", 10.0),
    ("{ 1.5 : 10 > 1 : 20 > 2 : 30 }", 20.0),
    ("{ 2.5 : 10 > 1 : 20 > 2 : 30 }", 30.0),
    ("{ Bar.P.y : Bar.Q.y > Bar.Q.y : Bar.P.y }", 12.0),
    ("{ Bar.P.x : Bar.Q.x > Bar.Q.x : Bar.P.x }", 3.0),
    (".min(x, y, Bar.P.x, .T)", 3.0),
    (".t*100", 400.0),
    ("1 - 2 - 3 - 4 - 5 - 6 - 7 - 8 - 9 - x", -43 - 10.0),
    ("x/2/2/2/2/2*2*2*2*2*2", 10.0),
]


@pytest.mark.parametrize(("expression", "expected"), SCALARS)
def test_scalars(expression: str, expected: float) -> None:
    names = {name: v for name, v in (("x", 10.0), ("y", 20.0), ("v", (1.0, 0.0))) if name in expression}
    names = {name: v for name, v in names.items() if name != "v" or "v." in expression}
    assert value(expression, 4.0, **names) == pytest.approx(expected, rel=1e-14, abs=1e-14)


VECTORS = [
    ("Bar.P + Bar.Q", (-2.0, 16.0)),
    ("-Bar.P", (-3.0, -4.0)),
    ("2*Bar.P - Bar.Q/4", (7.25, 5.0)),
    ("Bar.P*2/4*3", (4.5, 6.0)),
    ("Bar.P.r(90)", (-4.0, 3.0)),
    ("Bar.P.rotate(180)", (-3.0, -4.0)),
    ("[1,0]*2.r(90)", (0.0, 2.0)),
    ("[4,0]/2.r(90)", (0.0, 2.0)),
    ("Bar.Q + [1,0].r(30).r(60)", (-5.0, 13.0)),
    ("Bar.P + [_, 0]", (10.0, 4.0)),
    ("Bar.P + _", (10.0, 12.0)),
    ("2*_ + Bar.P", (17.0, 20.0)),
    ("[_,0].r(90)", (0.0, 7.0)),
    ("u + Bar.P", (4.0, 6.0)),
    ("s*Bar.P*s", (12.0, 16.0)),
    ("Bar.P" + " + Bar.Q - Bar.Q" * 10, (3.0, 4.0)),
    ("Bar.P" + "*2/2" * 10, (3.0, 4.0)),
    ("[1,2,0]", (1.0, 2.0)),
]


@pytest.mark.parametrize(("expression", "expected"), VECTORS)
def test_vectors(expression: str, expected: tuple[float, float]) -> None:
    names = {name: v for name, v in (("u", (1.0, 2.0)), ("s", 2.0)) if name in expression}
    assert value(expression, **names) == pytest.approx(expected, rel=1e-14, abs=1e-14)


def test_a_rotation_turns_the_product_in_front_of_it() -> None:
    """`.r` binds like `*`: where both readings make sense they are one."""
    assert value("2*Bar.P.r(37)*3") == pytest.approx(value("6*(Bar.P.r(37))"), rel=1e-15)
    assert value("-Bar.P.r(37)") == pytest.approx(value("(-Bar.P).r(37)"), rel=1e-15)
