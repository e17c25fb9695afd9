"""A display list made ready: its images and texts are loaded, and it is known which rectangle of the world is shown.

Everything that can fail is done here, before a file is begun. All ways to draw a film begin with a `PreparedDrawing`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.compose import compose
from movimentum.drawing.model import (
    Drawing,
    FilmMark,
    FreeArrow,
    GraphMark,
    ImageMark,
    NoteMark,
    OverMark,
    PolodeMark,
    SymbolMark,
    TextMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.motion import bounds, link_points, state
from movimentum.drawing.options import MAX_PREPARED_PIXELS, PictureOptions, Quality
from movimentum.drawing.paths import frame_path, paths
from movimentum.drawing.style import NOTE_HEIGHT
from movimentum.errors import ScriptError, UsageError
from movimentum.geometry import View
from movimentum.records import dataclass, replace
from movimentum.rendering.images import is_drawing, load_premultiplied
from movimentum.rendering.sprites import Sprite, framed, prepare
from movimentum.rendering.stream import PoseSource, chunks, concatenate, count
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]

"""Symbols that depend on the distances that they have in the whole film."""


FINER = 1.6
"""Pixels of a drawing to one of the canvas, each way: what bilinear sampling then shows is nearest to the drawing drawn
in its place (with 1 it is too soft, with 2 too hard).
"""


@dataclass(frozen=True, slots=True)
class PreparedMark:
    """A mark with its picture, if it is an image or a text; ``halo`` goes under the text of a note. ``clip``: it is
    drawn only inside that mark's outline (see `drawing.clips`).
    """

    mark: ThingMark | OverMark
    sprite: Sprite | None = None
    halo: Sprite | None = None
    clip: ThingMark | None = None

    def bounds(self, poses: Poses) -> Floats:
        """(F, 4): left, bottom, right, top in the world; rows of NaN where nothing is drawn."""
        found = self._unclipped(poses)
        if self.clip is None:
            return found
        around = bounds(self.clip, poses, ())
        low, high = np.maximum(found[:, :2], around[:, :2]), np.minimum(found[:, 2:], around[:, 2:])
        some = np.logical_and(low[:, 0] <= high[:, 0], low[:, 1] <= high[:, 1])
        return np.where(some[:, None], np.concatenate([low, high], axis=1), np.nan)

    def state(self, poses: Poses) -> Floats:
        """(F, K): all numbers that its picture depends on; equal rows are equal pictures."""
        own = state(self.mark, poses)
        return own if self.clip is None else np.concatenate([own, state(self.clip, poses)], axis=1)

    def _unclipped(self, poses: Poses) -> Floats:
        if isinstance(self.mark, TextMark) and self.mark.pieces:
            from movimentum.rendering.text import longest

            return bounds(self.mark, poses, longest(self.mark, poses))
        return bounds(self.mark, poses, () if self.sprite is None else self.sprite.local_corners())


@dataclass(frozen=True, slots=True)
class Trace:
    """A path of the whole film (see `drawing.paths`). ``last``: the time of the last frame of a film that begins again;
    it shows the path up to there.
    """

    mark: TraceMark
    path: Floats
    last: float = math.inf

    def ends(self, poses: Poses) -> NDArray[np.int64]:
        """(F,) how many rows of the path each frame shows."""
        times = np.where(poses.times == self.last, math.inf, poses.times)
        return np.searchsorted(self.path[:, 3], times, side="right")

    def between(self, poses: Poses) -> NDArray[np.int64]:
        """The frames (positions in ``poses``) that are between two rows of the path: a still at any moment."""
        times = self.path[:, 3]
        before = np.searchsorted(times, poses.times, side="right") - 1
        return np.flatnonzero((before < 0) | (times[np.maximum(before, 0)] < poses.times))

    def through(self, poses: Poses) -> tuple[Floats, NDArray[np.int64]]:
        """The path up to the last frame of ``poses``, with a row for each frame, and how many of them each shows."""
        ends, more = self.ends(poses), self.between(poses)
        rows = frame_path(self.mark, poses.select(more))
        path = np.insert(self.path, ends[more], rows, axis=0)
        ends = ends + np.searchsorted(more, np.arange(len(ends)), side="right")
        return path[: ends.max(initial=0)], ends

    def state(self, poses: Poses) -> Floats:
        """(F, K): all numbers that its picture depends on; its paint after the first four."""
        return np.concatenate([self.ends(poses)[:, None].astype(np.float64), state(self.mark, poses)], axis=1)


@dataclass(frozen=True, slots=True)
class PreparedDrawing:
    """``paths`` (traces of the whole film), ``things`` from back to front, then ``traces``,
    then ``overlays``: those marks of ``drawing`` that show anything.

    ``view`` is the rectangle of the world that the finished picture shows. Images and texts have ``fineness`` pixels to
    a pixel of that picture, each way (unless the image's file has fewer).
    """

    drawing: Drawing
    view: View
    fineness: int
    things: tuple[PreparedMark, ...]
    traces: tuple[Trace, ...]
    overlays: tuple[PreparedMark, ...]
    paths: tuple[Trace, ...] = ()


def prepare_drawing(scene: Scene, source: PoseSource, options: PictureOptions | None = None) -> PreparedDrawing:
    """The display list of ``scene``, ready to be drawn; reads ``source`` only if the canvas must fit the drawing, or
    something depends on the whole film.

    ``source`` has all frames of the film, so that canvas and traces are the same whichever frames are drawn.

    `ScriptError`: sprites that are missing, unreadable or too large (all of them), a canvas over the limit;
    `UsageError`: a scale that is not a positive number.
    """
    options = options or PictureOptions()
    if not (math.isfinite(options.scale) and options.scale > 0.0):
        raise UsageError([Diagnostic("usage/scale", Severity.ERROR, "the scale must be a positive number")])
    fineness = 2 if options.quality is Quality.HIGH else 1
    box = None if scene.config.size is None else (0.0, 0.0, float(scene.config.size[0]), float(scene.config.size[1]))
    if box is not None:
        _view(scene, options, fineness, box)  # a limit that needs no sprite
    magnification = options.scale * fineness
    _refuse_too_much(scene, magnification)
    drawing = compose(scene, options)
    things = _loaded(_free(_measured(_graphed(drawing.things, scene, source, options), source), source), magnification)
    if drawing.clips:
        clips: dict[int | None, ThingMark] = dict(drawing.clips)
        things = [replace(item, clip=clips.get(_painted(item.mark))) for item in things]
    whole, traces = _followed((drawing.paths, drawing.traces), source, options, box is None, 0.05 / magnification)
    overlays = [made for mark in drawing.overlays if (made := _overlay(mark, magnification)) is not None]
    arrows = [overlay for overlay in overlays if isinstance(overlay.mark, FreeArrow)]
    view = _view(scene, options, fineness, box or _fitted([*things, *arrows], (*whole, *traces), source))
    room = (view.left, view.bottom, view.left + view.width / view.scale, view.bottom + view.height / view.scale)
    things = [_in_room(item, room) for item in things]
    return PreparedDrawing(drawing, view, fineness, tuple(things), traces, tuple(overlays), whole)


def _in_room(item: PreparedMark, room: tuple[float, float, float, float]) -> PreparedMark:
    """What points to the edge of the picture knows where that is."""
    mark = item.mark
    return replace(item, mark=replace(mark, room=room)) if isinstance(mark, SymbolMark) and mark.kind.loose else item


def _painted(mark: ThingMark | OverMark) -> int | None:
    """The thing that a mark draws."""
    return None if isinstance(mark, NoteMark | FreeArrow) else mark.paint.thing


def needs_film(scene: Scene) -> bool:
    """Whether a picture of one frame depends on others: on the lengths that a cylinder has, on a path."""
    return any((thing.kind.of_film or thing.own.of_film) and not thing.hidden for thing in scene.things)


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
            case PolodeMark():
                from movimentum.drawing.polodes import polode

                found.append(polode(mark, scene, chunks(source), options.motion))
            case _:
                found.append(mark)
    return found


def _free(marks: list[ThingMark], source: PoseSource) -> list[ThingMark]:
    """The marks; labels that say nothing about it are where they cross least in the whole film."""
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
    return with_places(marks, concatenate(parts)) if parts else marks


def _followed(
    marks: Sequence[Sequence[TraceMark]], source: PoseSource, options: PictureOptions, fitted: bool, off: float
) -> list[tuple[Trace, ...]]:
    """The marks of each kind, those of whole paths first; straight pieces miss their paths by at most ``off``."""
    flat = [mark for some in marks for mark in some]
    motion, last = options.motion, math.inf
    if not flat:
        found: list[Floats] = []
    elif motion is None:
        parts = [[frame_path(mark, chunk) for mark in flat] for chunk in chunks(source)]
        found = [np.concatenate(path) for path in zip(*parts, strict=True)] or [np.zeros((0, 4))] * len(flat)
    else:
        timeline = motion.timeline
        times = [timeline.frame_time(frame) for frame in range(timeline.frame_count)]
        last = float(times[-1]) if timeline.loops else math.inf
        if timeline.loops:
            times.append(timeline.end)
        if options.until is not None and not (fitted or marks[0]):
            times = [time for time in times if time < options.until] + [options.until]
        found = paths(motion, flat, times, off)
    done = iter(found)
    return [tuple(Trace(mark, next(done), last if mark.tail is None else math.inf) for mark in some) for some in marks]


def _view(scene: Scene, options: PictureOptions, fineness: int, box: tuple[float, float, float, float]) -> View:
    left, bottom, right, top = box
    width, height = (right - left) * options.scale, (top - bottom) * options.scale
    pixels = width * height * fineness**2
    if not pixels <= options.max_pixels:
        size = (
            f"{width:.0f} x {height:.0f} pixels" if max(width, height) < 1e9 else f"{width:.1e} x {height:.1e} pixels"
        )
        drawn = f" (drawn {fineness}x as large for --quality high)" if fineness > 1 else ""
        raise ScriptError(
            [
                Diagnostic(
                    "limit/pixels",
                    Severity.ERROR,
                    f"the picture is too large: {size}{drawn}",
                    scene.config.span,
                    notes=(f"the limit is {options.max_pixels:,} pixels",),
                    helps=(
                        "give a smaller size in `.config(fps, width, height)`",
                        *([f"--max-pixels {math.ceil(pixels)}"] if pixels < 1e12 else []),
                    ),
                )
            ]
        )
    across, up = max(1, round(width)), max(1, round(height))
    if options.canvas is None:
        return View(left, bottom, across, up, options.scale)
    whole = max(across, options.canvas[0]), max(up, options.canvas[1])
    aside, below = (
        (all_of_it - film) // 2 / options.scale for all_of_it, film in zip(whole, (across, up), strict=True)
    )
    return View(left - aside, bottom - below, *whole, options.scale)


def _fitted(
    items: Sequence[PreparedMark], traces: Sequence[Trace], source: PoseSource
) -> tuple[float, float, float, float]:
    """(left, bottom, right, top), whole numbers: everything drawn in any frame, and a margin of 5 %, at least 8."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for chunk in chunks(source):
        for item in items:
            box = item.bounds(chunk)
            low = np.fmin(low, np.fmin.reduce(box[:, :2], axis=0))
            high = np.fmax(high, np.fmax.reduce(box[:, 2:], axis=0))
    for trace in traces:
        shown = trace.path[trace.path[:, 2] > 0.0, :2]
        low = np.fmin(low, shown.min(axis=0, initial=np.inf))
        high = np.fmax(high, shown.max(axis=0, initial=-np.inf))
    if not (low <= high).all():
        return 0.0, 0.0, 1.0, 1.0  # nothing is drawn at all
    margin = max(8.0, 0.05 * float((high - low).max()))
    left, bottom = np.floor(low - margin).tolist()
    right, top = np.ceil(high + margin).tolist()
    return left, bottom, right, top


def _refuse_too_much(scene: Scene, magnification: float) -> None:
    """`ScriptError` if the pictures of a scene would not fit into memory, before any is decoded."""
    sizes = {
        (picture.image, picture.scale): size[0] * size[1] * min(1.0, picture.scale * magnification) ** 2
        for thing in scene.things
        if (picture := thing.picture) is not None and (size := picture.image_size) is not None and not thing.hidden
    }
    total = sum(sizes.values())
    if total > MAX_PREPARED_PIXELS:
        message = (
            f"the {len(sizes)} pictures of this scene are too large together: {total:,.0f} pixels as they are drawn"
        )
        notes = (f"the limit is {MAX_PREPARED_PIXELS:,} pixels",)
        helps = ("make them smaller, in their files or by `.scale`",)
        raise ScriptError([Diagnostic("limit/pixels", Severity.ERROR, message, notes=notes, helps=helps)])


def _loaded(marks: Sequence[ThingMark], magnification: float) -> list[PreparedMark]:
    """The marks with their pictures; `ScriptError` with the diagnostics of all that cannot be loaded."""
    problems: list[Diagnostic] = []
    sprites: dict[tuple[str, float], Sprite | None] = {}
    found: list[PreparedMark] = []
    for mark in marks:
        try:
            if not isinstance(mark, ImageMark | TextMark):
                found.append(PreparedMark(mark))
            elif (sprite := _sprite(mark, magnification, sprites)) is not None:
                found.append(PreparedMark(mark, sprite))
        except ScriptError as error:
            problems += error.diagnostics
    if problems:
        raise ScriptError(problems)
    return found


def _sprite(
    mark: ImageMark | TextMark, magnification: float, sprites: dict[tuple[str, float], Sprite | None]
) -> Sprite | None:
    """The picture of a mark, its pixels mapped to the local frame; None if nothing of it is visible."""
    if isinstance(mark, TextMark):
        from movimentum.rendering.text import aligned, text_sprite

        sprite = text_sprite(mark.text, mark.height, magnification, mark.span)
        sprite = aligned(sprite, mark.text, mark.height, mark.align, mark.italic)
        return None if sprite is None else sprite.moved(*mark.start)
    key = (mark.path, mark.pixel)
    if key not in sprites:
        if is_drawing(mark.path):
            from movimentum.rendering.rasters import load_drawing  # only some scripts have drawings

            sprites[key] = framed(*load_drawing(mark.path, mark.pixel * magnification, FINER), mark.pixel)
            return sprites[key]
        loaded = load_premultiplied(mark.path, mark.pixel * magnification, mark.span)
        sprites[key] = prepare(loaded, mark.pixel, mark.pixel * magnification)
    sprite = sprites[key]
    if sprite is None or mark.placed is None:
        return sprite
    return replace(sprite, to_local=mark.placed @ sprite.to_local)


def _overlay(mark: OverMark, magnification: float) -> PreparedMark | None:
    if not isinstance(mark, NoteMark):
        return PreparedMark(mark)
    from movimentum.rendering.text import halo, text_sprite

    sprite = text_sprite(mark.text, NOTE_HEIGHT, magnification)
    return None if sprite is None else PreparedMark(mark, sprite, halo(sprite))
