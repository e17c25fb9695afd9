"""Followers that swing about a pivot: law, cut, touch, law again, mirrored and at any scale."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad


@pytest.mark.parametrize("side", [1, -1])
@broad("size", [0.01, 1.0, 1000.0], first=1)
@pytest.mark.parametrize("kind", ["roller", "face"])
def test_a_swinging_follower_finds_the_law_that_cut_the_cam(kind: str, size: float, side: int) -> None:
    def at(x: float, y: float) -> str:
        return f"[{side * x * size!r},{y * size!r}]"

    far = (160.0, 230.0) if kind == "roller" else (60.0, 215.0)
    pivot = (260.0, 160.0) if kind == "roller" else (290.0, 150.0)
    rods = "".join(f"{name} : .bar A = {at(*pivot)} B = {at(*far)};\n" for name in ("Law", "Other"))
    tool, held = "Law", "Other"
    rollers, carried = "", ""
    if kind == "roller":
        tool, held = "Cutter", "Roller"
        rollers = "".join(f"{name} : .disc({12 * size!r}) C = {at(*far)};\n" for name in (tool, held))
        carried = "Cutter.C = Law.B; Cutter.angle = 0; Roller.C = Other.B; Roller.angle = 0;"
    script = f"""
.config(50, 400, 400);
Hub : .disc({6 * size!r}) C = {at(150, 150)} P = {at(156, 150)};
{rods}{rollers}Cam : .cut {tool} .in Hub;
@0 Hub.C = {at(150, 150)};   Hub.angle = {side * 72}*.t;
   Law.A = {at(*pivot)};   Law.angle = {-5 * side}*(1 - .cos(72*.t));   Other.A = {at(*pivot)};   {carried}
   .gap({held}, Cam) = 0;   Other.B.y > {170 * size!r};
@5
"""
    motion = mv.loads(script).solve()
    assert np.abs(motion["Other.angle"] - motion["Law.angle"]).max() < 1e-9
