"""A value over two others: a map of coloured cells with contour lines, or coloured dots for scattered places."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.encoding.plot import ticks
from movimentum.records import dataclass

SIZE, LEFT, TOP, RIGHT, BOTTOM = 480, 84, 48, 110, 60
SCALE = 2
COLOURS = np.array(
    [(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], dtype=np.float64
)  # viridis (Smith & van der Walt 2015): even steps to the eye, also without colours
NOTHING = (225, 225, 225)


@dataclass(frozen=True, slots=True, eq=False)
class HeatMap:
    """``values`` (Y, X) over ``across`` (X,) and ``up`` (Y,), ascending; or, for dots, all three (N,). What is nan is
    grey.
    """

    title: str
    across_label: str
    up_label: str
    across: FloatArray
    up: FloatArray
    values: FloatArray


def write_heat_map(chart: HeatMap, path: Path) -> None:
    """Write a PNG."""
    from PIL import Image, ImageDraw

    from movimentum.rendering.faces import plain

    size = (LEFT + SIZE + RIGHT) * SCALE, (TOP + SIZE + BOTTOM) * SCALE
    image = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(image)
    frame = _MapFrame(chart)
    finite = chart.values[np.isfinite(chart.values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    if chart.values.ndim == 2:
        for box, value in frame.cells():
            pen.rectangle(box, fill=_colour(value, low, high))
        for level in ticks(low, high)[:12] if high > low else []:
            for line in _contour(chart, level):
                pen.line([frame.place(*point) for point in line], fill=(255, 255, 255), width=SCALE)
    else:
        for x, y, value in zip(chart.across, chart.up, chart.values, strict=True):
            u, v = frame.place(float(x), float(y))
            pen.ellipse((u - 6, v - 6, u + 6, v + 6), fill=_colour(float(value), low, high))
    font, small = plain(13 * SCALE), plain(11 * SCALE)
    left, top, right, bottom = (value * SCALE for value in (LEFT, TOP, LEFT + SIZE, TOP + SIZE))
    pen.rectangle((left, top, right, bottom), outline=(60, 60, 60), width=SCALE)
    pen.text(((left + right) / 2, top - 16 * SCALE), chart.title, fill="black", font=font, anchor="mm")
    for value in ticks(*frame.x):
        u, _ = frame.place(value, frame.y[0])
        pen.text((u, bottom + 14 * SCALE), f"{value:g}", fill="black", font=small, anchor="mm")
    for value in ticks(*frame.y):
        _, v = frame.place(frame.x[0], value)
        pen.text((left - 6 * SCALE, v), f"{value:g}", fill="black", font=small, anchor="rm")
    pen.text(((left + right) / 2, bottom + 38 * SCALE), chart.across_label, fill="black", font=font, anchor="mm")
    pen.text((6 * SCALE, top - 16 * SCALE), chart.up_label, fill="black", font=font, anchor="lm")
    _legend(pen, small, low, high)
    image.save(path, "PNG")


def _legend(pen: Any, font: Any, low: float, high: float) -> None:
    begin, top, bottom = (LEFT + SIZE + 18) * SCALE, TOP * SCALE, (TOP + SIZE) * SCALE
    for y in range(top, bottom):
        value = low + (high - low) * (bottom - y) / (bottom - top)
        pen.line((begin, y, begin + 14 * SCALE, y), fill=_colour(value, low, high))
    for value in ticks(low, high):
        y = bottom - (value - low) / ((high - low) or 1.0) * (bottom - top)
        pen.text((begin + 18 * SCALE, y), f"{value:g}", fill="black", font=font, anchor="lm")


def _colour(value: float, low: float, high: float) -> tuple[int, int, int]:
    if not np.isfinite(value):
        return NOTHING
    share = (value - low) / (high - low) if high > low else 0.5
    place = min(max(share, 0.0), 1.0) * (len(COLOURS) - 1)
    k = min(int(place), len(COLOURS) - 2)
    red, green, blue = (COLOURS[k] + (COLOURS[k + 1] - COLOURS[k]) * (place - k)).round().astype(int).tolist()
    return red, green, blue


class _MapFrame:
    """From values to places in the picture."""

    def __init__(self, chart: HeatMap) -> None:
        self.chart = chart
        self.x, self.y = _extent(chart.across), _extent(chart.up)

    def place(self, x: float, y: float) -> tuple[float, float]:
        """The place of a point."""
        u = LEFT + (x - self.x[0]) / (self.x[1] - self.x[0]) * SIZE
        v = TOP + SIZE - (y - self.y[0]) / (self.y[1] - self.y[0]) * SIZE
        return u * SCALE, v * SCALE

    def cells(self) -> Iterator[tuple[tuple[float, float, float, float], float]]:
        """The box of each cell, which reaches half way to its neighbours, and its value."""
        columns, rows = _edges(self.chart.across, self.x), _edges(self.chart.up, self.y)
        for j in range(len(rows) - 1):
            for i in range(len(columns) - 1):
                left, bottom = self.place(columns[i], rows[j])
                right, top = self.place(columns[i + 1], rows[j + 1])
                yield (left, top, right, bottom), float(self.chart.values[j, i])


def _extent(values: FloatArray) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _edges(values: FloatArray, extent: tuple[float, float]) -> list[float]:
    middles = 0.5 * (values[1:] + values[:-1])
    return [extent[0], *middles.tolist(), extent[1]]


def _contour(chart: HeatMap, level: float) -> Iterator[list[tuple[float, float]]]:
    """The pieces of a contour line (marching squares: Lorensen & Cline 1987, in the plane)."""
    z = chart.values - level
    for j in range(z.shape[0] - 1):
        for i in range(z.shape[1] - 1):
            corners = (z[j, i], z[j, i + 1], z[j + 1, i + 1], z[j + 1, i])
            if not np.isfinite(corners).all():
                continue
            x, y = chart.across[[i, i + 1, i + 1, i]], chart.up[[j, j, j + 1, j + 1]]
            points: list[tuple[float, float]] = []
            for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
                if (corners[a] > 0.0) != (corners[b] > 0.0):
                    share = corners[a] / (corners[a] - corners[b])
                    points.append((float(x[a] + share * (x[b] - x[a])), float(y[a] + share * (y[b] - y[a]))))
            for k in range(0, len(points) - 1, 2):
                yield points[k : k + 2]
