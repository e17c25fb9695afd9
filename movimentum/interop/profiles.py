"""Points of profiles and curves as a table, for machine tools and for `.points`."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from movimentum.outlines.contour import Contour
from movimentum.scene.model import Thing
from movimentum.scene.outlines import outline_of
from movimentum.things.kinds.curve import Curved

POINTS = 720
"""Of a profile, besides those where it has corners."""


def profiles_text(things: Sequence[Thing]) -> str:
    """A row for each point of cuts (of curves, where nothing is cut): x and y from its first anchor as drawn, in
    pixels, and its name. All points are exact; empty where there are none.
    """
    chosen = [thing for thing in things if thing.kind.word == "cut"] or [t for t in things if t.kind.word == "curve"]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["x", "y", "thing"])
    for thing in chosen:
        outline = outline_of(thing)
        if not isinstance(thing.own, Curved) or not isinstance(outline, Contour):
            return ""
        even = np.linspace(0.0, 1.0, POINTS + 1)[: POINTS if outline.closed else None]
        for x, y in _points(outline, even):
            writer.writerow([f"{x:.12g}", f"{y:.12g}", thing.name])
    return stream.getvalue() if chosen else ""


def _points(outline: Contour, share: np.ndarray) -> list[tuple[float, float]]:
    """Points that are evenly spaced along an outline."""
    grid, along = outline.lengths
    places = np.interp(share * outline.length, along, grid)
    places = np.unique(np.concatenate([places, outline.breaks[: -1 if outline.closed else None]]))
    x, y = outline.values(places)[:2]
    new = np.append(True, np.hypot(np.diff(x), np.diff(y)) > 0.0)
    return list(zip(x[new].tolist(), y[new].tolist(), strict=True))
