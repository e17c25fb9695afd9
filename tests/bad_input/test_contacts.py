"""Curves, contacts, cuts and cords with wrong arguments, without values, of no size: told with a code and a place."""

from __future__ import annotations

import pytest

import movimentum
from movimentum.errors import NoSolutionError, ScriptError
from tests.broad import broad

HEAD = """.config(10, 300, 300);
C : .curve A = [150,150] .polar(th, 40);   D : .disc(5) P = [150,200];   E : .disc(9) P = [200,200];
"""
STEP = "@0 C.A = [150,150]; C.angle = 0; "
CURVES = [
    "", ".polar(40)", ".polar(th)", ".polar(th, 40, 5)", ".polar(th, [1,2])", ".polar(th, 0)", ".polar(th, 1/.sin(th))",
    ".polar(th, .sqrt(.cos(th)))", ".polar(th, 1e300*th)", ".polar(th, q)", ".polar(th, .t)", ".polar(th, .acos(2))",
    ".polar(th, .mod(th, 0))", ".polar(th, .floor(th*50))", ".param(u, 5)", ".param(u, [3,4])", ".param(u, [u, u, u])",
    ".param(u, [u, u]) .range(5, 5)", ".param(u, [u, u]) .range(9, 5)", ".param(u, [u, u]) .range(5)", ".through()",
    ".through([0,0])", ".through([0,0], [0,0]) .open", ".through([0,0], [9,0])", ".through(5, 6, 7)", ".points()",
    ".points('nope.csv')", ".points(5)", ".polar(th, 40) .through([0,0], [1,1], [2,0])",
]  # fmt: skip
DEFINITIONS = [
    *(f"K : .curve A = [9,9] {curve};" for curve in CURVES), "K : .curve;", "K : .curve 'nope.svg#a' A = [9,9];",
    "K : .cut;", "K : .cut D;", "K : .cut D .in;", "K : .cut D .in D;", "K : .cut Nope .in C;", "K : .cut D .in Nope;",
    "K : .cut K .in D;", "K : .cord;", "K : .cord D.P;", "K : .cord D.P D.P;", "K : .cord D Nope;",
]  # fmt: skip
STATEMENTS = [
    ".gap(D);", ".gap(D, E);", ".gap() = 0;", ".gap(D, E, C) = 0;", ".gap(D.P, E.P) = 0;", ".gap(D, E) = [1,2];",
    ".gap(D, 5) = 0;", ".gap('x', D) = 0;", ".gap(D, E) = .sqrt(-1);", ".gap(D, E) = 1/0;", ".gap(D, E) = -50;",
    ".gap(D, E) = 1e9;", ".gap(C, C) = 0;", ".on(D.P) = 0;", ".on(D, C) = 0;", ".on(5, C) = 0;", ".on(C, D.P) = 0;",
    ".where(D.P, C) = 'x';", ".where(D.P) = 1;", ".where(D.P, C) = .t/0;", ".roll(C) = 0;", ".roll(C, C) = 0;",
    ".on(D.P, C) = 0; .where(D.P, C) = .tan(90*.t);", ".roll(C, D) = [0,1];", ".roll(C, D) = .sqrt(.t - 2);",
    ".roll(C.A, D) = 0;", ".cord() = 5;", ".cord(D) = 5;", ".cord(D.P, E.P) = -5;", ".cord(D.P, E.P) = [1,2];",
    ".cord(D.P, D, E.P) = 100;", ".cord(D, -D) = 5;", ".cord(D, E, D) = 1e9;", ".belt(D) = 0;", ".belt(D, D) = 0;",
    ".belt(D, E, C) = 0;", ".belt(D, E) = [1,2];", ".belt(D.P, E.P) = 0;", "D.P = .point(C);", "D.P = .point(D.P, 1);",
    "D.P = .point(C, [1,2]);", "D.P = .point(C, .sqrt(-1));", "D.P = .point(C, 1/.t);", "x = .curvature(C, 'a');",
    "x = .length(D.P);", ".gap(D, E) = 0; D.P = [100,100]; E.P = [100,100];",
]  # fmt: skip


@broad("text", [*(f"{each}\n{STEP}" for each in DEFINITIONS), *(STEP + each for each in STATEMENTS)], every=6)
def test_what_makes_no_sense_is_told(text):
    with pytest.raises((ScriptError, NoSolutionError)) as caught:
        movimentum.loads(f"{HEAD}{text}\n@1").solve()
    told = str(caught.value)
    assert told.startswith("error[")
    assert "internal/" not in told
    assert "None" not in told
    for item in getattr(caught.value, "diagnostics", ()):
        assert item.code
        assert item.message


@broad(
    ("place", "cord", "when"),
    [
        ("[250 - 80*.t, 200]", "[120,100], W, L.P", 0.875),
        ("[150, 250 - 40*.t]", "[120,100], W, L.P", 0.5),
        ("[250 - 80*.t, 200]", "[120,100], W, -L, [300,100]", 0.75),
        ("[250 - 80*.t, 200]", "[120,100], W, L, [300,100]", 1.0),
    ],
    first=2,
)
def test_a_cord_without_a_tangent_is_told_with_the_time(place, cord, when):
    text = f"""W : .disc(30) O = [150,200]; L : .disc(10) P = [250,200];
    @0 W.O = [150,200]; L.P = {place}; c = .cord({cord}); @1.2"""
    with pytest.raises(NoSolutionError) as caught:
        movimentum.loads(text).solve()
    (error,) = (each for each in caught.value.diagnostics if each.severity == "error")
    assert error.code == "solve/unreachable"
    assert "no tangent" in error.message
    assert float(error.message.split("t = ")[1].split()[0]) == pytest.approx(when, abs=1e-6)
