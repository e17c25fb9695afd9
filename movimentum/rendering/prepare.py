"""Prepares a display list: loads its images and texts, and decides which rectangle of the world is shown.

Everything that can fail is done here, before a file is begun. All renderers begin with a `PreparedDrawing`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.camera import is_still, largest_zoom
from movimentum.drawing.compose import compose
from movimentum.drawing.model import (
    Drawing,
    FreeArrow,
    ImageMark,
    InsetMark,
    NoteMark,
    OverMark,
    Paint,
    SymbolMark,
    TextMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.motion import state
from movimentum.drawing.paths import frame_path, paths
from movimentum.drawing.picture_options import MAX_PREPARED_PIXELS, PictureOptions, Quality
from movimentum.drawing.style import NOTE_HEIGHT
from movimentum.errors import ScriptError, UsageError
from movimentum.geometry import View
from movimentum.records import dataclass, replace
from movimentum.rendering.changing import in_places, zoomed
from movimentum.rendering.images import is_drawing, load_premultiplied
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.sprites import Sprite, framed, prepare
from movimentum.rendering.stream import PoseSource, chunks
from movimentum.rendering.whole_film import settled
from movimentum.scene.model import Scene
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.things.kinds.label import LABEL

Floats = NDArray[np.float64]


FINER = 1.6
"""Pixels of a drawing to one of the canvas, each way: what bilinear sampling then shows is nearest to the drawing drawn
in its place (with 1 it is too soft, with 2 too hard).
"""


@dataclass(frozen=True, slots=True)
class Trace:
    """A path of the whole film (see `drawing.paths`). ``last``: the time of the last frame of a film that begins again;
    it shows the path up to there. ``still``: the camera does not move it.
    """

    mark: TraceMark
    path: Floats
    last: float = math.inf
    still: bool = False

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
    then ``beside`` (insets, and what the camera leaves alone that lies over them), then ``overlays``: those marks of
    ``drawing`` that show anything.

    ``view`` is the rectangle of the world that the finished picture shows. Images and texts have ``fineness`` pixels to
    a pixel of that picture, each way (unless the image's file has fewer); a camera and insets enlarge them by at most
    ``closest``.
    """

    drawing: Drawing
    view: View
    fineness: int
    things: tuple[PreparedMark, ...]
    traces: tuple[Trace, ...]
    overlays: tuple[PreparedMark, ...]
    paths: tuple[Trace, ...] = ()
    beside: tuple[PreparedMark, ...] = ()
    closest: float = 1.0


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
    box = options.room
    if box is None and scene.config.size is not None:
        box = (0.0, 0.0, float(scene.config.size[0]), float(scene.config.size[1]))
    if box is not None:
        _view(scene, options, fineness, box)  # a limit that needs no sprite
    magnification = options.scale * fineness
    _refuse_too_much(scene, magnification)
    drawing = compose(scene, options)
    marks = zoomed(settled(drawing.things, scene, source, options), scene, source)
    near = scene.views or any(isinstance(mark, InsetMark) for mark in marks)
    closest = largest_zoom(marks, chunks(source)) if near else 1.0
    things = _loaded(marks, magnification, closest)
    things = _within(things, drawing)
    if scene.changes("layer"):
        things = in_places(things, drawing.under, scene, source)
    whole, traces = _followed(
        scene, (drawing.paths, drawing.traces), source, options, box is None, 0.05 / (magnification * closest)
    )
    overlays = [made for mark in drawing.overlays if (made := _overlay(mark, magnification)) is not None]
    if near:
        things = [replace(item, still=_is_still(scene, item)) for item in things]
        overlays = [replace(item, still=_is_still(scene, item)) for item in overlays]
    arrows = [overlay for overlay in overlays if isinstance(overlay.mark, FreeArrow)]
    view = _view(scene, options, fineness, box or _fitted([*things, *arrows], (*whole, *traces), source))
    room = (view.left, view.bottom, view.left + view.width / view.scale, view.bottom + view.height / view.scale)
    things = [_in_room(item, room) for item in things]
    inset = next((place for place, item in enumerate(things) if isinstance(item.mark, InsetMark)), len(things))
    under = tuple(item for place, item in enumerate(things) if place < inset or not item.still)
    beside = tuple(item for item in things[inset:] if item.still)
    return PreparedDrawing(drawing, view, fineness, under, traces, tuple(overlays), whole, beside, closest)


def _is_still(scene: Scene, item: PreparedMark) -> bool:
    """Whether the camera leaves a mark where it is."""
    thing = item.mark.body if isinstance(item.mark, NoteMark | FreeArrow) else item.mark.paint.thing
    return is_still(scene, thing)


