"""Scene and poses -> frames. A `Painter` is a value (it is sent to other processes); a `PaintSession` draws with it.

::

    painter = make_painter(scene, source, options)  # sizes, sprites, limits: everything that can fail
    image = painter.frame(poses, 0)  # one picture
    for image in Session(painter).frames(poses):
        ...  # a run of them, in order
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError, UsageError
from movimentum.geometry import View
from movimentum.rendering.canvas import Canvas, Color
from movimentum.rendering.images import load_premultiplied
from movimentum.rendering.items import BarItem, DiscItem, Item, LineItem, Paint, PictureItem
from movimentum.rendering.options import MAX_PREPARED_PIXELS, PictureOptions, Quality, Show
from movimentum.rendering.overlays import FreeArrow, Trace, TraceLayer, notes
from movimentum.rendering.sprites import Sprite, prepare
from movimentum.rendering.stream import PoseSource, chunks
from movimentum.rendering.style import BACKGROUND, TRACE_WIDTH, color_of, paint_of
from movimentum.scene.looks import DISC_RADIUS, LABEL_HEIGHT, width_of
from movimentum.scene.model import Scene, Shape, Thing
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Painter:
    """All that drawing needs. ``items`` from back to front, then ``traces``, then ``overlays``.

    ``view`` is the finished picture's; with ``supersample`` 2 it is drawn twice as large and averaged.
    """

    view: View
    items: tuple[Item, ...]
    traces: tuple[Trace, ...]
    overlays: tuple[Item, ...]
    background: Color
    transparent: bool = False
    draft: bool = False
    supersample: int = 1

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of a frame in pixels."""
        return self.view.width, self.view.height

    @property
    def mode(self) -> str:
        """``"RGB"``, or ``"RGBA"`` (straight alpha) if the background is transparent."""
        return "RGBA" if self.transparent else "RGB"

    def frame(self, poses: Poses, i: int) -> Image.Image:
        """The picture of frame ``i`` (a position in ``poses``); traces begin with the first frame of ``poses``."""
        past = self.trace_points(poses.select(slice(0, i)))
        return next(PaintSession(self).frames(poses.select(slice(i, i + 1)), past))

    def trace_points(self, poses: Poses) -> tuple[Floats, ...]:
        """For every trace, the points that `PaintSession.frames` needs from frames that the session did not draw."""
        return tuple(trace.points(poses) for trace in self.traces)


class PaintSession:
    """Draws runs of frames in order; remembers only the traces so far."""

    def __init__(self, painter: Painter) -> None:
        self.painter = painter
        view = painter.view.enlarged(painter.supersample)
        self._to_image = view.to_image
        self._size = (view.width, view.height)
        self._traces = [TraceLayer(trace, self._size) for trace in painter.traces]
        for layer in self._traces:
            if layer.trace.past is not None:
                layer.feed(layer.trace.past, self._to_image)

    def frames(self, poses: Poses, past: Sequence[Floats] = ()) -> Iterator[Image.Image]:
        """The pictures of all frames of ``poses``; ``past`` are the trace points of frames in between that this session
        did not draw. Pictures must not be changed: the same object is returned again if nothing moved.

        A layer that stands still through the run, with nothing moving below it, is drawn once.
        """
        painter = self.painter
        for layer, points in zip(self._traces, past, strict=False):
            layer.feed(points, self._to_image)
        count = len(poses.frames)
        layers: list[Item | TraceLayer] = [*painter.items, *self._traces, *painter.overlays]
        still, same = self._at_rest(layers, poses)
        news = [layer.trace.points(poses) for layer in self._traces]
        base = self._blank()
        image = base
        for i in range(count):
            for layer, points in zip(self._traces, news, strict=True):
                layer.feed(points[i : i + 1], self._to_image)
            if i == 0 and still:
                self._draw(base, layers[:still], poses, 0)
            if i == 0 or not same[i - 1]:
                large = base.copy() if still < len(layers) else base
                self._draw(large, layers[still:], poses, i)
                image = large if painter.supersample == 1 else large.reduce(painter.supersample)
            yield image

    def _draw(self, image: Image.Image, layers: Sequence[Item | TraceLayer], poses: Poses, i: int) -> None:
        canvas = Canvas(image, self.painter.draft)
        for layer in layers:
            layer.draw(canvas, self._to_image, poses, i)

    def _blank(self) -> Image.Image:
        if self.painter.transparent:
            return Image.new("RGBA", self._size, (0, 0, 0, 0))
        return Image.new("RGB", self._size, self.painter.background)

    def _at_rest(self, layers: Sequence[Item | TraceLayer], poses: Poses) -> tuple[int, NDArray[np.bool_]]:
        """How many layers from the back stand still in all frames, and (F - 1,) whether a frame equals the last."""
        same = np.ones(max(0, len(poses.frames) - 1), dtype=bool)
        still = 0
        for number, layer in enumerate(layers):
            state = layer.state(poses)
            rests = (state[1:] == state[:-1]).all(axis=1)
            if still == number and rests.all():
                still = number + 1
            same &= rests
        return still, same


