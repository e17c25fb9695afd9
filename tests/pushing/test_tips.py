"""Corners that meet tip to tip."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv

TIPS = """
    .config(10, 300, 200);
    A : .polygon P = [40,100] Q = [60,80] R = [80,100] S = [60,120];
    B : .polygon P = [110,{y}] Q = [130,{below}] R = [150,{y}] S = [130,{above}];
    @0 A.P = [40 + 40*.t, 100];   A.angle = 0;   B.angle = 0;
       .gap(A, B) >= 0 .pushes;
    @2
"""


def told(y: float) -> tuple[mv.Motion, list[mv.Diagnostic]]:
    motion = mv.loads(TIPS.format(y=y, below=y - 20, above=y + 20)).solve()
    return motion, [each for each in motion.diagnostics if each.code == "contact/undecided"]


def test_tips_that_meet_exactly_are_undecided() -> None:
    motion, (warning,) = told(100.0)
    assert "t = 0.75" in warning.message
    assert ("undecided", pytest.approx(0.75, abs=1e-9)) in [(each.event, each.time) for each in motion.contacts]
    x, y = (motion["B.P"][-1] - motion["B.P"][0]).tolist()
    assert abs(y) == pytest.approx(x, abs=1e-9)  # it slides along an edge, on one side
    assert x == pytest.approx(25.0, abs=1e-9)


@pytest.mark.parametrize("off", [1e-6, -1e-6, 1e-3, -1e-3, 1.0, -1.0])
def test_tips_that_come_past_each_other_are_not(off: float) -> None:
    motion, warnings = told(100.0 + off)
    assert not warnings
    way = motion["B.P"][-1] - motion["B.P"][0]
    assert way[1] == pytest.approx(np.sign(off) * way[0], abs=1e-9)
    assert way[0] == pytest.approx(25.0 - abs(off) / 2.0, abs=1e-9)


@pytest.mark.parametrize("up", [0.0, 10.0, -10.0])
def test_blocks_that_lie_flush_are_not(up: float) -> None:
    """Their corners meet, and both say the same."""
    text = f"""
        .config(10, 300, 200);
        A : .polygon P = [0,0] Q = [20,0] R = [20,20] S = [0,20];
        B : .polygon P = [50,{up}] Q = [70,{up}] R = [70,{20 + up}] S = [50,{20 + up}];
        @0 A.P = [40*.t, 0];  A.angle = 0;  B.P.y = {up};  B.angle = 0;  .gap(A, B) >= 0 .pushes;
        @2
    """
    motion = mv.loads(text).solve()
    assert np.abs(motion["B.P"][:, 0] - np.maximum(50.0, 40.0 * motion.times + 20.0)).max() < 1e-9
    assert not [each for each in motion.diagnostics if each.code == "contact/undecided"]
