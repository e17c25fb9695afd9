"""What is published about the gallery's walking legs and gears, measured on the poses."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.mechanisms.gear_oracles import escapement_turn, geneva_turn
from tests.mechanisms.kinematics import Columns, distance, point
from tests.mechanisms.leg_oracles import KLANN
from tests.mechanisms.linkage_oracles import HOLY

Solve = Callable[..., Columns]


def test_klann_steps_as_his_patent_says(solve_script: Solve) -> None:
    """Half a turn along the ground, one unit of the patent to the foot drawn in; then half a turn through the air."""
    foot = (point(solve_script("klann", "100"), "Leg.F") - 50) / 170
    np.testing.assert_allclose(foot[0], KLANN[33], atol=1e-12)
    np.testing.assert_allclose(foot[100], [1.0, 0.0], atol=2e-3)  # three decimals are published
    ground, air = foot[:101], foot[101:]
    assert np.ptp(ground[:, 1]) < 0.056 * np.ptp(ground[:, 0])  # nearly flat
    assert air[:, 1].max() > 0.45  # and lifted by about half a unit


def test_the_walker_has_six_of_jansens_legs(solve_script: Solve) -> None:
    table = solve_script("jansen-walker")
    ends = {"b": "bde.Z bde.R", "d": "bde.Z bde.S", "e": "bde.R bde.S", "g": "ghi.U ghi.V", "h": "ghi.V ghi.W"}
    ends |= {"i": "ghi.U ghi.W", "c": "c.Z c.U", "f": "f.S f.V", "j": "j.P j.R", "k": "k.P k.U"}
    for leg in (f"{side}[{n}]" for side in ("Left", "Right") for n in range(3)):
        for letter, pair in ends.items():
            first, second = (point(table, f"{leg}.{anchor}") for anchor in pair.split())
            np.testing.assert_allclose(distance(first, second), 1.7 * HOLY[letter], rtol=1e-11, err_msg=letter)


def test_the_walker_always_stands(solve_script: Solve) -> None:
    """Of six feet at least two are on the ground at any time, one on either side of the axle."""
    table = solve_script("jansen-walker")
    feet = np.stack([point(table, f"{side}[{n}].ghi.W") for side in ("Left", "Right") for n in range(3)])
    down = feet[:, :, 1] < feet[:, :, 1].min() + 5.0
    assert (down[:3].sum(axis=0) >= 1).all()
    assert (down[3:].sum(axis=0) >= 1).all()


def test_a_ratchet_gains_a_tooth_each_stroke_and_falls_back_onto_its_second_pawl(solve_script: Solve) -> None:
    """Tips are 100 from the axle and roots 83, the flanks undercut by 0.7041 degrees. The pawls are 84 long and pivot
    128 from the axle, the second one so that it drops 1.5 degrees before a stroke ends.
    """
    table = solve_script("ratchet")
    t, wheel = table["time"], table["Wheel.angle"]

    def ahead(radius: float) -> float:
        return math.degrees(math.acos((128.0**2 + radius**2 - 84.0**2) / (2.0 * 128.0 * radius)))

    back = ahead(100.0) - ahead(83.0) + 0.7041 + 1.5
    for stroke in range(1, 5):
        assert abs(wheel[25 * stroke] - 22.5 * stroke) < 2e-3  # six digits are written in the script
    for stroke in range(4):
        held = wheel[(t > stroke + 0.2) & (t < stroke + 0.6)]
        assert np.abs(held - (22.5 * stroke - back)).max() < 2e-3
        assert np.ptp(held) < 1e-9


def test_a_geneva_wheel_with_play_stays_behind(solve_script: Solve) -> None:
    """The pin (radius 6, 91.92 from its axis, slots 17 broad) pushes the wall ahead of it: asin(2.5/distance)."""
    table = solve_script("geneva-play")
    t = table["time"]
    wheel = table["Wheel.angle"]
    r = 91.9239
    for turn in (0, 1):
        pin = 180.0 * (t - 2 * turn) - 180.0
        x, y = 130.0 - r * np.cos(np.radians(pin)), r * np.sin(np.radians(pin))
        expected = -90.0 * turn - 45.0 - np.degrees(np.arctan2(y, x)) + np.degrees(np.arcsin(2.5 / np.hypot(x, y)))
        deep = np.abs(pin) < 25.0
        assert np.count_nonzero(deep) > 5
        assert np.abs(wheel - expected)[deep].max() < 1e-8
        behind = wheel[(pin > 60.0) & (pin < 200.0)]
        assert np.ptp(behind) < 1e-9  # it rests
        assert 1.5 < behind[0] + 90.0 * (turn + 1) < 1.6  # asin(2.5/91.9)


def test_an_escapement_steps_and_never_goes_back(solve_script: Solve) -> None:
    table = solve_script("escapement")
    wheel = table["Wheel.angle"]
    assert np.diff(wheel).max() < 1e-9
    assert np.abs(wheel - escapement_turn(table["time"])).max() < 2e-6
    assert np.abs(table["Hand.angle"] - wheel / 4).max() < 1e-9
    assert np.abs(wheel[30:] - wheel[5:-25] + 24.0).max() < 1e-7  # a tooth each second


@pytest.mark.slow
def test_a_geneva_wheel_rests_for_three_quarters(solve_script: Solve) -> None:
    """The pin pushes the wheel for (180 - 90)/360 of a turn, at most 1/(√2 - 1) times as fast as the crank turns. It
    has 0.5 px of play on each side; the wheel is drawn behind by that, so that it ends as it begins.
    """
    table = solve_script("geneva", "200")
    turned, t = table["turned"], table["time"]
    steps = np.diff(turned)
    assert abs(np.mean(steps > 1e-9) - 0.25) < 0.01  # and a little at the tips of the slots
    fastest = steps.max() / np.abs(np.diff(table["Crank.angle"])).max()
    assert abs(fastest - 1 / (np.sqrt(2) - 1)) < 5e-3
    assert np.abs(table["Pin.O.x"] - 275).min() > 43.9  # the pin stays clear of the wheel's axle
    r = 150.0 * np.sin(np.pi / 4)
    pin = np.deg2rad(180 * (t - 2 * np.floor(t / 2)) - 180)
    far = np.hypot(150.0 - r * np.cos(pin), r * np.sin(pin))
    lag = np.rad2deg(np.arcsin(0.5 / r)) - np.rad2deg(np.arcsin(0.5 / far))
    deep = far < r - 7.0
    assert np.count_nonzero(deep) > 300
    np.testing.assert_allclose(turned[deep], (geneva_turn(t) + lag)[deep], rtol=0, atol=1e-8)
    np.testing.assert_allclose(turned[::400], 90 * np.arange(4), atol=2e-3)  # the tips of the slots are round for a pin
    assert np.ptp(turned[260:540]) < 1e-9


@pytest.mark.slow
def test_a_combination_lock_opens_with_its_combination(solve_script: Solve) -> None:
    """Two pins of radius 3.5 at 53 and at 81 from the axle touch at 2 asin(3.5/53) and 2 asin(3.5/81)."""
    table = solve_script("combination-lock")
    inner, outer = (2 * math.degrees(math.asin(3.5 / radius)) for radius in (53, 81))
    first, second = -600.0, -40.0 - 2 * inner
    assert np.abs(table["A.angle"][-1] - (360 + first - inner - outer)) < 1e-7
    assert np.abs(table["B.angle"][-1] - (second - 180 + inner)) < 1e-7
    tried = (table["time"] > 0.8) & (table["time"] < 1.0)
    assert np.abs(table["Fence.P.y"][tried] - 250).max() < 1e-7  # on the rim: 140 + 105 + half its breadth
    assert np.ptp(table["Bolt.A.x"][(table["time"] > 0.1) & (table["time"] < 9)]) < 1e-6
    assert abs(table["Fence.P.y"][-1] - 180) < 1e-7
    assert table["Bolt.A.x"][-1] < 130


@pytest.mark.slow
def test_a_latch_stops_what_has_no_coin(solve_script: Solve) -> None:
    table = solve_script("vending-latch")
    t, drawer = table["time"], table["Drawer.A.x"]
    assert drawer[t < 2].max() < 117
    assert np.ptp(drawer[(t > 0.6) & (t < 1.5)]) < 1e-7  # it stands, however long one pulls
    assert abs(drawer[(t > 5.1) & (t < 5.5)].min() - 192) < 1e-6
    assert abs(table["Coin.C.y"][-1] - 22) < 1e-6


@pytest.mark.slow
def test_a_toy_walks_by_the_swing_of_its_leg_less_the_play(solve_script: Solve) -> None:
    table = solve_script("walking-toy")
    for foot in ("Fore.P.x", "Hind.P.x"):
        assert np.diff(table[foot]).min() > -1e-9
    for name in ("Fore.P.y", "Hind.P.y"):
        assert np.abs(table[name] - 40).max() < 1e-9
    play = table["Hind.angle"] - table["Body.angle"]
    assert np.abs(play).max() < 5 + 1e-7
    steps = table["Hind.P.x"][50::25] - table["Hind.P.x"][25:-25:25]
    assert np.ptp(steps) < 1e-6  # all steps are equal
    assert abs(steps[0] - 55) < 1


def test_gears_turn_in_the_ratio_of_their_teeth(solve_script: Solve) -> None:
    clock = solve_script("clockwork")
    np.testing.assert_allclose(clock["Long.angle"], 12 * clock["Short.angle"], atol=1e-9)
    np.testing.assert_allclose(clock["Cannon.angle"], -3 * clock["Wheel.angle"], atol=1e-9)
    np.testing.assert_allclose(clock["Pinion.angle"], -4 * clock["Hour.angle"], atol=1e-9)
    planets = solve_script("planetary")
    sun, carrier = planets["Sun.angle"], planets["Carrier.angle"]
    np.testing.assert_allclose(carrier * (1 + 45 / 15), sun, atol=1e-9)  # Willis
    for k in range(3):
        relative = planets[f"Planet[{k}].angle"] - carrier
        np.testing.assert_allclose(relative * 15, -(sun - carrier) * 15, atol=1e-8)  # teeth that pass the sun's
        np.testing.assert_allclose(relative * 15, -carrier * 45, atol=1e-8)  # and those that pass the ring's
