"""Notes about a GIF: what the format cannot show, and the file's size."""

from __future__ import annotations

from collections.abc import Callable
from decimal import ROUND_FLOOR, Context
from fractions import Fraction
from math import ceil, floor, sqrt
from pathlib import Path

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.encoding.gif import ANIMATED_AREA, FASTEST, SEEN, GifWriter
from movimentum.encoding.palette import MOST
from movimentum.terminal import typed
from movimentum.text import counted

HEAVY, AREA = "render/weight", "render/gif-area"
FIRST = "output/one-picture"
RASTER = "asset/raster"
"""Of a drawing whose outlines a file cannot hold."""
_HEAVY = 1_000_000  # bytes
_FOUR_DIGITS, _SHRUNK = Context(prec=4, rounding=ROUND_FLOOR), 0.99
_SLOWEST = 5  # frames a second: fewer are no film
_FEW = 25  # pixels: fewer wrong ones are not seen


def only_first(frames: range, drawn: range, path: Path) -> list[Diagnostic]:
    """Of several frames that somebody asks for in one picture."""
    if len(drawn) == len(frames):
        return []
    what = f"`{path.name}` is one picture, and {counted(len(frames), 'frame')} are asked for: this is frame {drawn[0]}"
    numbered = Choose.OUTPUT.to(typed(path.with_name(f"{path.stem}-%04d{path.suffix}")))
    return [Diagnostic(FIRST, Severity.NOTE, what, helps=(numbered, Choose.OUTPUT.to(typed(path.with_suffix(".gif")))))]


def too_fast(fps: Fraction) -> Diagnostic:
    """Of more frames a second than are shown."""
    return Diagnostic(
        "render/gif-rate",
        Severity.WARNING,
        f"GIF shows at most {FASTEST} frames a second: {float(fps):g} are thinned out to {FASTEST}",
        notes=("browsers slow faster films down to 10 frames a second",),
        helps=(Choose.FPS.to(FASTEST), Choose.OUTPUT.to("out.webp")),
    )


def colors(writer: GifWriter, lossy: int, path: Path) -> list[Diagnostic]:
    """Of pixels that are not as they were drawn, and are seen not to be; and of half-transparent ones."""
    found: list[Diagnostic] = []
    if writer.missed > _FEW and writer.worst > lossy + SEEN:
        what = f"{counted(writer.missed, 'pixel')} of a frame are off by up to {writer.worst} of 255"
        message = f"a GIF has {MOST} colours, and this film has more: {what}"
        found.append(Diagnostic("render/gif-colors", Severity.WARNING, message, helps=(_as_webp(path),)))
    if writer.cut:
        message = "a pixel of a GIF is opaque or clear: edges that were half-transparent are jagged"
        notes = (
            f"{counted(writer.cut, 'pixel')} of a frame",
            Advised(Choose.BACKGROUND.to(), ": the colour that edges are blended with"),
        )
        helps = (Choose.BACKGROUND.to("white"), _as_webp(path))
        found.append(Diagnostic("render/gif-alpha", Severity.WARNING, message, notes=notes, helps=helps))
    return found


def weight(size: int, path: Path, frames: int, picture: tuple[int, int], fps: Fraction, lossy: int) -> list[Diagnostic]:
    """The size of a large file, and ways to make it smaller."""
    if size <= _HEAVY:
        return []
    each = f"{counted(frames, 'frame')} of {picture[0]} x {picture[1]} pixels, {size / frames / 1000:.1f} kB each"
    helps = (
        *(() if lossy else (Choose.LOSSY.to(8),)),
        Choose.OUTPUT.to(typed(path.with_suffix(".mp4"))),
        Choose.FPS.to(max(1, round(fps / 2))),
        Choose.SCALE.to("0.7"),
    )
    return [Diagnostic(HEAVY, Severity.NOTE, f"`{path.name}` has {size / 1e6:.1f} MB: {each}", helps=helps)]


def area(path: Path, frames: int, size: tuple[int, int], scale: float, fps: Fraction) -> list[Diagnostic]:
    """The note that a GIF has too many pixels for moving thumbnails, and what would help."""
    width, height = size
    if width * height * frames <= ANIMATED_AREA:
        return []
    smaller = largest_scale(lambda s: _at(size, s / scale), frames, scale, ANIMATED_AREA)
    slower = floor(fps * ANIMATED_AREA / (width * height * frames))
    whole = f"{counted(frames, 'frame')} of {width} x {height} pixels, {width * height * frames / 1e6:,.0f} megapixels"
    note = f"of GIFs over {ANIMATED_AREA // 10**6} megapixels, counted over all frames, Wikipedia shows only a still"
    helps = (Choose.SCALE.to(f"{smaller:.4g}"), *((Choose.FPS.to(slower),) if slower >= _SLOWEST else ()))
    return [Diagnostic(AREA, Severity.NOTE, f"`{path.name}` has {whole}", notes=(note,), helps=helps)]


def _at(size: tuple[int, int], factor: float) -> tuple[int, int]:
    """A picture's size, and a pixel for rounding."""
    width, height = (max(1, ceil(side * factor)) for side in size)
    return width, height


def largest_scale(size: Callable[[float], tuple[int, int]], frames: int, scale: float, most: int) -> float:
    """The largest scale that can be typed, up to ``scale``, at which ``frames`` pictures have no more than ``most``
    pixels together. ``size``: from a scale to a picture's width and height.
    """
    while True:
        width, height = size(scale)
        if width * height * frames <= most or width * height == 1:
            return scale
        scale = short(scale * min(_SHRUNK, sqrt(most / (width * height * frames))))


def short(scale: float) -> float:
    """A scale that can be typed, not larger."""
    return float(_FOUR_DIGITS.create_decimal(repr(scale)))


def _as_webp(path: Path) -> str:
    return Choose.OUTPUT.to(typed(path.with_suffix(".webp")))
