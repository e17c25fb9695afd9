"""Prepares marks whose scale or layer changes over time, and groups that fade together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np

from movimentum.drawing.model import FreeArrow, NoteMark, Paint, ThingMark
from movimentum.drawing.slots import Slot, slots_of
from movimentum.records import replace
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.stream import PoseSource, chunks
from movimentum.scene.model import Scene

LEAST_ZOOM, MOST_ZOOM = 1 / 16, 8.0
"""How finely a thing is prepared whose scale changes; beyond it, curves become coarse and pictures soft."""


def zoomed(marks: list[ThingMark], scene: Scene, source: PoseSource) -> list[ThingMark]:
    """The marks; those of things whose scale changes know how large they get."""
    if not scene.changes("scale"):
        return marks
    zoom = {thing: 0.0 for thing, name in scene.changing if name == "scale"}
    for chunk in chunks(source):
        for thing, most in zoom.items():
            values = chunk.properties.get((thing, "scale"), np.ones(1))
            zoom[thing] = max(most, float(values.max(initial=0.0)))
    return [
        replace(mark, paint=replace(mark.paint, zoom=min(max(zoom[mark.paint.thing], LEAST_ZOOM), MOST_ZOOM)))
        if mark.paint.thing in zoom
        else mark
        for mark in marks
    ]


def in_places(items: list[PreparedMark], under: int, scene: Scene, source: PoseSource) -> list[PreparedMark]:
    """The items; those of things whose layers change are in the list once for each place that they take."""
    of_thing: dict[int, list[PreparedMark]] = {}
    for item in items[under:]:
        assert not isinstance(item.mark, NoteMark | FreeArrow)
        of_thing.setdefault((item.group or item.mark.paint).thing, []).append(item)
    layers = {number: scene.things[number].layer for number in of_thing}
    found = items[:under]
    for thing, slot in slots_of(layers, chunks(source)).all():
        found += of_thing[thing] if slot is None else [_in_slot(item, slot) for item in of_thing[thing]]
    return found


def _in_slot(item: PreparedMark, slot: Slot) -> PreparedMark:
    assert not isinstance(item.mark, NoteMark | FreeArrow)
    return replace(item, mark=replace(item.mark, paint=replace(item.mark.paint, slot=slot)))


def runs(items: Sequence[PreparedMark]) -> Iterator[tuple[Paint | None, list[int]]]:
    """The marks (by number) that are faded together, and the paint of their group; others by themselves."""
    for group, some in groupby(range(len(items)), key=lambda number: items[number].group):
        yield group, [*some]