def marks_of(
    scene: Scene, source: PoseSource, motion: PathMotion, wanted: Collection[int]
) -> dict[int, list[PreparedMark]]:
    """The marks of some things, ready to be drawn at their own size, without those that cannot be loaded."""
    options = PictureOptions(motion=motion)
    drawing = compose(scene, options)
    marks = drawing.things
    if not any(scene.things[thing].kind is LABEL and scene.things[thing].own.of_film for thing in wanted):
        marks = [mark for mark in marks if mark.paint.thing in wanted]  # such labels keep clear of all others
    drawn: dict[int, list[ThingMark]] = {}
    for mark in settled(marks, scene, source, options):
        drawn.setdefault(mark.paint.thing, []).append(mark)
    found: dict[int, list[PreparedMark]] = {}
    for thing in sorted(set(wanted) & drawn.keys()):
        try:
            found[thing] = _within(_loaded(drawn[thing], 1.0), drawing)
        except ScriptError:
            continue  # it is reported where it is drawn
    return found


def _within(items: list[PreparedMark], drawing: Drawing) -> list[PreparedMark]:
    """The marks, with what they are cut off by, and the groups that fade together."""
    if drawing.clips:
        clips: dict[int | None, ThingMark] = dict(drawing.clips)
        items = [replace(item, clip=clips.get(_painted(item.mark))) for item in items]
    if drawing.groups:
        groups: dict[int | None, Paint] = dict(drawing.groups)
        items = [replace(item, group=groups.get(_painted(item.mark))) for item in items]
    return items


def _in_room(item: PreparedMark, room: tuple[float, float, float, float]) -> PreparedMark:
    """What points to the edge of the picture knows where that is."""
    mark = item.mark
    return replace(item, mark=replace(mark, room=room)) if isinstance(mark, SymbolMark) and mark.kind.loose else item


def _painted(mark: ThingMark | OverMark) -> int | None:
    """The thing that a mark draws."""
    return None if isinstance(mark, NoteMark | FreeArrow) else mark.paint.thing


def needs_film(scene: Scene) -> bool:
    """Whether a picture of one frame depends on others: on the lengths that a cylinder has, on layers,
    on how near a camera comes.
    """
    return (
        bool(scene.views)
        or scene.changes("layer")
        or scene.changes("scale")
        or any((thing.kind.of_film or thing.own.of_film) and not thing.hidden for thing in scene.things)
    )


def _followed(
    scene: Scene,
    marks: Sequence[Sequence[TraceMark]],
    source: PoseSource,
    options: PictureOptions,
    fitted: bool,
    off: float,
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
    return [tuple(_trace(scene, mark, next(done), last) for mark in some) for some in marks]


def _trace(scene: Scene, mark: TraceMark, path: Floats, last: float) -> Trace:
    still = mark.paint is not None and is_still(scene, mark.paint.thing)
    return Trace(mark, path, last if mark.tail is None else math.inf, still)


def _view(scene: Scene, options: PictureOptions, fineness: int, box: tuple[float, float, float, float]) -> View:
    left, bottom, right, top = box
    width, height = (right - left) * options.scale, (top - bottom) * options.scale
    pixels = width * height * fineness**2
    if not pixels <= options.max_pixels:
        size = (
            f"{width:.0f} x {height:.0f} pixels" if max(width, height) < 1e9 else f"{width:.1e} x {height:.1e} pixels"
        )
        drawn = Advised(f" (drawn {fineness}x as large for ", Choose.QUALITY.to("high"), ")") if fineness > 1 else ""
        raise ScriptError(
            [
                Diagnostic(
                    "limit/pixels",
                    Severity.ERROR,
                    Advised(f"the picture is too large: {size}", drawn),
                    scene.config.span,
                    notes=(f"the limit is {options.max_pixels:,} pixels",),
                    helps=(
                        "give a smaller size in `.config(fps, width, height)`",
                        *([Choose.MAX_PIXELS.to(math.ceil(pixels))] if pixels < 1e12 else []),
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


def _loaded(marks: Sequence[ThingMark], magnification: float, closest: float = 1.0) -> list[PreparedMark]:
    """The marks with their pictures, images as fine as is seen when all is ``closest`` times as large.

    `ScriptError` with the diagnostics of all that cannot be loaded.
    """
    problems: list[Diagnostic] = []
    sprites: dict[tuple[str, float, float], Sprite | None] = {}
    found: list[PreparedMark] = []
    for mark in marks:
        try:
            if not isinstance(mark, ImageMark | TextMark):
                found.append(PreparedMark(mark))
            elif (sprite := _sprite(mark, magnification * mark.paint.zoom, closest, sprites)) is not None:
                found.append(PreparedMark(mark, sprite))
        except ScriptError as error:
            problems += error.diagnostics
    if problems:
        raise ScriptError(problems)
    return found


def _sprite(
    mark: ImageMark | TextMark,
    magnification: float,
    closest: float,
    sprites: dict[tuple[str, float, float], Sprite | None],
) -> Sprite | None:
    """The picture of a mark, its pixels mapped to the local frame; None if nothing of it is visible."""
    if isinstance(mark, TextMark):
        from movimentum.rendering.text import aligned, text_sprite

        sprite = text_sprite(mark.text, mark.height, magnification, mark.span)
        sprite = aligned(sprite, mark.text, mark.height, mark.align, mark.italic)
        return None if sprite is None else sprite.moved(*mark.start)
    magnification *= closest
    key = (mark.path, mark.pixel, magnification)
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
