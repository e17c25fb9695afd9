"""Arrows of free motions in the picture that the command makes: their colours, where they start, where they point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from movimentum.drawing.style import LONGEST, MOTIONS
from tests.command import movimentum

FOUR_BAR = """.config(10, 300, 300);
A : .bar P = [60,60]   Q = [100,170];
B : .bar P = [100,170] Q = [240,200];
C : .bar P = [240,200] Q = [220,60];
@0 A.P = [60,60]; B.P = A.Q; C.P = B.Q; C.Q = [220,60];
"""
TWO = """.config(10, 300, 200);
A : .bar P = [60,40] Q = [60,140];
B : .bar P = [200,60] Q = [220,60];
@0 A.P = [60,40]; B.P = [200, y]; B.angle = 0;
"""


def arrows(text: str, folder: Path, *more: str) -> NDArray[np.float64]:
    """(H, W, 3): a still with arrows; white where the still without them is the same."""
    script = folder / "scene.mov"
    script.write_text(text)
    images: list[NDArray[np.float64]] = []
    for name, options in (("with.png", ("--show", "free")), ("without.png", ())):
        assert movimentum("run", script, "--at", "0", "-o", folder / name, *options, *more).returncode == 0
        with Image.open(folder / name) as picture:
            images.append(np.asarray(picture.convert("RGB"), dtype=np.float64))
    drawn, plain = images
    return np.where((drawn != plain).any(axis=2, keepdims=True), drawn, 255.0)


def of_color(image: NDArray[np.float64], color: tuple[int, int, int]) -> NDArray[np.float64]:
    """(N, 2): the places, x to the right and y up, of pixels in just this colour."""
    rows, columns = np.nonzero((image == np.array(color)).all(axis=2))
    return np.stack([columns + 0.5, len(image) - rows - 0.5], axis=1)


def arrow_at(places: NDArray[np.float64], anchor: tuple[float, float]) -> NDArray[np.float64]:
    """From an anchor to the tip of the arrow that starts there."""
    off = places - np.array(anchor)
    off = off[np.hypot(*off.T) < LONGEST + 2]
    assert np.hypot(*off.T).min() < 1.5
    tip = off[np.argmax(np.hypot(*off.T))]
    # a shaft and a head: everything is near the line from the anchor to the tip, and none is behind the anchor
    along, across = off @ tip / np.hypot(*tip), (off @ np.array([-tip[1], tip[0]])) / np.hypot(*tip)
    assert along.min() > -2
    assert np.abs(across).max() < 6
    assert abs(float(across.mean())) < 0.7
    return tip


def angle_between(u: NDArray[np.float64], v: NDArray[np.float64]) -> float:
    return abs(float(np.degrees(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v))))


def test_two_motions_have_two_colours_and_start_at_what_they_move(tmp_path: Path) -> None:
    image = arrows(TWO, tmp_path)
    first, second = of_color(image, MOTIONS[0]), of_color(image, MOTIONS[1])
    turn = arrow_at(first, (60, 140))  # the first thing's motion has the first colour
    assert angle_between(turn, np.array([-1.0, 0.0])) < 3  # counter-clockwise
    assert np.hypot(*turn) == pytest.approx(LONGEST, abs=4)  # its tip is too fine to have the full colour
    for anchor in ((200, 60), (220, 60)):
        assert angle_between(arrow_at(second[np.abs(second[:, 0] - anchor[0]) < 8], anchor), np.array([0.0, 1.0])) < 3
    assert first[:, 0].max() < 110
    assert second[:, 0].min() > 180
    for color in MOTIONS[2:]:
        assert len(of_color(image, color)) == 0


def test_nothing_is_drawn_where_nothing_is_free(tmp_path: Path) -> None:
    held = TWO.replace("B.angle = 0;", "B.angle = 0; y = 60; A.angle = 0;")
    assert (arrows(held, tmp_path) == 255).all()


@pytest.mark.parametrize("scale", [1, 2])
def test_arrows_of_a_four_bar_are_the_velocities_of_its_pins(scale: int, tmp_path: Path) -> None:
    places = of_color(arrows(FOUR_BAR, tmp_path, "--scale", str(scale)), MOTIONS[0]) / scale
    a, b, c, d = (np.array(point, dtype=float) for point in ((60, 60), (100, 170), (240, 200), (220, 60)))
    # turning counter-clockwise by 1: the pins move across their cranks, and alike along the rod between them
    one = np.array([-(b - a)[1], (b - a)[0]])
    across = np.array([(c - d)[1], -(c - d)[0]])
    other = across * (one @ (c - b)) / (across @ (c - b))
    longest = max(np.hypot(*one), np.hypot(*other)) / LONGEST
    for velocity, pin in ((one, b), (other, c)):
        arrow = arrow_at(places, (float(pin[0]), float(pin[1])))
        assert angle_between(arrow, velocity) < 4
        assert np.hypot(*arrow) == pytest.approx(np.hypot(*velocity) / longest, abs=4 / scale)
    near = np.minimum(np.hypot(*(places - b).T), np.hypot(*(places - c).T))
    assert near.max() < LONGEST + 2  # none at the pins that stand still


@pytest.mark.slow
def test_the_arrow_of_a_crank_keeps_its_sense_all_the_way_round(tmp_path: Path) -> None:
    """It is found anew in each pose."""
    for degrees in (0, 45, 90, 135, 200, 270, 359):
        c, s = float(np.cos(np.radians(degrees))), float(np.sin(np.radians(degrees)))
        pin = (150 + 80 * c, 150 + 80 * s)
        bar = f"A : .bar P = [150,150] Q = [{pin[0]},{pin[1]}];"
        image = arrows(f".config(10, 300, 300);\n{bar}\n@0 A.P = [150,150];\n", tmp_path)
        assert angle_between(arrow_at(of_color(image, MOTIONS[0]), pin), np.array([-s, c])) < 4
