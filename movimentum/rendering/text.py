"""Text as coverage masks, in fonts that have its characters (see `rendering.faces`)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw, ImageFilter  # slow: this module is imported only if there is text

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.model import TextMark
from movimentum.drawing.picture_options import MAX_SPRITE_PIXELS
from movimentum.drawing.style import MIDDLE, SLANT
from movimentum.drawing.texts import written
from movimentum.errors import ScriptError
from movimentum.geometry import Affine
from movimentum.rendering.faces import REPLACEMENT, missing
from movimentum.rendering.layout import laid_out, width_of
from movimentum.rendering.sprites import Sprite, outline_of
from movimentum.scene.model import Thing
from movimentum.solver.poses import Poses
from movimentum.source import Span
from movimentum.things.kinds.label import LABEL

_LONGEST = 10_000  # characters: what follows is measured with care, but the measuring itself costs


def text_sprite(text: str, height: float, magnification: float, span: Span | None = None) -> Sprite | None:
    """``text`` as a coverage whose baseline starts at the local origin; None if nothing of it is visible.

    ``height`` is the font's size in local units, ``magnification`` canvas pixels per local unit. A text too large to
    be drawn is a `ScriptError` with ``limit/pixels``.
    """
    pixels = max(1.0, height * magnification)
    if len(text) > _LONGEST or len(text) * pixels * pixels > MAX_SPRITE_PIXELS:
        raise ScriptError([_too_large(span)])
    pieces = [
        (
            part.x * pixels,
            -part.rise * pixels,
            part.text,
            part.face.at(max(1.0, part.size * pixels), joined=part.joined),
        )
        for part in laid_out(text)
    ]
    if not pieces:
        return None
    draw = ImageDraw.Draw(Image.new("L", (1, 1)))
    boxes = [draw.textbbox((x, y), piece, font, anchor="ls") for x, y, piece, font in pieces]
    left, top = (math.floor(min(box[side] for box in boxes)) for side in (0, 1))
    right, bottom = (math.ceil(max(box[side] for box in boxes)) for side in (2, 3))
    left, top, right, bottom = left - 2, top - 2, right + 2, bottom + 2  # the clear rim
    if (right - left) * (bottom - top) > MAX_SPRITE_PIXELS:
        raise ScriptError([_too_large(span)])
    mask = Image.new("L", (right - left, bottom - top), 0)
    pen = ImageDraw.Draw(mask)
    for x, y, piece, font in pieces:
        pen.text((x - left, y - top), piece, 255, font, anchor="ls")
    if mask.getbbox() is None:
        return None
    unit = height / pixels
    return Sprite(mask, Affine(unit, 0.0, unit * left, 0.0, -unit, -unit * top), outline_of(np.asarray(mask)))


@lru_cache(maxsize=512)
def written_sprite(
    text: str, height: float, magnification: float, align: str, italic: bool, span: Span | None = None
) -> Sprite | None:
    """`text_sprite` for a text that changes, whose local origin is where ``align`` says: at the left, the centre or the
    right of its baseline, or in the middle of its letters. Enormous letters have fewer pixels than are asked for.
    """
    pixels = min(height * magnification, math.sqrt(MAX_SPRITE_PIXELS / 4.0 / max(1, len(text))))
    return aligned(text_sprite(text, height, pixels / height, span), text, height, align, italic)


def aligned(sprite: Sprite | None, text: str, height: float, align: str, italic: bool) -> Sprite | None:
    """A text moved so that its origin is where ``align`` says, and slanted if it is ``italic``."""
    if sprite is None:
        return None
    if italic:
        sprite = Sprite(sprite.image, Affine(1.0, SLANT, 0.0, 0.0, 1.0, 0.0) @ sprite.to_local, sprite.outline)
    if align != "left":
        part = 1.0 if align == "right" else 0.5
        down = -MIDDLE * height if align == "middle" else 0.0
        sprite = sprite.moved(-part * height * width_of(text), down)
    return sprite


def longest(mark: TextMark, poses: Poses) -> list[tuple[float, float]]:
    """The local corners of a box that holds a label whose text changes, in all frames of ``poses``."""
    texts = set(written(mark.pieces, mark.paint.thing, poses))
    wide = mark.height * max(map(width_of, texts), default=0.0)
    x, y = mark.start
    left = x - {"left": 0.0, "center": 0.5, "right": 1.0}[mark.align] * wide
    low, high = y - 0.25 * mark.height, y + 0.95 * mark.height
    return [(left, low), (left + wide, low), (left + wide, high), (left, high)]


def halo(sprite: Sprite) -> Sprite:
    """The same text, a pixel wider on every side: under the text, it keeps it readable on any background."""
    mask = sprite.image.filter(ImageFilter.MaxFilter(3))
    return Sprite(mask, sprite.to_local, outline_of(np.asarray(mask)))


def lettering(things: Iterable[Thing]) -> Iterator[Diagnostic]:
    """A warning for each label with characters that no available font has."""
    for thing in things:
        if thing.hidden or not (lacking := missing(thing.text or "")):
            continue
        named = ", ".join(f"`{c}` (U+{ord(c):04X})" if c.isprintable() else f"U+{ord(c):04X}" for c in lacking[:8])
        what = "label" if thing.kind is LABEL else "text of"
        yield Diagnostic(
            "asset/glyph",
            Severity.WARNING,
            f"no font has {named}{' and more' if len(lacking) > 8 else ''} of the {what} `{thing.name}`;"
            f" `{REPLACEMENT}` is drawn instead",
            thing.span,
            helps=("install a font that has it (Noto Sans has nearly everything), or write it differently",),
        )


def _too_large(span: Span | None) -> Diagnostic:
    return Diagnostic("limit/pixels", Severity.ERROR, "the text is too large to be drawn", span, helps=("shorten it",))
