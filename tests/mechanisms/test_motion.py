"""Motion in time: integrals and a maximum, against school physics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.mechanisms.kinematics import Columns, point

Solve = Callable[..., Columns]


def test_falling_bar_is_weightless_but_for_gravity(solve_script: Solve) -> None:
    table = solve_script("falling-bar")
    m = point(table, "Bar.M")
    flying = m[50:]
    second = np.diff(flying, n=2, axis=0) * 25**2
    np.testing.assert_allclose(second, [[0.0, -300.0]] * len(second), atol=1e-6)
    np.testing.assert_allclose(np.diff(table["Bar.angle"]), 8, atol=1e-9)
    pinned = point(table, "Bar.P")[:50]
    np.testing.assert_allclose(pinned, [[310.0, 220.0]] * 50, atol=1e-9)


def test_falling_bar_flies_off_along_its_tangent(solve_script: Solve) -> None:
    """No jump in place or velocity where the pin is pulled."""
    m = point(solve_script("falling-bar", "1000"), "Bar.M")
    before, after = (m[2000] - m[1999]) * 1000, (m[2001] - m[2000]) * 1000
    speed = 55 * np.deg2rad(200)
    assert abs(np.hypot(*after) - speed) < 0.2
    assert np.abs(after - before).max() < 0.6


def test_acceleration_is_what_was_stated(solve_script: Solve) -> None:
    table = solve_script("acceleration")
    second = np.diff(table["Wheel.angle"], n=2) * 25**2
    np.testing.assert_allclose(second[:48], 180, rtol=1e-9)
    np.testing.assert_allclose(second[50:], -180, rtol=1e-9)
    assert abs(table["Wheel.angle"][-1] - (720 - 90 / 25**2)) < 1e-9  # the next frame has turned twice, and is at rest
    assert abs(table["speed"][-1] - 180 / 25) < 1e-9


def test_acceleration_does_not_depend_on_fps(solve_script: Solve) -> None:
    coarse, fine = solve_script("acceleration", "5"), solve_script("acceleration", "25")
    for column, values in coarse.items():
        if column != "frame":
            np.testing.assert_allclose(values, fine[column][::5], atol=1e-9, err_msg=column)


def test_plate_rests_on_the_higher_roller(solve_script: Solve) -> None:
    table = solve_script("maximum")
    gaps = np.stack([table["Plate.O.y"] - 19 - table[f"{roller}.O.y"] for roller in ("RollP", "RollQ")])
    np.testing.assert_allclose(gaps.min(axis=0), 0, atol=1e-10)
    touching = gaps < 1e-9
    assert touching[0].any()
    assert touching[1].any()
    assert not touching.all()