def make_painter(
    scene: Scene, source: PoseSource, options: PictureOptions | None = None, *, before: PoseSource = ()
) -> Painter:
    """Everything ready to draw ``scene``; reads ``source`` only if the canvas must fit the drawing.

    ``source`` has all frames of the animation, so that the canvas is the same whichever frames are drawn. ``before``
    has the frames before the first one that is drawn, so that traces are the same.

    `ScriptError`: sprites that are missing, unreadable or too large (all of them), a canvas over the limit;
    `UsageError`: a scale that is not a positive number.
    """
    options = options or PictureOptions()
    _ = np.eye(2) @ np.eye(
        2
    )  # OpenBLAS takes memory at the first product, or ends the process: so before a file is begun
    if not (math.isfinite(options.scale) and options.scale > 0.0):
        raise UsageError([Diagnostic("usage/scale", Severity.ERROR, "the scale must be a positive number")])
    supersample = 2 if options.quality is Quality.HIGH else 1
    box = None if scene.config.size is None else (0.0, 0.0, float(scene.config.size[0]), float(scene.config.size[1]))
    if box is not None:
        _view(scene, options, supersample, box)  # a limit that needs no sprite
    magnification = options.scale * supersample
    items = _items(scene, magnification)
    things = scene.things
    traces = tuple(
        Trace(ref.thing, things[ref.thing].anchors[ref.anchor].local, color_of(things[ref.thing]), TRACE_WIDTH)
        for ref in options.traces
    )
    if traces:
        earlier = [[trace.points(chunk) for trace in traces] for chunk in chunks(before)]
        paths = [np.concatenate(parts) for parts in zip(*earlier, strict=True)] or [None] * len(traces)
        traces = tuple(replace(trace, past=path) for trace, path in zip(traces, paths, strict=True))
    arrows = [FreeArrow(mark) for mark in options.free] if Show.FREE in options.show else []
    overlays: list[Item] = [*notes(things, options.show, magnification), *arrows]
    return Painter(
        view=_view(scene, options, supersample, box or _fitted([*items, *arrows], traces, source)),
        items=tuple(items),
        traces=traces,
        overlays=tuple(overlays),
        background=options.background or scene.config.background or BACKGROUND,
        transparent=options.transparent,
        draft=options.quality is Quality.DRAFT,
        supersample=supersample,
    )


def _view(scene: Scene, options: PictureOptions, supersample: int, box: tuple[float, float, float, float]) -> View:
    left, bottom, right, top = box
    width, height = (right - left) * options.scale, (top - bottom) * options.scale
    pixels = width * height * supersample**2
    if not pixels <= options.max_pixels:
        size = (
            f"{width:.0f} x {height:.0f} pixels" if max(width, height) < 1e9 else f"{width:.1e} x {height:.1e} pixels"
        )
        drawn = f" (drawn {supersample}x as large for --quality high)" if supersample > 1 else ""
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
    return View(left, bottom, max(1, round(width)), max(1, round(height)), options.scale)


