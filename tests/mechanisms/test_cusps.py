"""Curves whose parameter stands still at cusps, outwards and inwards: what touches them, against closed forms and
shapely.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

import movimentum as mv
from tests.broad import broad

CURVES = {
    "astroid": "[S*.cos(u)^3, S*.sin(u)^3]",
    "deltoid": "[S*(2*.cos(u) + .cos(2*u))/3, S*(2*.sin(u) - .sin(2*u))/3]",
    "cardioid": "[S*(2*.cos(u) - .cos(2*u))/3, S*(2*.sin(u) - .sin(2*u))/3]",
    "nephroid": "[S*(3*.cos(u) - .cos(3*u))/4, S*(3*.sin(u) - .sin(3*u))/4]",
}


def points_of(name: str, size: float, angles: np.ndarray) -> np.ndarray:
    text = CURVES[name].replace(".cos(", "np.cos(A*").replace(".sin(", "np.sin(A*").replace("^3", "**3")
    x, y = eval(text, {"np": np, "A": np.pi / 180.0, "S": size, "u": angles})
    return np.stack([x, y], axis=-1)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("size", [0.4, 40.0, 4000.0])
@broad("name", CURVES, first=1)
def test_distances_from_curves_with_cusps(name: str, size: float, way: int) -> None:
    """They have the right sign and size everywhere, whichever way round the curve is told."""
    text = CURVES[name].replace("S", repr(size)).replace("u)", f"({way}*u))")
    random = np.random.default_rng(7)
    places = random.uniform(-1.3, 1.3, (40, 2)) * size
    dots = "".join(f"D{k} : .disc({size / 100!r}) C = [{x!r},{y!r}]; " for k, (x, y) in enumerate(places.tolist()))
    held = "".join(f"D{k}.C = [{x!r},{y!r}]; g{k} = .on(D{k}.C, Curve); " for k, (x, y) in enumerate(places.tolist()))
    script = f".config(1, 300, 300); Curve : .curve C = [0,0] .param(u, {text}); {dots} @0 Curve.C = [0,0]; {held} @1"
    motion = mv.loads(script).solve()
    found = np.array([motion[f"g{k}"][0] for k in range(len(places))])
    corners = points_of(name, size, np.linspace(0.0, 360.0, 60_001))
    far = shapely.distance(shapely.LinearRing(corners), shapely.points(places))
    assert np.abs(np.abs(found) - far).max() < 1e-8 * size
    inside = shapely.contains_xy(shapely.Polygon(corners), places)
    assert len(set(np.sign(found[inside]))) == 1
    assert set(np.sign(found[inside])) == {-value for value in set(np.sign(found[~inside]))}


@broad("size", [0.01, 1.0, 1000.0], first=1)
@pytest.mark.parametrize("begin", [0.0, -3.0, 2.0])
@pytest.mark.parametrize("order", [">", ">="])
def test_a_roller_goes_round_the_tip_of_an_astroid(begin: float, order: str, size: float) -> None:
    """It starts on the tip, before it, or behind its middle."""
    script = f"""
.config(200, 300, 300);
Tip : .curve C = [0,0] .param(u, [{40 * size!r}*.cos(u)^3, {40 * size!r}*.sin(u)^3]);
Roller : .disc({5 * size!r}) C = [0,{45 * size!r}];
@0 Tip.C = [0,0]; Tip.angle = {begin} + 20*.t; Roller.angle = 0;
   Roller.C.x = 0; Roller.C.y {order} 0; .gap(Roller, Tip) = 0;
@1/5
"""
    motion = mv.loads(script).solve()
    turn = np.radians(begin + 20.0 * np.asarray(motion.times, dtype=float))
    height = 40.0 * np.cos(turn) + np.sqrt(25.0 - (40.0 * np.sin(turn)) ** 2)
    assert np.abs(motion["Roller.C.y"] / size - height).max() < 1e-11


def test_a_pin_passes_the_cusps_of_a_cycloid() -> None:
    """The arches of a rolling circle, along which a pin is led by its share of the length."""
    radius = 12.0
    script = f"""
.config(60, 300, 300);
Arches : .curve A = [0,0] .param(u, [{radius}*(u*.pi/180 - .sin(u)), {radius}*(1 - .cos(u))]) .range(0, 1080) .open;
Pin : .disc(2) C = [10,10];
@0 Arches.A = [0,0]; Arches.angle = 0; Pin.angle = 0; .on(Pin.C, Arches) = 0; .where(Pin.C, Arches) = .t/10 + 0.02;
@9
"""
    motion = mv.loads(script).solve()
    along = (np.asarray(motion.times, dtype=float) / 10.0 + 0.02) * 3.0  # an arch is 8 radii long
    arch, part = np.floor(along), along - np.floor(along)
    angle = 2.0 * np.arccos(1.0 - 2.0 * part)
    x, y = radius * (2.0 * math.pi * arch + angle - np.sin(angle)), radius * (1.0 - np.cos(angle))
    assert np.abs(motion["Pin.C.x"] - x).max() < 1e-8
    assert np.abs(motion["Pin.C.y"] - y).max() < 1e-8
