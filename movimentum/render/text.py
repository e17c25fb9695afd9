"""Text as coverages, in the font that Pillow brings along."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont  # slow: this module is imported where there is text

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.geometry import Affine
from movimentum.render.options import MAX_SPRITE_PIXELS
from movimentum.render.sprites import Sprite, outline_of
from movimentum.source import Span

_LONGEST = 10_000  # characters: what follows is measured with care, but the measuring itself costs


def text_sprite(text: str, height: float, magnification: float, span: Span | None = None) -> Sprite | None:
    """``text`` as a coverage whose baseline starts at the local origin; None if nothing of it is visible.

    ``height`` is the font's size in local units, ``magnification`` canvas pixels per local unit. A text too large to
    be drawn is a `ScriptError` with ``limit/pixels``.
    """
    pixels = max(1.0, height * magnification)
    if len(text) > _LONGEST or len(text) * pixels * pixels > MAX_SPRITE_PIXELS:
        raise ScriptError([_too_large(span)])
    font = ImageFont.load_default(pixels)
    draw = ImageDraw.Draw(Image.new("L", (1, 1)))
    left, top, right, bottom = (round(edge) for edge in draw.textbbox((0, 0), text, font, anchor="ls"))
    left, top, right, bottom = left - 2, top - 2, right + 2, bottom + 2  # the clear rim
    if (right - left) * (bottom - top) > MAX_SPRITE_PIXELS:
        raise ScriptError([_too_large(span)])
    mask = Image.new("L", (right - left, bottom - top), 0)
    ImageDraw.Draw(mask).text((-left, -top), text, 255, font, anchor="ls")
    if mask.getbbox() is None:
        return None
    unit = height / pixels
    return Sprite(mask, Affine(unit, 0.0, unit * left, 0.0, -unit, -unit * top), outline_of(np.asarray(mask)))


def halo(sprite: Sprite) -> Sprite:
    """The same text, a pixel fatter on every side: laid under it, it keeps it readable on any ground."""
    mask = sprite.image.filter(ImageFilter.MaxFilter(3))
    return Sprite(mask, sprite.to_local, outline_of(np.asarray(mask)))


def _too_large(span: Span | None) -> Diagnostic:
    return Diagnostic("limit/pixels", Severity.ERROR, "the text is too large to be drawn", span, helps=("shorten it",))
