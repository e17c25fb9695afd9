"""Text as coverages, in fonts that have its characters (see `rendering.faces`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFilter  # slow: this module is imported only if there is text

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.options import MAX_SPRITE_PIXELS
from movimentum.errors import ScriptError
from movimentum.geometry import Affine
from movimentum.rendering.faces import REPLACEMENT, Face, missing, normal, runs
from movimentum.rendering.sprites import Sprite, outline_of
from movimentum.scene.model import Thing
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
    pieces = _laid_out(text, pixels)
    draw = ImageDraw.Draw(Image.new("L", (1, 1)))
    boxes = [draw.textbbox((x, 0), piece, font, anchor="ls") for x, piece, font in pieces]
    left, top = (round(min(box[side] for box in boxes)) for side in (0, 1))
    right, bottom = (round(max(box[side] for box in boxes)) for side in (2, 3))
    left, top, right, bottom = left - 2, top - 2, right + 2, bottom + 2  # the clear rim
    if (right - left) * (bottom - top) > MAX_SPRITE_PIXELS:
        raise ScriptError([_too_large(span)])
    mask = Image.new("L", (right - left, bottom - top), 0)
    pen = ImageDraw.Draw(mask)
    for x, piece, font in pieces:
        pen.text((x - left, -top), piece, 255, font, anchor="ls")
    if mask.getbbox() is None:
        return None
    unit = height / pixels
    return Sprite(mask, Affine(unit, 0.0, unit * left, 0.0, -unit, -unit * top), outline_of(np.asarray(mask)))


def _laid_out(text: str, pixels: float) -> list[tuple[float, str, Any]]:
    """The pieces of a text, each with its font and where it begins (pixels along the baseline)."""
    found: list[tuple[float, str, Any]] = []
    x = 0.0
    for face, piece in runs(normal(text)):
        font = face.at(pixels)
        found.append((x, piece, font))
        x += float(font.getlength(piece))
    return found or [(0.0, "", Face("").at(pixels))]


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
        yield Diagnostic(
            "asset/glyph",
            Severity.WARNING,
            f"no font has {named}{' and more' if len(lacking) > 8 else ''} of the label `{thing.name}`;"
            f" `{REPLACEMENT}` is drawn instead",
            thing.span,
            helps=("install a font that has it (Noto Sans has nearly everything), or write it differently",),
        )


def _too_large(span: Span | None) -> Diagnostic:
    return Diagnostic("limit/pixels", Severity.ERROR, "the text is too large to be drawn", span, helps=("shorten it",))