def _fitted(items: Sequence[Item], traces: Sequence[Trace], source: PoseSource) -> tuple[float, float, float, float]:
    """(left, bottom, right, top), whole numbers: everything drawn in any frame, and a margin of 5 %, at least 8."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for chunk in chunks(source):
        for item in items:
            box = item.bounds(chunk)
            low = np.fmin(low, np.fmin.reduce(box[:, :2], axis=0))
            high = np.fmax(high, np.fmax.reduce(box[:, 2:], axis=0))
        for trace in traces:
            points = trace.points(chunk)
            shown = points[points[:, 2] > 0.0, :2]
            low, high = (
                np.fmin(low, shown.min(axis=0, initial=np.inf)),
                np.fmax(high, shown.max(axis=0, initial=-np.inf)),
            )
    if not (low <= high).all():
        return 0.0, 0.0, 1.0, 1.0  # nothing is drawn at all
    margin = max(8.0, 0.05 * float((high - low).max()))
    left, bottom = np.floor(low - margin).tolist()
    right, top = np.ceil(high + margin).tolist()
    return left, bottom, right, top


def _items(scene: Scene, magnification: float) -> list[Item]:
    _refuse_too_much(scene, magnification)
    problems: list[Diagnostic] = []
    sprites: dict[tuple[str, float], Sprite | None] = {}
    items: list[Item] = []
    for number in scene.drawing_order():
        thing = scene.things[number]
        if thing.hidden:
            continue
        try:
            item = _item(scene, thing, magnification, sprites)
        except ScriptError as error:
            problems += error.diagnostics
        else:
            items += [] if item is None else [item]
    if problems:
        raise ScriptError(problems)
    return items


def _refuse_too_much(scene: Scene, magnification: float) -> None:
    """`ScriptError` if the pictures of a scene would not fit into memory, before any is decoded."""
    sizes = {
        (thing.image, thing.scale): thing.image_size[0]
        * thing.image_size[1]
        * min(1.0, thing.scale * magnification) ** 2
        for thing in scene.things
        if thing.image is not None and thing.image_size is not None and not thing.hidden
    }
    total = sum(sizes.values())
    if total > MAX_PREPARED_PIXELS:
        message = (
            f"the {len(sizes)} pictures of this scene are too large together: {total:,.0f} pixels as they are drawn"
        )
        notes = (f"the limit is {MAX_PREPARED_PIXELS:,} pixels",)
        helps = ("make them smaller, in their files or by `.scale`",)
        raise ScriptError([Diagnostic("limit/pixels", Severity.ERROR, message, notes=notes, helps=helps)])


def _item(
    scene: Scene, thing: Thing, magnification: float, sprites: dict[tuple[str, float], Sprite | None]
) -> Item | None:
    paint = Paint(thing.number, paint_of(thing))
    points = tuple(anchor.local for anchor in thing.anchors)
    first = points[0] if points else (0.0, 0.0)
    match thing.shape:
        case Shape.SPRITE:
            if thing.image is None:
                return None
            key = (thing.image, thing.scale)
            if key not in sprites:
                loaded = load_premultiplied(thing.image, thing.scale * magnification, thing.span)
                sprites[key] = prepare(loaded, thing.scale, thing.scale * magnification)
            sprite = sprites[key]
            return None if sprite is None else PictureItem(paint, sprite)
        case Shape.BAR | Shape.ARROW:
            return BarItem(paint, points, width_of(thing), thing.shape is Shape.ARROW) if points else None
        case Shape.DISC:
            return DiscItem(paint, first, DISC_RADIUS if thing.radius is None else thing.radius, thing.width)
        case Shape.LABEL:
            from movimentum.rendering.text import text_sprite

            sprite = text_sprite(thing.text or "", LABEL_HEIGHT * thing.scale, magnification, thing.span)
            return None if sprite is None else PictureItem(paint, sprite.moved(*first))
        case Shape.LINE:
            through = tuple((ref.thing, scene.things[ref.thing].anchors[ref.anchor].local) for ref in thing.through)
            return LineItem(paint, through, width_of(thing)) if through else None
