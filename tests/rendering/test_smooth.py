"""Whole paths between frames."""

from __future__ import annotations

import numpy as np
import pytest

from movimentum.rendering.smooth import smooth


def _path(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points, np.ones((len(points), 1))], axis=1)


@pytest.mark.parametrize("count", [24, 50])
def test_an_ellipse_of_few_frames_is_round(count: int) -> None:
    angle = 2 * np.pi * np.arange(count + 1) / count
    drawn = np.stack([170 * np.cos(angle), 100 * np.sin(angle)], axis=1)
    drawn[-1] = drawn[0] + 1e-10
    found = smooth(_path(drawn))
    x, y = found[:, 0] / 170, found[:, 1] / 100
    off = 100 * np.abs(np.hypot(x, y) - 1).max()
    assert off < 0.05
    turns = np.unwrap(np.arctan2(*np.diff(found[:, :2], axis=0).T[::-1]))
    assert np.abs(np.diff(turns)).max() < 0.12  # no corner, not where it is closed either
    for point in drawn:
        assert np.hypot(*(found[:, :2] - point).T).min() == 0.0


def test_corners_and_lines_stay() -> None:
    square = np.array([[0, 0], [50, 0], [100, 0], [100, 50], [100, 100], [50, 100], [0, 100], [0, 50], [0, 0]], float)
    found = smooth(_path(square))[:, :2]
    assert np.minimum.reduce([np.abs(found), np.abs(found - 100)]).min(axis=1).max() < 1e-9
    there_and_back = np.array([[0, 0], [40, 0], [60, 0], [40, 0], [0, 0]], float)
    assert np.abs(smooth(_path(there_and_back))[:, 1]).max() == 0.0
    assert smooth(_path(there_and_back))[:, 0].max() <= 60.0 + 1e-9


def test_what_is_hidden_for_a_while_is_left_alone() -> None:
    points = _path(np.random.default_rng(1).normal(size=(20, 2)))
    points[7, 2] = 0.0
    np.testing.assert_array_equal(smooth(points), points)
