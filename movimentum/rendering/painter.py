"""Scene and poses -> frames. A `Painter` is a value (it is sent to other processes); a `PaintSession` draws with it.

::

    painter = make_painter(scene, source, options)  # sizes, sprites, limits: everything that can fail
    image = painter.frame(poses, 0)  # one picture
    for image in PaintSession(painter).frames(poses):
        ...  # a run of them, in order
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from movimentum.drawing.options import PictureOptions, Quality
from movimentum.drawing.style import Color
from movimentum.geometry import View
from movimentum.rendering.canvas import Canvas
from movimentum.rendering.items import Item
from movimentum.rendering.prepare import Trace, prepare_drawing
from movimentum.rendering.stream import PoseSource
from movimentum.rendering.traces import PathLayer, TailLayer, TraceLayer, layer_of
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]

Layer: TypeAlias = Item | TraceLayer | TailLayer | PathLayer
"""What a picture is laid together from."""


@dataclass(frozen=True, slots=True)
class Painter:
    """All that drawing needs. ``paths`` and ``items`` from back to front, then ``traces``, then ``overlays``.

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
    paths: tuple[Trace, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of a frame in pixels."""
        return self.view.width, self.view.height

    @property
    def mode(self) -> str:
        """``"RGB"``, or ``"RGBA"`` (straight alpha) if the background is transparent."""
        return "RGBA" if self.transparent else "RGB"

    def frame(self, poses: Poses, i: int) -> Image.Image:
        """The picture of frame ``i`` (a position in ``poses``)."""
        return next(PaintSession(self).frames(poses.select(slice(i, i + 1))))


class PaintSession:
    """Draws runs of frames in order; remembers only the traces so far."""

    def __init__(self, painter: Painter) -> None:
        self.painter = painter
        view = painter.view.enlarged(painter.supersample)
        self._to_image = view.to_image
        self._size = (view.width, view.height)
        self._traces = [layer_of(trace, self._size) for trace in painter.traces]
        self._paths = [PathLayer(trace, self._to_image, self._size) for trace in painter.paths]

    def frames(self, poses: Poses) -> Iterator[Image.Image]:
        """The pictures of all frames of ``poses``, none of them before those that it drew earlier. Pictures must not be
        changed: the same object is returned again if nothing moved.

        A layer that stands still through the run, with nothing moving below it, is drawn once.
        """
        painter = self.painter
        count = len(poses.frames)
        layers: list[Layer] = [*self._paths, *painter.items, *self._traces, *painter.overlays]
        still, same = self._at_rest(layers, poses)
        base = self._blank()
        image = base
        for i in range(count):
            if i == 0 and still:
                self._draw(base, layers[:still], poses, 0)
            if i == 0 or not same[i - 1]:
                large = base.copy() if still < len(layers) else base
                self._draw(large, layers[still:], poses, i)
                image = large if painter.supersample == 1 else large.reduce(painter.supersample)
            yield image

    def _draw(self, image: Image.Image, layers: Sequence[Layer], poses: Poses, i: int) -> None:
        canvas = Canvas(image, self.painter.draft)
        for layer in layers:
            layer.draw(canvas, self._to_image, poses, i)

    def _blank(self) -> Image.Image:
        if self.painter.transparent:
            return Image.new("RGBA", self._size, (0, 0, 0, 0))
        return Image.new("RGB", self._size, self.painter.background)

    def _at_rest(self, layers: Sequence[Layer], poses: Poses) -> tuple[int, NDArray[np.bool_]]:
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


def make_painter(scene: Scene, source: PoseSource, options: PictureOptions | None = None) -> Painter:
    """Everything ready to draw ``scene`` with Pillow; takes and raises what `prepare_drawing` does."""
    options = options or PictureOptions()
    _ = np.eye(2) @ np.eye(
        2
    )  # OpenBLAS takes memory at the first product, or ends the process: so before a file is begun
    prepared = prepare_drawing(scene, source, options)
    return Painter(
        view=prepared.view,
        items=tuple(map(Item, prepared.things)),
        traces=prepared.traces,
        overlays=tuple(map(Item, prepared.overlays)),
        background=prepared.drawing.matte,
        transparent=prepared.drawing.transparent,
        draft=options.quality is Quality.DRAFT,
        supersample=prepared.fineness,
        paths=prepared.paths,
    )
