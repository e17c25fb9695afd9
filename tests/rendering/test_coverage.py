"""Bars, discs and heads against pictures that sample each pixel 64 times."""

import math
from itertools import pairwise

import numpy as np
import pytest

from movimentum.rendering.coverage import disc, polygon, stroke, union
from tests.rendering.scenes import capsule, truth

SIZE = (90, 70)


def whole(coverage, size=SIZE):
    picture = np.zeros((size[1], size[0]))
    if coverage is not None:
        rows, columns = coverage.values.shape
        picture[coverage.top : coverage.top + rows, coverage.left : coverage.left + columns] = coverage.values / 255.0
    return picture


def rms(difference):
    return float(np.sqrt((difference**2).mean()))


@pytest.mark.parametrize("width", [1.0, 2.5, 7.0, 16.0])
@pytest.mark.parametrize("degrees", [0, 7, 33, 45, 81, 90, 124, 200, 300])
def test_a_bar_is_as_the_truth(width, degrees):
    a = math.radians(degrees)
    p, q = (45.3 - 27 * math.cos(a), 35.6 - 27 * math.sin(a)), (45.3 + 27 * math.cos(a), 35.6 + 27 * math.sin(a))
    ours = whole(stroke([p, q], width, SIZE))
    exact = truth(capsule(p, q, width / 2), SIZE)
    assert rms(ours - exact) < 0.012
    assert abs(ours - exact).max() < 0.26  # only where a cap's curve cuts a pixel
    area = 54.0 * width + math.pi * width * width / 4.0
    assert ours.sum() == pytest.approx(area, rel=0.03 if width == 1.0 else 0.01)  # neither fat nor thin


@pytest.mark.parametrize("width", [0.1, 0.3, 0.6, 0.99])
def test_lines_thinner_than_a_pixel_are_faint_not_fat(width):
    # across a long straight piece the sum is the width, wherever the line lies between pixel rows
    for y in (30.0, 30.25, 30.5, 30.9):
        ours = whole(stroke([(-20.0, y), (120.0, y)], width, SIZE))
        assert ours[:, 45].sum() == pytest.approx(width, abs=0.35 * width + 0.01)


def test_caps_are_round():
    ours = whole(stroke([(30.0, 35.0), (60.0, 35.0)], 20.0, SIZE))
    assert ours[35, 21] == 1.0
    assert ours[35, 19] == 0.0
    assert ours[26, 22] == 0.0  # a square cap would cover the corner
    assert ours[43, 22] == 0.0


def test_joins_are_round_and_a_polyline_that_crosses_itself_is_one_coverage():
    points = [(15.0, 20.0), (70.0, 22.0), (30.0, 60.0), (45.0, 8.0)]
    ours = whole(stroke(points, 9.0, SIZE))
    parts = [truth(capsule(p, q, 4.5), SIZE, 8) for p, q in pairwise(points)]
    inside = np.maximum.reduce(parts)
    assert rms(ours - inside) < 0.015
    assert ours.max() == 1.0


def test_long_diagonals_are_computed_in_bands_without_seams():
    size = (700, 600)
    p, q = (20.0, 15.0), (660.0, 570.0)
    ours = whole(stroke([p, q], 7.0, size), size)
    nx, ny = (q[1] - p[1]), -(q[0] - p[0])
    length = math.hypot(nx, ny)
    x, y = np.meshgrid(np.arange(700) + 0.5, np.arange(600) + 0.5)
    distance = abs((x - p[0]) * nx + (y - p[1]) * ny) / length
    along = ((x - p[0]) * -ny + (y - p[1]) * nx) / length
    middle = (along > 6) & (along < length - 6)
    expected = np.clip(4.0 - distance, 0.0, 1.0)
    assert abs(ours - expected)[middle].max() < 0.004


def test_nothing_far_away_does_harm():
    assert stroke([(1e30, 1e30), (1e31, 1e30)], 7.0, SIZE) is None
    ours = whole(stroke([(-1e12, 30.0), (1e12, 30.0)], 8.0, SIZE))
    assert (ours[26:34] == 1.0).all()
    assert ours[:25].max() == ours[35:].max() == 0.0
    assert whole(disc((45.0, 1e6), 1e6 - 30.0, None, SIZE))[32:].min() == 1.0


def test_a_point_is_a_dot():
    assert whole(stroke([(40.0, 30.0)], 10.0, SIZE)).sum() == pytest.approx(math.pi * 25, rel=0.01)
    assert whole(stroke([(40.0, 30.0), (40.0, 30.0)], 10.0, SIZE)).sum() == pytest.approx(math.pi * 25, rel=0.01)


def test_discs_and_rings():
    full = whole(disc((41.3, 33.8), 20.0, None, SIZE))
    assert rms(full - truth(lambda x, y: np.hypot(x - 41.3, y - 33.8) <= 20.0, SIZE)) < 0.008
    ring = whole(disc((41.3, 33.8), 20.0, 5.0, SIZE))
    assert rms(ring - truth(lambda x, y: abs(np.hypot(x - 41.3, y - 33.8) - 20.0) <= 2.5, SIZE)) < 0.01


def test_polygons_in_either_sense():
    corners = [(10.2, 12.7), (70.1, 20.3), (33.3, 60.9)]

    def inside(x, y):
        signs = [
            (qx - px) * (y - py) - (qy - py) * (x - px) >= 0
            for (px, py), (qx, qy) in zip(corners, corners[1:] + corners[:1], strict=True)
        ]
        return signs[0] & signs[1] & signs[2]

    exact = truth(inside, SIZE)
    assert rms(whole(polygon(corners, SIZE)) - exact) < 0.02
    assert rms(whole(polygon(corners[::-1], SIZE)) - exact) < 0.02


def test_union_keeps_the_larger():
    a, b = stroke([(10.0, 10.0), (40.0, 40.0)], 6.0, SIZE), disc((40.0, 40.0), 9.0, None, SIZE)
    assert (whole(union([a, None, b])) == np.maximum(whole(a), whole(b))).all()
    assert union([None, None]) is None
