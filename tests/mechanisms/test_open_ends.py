"""Contacts that come to the end of an open curve, whose times are known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum
from movimentum import stages
from tests.broad import broad
from tests.understand import timeline_of

HEAD = ".config(10, 400, 400);\n"


def arc(seed):
    """An open curve as text, its kind, and where it ends, both as places (x, y) about its anchor."""
    random = np.random.default_rng(seed)
    kind = seed % 4
    if kind == 0:  # a straight line
        length, slope = round(float(random.uniform(40.0, 120.0)), 2), round(float(random.uniform(-0.5, 0.5)), 3)
        return f".param(u, [u, {slope}*u]) .range(0, {length})", (length, slope * length)
    if kind == 1:  # a parabola
        length = round(float(random.uniform(40.0, 120.0)), 2)
        return f".param(u, [{length}*u, 30*u^2]) .range(0, 1)", (length, 30.0)
    if kind == 2:  # a line with a corner
        length = round(float(random.uniform(40.0, 120.0)), 2)
        return f".param(u, [u, .abs(u - 20)]) .range(0, {length})", (length, length - 20.0)
    x, y = np.round(random.uniform((60.0, -30.0), (120.0, 30.0)), 2).tolist()
    return f".through([0,0], [20,10], [40,5], [{x},{y}])", (x, y)


@broad("seed", range(24), first=4)
def test_a_pin_that_is_driven_over_the_end_is_told_when(seed):
    random = np.random.default_rng(seed + 100)
    text, (x, _) = arc(seed)
    begin = round(float(random.uniform(0.1, 0.5)) * x, 2)
    speed = round(float(random.uniform(10.0, 40.0)), 2)
    end = (x - begin) / speed
    statements = ["E.A = [200,200];", "E.angle = 0;", ".on(P.P, E) = 0;", f"P.P.x = {200 + begin} + {speed}*.t;"]
    random.shuffle(statements)
    script = (
        f"E : .curve A = [200,200] {text} .open;   P : .disc(4) P = [{200 + begin},200];\n@0 {' '.join(statements)}\n"
    )
    motion = stages.solve(timeline_of(f"{HEAD}{script}@{end + 1.0}"))
    told = [item for item in stages.examine(motion).diagnostics if item.severity.name == "ERROR"]
    assert [item.code for item in told] == ["contact/end"]
    when = float(told[0].message.split("t = ")[1].split(":")[0])
    assert when == pytest.approx(end, abs=1e-7)
    assert "at its end" in told[0].message
    # as far as its end it is fine
    movimentum.loads(f"{HEAD}{script}@{math.floor(end * 1e6) / 1e6}").solve()


def test_a_pin_that_begins_beyond_an_end_is_told():
    motion = stages.solve(timeline_of(HEAD + """E : .curve A = [200,200] .param(u, [u, 0.3*u]) .range(0, 100) .open;
P : .disc(4) P = [200,200];
@0 E.A = [200,200]; E.angle = 0; .on(P.P, E) = 0; P.P.x = 180 + 20*.t;
@4"""))  # fmt: skip
    told = [item for item in stages.examine(motion).diagnostics if item.severity.name == "ERROR"]
    assert [item.code for item in told] == ["contact/end"]
    assert "until t = 0.99999" in told[0].message or "until t = 1" in told[0].message


@pytest.mark.parametrize("value", [".point(E, .t/2)", "[200,200] + 9*.tangent(E, .t/2)"])
def test_a_place_beyond_an_end_is_told(value):
    motion = stages.solve(timeline_of(HEAD + f"""E : .curve A = [200,200] .through([0,0], [40,40], [90,0]) .open;
P : .disc(4) P = [200,200];
@0 E.A = [200,200]; E.angle = 0; P.P = {value};
@3"""))  # fmt: skip
    told = [item for item in stages.examine(motion).diagnostics if item.severity.name == "ERROR"]
    assert [item.code for item in told] == ["contact/end"]
    assert "from t = 2 on" in told[0].message
