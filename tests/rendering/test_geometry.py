"""Axes and pixel centres: world (x, y) is image (x, H - y)."""

import math

import pytest

from movimentum.geometry import Affine, View, image_to_local, pose


def test_world_y_points_up():
    view = View(0, 0, 600, 400)
    assert view.to_image.apply(0, 0) == (0, 400)
    assert view.to_image.apply(600, 400) == (600, 0)
    assert view.to_image.apply(10, 30) == (10, 370)


def test_view_with_offset_and_scale():
    view = View(-20, 10, 300, 200, 2.0)
    assert view.to_image.apply(-20, 10) == (0, 200)
    assert view.to_image.apply(0, 20) == (40, 180)
    assert view.enlarged(2).to_image.apply(0, 20) == (80, 360)


def test_positive_turns_are_counter_clockwise():
    x, y = pose(5, 6, 0.0, 1.0).apply(1, 0)
    assert (x, y) == (5, 7)


def test_picture_pixels_become_local_coordinates():
    to_local = image_to_local(50, 0.5)
    assert to_local.apply(0, 50) == (0, 0)  # the lower-left corner
    assert to_local.apply(10, 0) == (5, 25)


def test_inverse_and_composition():
    c, s = math.cos(0.7), math.sin(0.7)
    both = View(3, 4, 90, 60, 1.5).to_image @ pose(11, 12, c, s)
    assert both.apply(2, 5) == pytest.approx(View(3, 4, 90, 60, 1.5).to_image.apply(*pose(11, 12, c, s).apply(2, 5)))
    assert (both.inverse() @ both).apply(7, 8) == pytest.approx((7, 8))
    with pytest.raises(ZeroDivisionError):
        Affine(1, 2, 0, 2, 4, 0).inverse()
