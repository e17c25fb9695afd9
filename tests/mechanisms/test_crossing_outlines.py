"""Outlines that cross themselves are told, where a distance from them is asked for; others are not."""

from __future__ import annotations

import pytest

import movimentum as mv

CROSSES = {
    "an eight": ".curve C = [150,100] .param(u, [60*.sin(u), 30*.sin(2*u)])",
    "an eight that is turned": ".curve C = [150,100] .param(u, [60*.sin(u + 13), 30*.sin(2*u + 26)])",
    "a limaçon": ".curve C = [150,100] .param(u, [(20 + 40*.cos(u))*.cos(u), (20 + 40*.cos(u))*.sin(u)])",
    "an epitrochoid": ".curve C = [150,100] .param(u, [40*.cos(u) + 30*.cos(4*u), 40*.sin(u) + 30*.sin(4*u)])",
    "through points": ".curve C = [150,100] .through([0,0], [40,40], [0,40], [40,0])",
    "a bow tie": ".polygon C = [150,100] P = [190,140] Q = [190,100] R = [150,140]",
    "a pentagram": ".polygon C = [150,100] P[k = 0..4] = C + [40,0].r(144*k) .through(P)",
}
CLEAN = {
    "a lobed cam": ".curve C = [150,100] .polar(th, 40 + 20*.cos(5*th))",
    "an astroid": ".curve C = [150,100] .param(u, [50*.cos(u)^3, 50*.sin(u)^3])",
    "a deltoid": ".curve C = [150,100] .param(u, [40*.cos(u) + 20*.cos(2*u), 40*.sin(u) - 20*.sin(2*u)])",
    "a snail": ".curve C = [150,100] .polar(th, 30 + th/12)",
    "a gear": ".gear(12, 5) C = [150,100]",
    "a hollow polygon": ".polygon C = [130,80] P = [190,80] Q = [190,140] R = [160,100] S = [130,140]",
    "an open eight": ".curve C = [150,100] .param(u, [60*.sin(u), 30*.sin(2*u)]) .open .width(2)",
    "a bent bar": ".bar C = [150,100] P = [190,140] Q = [190,100] R = [150,140] .width(6)",
}


def told(shape: str, value: str) -> list[str]:
    script = mv.loads(f"K : {shape}; D : .disc(5) C = [250,100]; @0 K.C = [150,100]; D.C = [250,100]; g = {value};")
    return [item.code for item in script.diagnostics if item.code == "contact/crosses"]


@pytest.mark.parametrize("name", CROSSES)
def test_an_outline_that_crosses_itself_is_told_once(name: str) -> None:
    assert told(CROSSES[name], ".gap(D, K) + .gap(K, D)") == ["contact/crosses"]


@pytest.mark.parametrize("name", CLEAN)
def test_one_that_does_not_is_not(name: str) -> None:
    assert told(CLEAN[name], ".gap(D, K)") == []


def test_what_only_follows_the_line_may_cross_itself() -> None:
    assert told(CROSSES["an eight"], ".where(D.C, K)") == []
