"""Scene and poses -> frames. A `Painter` is a value (it is sent to other processes); a `PaintSession` draws with it.

::

    painter = make_painter(scene, source, options)  # sizes, sprites, limits: everything that can fail
    image = painter.frame(poses, 0)  # one picture
    for image in PaintSession(painter).frames(poses):
        ...  # a run of them, in order
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageChops

from movimentum.drawing.camera import camera, detail, inset_frame, inset_lines, seen
from movimentum.drawing.figure_outlines import MovingPart
from movimentum.drawing.model import InsetMark, OverMark, Point, ThingMark
from movimentum.drawing.motion import paint_at
from movimentum.drawing.picture_options import PictureOptions, Quality
from movimentum.drawing.style import Color
from movimentum.geometry import Affine, View
from movimentum.records import dataclass, replace
from movimentum.rendering.canvas import Canvas, stamped
from movimentum.rendering.changing import runs
from movimentum.rendering.coverage import Outline
from movimentum.rendering.items import Item, ItemGroup
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.prepare import Trace, prepare_drawing
from movimentum.rendering.shapes import part_shape
from movimentum.rendering.stamps import Box, Frame, Stamps, area, lay, regions
from movimentum.rendering.stream import PoseSource
from movimentum.rendering.traces import PathLayer, layer_of
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]

_AHEAD = 2_000_000  # pixels of the stamps that are prepared together
_KEPT = 4  # pictures of the canvas: how much is remembered of what was drawn


@dataclass(frozen=True, slots=True)
class Painter:
    """All that drawing needs. ``paths`` and ``items`` from back to front, then ``traces``, then ``beside``, then
    ``overlays``.

    ``view`` is the finished picture's; with ``supersample`` 2 it is drawn twice as large and averaged.
    """

    view: View
    items: tuple[Item | ItemGroup, ...]
    traces: tuple[Trace, ...]
    overlays: tuple[Item, ...]
    background: Color
    transparent: bool = False
    draft: bool = False
    supersample: int = 1
    paths: tuple[Trace, ...] = ()
    beside: tuple[Item, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of a frame in pixels."""
        return self.view.width, self.view.height

    @property
    def mode(self) -> str:
        """``"RGB"``, or ``"RGBA"`` (straight alpha) if the background is transparent."""
        return "RGBA" if self.transparent else "RGB"

    @property
    def marks(self) -> list[ThingMark | OverMark]:
        """All marks but the traces."""
        things = [part for item in self.items for part in (item.items if isinstance(item, ItemGroup) else (item,))]
        return [item.prepared.mark for item in (*things, *self.overlays)]

    def frame(self, poses: Poses, i: int) -> Image.Image:
        """The picture of frame ``i`` (a position in ``poses``)."""
        return next(PaintSession(self).frames(poses.one(i)))


@dataclass(slots=True)
class _Drawn:
    """A layer's last state: its ``state`` and its stamps, or only their ``boxes`` if there is no room."""

    state: Floats
    stamps: Stamps | None
    boxes: list[Box]


