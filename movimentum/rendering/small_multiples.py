"""Small multiples: pictures of variants side by side, each with a caption."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from movimentum.records import dataclass

WIDTH, GAP, CAPTION = 240, 10, 22
PAPER, INK, FAILED, BLANK = (255, 255, 255), (30, 30, 30), (176, 32, 32), (238, 238, 238)


@dataclass(frozen=True, slots=True)
class SheetCell:
    """One variant: the file of its ``picture`` (None: there is none), its ``caption``; ``failed``: it does not move."""

    picture: Path | None
    caption: str
    failed: bool


def write_small_multiples(cells: Sequence[SheetCell], columns: int | None, path: Path) -> None:
    """Write ``cells`` as one PNG, in rows of so many ``columns`` (None: about square)."""
    from PIL import Image, ImageDraw

    from movimentum.rendering.faces import plain

    pictures = [None if cell.picture is None else Image.open(cell.picture).convert("RGB") for cell in cells]
    sizes = [picture.size for picture in pictures if picture is not None] or [(4, 3)]
    high = round(WIDTH * max(height / width for width, height in sizes))
    many = columns or max(1, math.ceil(math.sqrt(len(cells) * (high + CAPTION) / WIDTH)))
    rows = math.ceil(len(cells) / many)
    sheet = Image.new("RGB", (many * (WIDTH + GAP) + GAP, rows * (high + CAPTION + GAP) + GAP), PAPER)
    pen, font = ImageDraw.Draw(sheet), plain(13)
    for k, (cell, picture) in enumerate(zip(cells, pictures, strict=True)):
        x, y = GAP + k % many * (WIDTH + GAP), GAP + k // many * (high + CAPTION + GAP)
        if picture is None:
            pen.rectangle((x, y, x + WIDTH - 1, y + high - 1), fill=BLANK)
        else:
            scale = min(WIDTH / picture.width, high / picture.height)
            small = picture.resize(
                (round(picture.width * scale), round(picture.height * scale)), Image.Resampling.LANCZOS
            )
            sheet.paste(small, (x + (WIDTH - small.width) // 2, y + (high - small.height) // 2))
        pen.rectangle((x, y, x + WIDTH - 1, y + high - 1), outline=FAILED if cell.failed else (200, 200, 200))
        pen.text((x + 3, y + high + 3), cell.caption, fill=FAILED if cell.failed else INK, font=font)
    sheet.save(path, "PNG")
