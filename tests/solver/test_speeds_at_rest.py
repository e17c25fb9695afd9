"""How fast a speed changes where it is zero: as it comes next, and at the end as it came."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv

LAWS = {
    "from rest": ("[60 + 20*.t^2, 100]", lambda t: np.full_like(t, 40.0)),
    "in two directions": ("[60 + 15*.t^2, 100 + 20*.t^2]", lambda t: np.full_like(t, 50.0)),
    "rests at first": ("[60 + 30*.max(0, .t - 0.5)^2, 100]", lambda t: np.where(t >= 0.5, 60.0, 0.0)),
    "turns back": ("[60, 100 + 25*(.t - 1)^2]", lambda t: np.where(t >= 1.0, 50.0, -50.0)),
    "comes to rest": ("[60, 100 + 25*(.t - 2)^2]", lambda t: np.full_like(t, -50.0)),
}


WORDINGS = (
    "a = .d(.d(A.P).l);",
    "s = .d(A.P).l; a = .d(s);",
    ".d(A.P).l = s; a = .d(s);",
    "0 = s - .d(A.P).l; a = .d(s);",
    "s = 2*.d(A.P).l + 1; a = .d(s)/2;",
    "v = .d(A.P); s = v.l; a = .d(s);",
)


@pytest.mark.parametrize("wording", WORDINGS)
@pytest.mark.parametrize("name", LAWS)
def test_a_speed_that_is_zero_has_a_rate(name: str, wording: str) -> None:
    place, truth = LAWS[name]
    motion = mv.loads(f".config(10); A : .disc(5) P = [60,100]; @0 A.P = {place}; {wording} @2").solve()
    assert motion["a"] == pytest.approx(truth(motion.times), abs=1e-9)


@pytest.mark.parametrize("wording", ["a = .d((A.P - [60,100]).l);", "r = (A.P - [60,100]).l; a = .d(r);"])
def test_a_distance_that_is_zero_has_a_rate(wording: str) -> None:
    place = "[60 + 30*(.t - 1), 100]"
    motion = mv.loads(f".config(10); A : .disc(5) P = [60,100]; @0 A.P = {place}; {wording} @2").solve()
    assert motion["a"] == pytest.approx(np.where(motion.times >= 1.0, 30.0, -30.0), abs=1e-9)
