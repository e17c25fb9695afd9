"""What the textbooks say about engines and their valve gears, measured on the solved poses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.mechanisms import engine_oracles
from tests.mechanisms.kinematics import Array, Columns, distance, point, root

Solve = Callable[..., Columns]

LAP = 6.0
"""Of both valve gears' slide valves."""


def test_piston_stroke_is_twice_the_crank(solve_script: Solve) -> None:
    for name, throw in (("slider-crank", 45), ("walschaerts", 40)):
        h = solve_script(name)["Piston.H.x"]
        assert np.ptp(h) == pytest.approx(2 * throw, rel=1e-12)


def test_slide_valve_leads_the_piston(solve_script: Solve) -> None:
    """The eccentric rod's line leans by 16.9°, so 127° ahead of the crank acts like 110°: lap and lead 4.8 each way."""
    table = solve_script("slider-crank", "50")
    v = table["Valve.V.x"]
    at_front, at_back = v[0], v[50]
    assert (at_back - at_front) / 2 == pytest.approx(14 * np.sin(np.deg2rad(20.1)), rel=0.03)


def test_oscillating_cylinder_points_at_the_crank(solve_script: Solve) -> None:
    table = solve_script("oscillating-engine")
    reach = point(table, "Wheel.P") - point(table, "Cylinder.T")
    np.testing.assert_allclose(np.rad2deg(np.arctan2(-reach[:, 0], reach[:, 1])), table["Cylinder.angle"], atol=1e-10)
    # the largest swing is where the rod touches the crank circle: sin α = r/D
    finest = np.abs(solve_script("oscillating-engine", "500")["Cylinder.angle"]).max()
    assert finest == pytest.approx(np.rad2deg(np.arcsin(45 / 190)), abs=1e-3)


@pytest.mark.parametrize("fps", ["25", "30", "7"])
def test_coupled_cranks_stay_parallel_through_dead_points(fps: str, solve_script: Solve) -> None:
    table = solve_script("coupling-rods", fps)
    crank = np.mod(table["Middle.angle"], 180)
    if fps == "30":  # frames exactly on both dead points
        assert np.sum(np.minimum(crank, 180 - crank) < 1e-9) == 2
    for name in ("Front", "Rear"):
        np.testing.assert_allclose(table[f"{name}.angle"], table["Middle.angle"], atol=1e-9)
    for name in ("FrontRod", "RearRod"):
        np.testing.assert_allclose(table[f"{name}.angle"], 0, atol=1e-9)


def test_scotch_yoke_is_an_exact_sine(solve_script: Solve) -> None:
    table = solve_script("scotch-yoke")
    np.testing.assert_allclose(table["Yoke.O.x"], 260 + 50 * np.cos(np.pi * table["time"]), rtol=1e-14)


# --- Walschaerts ------------------------------------------------------------------------------------------


def _dead_centres(time: Array) -> NDArray[np.int64]:
    return np.flatnonzero(np.abs(time * 2 - np.round(time * 2)) < 1e-9)


def test_walschaerts_lead_is_constant(solve_script: Solve) -> None:
    """The link stands in its middle at both dead centres, so where the die is makes no difference: lap + lead."""
    table = solve_script("walschaerts")
    at = _dead_centres(table["time"])
    assert len(at) == 12
    valve = table["Valve.V.x"][at] - 405
    front = np.where(np.arange(12) % 2 == 0, -1.0, 1.0)
    np.testing.assert_allclose(valve, front * 40 * 18.2 / 104, atol=1e-9)
    np.testing.assert_allclose(table["Link.angle"][at], 0, atol=1e-9)


def test_walschaerts_travel_in_mid_gear_is_twice_lap_and_lead(solve_script: Solve) -> None:
    table = solve_script("walschaerts", "100")
    time = table["time"]
    mid = (time >= 2) & (time <= 3)
    valve = table["Valve.V.x"][mid]
    assert np.ptp(valve) == pytest.approx(2 * 40 * 18.2 / 104, abs=1e-9)
    # and it comes from the crosshead alone: the valve follows it, in the lever's ratio, within the swing of a short rod
    cross = table["Piston.H.x"][mid] - 330
    np.testing.assert_allclose(valve - 405, -cross * 18.2 / 104, atol=0.3)
    # the die stays at the trunnion within the slip that the lever's nodding makes
    assert distance(point(table, "Radius.D"), point(table, "Link.T"))[mid].max() < 0.46


