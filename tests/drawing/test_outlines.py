"""Texts as outlines: the same letters at the same places as Pillow draws."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image, ImageChops, ImageDraw

from movimentum.drawing.style import UNITS
from movimentum.rendering.outlines import text_outline
from movimentum.rendering.text import text_sprite


def rings(path: str) -> list[list[tuple[float, float]]]:
    """The polygons of a path, in units."""
    found = []
    for x, y, steps in re.findall(r"M(-?\d+) (-?\d+)l([^z]*)z", re.sub(r"(?<=\d)-", " -", path)):
        corner = (float(x), float(y))
        numbers = [float(number) for number in re.findall(r"-?\d+", steps)]
        ring = [corner]
        for dx, dy in zip(numbers[::2], numbers[1::2], strict=True):
            corner = (corner[0] + dx, corner[1] + dy)
            ring.append(corner)
        found.append(ring)
    assert len(found) == path.count("z")
    return found


def drawn(path: str, height: int, size: tuple[int, int], origin: tuple[float, float]) -> Image.Image:
    """The outline filled by the even-odd rule, four times as fine and averaged."""
    mask = Image.new("1", (size[0] * 4, size[1] * 4))
    for ring in rings(path):
        corners = [(4 * (origin[0] + x * height / UNITS), 4 * (origin[1] - y * height / UNITS)) for x, y in ring]
        one = Image.new("1", mask.size)
        ImageDraw.Draw(one).polygon(corners, fill=1)
        mask = ImageChops.logical_xor(mask, one)
    return mask.convert("L").reduce(4)


@pytest.mark.parametrize("text", ["Crank", "Größe: 0.5 m²", "ΔΩ жук", "fi AVA", "مرحبا", "q̇ e\u0301"])
def test_an_outline_covers_what_pillow_draws(text: str) -> None:
    sprite = text_sprite(text, 48.0, 1.0)
    assert sprite is not None
    left, top = sprite.to_local.c, -sprite.to_local.f
    found = drawn(text_outline(text), 48, sprite.image.size, (-left, -top))
    difference = np.abs(np.asarray(found).astype(int) - np.asarray(sprite.image).astype(int))
    # edges, which Pillow fits to whole pixels from top to bottom; nothing else
    assert difference.mean() < 0.35 * np.asarray(sprite.image).mean()


def test_letters_with_holes_have_two_edges() -> None:
    assert [text_outline(letter).count("z") for letter in ("o", "l", "8", " ")] == [2, 1, 3, 0]


def test_an_outline_is_short_and_the_same_each_time() -> None:
    path = text_outline("Connecting rod")
    assert len(path) < 450 * len("Connecting rod")
    text_outline.cache_clear()
    assert text_outline("Connecting rod") == path


def test_nothing_is_an_empty_outline() -> None:
    assert text_outline("") == text_outline("  ") == ""
