"""Marks that depend on the whole film: graphs, polodes, cylinders, labels that need a free place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.drawing.model import FilmMark, FollowMark, GraphMark, PolodeMark, SymbolMark, ThingMark
from movimentum.drawing.motion import link_points
from movimentum.drawing.picture_options import PictureOptions
from movimentum.records import replace
from movimentum.rendering.stream import PoseSource, chunks, concatenate, count
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses


def settled(
    marks: Sequence[ThingMark | FilmMark], scene: Scene, source: PoseSource, options: PictureOptions
) -> list[ThingMark]:
    """The marks, with all that they must know of the film that ``source`` has."""
    return _free(_measured(_graphed(marks, scene, source, options), source), source, scene.config.size)


def _measured(marks: Sequence[ThingMark], source: PoseSource) -> list[ThingMark]:
    """The marks; those that depend on it with the least and the greatest distance that they have in the whole film."""
    if not any(isinstance(mark, SymbolMark) and mark.kind.of_film for mark in marks):
        return list(marks)
    found: list[ThingMark] = []
    for mark in marks:
        if isinstance(mark, SymbolMark) and mark.kind.of_film:
            reach = [link_points(mark, chunk) for chunk in chunks(source)]
            lengths = np.concatenate([np.zeros(0), *(np.hypot(*(p[:, -1] - p[:, 0]).T) for p in reach)])
            least, most = (float(lengths.min()), float(lengths.max())) if len(lengths) else (0.0, 0.0)
            mark = replace(mark, lengths=(least, most))
        found.append(mark)
    return found


def _graphed(
    marks: Sequence[ThingMark | FilmMark], scene: Scene, source: PoseSource, options: PictureOptions
) -> list[ThingMark]:
    """The marks; graphs and polodes are what they consist of in the whole film."""
    found: list[ThingMark] = []
    for mark in marks:
        match mark:
            case GraphMark():
                from movimentum.drawing.graph_curves import curves_of
                from movimentum.drawing.graphs import graph_marks

                found += graph_marks(mark, curves_of(mark, scene, chunks(source), options.motion))
            case FollowMark():
                from movimentum.rendering.following import following

                found.append(following(mark, source, options.motion))
            case PolodeMark():
                from movimentum.drawing.polodes import polode

                found.append(polode(mark, scene, chunks(source), options.motion))
            case _:
                found.append(mark)
    return found


def _free(marks: list[ThingMark], source: PoseSource, canvas: tuple[int, int] | None) -> list[ThingMark]:
    """The marks; labels that say nothing about it are where they cross least in the whole film, on the canvas."""
    if not any(isinstance(mark, SymbolMark) and mark.own.of_film for mark in marks):
        return marks
    from movimentum.drawing.free_places import FRAMES, with_places

    frames = count(source)
    chosen = np.unique(np.linspace(0, frames - 1, min(FRAMES, frames)).round().astype(np.int64))
    parts: list[Poses] = []
    first = 0
    for chunk in chunks(source):
        inside = chosen[(first <= chosen) & (chosen < first + len(chunk.frames))] - first
        first += len(chunk.frames)
        if len(inside):
            parts.append(chunk.select(inside))
    return with_places(marks, concatenate(parts), canvas) if parts else marks
