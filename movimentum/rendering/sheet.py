"""A sheet of thumbnails: a scene in several poses, numbered, side by side."""

from __future__ import annotations

import math
from pathlib import Path

from movimentum.drawing.picture_options import PictureOptions
from movimentum.records import replace
from movimentum.rendering.painter import Painter, make_painter
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses

WIDTH = 320
GAP = 8


def write_thumbnails(scene: Scene, poses: Poses, path: Path) -> None:
    """Write the frames of ``poses`` as one PNG, row by row, with rows that make the sheet about square."""
    from PIL import Image, ImageDraw

    from movimentum.rendering.faces import plain

    painter = _whole(scene, poses)
    pictures = [painter.frame(poses, i).convert("RGB") for i in range(len(poses.frames))]
    wide, high = painter.size
    scale = min(1.0, WIDTH / wide)
    cell = max(1, round(wide * scale)), max(1, round(high * scale))
    columns = min(len(pictures), max(1, round(math.sqrt(len(pictures) * cell[1] / cell[0]))))
    rows = math.ceil(len(pictures) / columns)
    sheet = Image.new("RGB", (columns * (cell[0] + GAP) + GAP, rows * (cell[1] + GAP) + GAP), (200, 200, 200))
    pen, font = ImageDraw.Draw(sheet), plain(14)
    for k, picture in enumerate(pictures):
        x, y = GAP + k % columns * (cell[0] + GAP), GAP + k // columns * (cell[1] + GAP)
        sheet.paste(picture.resize(cell, Image.Resampling.LANCZOS) if scale < 1.0 else picture, (x, y))
        pen.text((x + 5, y + 3), str(k + 1), fill=(0, 0, 0), font=font)
    sheet.save(path, "PNG")


def _whole(scene: Scene, poses: Poses) -> Painter:
    """A painter whose picture has the script's canvas and the whole of every pose."""
    fitted = make_painter(replace(scene, config=replace(scene.config, size=None)), (poses,), PictureOptions())
    if scene.config.size is None:
        return fitted
    view, (width, height) = fitted.view, scene.config.size
    left, bottom = min(view.left, 0.0), min(view.bottom, 0.0)
    right, top = max(view.left + view.width, width), max(view.bottom + view.height, height)
    return replace(
        fitted, view=replace(view, left=left, bottom=bottom, width=round(right - left), height=round(top - bottom))
    )
