"""Insets, as Pillow's painter draws them: the layers of the film once more, in a rectangle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.camera import camera, detail, inset_frame, inset_lines, seen
from movimentum.drawing.model import InsetMark, Point
from movimentum.drawing.motion import paint_at
from movimentum.drawing.parts import MovingPart
from movimentum.geometry import Affine, View
from movimentum.records import replace
from movimentum.rendering.canvas import Canvas
from movimentum.rendering.coverage import Outline
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.shapes import part_shape
from movimentum.solver.poses import Poses


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
