"""Pushing inequalities in other words: gaps and rates inside expressions, things that are kept together, and how fast
what is pushed goes.
"""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv

DISCS = """
    .config(20, 300, 100);
    A : .disc(5) C = [0, 50];  B : .disc(5) C = [40, 50];
    @0 A.C = [20*.t, 50];  B.C.y = 50;  B.angle = 0;
       {statement}
    @4
"""


@pytest.mark.parametrize(
    ("statement", "least"),
    [
        ("0 <= .gap(A, B) .pushes;", 0.0),
        (".gap(A, B) - 3 >= 0 .pushes;", 3.0),
        ("2*.gap(A, B) >= 6 .pushes;", 3.0),
        ("-.gap(A, B) <= -2 .pushes;", 2.0),
        ("5 - .gap(A, B)/2 <= 1 .pushes;", 8.0),
        (".gap(A, B) >= w .pushes;  w = 3 + .t;", None),
        (".abs(B.C.x - A.C.x) >= 10 .pushes;", 0.0),
    ],
)
def test_a_gap_pushes_within_an_expression(statement: str, least: float | None) -> None:
    motion = mv.loads(DISCS.format(statement=statement)).solve()
    t = motion.times
    between = 3.0 + t if least is None else least
    truth = np.maximum.accumulate(np.maximum(40.0, 20.0 * t + 10.0 + between))
    assert np.abs(motion["B.C"][:, 0] - truth).max() < 1e-9


def test_a_gap_within_an_expression_pushes_with_all_its_places() -> None:
    """A block comes flat onto a step: as one value a gap would know only its nearest place."""
    text = """
        .config(20, 300, 100);
        A : .polygon P = [0,0] Q = [30,0] R = [30,10] S = [10,10] T = [10,40] U = [0,40];
        B : .polygon P = [60,15] Q = [80,15] R = [80,25] S = [60,25];
        @0 A.P = [20*.t, 0];  A.angle = 0;  B.angle = 0;  {statement}
        @4
    """
    plain = mv.loads(text.format(statement=".gap(A, B) >= 0 .pushes;")).solve()
    other = mv.loads(text.format(statement="3*.gap(A, B) + 1 >= 1 .pushes;")).solve()
    assert np.abs(plain["B.P"] - other["B.P"]).max() < 1e-12


@pytest.mark.parametrize("outline", ["disc", "polygon"])
def test_a_gap_that_stays_small_pulls(outline: str) -> None:
    things = {
        "disc": "A : .disc(5) P = [0, 0];  B : .disc(5) P = [40, 0];",
        "polygon": "A : .polygon P=[0,0] Q=[5,0] R=[5,10] S=[-5,10] T=[-5,0] .through(P, Q, R, S, T);"
        "B : .polygon P=[40,0] Q=[45,0] R=[45,10] S=[35,10] T=[35,0] .through(P, Q, R, S, T);",
    }[outline]
    text = f"""
        .config(20, 300, 100);  {things}
        @0 A.P = [-20*.t, 0];  A.angle = 0;  B.P.y = 0;  B.angle = 0;  .gap(A, B) <= 35 .pushes;
        @4
    """
    motion = mv.loads(text).solve()
    truth = np.minimum(40.0, -20.0 * motion.times + 45.0)
    assert np.abs(motion["B.P"][:, 0] - truth).max() < 1e-9
    assert [(each.event, each.time) for each in motion.contacts] == [("begins", pytest.approx(0.25, abs=1e-9))]


@pytest.mark.parametrize(
    ("statement", "speed"),
    [
        (".d(B.C.x) - .d(A.C.x) >= 0 .pushes;", 20.0),
        ("2*.d(B.C.x) >= 10 .pushes;", 5.0),
        ("0 <= .d(B.C.x - A.C.x) .pushes;", 20.0),
        (".d(A.C.x) <= .d(B.C.x)/2 - 1 .pushes;", 42.0),
        (".d(.gap(A, B)) >= 0 .pushes;", 20.0),
    ],
)
def test_a_rate_pushes_within_an_expression(statement: str, speed: float) -> None:
    motion = mv.loads(DISCS.format(statement=statement)).solve()
    assert np.abs(motion["B.C"][:, 0] - 40.0 - speed * motion.times).max() < 1e-7


def test_how_fast_what_is_pushed_goes() -> None:
    text = """
        .config(20, 300, 100);
        A : .disc(5) C = [0, 50];  B : .disc(5) C = [40, 50];  N : .bar O = [0, 0] P = [10, 0];
        @0 A.C = [20*.t + 10*.sin(180*.t), 50];  B.C.y = 50;  B.angle = 0;  .gap(A, B) >= 0 .pushes;
           v = .d(B.C.x);  N.O = [v, 0];  N.angle = 0;  .claim v >= 0;
        @4
    """
    motion = mv.loads(text).solve()
    begins, ends, again = (each.time for each in motion.contacts)
    t = motion.times
    pushed = ((t >= begins) & (t < ends)) | (t >= again)
    truth = np.where(pushed, 20.0 + 10.0 * np.pi * np.cos(np.pi * t), 0.0)
    assert np.abs(motion["v"] - truth).max() < 1e-8
    assert np.abs(motion["v"] - motion.velocity("B.C")[:, 0]).max() < 1e-8
    assert np.abs(motion["N.O"][:, 0] - truth).max() < 1e-8


def test_what_is_pushed_has_no_acceleration() -> None:
    with pytest.raises(mv.ScriptError) as told:
        mv.loads(DISCS.format(statement=".gap(A, B) >= 0 .pushes;  a = .d(.d(B.C.x));")).solve()
    (error,) = [each for each in told.value.diagnostics if each.severity == "error"]
    assert error.code == "constraint/no-acceleration"
