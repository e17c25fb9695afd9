"""Texts as outlines, for vector output: the page or the SVG needs no font.

Fonts differ in format and licence, and Pillow does not give their outlines. So every character is drawn once, large,
and its edge is traced. That works with all fonts, needs no other library, and every browser shows the letters that
Pillow draws.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import pairwise

import numpy as np
from PIL import Image, ImageDraw

from movimentum.arrays import FloatArray
from movimentum.drawing.model import Point
from movimentum.drawing.style import UNITS
from movimentum.rendering.faces import Face
from movimentum.rendering.layout import Letters, laid_out
from movimentum.tolerances import LEAST_CHORD

_LARGE = 128  # pixels: the size at which characters are traced
_LONG = 500  # characters of a script that is traced as a whole; longer ones are traced at a quarter of that size
_CLOSE = 0.0012  # of the font's height: how far an outline may be from the traced edge


@cache
def text_outline(text: str) -> str:
    """The path of a text (SVG's ``d``, to be filled by the even-odd rule): y up, the baseline starts at the origin.

    The font's height is `UNITS`. "" where nothing of the text is visible.
    """
    return "".join(part for letters in laid_out(text) for part in _moved(letters, letters.x))


@cache
def glyphs(text: str) -> tuple[tuple[str, float], ...] | None:
    """The same, one path for each character that shows anything, at the origin, and how far it is moved to the right;
    None where characters look different beside each other. Equal characters have equal paths.
    """
    if any(letters.joined for letters in laid_out(text)):
        return None
    paths = [("".join(_moved(letters, 0.0)), letters.x * UNITS) for letters in laid_out(text)]
    return tuple((path, x) for path, x in paths if path)


def outline_of(letters: Letters) -> str:
    """The path of some letters of a text, from where they begin on its baseline."""
    return "".join(_moved(letters, 0.0))


def edges_of(letters: Letters) -> tuple[tuple[Point, ...], ...]:
    """The edges of letters as closed polygons, in heights of their font, y up, from where they begin; what is outside
    goes round one way, and holes the other way.
    """
    return _traced(letters)


def _moved(letters: Letters, x: float) -> Iterator[str]:
    """The edges of letters as a path in whole `UNITS`, moved to ``x``."""
    size, rise = letters.size, letters.rise
    for ring in _traced(letters):
        corners = [(round((size * px + x) * UNITS), round((size * py + rise) * UNITS)) for px, py in ring]
        steps = [(bx - ax, by - ay) for (ax, ay), (bx, by) in pairwise(corners) if (ax, ay) != (bx, by)]
        if len(steps) > 1:
            line = " ".join(f"{dx}{dy}" if dy < 0 else f"{dx} {dy}" for dx, dy in steps)
            yield f"M{corners[0][0]} {corners[0][1]}l{line}z".replace(" -", "-")


def _traced(letters: Letters) -> tuple[tuple[Point, ...], ...]:
    size = _LARGE if len(letters.text) <= _LONG else _LARGE // 4
    return _edges(letters.face, letters.text, size, letters.joined)


@cache
def _edges(face: Face, text: str, size: int, joined: bool) -> tuple[tuple[Point, ...], ...]:
    """The edges of a text as closed polygons, in heights of the font, y up; inside is to one side of all of them."""
    font = face.at(size, joined=joined)
    left, top, right, bottom = (round(side) for side in font.getbbox(text, anchor="ls"))
    if right <= left or bottom <= top:
        return ()
    mask = Image.new("L", (right - left + 4, bottom - top + 4), 0)
    ImageDraw.Draw(mask).text((2 - left, 2 - top), text, 255, font, anchor="ls")
    found: list[tuple[Point, ...]] = []
    for ring in _rings(np.asarray(mask, dtype=np.float64)):
        # a pixel's value belongs to its centre
        corners = [((x + 0.5 + left - 2) / size, -(y + 0.5 + top - 2) / size) for x, y in _simplified(ring, size)]
        found.append(tuple(corners))
    return tuple(found)


def _rings(values: FloatArray) -> Iterator[list[Point]]:
    """Where ``values`` (rows, columns), interpolated, pass the middle of 0 to 255: closed lines of (column, row), by
    marching squares (Lorensen and Cline 1987, in the plane).
    """
    follow: dict[tuple[int, int, int], tuple[int, int, int]] = {}
    bits = (values > 127.5).astype(np.int64)
    case = bits[:-1, :-1] + 2 * bits[:-1, 1:] + 4 * bits[1:, 1:] + 8 * bits[1:, :-1]
    for row, column in zip(*(places.tolist() for places in np.nonzero((case > 0) & (case < 15))), strict=True):
        # the sides of a cell: between which two pixels, each (row, column, 0: along the row or 1: down)
        sides = ((row, column, 0), (row, column + 1, 1), (row + 1, column, 0), (row, column, 1))
        for begin, end in _CASES[int(case[row, column])]:
            follow[sides[begin]] = sides[end]
    while follow:
        first, side = follow.popitem()
        ring = [_crossing(values, first)]
        while side != first:
            ring.append(_crossing(values, side))
            side = follow.pop(side)
        yield ring


_CASES: tuple[tuple[tuple[int, int], ...], ...] = (
    (), ((3, 0),), ((0, 1),), ((3, 1),), ((1, 2),), ((3, 0), (1, 2)), ((0, 2),), ((3, 2),),
    ((2, 3),), ((2, 0),), ((0, 1), (2, 3)), ((2, 1),), ((1, 3),), ((1, 0),), ((0, 3),), (),
)  # fmt: skip
"""From which side of a cell to which the edge goes, by which corners are inside: bits from the upper left, clockwise.
Sides from the upper one, clockwise.
"""


def _crossing(values: FloatArray, side: tuple[int, int, int]) -> Point:
    row, column, down = side
    a = float(values[row, column])
    b = float(values[row + down, column + 1 - down])
    part = (127.5 - a) / (b - a)
    return (float(column), row + part) if down else (column + part, float(row))


def _simplified(ring: list[Point], size: int) -> list[Point]:
    """Fewer corners, none of the left out ones farther than `_CLOSE` from the line (Douglas and Peucker 1973).

    The first corner is there again at the end.
    """
    points = np.array([*ring, ring[0]])
    keep = np.zeros(len(points), dtype=np.bool_)
    middle = int(((points - points[0]) ** 2).sum(axis=1).argmax())
    keep[[0, middle, len(points) - 1]] = True
    waiting = [(0, middle), (middle, len(points) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        (ax, ay), (bx, by) = points[first], points[last]
        between = points[first + 1 : last]
        length = float(np.hypot(bx - ax, by - ay))
        away = np.abs((between[:, 0] - ax) * (by - ay) - (between[:, 1] - ay) * (bx - ax)) / max(length, LEAST_CHORD)
        farthest = int(away.argmax())
        if away[farthest] > _CLOSE * size:
            keep[first + 1 + farthest] = True
            waiting += [(first, first + 1 + farthest), (first + 1 + farthest, last)]
    return [(float(x), float(y)) for x, y in points[keep]]