def test_walschaerts_reverses(solve_script: Solve) -> None:
    table = solve_script("walschaerts", "100")
    valve, time = table["Valve.V.x"] - 405, table["time"]
    forward, middle, reverse = (valve[(time >= a - 1e-9) & (time < a + 1 - 1e-9)] for a in (0, 2, 4))
    assert len(forward) == len(middle) == len(reverse) == 100
    driven_forward, driven_reverse = forward - middle, reverse - middle
    # what the return crank adds changes its sign, and is a sine in quadrature with the crosshead's part
    turn = 2 * np.pi * np.arange(100) / 100
    for part, sign in ((driven_forward, -1), (driven_reverse, +1)):
        amplitude = 2 * np.mean(part * np.sin(turn))
        assert sign * amplitude == pytest.approx(13.9, abs=1.2)
        assert abs(2 * np.mean(part * np.cos(turn))) < 0.3
    assert np.ptp(forward) > 2 * 14
    assert np.ptp(reverse) > 2 * 14


def test_walschaerts_cut_off(solve_script: Solve) -> None:
    """Admission ends where the valve comes back over its port: about three quarters of the stroke in full gear."""

    def front_valve(turn: float) -> float:
        return float(engine_oracles.walschaerts(np.array([turn]), np.array([1.0]))["Valve.V.x"][0]) - 405 + LAP

    turn = root(front_valve, 0.325, 0.07)
    table = solve_script("walschaerts", "100")
    time = table["time"]
    first = (time > 0.1) & (time < 0.5)
    valve = table["Valve.V.x"][first] - 405 + LAP
    k = int(np.flatnonzero((valve[:-1] < 0) & (valve[1:] >= 0))[0])
    seen = time[first][k] + 0.01 * -valve[k] / (valve[k + 1] - valve[k])
    assert seen == pytest.approx(turn, abs=1e-4)
    stroke = (370 - float(np.interp(seen, time, table["Piston.H.x"]))) / 80
    assert 0.70 < stroke < 0.80


# --- Stephenson -------------------------------------------------------------------------------------------


def test_stephenson_lead_grows_towards_mid_gear(solve_script: Solve) -> None:
    """Open rods: the nearer to mid-gear, the more the valve is open at the dead centres (unlike Walschaerts')."""
    table = solve_script("stephenson")
    at = [0, 20, 40, 60]
    valve = table["Valve.D.x"]
    lead = [(valve[k + 10] - valve[k]) / 2 - LAP for k in (0, 40, 80)]
    assert lead[0] == pytest.approx(1.33, abs=0.01)
    assert lead[1] == pytest.approx(2.91, abs=0.01)
    assert lead[2] == pytest.approx(0.91, abs=0.01)
    assert table["gear"][at] == pytest.approx([1, 1, 0, 0])


def test_stephenson_link_hangs_on_three_rods(solve_script: Solve) -> None:
    table = solve_script("stephenson")
    axle, pins = point(table, "Axle.C"), {n: point(table, f"Link.{n}") for n in "ABSK"}
    for eccentric, end in (("F", "A"), ("B", "B")):
        np.testing.assert_allclose(distance(point(table, f"Axle.{eccentric}"), axle), 20, rtol=1e-12)
        np.testing.assert_allclose(distance(point(table, f"Axle.{eccentric}"), pins[end]), 220, rtol=1e-12)
    np.testing.assert_allclose(distance(pins["S"], point(table, "Arm.H")), 80, rtol=1e-12)
    np.testing.assert_allclose(distance(pins["A"], pins["B"]), 90, rtol=1e-12)
    np.testing.assert_allclose(distance(pins["K"], point(table, "Valve.D")), 220, rtol=1e-12)


def test_stephenson_reverses(solve_script: Solve) -> None:
    """Full backward gear is full forward gear run the other way, but for the hanger's own arc."""
    table = solve_script("stephenson", "100")
    valve, time = table["Valve.D.x"], table["time"]
    forward = valve[(time >= -1e-9) & (time < 1 - 1e-9)]
    backward = valve[(time >= 4 - 1e-9) & (time < 5 - 1e-9)]
    mirrored = backward[(-np.arange(100)) % 100]
    assert np.abs((forward - forward.mean()) - (mirrored - mirrored.mean())).max() < 0.1 * np.ptp(forward)
    assert np.corrcoef(forward, backward)[0, 1] < 0.2
