"""Parses SVG's ``transform`` attributes."""

from __future__ import annotations

import math
import re

from movimentum.geometry import Affine

_STEP = re.compile(r"\s*,?\s*([A-Za-z]+)\s*\(([^()]*)\)")
_SAME = Affine(1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def transform_of(text: str) -> Affine | None:
    """The map that a ``transform`` stands for; None if it is not understood."""
    result, at = _SAME, 0
    for match in _STEP.finditer(text):
        if match.start() != at:
            return None
        at = match.end()
        try:
            numbers = [float(part) for part in re.split(r"[\s,]+", match[2].strip())]
        except ValueError:
            return None
        step = _step(match[1], numbers)
        if step is None:
            return None
        result = result @ step
    return result if not text[at:].strip() else None


def _step(name: str, n: list[float]) -> Affine | None:
    match name, len(n):
        case "translate", 1 | 2:
            return Affine(1.0, 0.0, n[0], 0.0, 1.0, n[1] if len(n) > 1 else 0.0)
        case "scale", 1 | 2:
            return Affine(n[0], 0.0, 0.0, 0.0, n[-1], 0.0)
        case "matrix", 6:
            return Affine(n[0], n[2], n[4], n[1], n[3], n[5])
        case "rotate", 1 | 3:
            c, s = math.cos(math.radians(n[0])), math.sin(math.radians(n[0]))
            x, y = (n[1], n[2]) if len(n) == 3 else (0.0, 0.0)
            return Affine(c, -s, x - c * x + s * y, s, c, y - s * x - c * y)
        case "skewX", 1:
            return Affine(1.0, math.tan(math.radians(n[0])), 0.0, 0.0, 1.0, 0.0)
        case "skewY", 1:
            return Affine(1.0, 0.0, 0.0, math.tan(math.radians(n[0])), 1.0, 0.0)
        case _:
            return None
