"""What would do where a profile crosses itself: radii of curvature, necks, and faces by their support function."""

from __future__ import annotations

import math
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from movimentum.outlines.envelope import ToolPoses
from movimentum.outlines.lines import there_and_back
from movimentum.solver.undercut import fitting_radius, required_offset
from movimentum.tolerances import CUT_WOULD_DO
from tests.outlines.test_envelopes import course

W = 2.0 * math.pi
SCALES = (1e-3, 1.0, 1e5)


def film_of(way, count=720):
    times = [Fraction(k, count) for k in range(count + 1)]
    return ToolPoses(np.array([float(time) for time in times]), way(times))


def polar(radius, first, second, scale):
    """A way about the origin at a distance that its direction says, once round in one time unit."""

    def rates(t):
        c, s = np.cos(W * t), np.sin(W * t)
        r, d, dd = scale * radius(W * t), scale * W * first(W * t), scale * W * W * second(W * t)
        x, y = (
            (d * c - r * W * s, dd * c - 2 * d * W * s - r * W * W * c),
            (d * s + r * W * c, dd * s + 2 * d * W * c - r * W * W * s),
        )
        return (r * c, r * s), x, y

    return course(
        lambda t: rates(t)[0][0], lambda t: rates(t)[0][1], lambda t: 0.0 * t,
        ((lambda t: rates(t)[1][0], lambda t: rates(t)[1][1]), (lambda t: rates(t)[2][0], lambda t: rates(t)[2][1]),
         (lambda t: 0.0, lambda t: 0.0)),
    )  # fmt: skip


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_roller_fits_if_it_is_smaller_than_the_least_radius_of_curvature(scale, sense):
    """Within an ellipse, whichever way its middle goes round: b² / a. Without, nothing is in its way."""
    a, b = 4.0 * scale, 2.0 * scale
    way = course(
        lambda t: a * np.cos(W * t), lambda t: sense * b * np.sin(W * t), lambda t: 0.0 * t,
        ((lambda t: -a * W * np.sin(W * t), lambda t: -a * W * W * np.cos(W * t)),
         (lambda t: sense * b * W * np.cos(W * t), lambda t: -sense * b * W * W * np.sin(W * t)),
         (lambda t: 0.0, lambda t: 0.0)),
    )  # fmt: skip
    film = film_of(way)
    assert fitting_radius(way, film, 1.6 * scale, outer=False) == pytest.approx(CUT_WOULD_DO * scale, rel=1e-6)
    # no more than the one that there is, on the side where nothing is in its way
    assert fitting_radius(way, film, 1.6 * scale, outer=True) == pytest.approx(CUT_WOULD_DO * 1.6 * scale, rel=1e-6)
    assert fitting_radius(way, ToolPoses(film.times[:1], film.poses[:, :1]), scale, outer=False) is None


@pytest.mark.parametrize("scale", SCALES)
def test_a_roller_fits_through_a_neck(scale):
    """Of r = 1 + 0.6 cos 2a: the neck is 0.8 wide, and nothing is bent as much as that."""
    way = polar(
        lambda a: 1.0 + 0.6 * np.cos(2 * a), lambda a: -1.2 * np.sin(2 * a), lambda a: -2.4 * np.cos(2 * a), scale
    )
    found = fitting_radius(way, film_of(way), 0.6 * scale, outer=False)
    assert found == pytest.approx(CUT_WOULD_DO * 0.4 * scale, rel=1e-5)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("swapped", [False, True])
def test_a_face_must_be_as_much_farther_as_its_support_function_lacks(scale, swapped):
    """A face at the distance h(a) = 1 + 0.2 cos 3a cuts radii of curvature h + h'' = 1 - 1.6 cos 3a: 0.6 too few."""
    e = 0.2

    def rates(t):
        a = W * t
        h, d, dd = (
            scale * (1 + e * np.cos(3 * a)),
            -3 * W * scale * e * np.sin(3 * a),
            -9 * W * W * scale * e * np.cos(3 * a),
        )
        c, s = np.cos(a), np.sin(a)
        x = h * c, d * c - h * W * s, dd * c - 2 * d * W * s - h * W * W * c
        y = h * s, d * s + h * W * c, dd * s + 2 * d * W * c - h * W * W * s
        return x, y

    way = course(
        lambda t: rates(t)[0][0], lambda t: rates(t)[1][0], lambda t: W * t - math.pi / 2.0,
        ((lambda t: rates(t)[0][1], lambda t: rates(t)[0][2]), (lambda t: rates(t)[1][1], lambda t: rates(t)[1][2]),
         (lambda t: W, lambda t: 0.0)),
    )  # fmt: skip
    ends = [(-3.0 * scale, 0.0), (3.0 * scale, 0.0)]
    ends = ends[::-1] if swapped else ends
    outline = there_and_back(ends)
    tool = SimpleNamespace(kind=SimpleNamespace(word="bar"), anchors=[SimpleNamespace(local=end) for end in ends])
    film = film_of(way, 700)
    assert required_offset(way, film, tool, outline) == pytest.approx(0.6 * scale, rel=1e-5)
    plate = SimpleNamespace(kind=SimpleNamespace(word="plate"), anchors=tool.anchors)
    assert required_offset(way, film, plate, outline) is None
    e = 0.1  # 1 - 0.8 cos 3a: nothing is lacking
    assert required_offset(way, film_of(way, 700), tool, outline) is None