class PaintSession:
    """Draws frames in order. It remembers what each layer looked like: what does not move is drawn once, and only the
    rectangles in which something moves are laid together anew.
    """

    def __init__(self, painter: Painter) -> None:
        self.painter = painter
        view = painter.view.enlarged(painter.supersample)
        self._to_image, self._size = view.to_image, (view.width, view.height)
        beside: list[ShownLayer] = [Item(item.prepared) for item in painter.beside]
        overlays = [Item(item.prepared) for item in painter.overlays]
        self._layers: list[ShownLayer] = [*self._made(), *with_insets(beside, painter.view, self._made), *overlays]
        self._drawn: list[_Drawn] = []
        self._moving = 0  # pixels of the stamps that changed last
        self._image = self._ground(painter.size)

    def _made(self) -> list[ShownLayer]:
        """The layers of the film itself, which insets show too."""
        painter = self.painter
        return [
            *(PathLayer(trace, self._to_image, self._size) for trace in painter.paths),
            *(item.again() for item in painter.items),
            *(layer_of(trace, self._to_image, self._size) for trace in painter.traces),
        ]

    def frames(self, poses: Poses) -> Iterator[Image.Image]:
        """The pictures of all frames of ``poses``, with traces none of them before those that it drew earlier. It is
        one picture, which is changed for the next frame.
        """
        return (frame.image for frame in self.changes(poses))

    def changes(self, poses: Poses) -> Iterator[Frame]:
        """The same, with what changed since the last frame that this session drew."""
        looks = camera(poses, self.painter.view)
        states = [
            layer.state(poses) if looks is None or layer.still else np.concatenate([layer.state(poses), looks], axis=1)
            for layer in self._layers
        ]
        first = 0
        while first < len(poses.frames):
            # where little moves, some frames are prepared together
            block = range(first, min(len(poses.frames), first + self._ahead()))
            for i, changed in zip(block, self._prepared(states, poses, block), strict=True):
                begun = bool(self._drawn)
                self._moving = sum(map(area, (box for _, drawn in changed for box in drawn.boxes)))
                parts = regions(self._shown(changed), self.painter.supersample) if begun else [Box(0, 0, *self._size)]
                if not begun:
                    self._drawn = [drawn for _, drawn in changed]
                boxes = [box for part in parts if (box := self._composed(part, poses, i)) is not None]
                yield Frame(self._image, tuple(boxes) if begun else (Box(0, 0, *self._image.size),))
            self._forget()
            first = block.stop

    def _ahead(self) -> int:
        """How many frames are prepared together."""
        if not self._drawn or any(drawn.stamps is None for drawn in self._drawn):
            return 1
        return max(1, _AHEAD // max(1, self._moving))

    def _prepared(self, states: Sequence[Floats], poses: Poses, block: range) -> list[list[tuple[int, _Drawn]]]:
        """For each of some frames, the layers that change, drawn anew."""
        before = [drawn.state for drawn in self._drawn] or [None] * len(states)
        changed: list[list[int]] = []
        for i in block:
            changed.append([n for n, state in enumerate(states) if not _same(before[n], state[i])])
            before = [state[i] for state in states]
        stamps = iter(self._stamps([(n, i) for i, some in zip(block, changed, strict=True) for n in some], poses))
        return [
            [(n, _Drawn(states[n][i], found := next(stamps), [stamp.box for stamp in found])) for n in some]
            for i, some in zip(block, changed, strict=True)
        ]

    def _shown(self, changed: Sequence[tuple[int, _Drawn]]) -> Iterator[Box]:
        """Take over what some layers look like now; where they were and where they are."""
        for n, now in changed:
            before = self._drawn[n]
            old, new = set(map(id, before.stamps or ())), set(map(id, now.stamps or ()))
            yield from (stamp.box for stamp in now.stamps or () if id(stamp) not in old)
            if before.stamps is None:
                yield from before.boxes
            else:
                yield from (stamp.box for stamp in before.stamps if id(stamp) not in new)
            self._drawn[n] = now

    def _stamps(self, layers: Sequence[tuple[int, int]], poses: Poses) -> list[Stamps]:
        """The stamps of some layers in some frames, (number, frame) each."""
        canvases = [Canvas(self._size, self.painter.draft) for _ in layers]
        looks = camera(poses, self.painter.view)
        for (number, i), canvas in zip(layers, canvases, strict=True):
            layer = self._layers[number]
            place = self._to_image if looks is None or layer.still else seen(self._to_image, looks[i])
            layer.draw(canvas, place, poses, i)
        return stamped(canvases)

    def _forget(self) -> None:
        """Keep no more stamps than some pictures of the canvas would take: the largest are drawn whenever needed."""
        room = _KEPT * self._size[0] * self._size[1]
        for drawn in self._drawn:
            if drawn.stamps is not None:
                room -= sum(map(area, drawn.boxes))
                if room < 0:
                    drawn.stamps = None

    def _composed(self, region: Box, poses: Poses, i: int) -> Box | None:
        """Lay a rectangle together anew; the part of it that differs from what was there."""
        fine = self.painter.supersample
        part = self._ground((region.right - region.left, region.bottom - region.top))
        for number, drawn in enumerate(self._drawn):
            stamps = self._stamps([(number, i)], poses)[0] if drawn.stamps is None else drawn.stamps
            lay(part, region, stamps)
        part = part if fine == 1 else part.reduce(fine)
        left, top = region.left // fine, region.top // fine
        place = (left, top, left + part.width, top + part.height)
        box = ImageChops.difference(part, self._image.crop(place)).getbbox(alpha_only=False)
        if box is None:
            return None
        self._image.paste(part.crop(box), (left + box[0], top + box[1]))
        return Box(left + box[0], top + box[1], left + box[2], top + box[3])

    def _ground(self, size: tuple[int, int]) -> Image.Image:
        if self.painter.transparent:
            return Image.new("RGBA", size, (0, 0, 0, 0))
        return Image.new("RGB", size, self.painter.background)


def _same(before: Floats | None, now: Floats) -> bool:
    return before is not None and np.array_equal(before, now)


def _items(marks: Sequence[PreparedMark]) -> Iterator[Item | ItemGroup]:
    for group, numbers in runs(marks):
        items = tuple(Item(marks[number]) for number in numbers)
        yield from items if group is None else (ItemGroup(group, items),)


def make_painter(scene: Scene, source: PoseSource, options: PictureOptions | None = None) -> Painter:
    """Everything ready to draw ``scene`` with Pillow; takes and raises what `prepare_drawing` does."""
    options = options or PictureOptions()
    _ = np.eye(2) @ np.eye(
        2
    )  # OpenBLAS takes memory at the first product, or ends the process: so before a file is begun
    prepared = prepare_drawing(scene, source, options)
    return Painter(
        view=prepared.view,
        items=tuple(_items(prepared.things)),
        traces=prepared.traces,
        overlays=tuple(map(Item, prepared.overlays)),
        background=prepared.drawing.matte,
        transparent=prepared.drawing.transparent,
        draft=options.quality is Quality.DRAFT,
        supersample=prepared.fineness,
        paths=prepared.paths,
        beside=tuple(map(Item, prepared.beside)),
    )


# --- insets, as Pillow's painter draws them: the layers of the film once more, in a rectangle


class ShownLayer(Protocol):
    """A layer of a picture."""

    @property
    def still(self) -> bool:
        """Whether the camera leaves it where it is."""
        ...

    def state(self, poses: Poses) -> NDArray[np.float64]:
        """(F, K): all numbers that its picture depends on."""
        ...

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``."""
        ...


class InsetLayer:
    """One inset. ``view``: what the canvas shows without a camera; ``layers``: those of its own that it shows."""

    def __init__(self, prepared: PreparedMark, view: View, layers: Sequence[ShownLayer]) -> None:
        assert isinstance(prepared.mark, InsetMark)
        self.prepared, self.still = prepared, True
        self._mark, self._view = prepared.mark, view
        self._layers = [layer for layer in layers if not layer.still]

    def state(self, poses: Poses) -> NDArray[np.float64]:
        """(F, K): all numbers that its picture depends on."""
        look, shown = detail(self._mark, poses)
        whole = camera(poses, self._view)
        own = [self.prepared.state(poses), look, shown[:, None].astype(np.float64)]
        if whole is not None:
            own.append(whole)
        return np.concatenate([*own, *(layer.state(poses) for layer in self._layers)], axis=1)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Draw frame ``i``."""
        now, mark = poses.one(i), self._mark
        opacity, color = paint_at(mark.paint, poses, i)
        look, shown = detail(mark, now)
        if not shown[0]:
            return
        scale = to_image.a

        def placed(part: MovingPart) -> tuple[Outline, Affine]:
            points: list[Point] = [(x, y) for x, y in part.points[0].tolist()]
            return part_shape(replace(part.style, points=tuple(points)), scale, canvas.thinnest).at(to_image, scale)

        def film(sheet: Canvas) -> None:
            for layer in self._layers:
                layer.draw(sheet, seen(to_image, look[0]), poses, i)

        def whole(sheet: Canvas) -> None:
            frame = placed(inset_frame(mark, now))
            sheet.fill(frame, mark.fill or color)
            sheet.within(frame, film)
            for part in inset_lines(mark, now, camera(now, self._view)):
                sheet.fill(placed(part), color)

        canvas.together(opacity, whole)


def with_insets(
    layers: Sequence[ShownLayer], view: View, again: Callable[[], Sequence[ShownLayer]]
) -> list[ShownLayer]:
    """The layers of a picture; insets have layers of their own, made by ``again``."""
    found: list[ShownLayer] = []
    for layer in layers:
        prepared = getattr(layer, "prepared", None)
        inset = isinstance(prepared, PreparedMark) and isinstance(prepared.mark, InsetMark)
        found.append(InsetLayer(prepared, view, again()) if inset and prepared is not None else layer)
    return found
