"""What is published about the gallery's inversor, quick return, lift, excavator and locomotive."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.mechanisms.kinematics import Columns, distance, point

Solve = Callable[..., Columns]


def test_hart_draws_an_exact_line(solve_script: Solve) -> None:
    table = solve_script("hart")
    o, p, q = (point(table, anchor) for anchor in ("Left.O", "Down.P", "Up.Q"))
    np.testing.assert_allclose(q[:, 0] - o[:, 0], 120, rtol=1e-12)
    assert np.ptp(q[:, 1]) > 140
    np.testing.assert_allclose(distance(o, p) * distance(o, q), (240**2 - 120**2) / 4, rtol=1e-11)
    across = (p - o)[:, 0] * (q - o)[:, 1] - (p - o)[:, 1] * (q - o)[:, 0]
    np.testing.assert_allclose(across, 0, atol=1e-8)  # O, P and Q stay in line
    for anchors in (("Left.A", "Down.B"), ("Left.D", "Up.C")):
        np.testing.assert_allclose(distance(*(point(table, anchor) for anchor in anchors)), 240, rtol=1e-12)
    np.testing.assert_allclose(distance(point(table, "Down.B"), point(table, "Up.C")), 120, rtol=1e-12)


def test_whitworth_cuts_for_two_thirds_of_the_turn(solve_script: Solve) -> None:
    """Time ratio (180 + 2 asin(1/2))/(180 - 2 asin(1/2)) = 2; stroke twice the tail of the arm."""
    table = solve_script("whitworth", "300")
    x, v = table["Ram.H.x"], table["v"]
    assert abs(np.ptp(x) - 2 * 70) < 1e-9
    np.testing.assert_allclose(np.mean(v > 1e-9), 2 / 3, atol=1 / 300)
    assert np.argmax(x) == 400
    assert np.argmin(x) == 0
    assert -v.min() > 2.5 * v.max()  # the return is the fast one
    numeric = (x[2:] - x[:-2]) * 150
    np.testing.assert_allclose(v[1:-1], numeric, atol=0.1)
    np.testing.assert_allclose(table["Dot.O.y"] - 75, 0.12 * v, atol=1e-9)


def test_the_lift_stays_level_and_upright(solve_script: Solve) -> None:
    table = solve_script("scissor-lift")
    top, foot = point(table, "S[3].B.Q"), point(table, "S[1].A.P")
    np.testing.assert_allclose(top[:, 0], foot[:, 0], atol=1e-9)
    np.testing.assert_allclose(point(table, "Platform.L") - top, [[-40, 9]] * len(top), atol=1e-9)
    np.testing.assert_allclose(table["Platform.angle"], 0, atol=1e-12)
    lift = distance(point(table, "S[2].A.M"), foot)
    np.testing.assert_allclose(lift, table["c"], atol=1e-9)
    assert lift.max() / lift.min() < 2  # what a cylinder can do
    assert np.ptp(top[:, 1]) > 2.5 * np.ptp(lift)  # three stages multiply its stroke


def test_the_excavators_cylinders_are_as_long_as_stated(solve_script: Solve) -> None:
    table = solve_script("excavator")
    for name, ends in {
        "boom": ("Boom.L", "Lug.O"),
        "stick": ("Stick.R", "Boom.U"),
        "bucket": ("Rocker.N", "Stick.K"),
    }.items():
        np.testing.assert_allclose(distance(*(point(table, end) for end in ends)), table[name], atol=1e-9)
        assert table[name].max() / table[name].min() < 2
    assert np.ptp(table["Bucket.angle"] - table["Stick.angle"]) > 100
    assert point(table, "Bucket.D")[:, 1].min() < 60  # it digs
    assert point(table, "Bucket.D")[:, 1].max() > 150


def test_quartered_engines_are_never_both_at_a_dead_point(solve_script: Solve) -> None:
    table = solve_script("locomotive")
    axle = point(table, "Wheel[1].C")
    heights = [np.abs(point(table, f"{side}.Coupling.B")[:, 1] - axle[:, 1]) / 26 for side in ("Near", "Far")]
    np.testing.assert_allclose(heights[0] ** 2 + heights[1] ** 2, 1, rtol=1e-11)
    assert np.maximum(*heights).min() > 0.7
    for k in (0, 2):
        np.testing.assert_allclose(table[f"Wheel[{k}].angle"], table["Wheel[1].angle"], atol=1e-9)
