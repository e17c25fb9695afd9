"""Plots of cost against error, on logarithmic scales, and of values over time: as SVG text, or as a PNG by Pillow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from xml.sax.saxutils import escape

from movimentum.records import dataclass
from movimentum.tolerances import TICK_AT_END

WIDTH, HEIGHT = 460, 340
LEFT, RIGHT, TOP, BOTTOM = 74, 24, 44, 52
COLORS = ("#c0392b", "#2471a3", "#1e8449", "#7d3c98", "#b9770e", "#34495e", "#117a65", "#922b21")
SUFFIXES = (".svg", ".png")


@dataclass(frozen=True, slots=True)
class Point:
    """One thing measured; ``group`` gives its colour. Values that are not positive are drawn at the edge."""

    label: str
    x: float
    y: float
    group: int = 0


@dataclass(frozen=True, slots=True)
class Panel:
    """One diagram."""

    title: str
    x_label: str
    y_label: str
    points: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class _Line:
    ends: tuple[float, float, float, float]
    color: str


@dataclass(frozen=True, slots=True)
class _Dot:
    x: float
    y: float
    color: str


@dataclass(frozen=True, slots=True)
class _Text:
    """``anchor``: "start", "middle" or "end" of the text is at (x, y), its base line."""

    x: float
    y: float
    text: str
    size: int
    anchor: str
    color: str = "#222222"
    upright: bool = False


_Shape = _Line | _Dot | _Text


def write_plot(panels: Sequence[Panel], path: Path, suffix: str) -> None:
    """Write the panels side by side, in the format that ``suffix`` (one of `SUFFIXES`) names."""
    shapes = [shape for k, panel in enumerate(panels) for shape in _shapes(panel, k * WIDTH)]
    size = WIDTH * len(panels), HEIGHT
    if suffix.lower() == ".svg":
        path.write_text(_svg(shapes, size), encoding="utf-8", newline="\n")
    else:
        _png(shapes, size, path)


def write_curves(
    title: str,
    times: Sequence[float],
    curves: Sequence[tuple[str, Sequence[float]]],
    path: Path,
    suffix: str,
    across_label: str = "time",
) -> None:
    """Write courses over time (or what ``across_label`` says) in one diagram: (name, values at ``times``); values that
    are not finite are left out.
    """
    finite = [v for _, values in curves for v in values if math.isfinite(v)] or [0.0]
    low, high = min(finite), max(finite)
    spare = 0.05 * (high - low) or 0.5
    low, high = low - spare, high + spare
    left, right, top, bottom = LEFT, WIDTH * 2 - RIGHT, TOP, HEIGHT - BOTTOM
    first, last = times[0], times[-1]

    def across(time: float) -> float:
        return left + (time - first) / ((last - first) or 1.0) * (right - left)

    def up(value: float) -> float:
        return bottom + (value - low) / (high - low) * (top - bottom)

    shapes: list[_Shape] = [_Text((left + right) / 2, TOP - 18, title, 13, "middle")]
    shapes.append(_Text((left + right) / 2, HEIGHT - 14, across_label, 11, "middle"))
    for value in ticks(low, high):
        shapes.append(_Line((left, up(value), right, up(value)), "#dddddd"))
        shapes.append(_Text(left - 6, up(value) + 4, f"{value:g}", 10, "end"))
    for value in ticks(first, last):
        shapes.append(_Line((across(value), bottom, across(value), top), "#dddddd"))
        shapes.append(_Text(across(value), bottom + 15, f"{value:g}", 10, "middle"))
    for k, (name, values) in enumerate(curves):
        color = COLORS[k % len(COLORS)]
        points = [(across(t), up(v)) if math.isfinite(v) else None for t, v in zip(times, values, strict=True)]
        shapes += [_Line((*a, *b), color) for a, b in pairwise(points) if a is not None and b is not None]
        if len(curves) > 1:
            shapes.append(_Text(right - 4, top + 12 + 14 * k, name, 11, "end", color))
    size = 2 * WIDTH, HEIGHT
    if suffix.lower() == ".svg":
        path.write_text(_svg(shapes, size), encoding="utf-8", newline="\n")
    else:
        _png(shapes, size, path)


def ticks(low: float, high: float) -> list[float]:
    """About five round numbers from ``low`` to ``high``."""
    if not high > low:
        return [low]
    rough = (high - low) / 5
    unit = 10.0 ** math.floor(math.log10(rough))
    step = next(m * unit for m in (1, 2, 5, 10) if m * unit >= rough * 0.999)
    return [k * step for k in range(math.ceil(low / step - TICK_AT_END), math.floor(high / step + TICK_AT_END) + 1)]


def _span(values: Sequence[float]) -> tuple[int, int]:
    """Powers of ten around the positive values."""
    logs = [math.log10(value) for value in values if value > 0.0 and math.isfinite(value)] or [0.0]
    low, high = math.floor(min(logs) - 0.15), math.ceil(max(logs) + 0.15)
    return low, max(high, low + 1)


def _shapes(panel: Panel, offset: float) -> list[_Shape]:
    x_low, x_high = _span([point.x for point in panel.points])
    y_low, y_high = _span([point.y for point in panel.points])
    left, right, top, bottom = offset + LEFT, offset + WIDTH - RIGHT, TOP, HEIGHT - BOTTOM

    def place(value: float, low: int, high: int, begin: float, end: float) -> float:
        at = math.log10(value) if value > 0.0 else low
        return begin + (min(max(at, low), high) - low) / (high - low) * (end - begin)

    shapes: list[_Shape] = [_Text((left + right) / 2, TOP - 18, panel.title, 13, "middle")]
    for low, high, across in ((x_low, x_high, False), (y_low, y_high, True)):
        step = max(1, math.ceil((high - low) / 8))
        for power in range(low, high + 1, step):
            if across:
                y = place(10.0**power, low, high, bottom, top)
                shapes.append(_Line((left, y, right, y), "#dddddd"))
                shapes.append(_Text(left - 6, y + 4, f"1e{power}", 10, "end"))
            else:
                x = place(10.0**power, low, high, left, right)
                shapes.append(_Line((x, bottom, x, top), "#dddddd"))
                shapes.append(_Text(x, bottom + 15, f"1e{power}", 10, "middle"))
    shapes.append(_Text((left + right) / 2, HEIGHT - 14, panel.x_label, 11, "middle"))
    shapes.append(_Text(offset + 18, (top + bottom) / 2, panel.y_label, 11, "middle", upright=True))
    boxes: list[tuple[float, float, float]] = []
    for point in panel.points:
        color = COLORS[point.group % len(COLORS)]
        x = place(point.x, x_low, x_high, left, right)
        y = place(point.y, y_low, y_high, bottom, top)
        shapes.append(_Dot(x, y, color))
        if not point.label:
            continue
        wide = 5.6 * len(point.label)
        begin = x - 6 - wide if x + 6 + wide > right else x + 6
        at = _free_height(boxes, begin, begin + wide, y - 6, top + 8)
        boxes.append((begin, begin + wide, at))
        end = begin < x
        shapes.append(_Text(x - 6 if end else x + 6, at, point.label, 10, "end" if end else "start", color))
    return shapes


def _free_height(boxes: Sequence[tuple[float, float, float]], begin: float, end: float, at: float, top: float) -> float:
    """The base line nearest to ``at`` on which a label from ``begin`` to ``end`` covers no other."""
    tries = [at - 12.0 * k for n in range(12) for k in (n, -n) if at - 12.0 * k > top]
    for height in tries:
        if all(abs(height - other) >= 11 or end < low or begin > high for low, high, other in boxes):
            return height
    return at


def _svg(shapes: Sequence[_Shape], size: tuple[int, int]) -> str:
    box = f'width="{size[0]}" height="{size[1]}" viewBox="0 0 {size[0]} {size[1]}"'
    rows = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {box} font-family="sans-serif">',
        f'<rect width="{size[0]}" height="{size[1]}" fill="white"/>',
    ]
    for shape in shapes:
        match shape:
            case _Line((x1, y1, x2, y2), color):
                rows.append(f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{color}"/>')
            case _Dot(x, y, color):
                rows.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{color}"/>')
            case _Text(x, y, text, height, anchor, color, upright):
                turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if upright else ""
                rows.append(
                    f'<text x="{x:.1f}" y="{y:.1f}" font-size="{height}" text-anchor="{anchor}" fill="{color}"{turn}>'
                    f"{escape(text)}</text>"
                )
    return "\n".join([*rows, "</svg>", ""])


def _png(shapes: Sequence[_Shape], size: tuple[int, int], path: Path) -> None:
    from PIL import Image, ImageDraw

    from movimentum.rendering.faces import plain

    scale = 2
    image = Image.new("RGB", (size[0] * scale, size[1] * scale), "white")
    pen = ImageDraw.Draw(image)
    for shape in shapes:
        match shape:
            case _Line((x1, y1, x2, y2), color):
                pen.line((x1 * scale, y1 * scale, x2 * scale, y2 * scale), fill=color, width=scale)
            case _Dot(x, y, color):
                r = 3.5
                pen.ellipse(((x - r) * scale, (y - r) * scale, (x + r) * scale, (y + r) * scale), fill=color)
            case _Text(x, y, text, height, anchor, color, upright):
                font = plain(height * scale)
                mark = {"start": "ls", "middle": "ms", "end": "rs"}[anchor]
                if not upright:
                    pen.text((x * scale, y * scale), text, fill=color, font=font, anchor=mark)
                    continue
                length = int(font.getlength(text)) + 4
                label = Image.new("RGB", (length, 2 * height * scale), "white")
                ImageDraw.Draw(label).text((2, int(1.4 * height * scale)), text, fill=color, font=font, anchor="ls")
                label = label.rotate(90, expand=True)
                image.paste(label, (int(x * scale - 1.4 * height * scale), int(y * scale - length / 2)))
    image.save(path, "PNG")
