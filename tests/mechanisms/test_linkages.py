"""What is published about the gallery's bar linkages, measured on the solved poses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.mechanisms.kinematics import Columns, distance, point
from tests.mechanisms.linkage_oracles import HOLY

Solve = Callable[..., Columns]


def test_peaucellier_draws_an_exact_line(solve_script: Solve) -> None:
    table = solve_script("peaucellier")
    o, m, p = (point(table, anchor) for anchor in ("Upper.O", "Crank.M", "AP.P"))
    line = (200**2 - 80**2) / (2 * 70)  # x = (L² - s²)/(2q), measured from O
    np.testing.assert_allclose(p[:, 0] - o[:, 0], line, rtol=1e-11)
    np.testing.assert_allclose(distance(o, m) * distance(o, p), 200**2 - 80**2, rtol=1e-11)
    assert np.ptp(p[:, 1]) > 200  # and goes along it


def test_hoecken_is_within_0_00975_of_a_line_over_4_units(solve_script: Solve) -> None:
    table = solve_script("hoecken", "1000")
    pen = (point(table, "Coupler.P") - point(table, "Crank.O")) / 50
    crank = table["Crank.angle"]
    left = (crank >= 90 - 1e-9) & (crank <= 270 + 1e-9)
    x, y = pen[left].T
    assert abs(x[0] - 4) < 1e-9
    assert abs(x[-1]) < 1e-9  # the stroke: from 4 to 0
    assert np.all(np.diff(x) < 0)
    np.testing.assert_allclose(y[[0, len(y) // 2, -1]], 4, atol=1e-10)  # on the line at both ends and in the middle
    assert y.min() >= 4 - 1e-10
    assert abs((y.max() - 4) - 0.0097537) < 1e-6  # published, cut off after five places: 0.00975
    assert pen[:, 1].max() > 4.89  # on the other half turn it returns high above


def test_watt_draws_his_curve(solve_script: Solve) -> None:
    table = solve_script("watt")
    middle = (point(table, "Left.A") + point(table, "Right.D")) / 2
    along = point(table, "Right.D") - point(table, "Left.A")
    a, b, c = 130.0, 120.0, 50.0
    np.testing.assert_allclose(np.hypot(*along.T), 2 * a, rtol=1e-14)
    p = point(table, "Coupler.P") - middle
    unit = along / (2 * a)
    x, y = (p * unit).sum(-1), unit[:, 0] * p[:, 1] - unit[:, 1] * p[:, 0]
    # Watt's sextic: r²(r² - a² - b² + c²)² + 4a²y²(r² - b²) = 0, in the frame of the pivots (±a, 0)
    r2 = x**2 + y**2
    sextic = r2 * (r2 - a**2 - b**2 + c**2) ** 2 + 4 * a**2 * y**2 * (r2 - b**2)
    assert np.abs(sextic).max() <= 1e-9 * a**6
    # close to the double point P hardly leaves its tangent, the line of the coupler in the middle position (upright)
    near = np.abs(p[:, 1]) < 25
    assert near.sum() >= 10
    assert np.abs(p[near, 0]).max() < 0.2


def test_four_bar_obeys_freudenstein(solve_script: Solve) -> None:
    table = solve_script("four-bar")
    crank, coupler, rocker, ground = 50.0, 150.0, 130.0, 180.0
    theta = np.deg2rad(table["Crank.angle"])
    up = point(table, "Rocker.C") - point(table, "Rocker.D")
    phi = np.arctan2(up[:, 1], up[:, 0])
    k1, k2 = ground / crank, ground / rocker
    k3 = (crank**2 - coupler**2 + rocker**2 + ground**2) / (2 * crank * rocker)
    # with both angles measured from the direction of the ground link: K1 cos φ - K2 cos θ + K3 = cos(θ - φ)
    np.testing.assert_allclose(-k1 * np.cos(phi) + k2 * np.cos(theta) - k3, -np.cos(theta - phi), atol=1e-11)


def test_jansen_keeps_all_his_numbers(solve_script: Solve) -> None:
    table = solve_script("jansen")
    unit = 3.0
    ends = {
        "b": ("bde.Z", "bde.R"), "c": ("c.Z", "c.U"), "d": ("bde.Z", "bde.S"), "e": ("bde.R", "bde.S"),
        "f": ("f.S", "f.V"), "g": ("ghi.U", "ghi.V"), "h": ("ghi.V", "ghi.W"), "i": ("ghi.U", "ghi.W"),
        "j": ("m.P", "bde.R"), "k": ("m.P", "c.U"), "m": ("m.O", "m.P"),
    }  # fmt: skip
    for letter, (first, second) in ends.items():
        np.testing.assert_allclose(
            distance(point(table, first), point(table, second)), unit * HOLY[letter], rtol=1e-11, err_msg=letter
        )
    frame = point(table, "m.O") - point(table, "c.Z")
    np.testing.assert_allclose(frame / unit, [[HOLY["a"], HOLY["l"]]] * len(frame), rtol=1e-12)


def test_jansen_walks_level(solve_script: Solve) -> None:
    """The foot is on the ground for more than half a turn, and hardly rises while it is."""
    foot = point(solve_script("jansen", "100"), "ghi.W")[:-1] / 3
    height = foot[:, 1] - foot[:, 1].min()
    stride = np.ptp(foot[:, 0])
    assert 55 < stride < 75
    assert np.mean(height < 0.06 * stride) > 0.5
    assert height.max() > 15  # and it is lifted well clear on its way forward


def test_trammel_draws_an_ellipse(solve_script: Solve) -> None:
    table = solve_script("trammel")
    x, y = (point(table, "Rod.P") - 200).T
    np.testing.assert_allclose((x / 170) ** 2 + (y / 100) ** 2, 1, rtol=1e-12)
    np.testing.assert_allclose(table["Rod.A.x"], 200, rtol=1e-14)
    np.testing.assert_allclose(table["Rod.B.y"], 200, rtol=1e-14)


def test_pantograph_doubles(solve_script: Solve) -> None:
    table = solve_script("pantograph")
    o, p, q = (point(table, anchor) for anchor in ("OA.O", "BP.P", "AQ.Q"))
    np.testing.assert_allclose(q - o, 2 * (p - o), rtol=1e-11)
    np.testing.assert_allclose(p, point(table, "CP.P"), rtol=1e-12)
