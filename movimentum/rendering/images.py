"""Image files: refused early if they are too large or unreadable, otherwise read as straight 8-bit RGBA.

Only a few formats are read. Others would bring interpreters (EPS starts Ghostscript) and poorly tested decoders. Only
the first picture of an animated file is used. A camera's orientation tag is obeyed.
"""

from __future__ import annotations

import os
import stat
import warnings
from collections.abc import Generator, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.picture_options import MAX_SPRITE_BYTES, MAX_SPRITE_PIXELS
from movimentum.errors import ScriptError
from movimentum.records import dataclass, replace
from movimentum.source import Span, drawing_file

FORMATS = ("PNG", "GIF", "JPEG", "WEBP", "BMP", "TIFF")
"""The formats that a picture may have, with Pillow's names; judged by its content, not by its file name."""

_WIDTH, _HEIGHT, _ORIENTATION = 0x0100, 0x0101, 0x0112
_TURNS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}


def is_drawing(path: str) -> bool:
    """Whether a picture's path names an SVG, or with ``#id`` an element of one."""
    return drawing_file(path).lower().endswith(".svg")


def image_size(path: str, span: Span | None = None) -> tuple[int, int] | Diagnostic:
    """(width, height) of an image file from its header alone, as it will be drawn; or what is wrong with it.

    The diagnostic is ``asset/missing``, ``asset/unreadable`` or ``limit/pixels``, at ``span``. An SVG has others, too
    (see `rendering.rasters`).
    """
    if is_drawing(path):
        from movimentum.rendering.rasters import drawing_size

        found = drawing_size(path)
        return replace(found, span=span) if isinstance(found, Diagnostic) else found
    try:
        with picture_file(path, span=span) as image:
            width, height = image.size
            orientation = _orientation(image)
            if image.format == "TIFF":  # in older Pillows its size is turned only with its pixels
                tags: dict[int, int] = getattr(image, "tag_v2", {})
                width, height = tags.get(_WIDTH, width), tags.get(_HEIGHT, height)
                orientation = tags.get(_ORIENTATION, 1)
            return (height, width) if orientation in (5, 6, 7, 8) else (width, height)
    except ScriptError as error:
        return error.diagnostics[0]


def load_rgba(path: str, span: Span | None = None) -> Image.Image:
    """The first picture of a file as straight 8-bit RGBA; `ScriptError` with the diagnostics of `image_size`."""
    with _upright(path, span) as image:
        rgba = Image.new("RGBA", image.size)
        for top, strip in _strips(image, 1):
            rgba.paste(strip, (0, top))
        return rgba


@dataclass(frozen=True, slots=True)
class Loaded:
    """A premultiplied picture (mode RGBa), each pixel the mean of ``factor`` x ``factor`` of the file's, whose size in
    pixels is ``size`` (at the right and lower edge of fewer).
    """

    image: Image.Image
    size: tuple[int, int]
    factor: int


def load_premultiplied(path: str, magnification: float = 1.0, span: Span | None = None) -> Loaded:
    """The first picture of a file, to be drawn ``magnification`` times as large; `ScriptError` as for `image_size`.

    Most of a large reduction is a plain mean, which is as good as a better filter and much faster. It is done here,
    strip by strip: besides the decoder's own copy, memory never holds more than the drawing needs.
    """
    with _upright(path, span) as image:
        width, height = image.size
        shrink = min(width / max(1, round(width * magnification)), height / max(1, round(height * magnification)))
        factor = max(1, int(shrink / 3.0))
        small = Image.new("RGBa", (-(-width // factor), -(-height // factor)))
        for top, strip in _strips(image, factor):
            premultiplied = strip.convert("RGBa")
            small.paste(premultiplied.reduce(factor) if factor > 1 else premultiplied, (0, top // factor))
        return Loaded(small, (width, height), factor)


STRIP_PIXELS = 4_000_000
"""Pixels that are converted at a time: conversions through floats take 30 bytes for each."""


def _strips(image: Image.Image, multiple: int) -> Iterator[tuple[int, Image.Image]]:
    """(first row, rows as straight RGBA) of an image from top to bottom, ``multiple`` of so many rows at a time."""
    peak = _peak(image)
    rows = multiple * max(1, STRIP_PIXELS // (image.width * multiple))
    for top in range(0, image.height, rows):
        whole = rows >= image.height
        part = image if whole else image.crop((0, top, image.width, min(image.height, top + rows)))
        yield top, _as_rgba(part, peak)


@contextmanager
def _upright(path: str, span: Span | None) -> Generator[Image.Image, None, None]:
    """The decoded picture in its file's own mode, turned as its camera says."""
    with picture_file(path, span=span) as image:
        orientation = _orientation(image)
        image.load()
        turn = _TURNS.get(orientation)
        yield image if turn is None else image.transpose(turn)


def _orientation(image: Image.Image) -> int:
    """The camera's orientation, 1 to 8, without loading pixels (a PNG may store it after them: then it is 1)."""
    if image.format == "TIFF" or (image.format == "PNG" and "exif" not in image.info):
        return 1  # Pillow turns a TIFF itself
    try:
        value = image.getexif().get(_ORIENTATION, 1)
    except (OSError, SyntaxError, ValueError, TypeError, KeyError):
        return 1
    return value if value in _TURNS else 1


def _peak(image: Image.Image) -> float:
    """The largest value of a grey picture of 16 or 32 bits; 0 for other pictures."""
    if not (image.mode.startswith("I") or image.mode == "F"):
        return 0.0
    rows = max(1, STRIP_PIXELS // image.width)
    boxes = ((0, top, image.width, min(image.height, top + rows)) for top in range(0, image.height, rows))
    return max(float(_grey(image.crop(box)).max(initial=0.0)) for box in boxes)


def _grey(image: Image.Image) -> NDArray[np.float64]:
    return np.nan_to_num(np.asarray(image).astype(np.float64), posinf=0.0, neginf=0.0)


def _as_rgba(image: Image.Image, peak: float) -> Image.Image:
    """Straight 8-bit RGBA; ``peak`` is the largest value of the whole picture, of which ``image`` may be a part."""
    if image.mode.startswith("I") or image.mode == "F":  # 16 or 32 bits of grey
        values = _grey(image)
        if image.mode == "F":
            values *= 255.0 if peak <= 1.0 else 1.0
        elif image.mode != "I" or peak > 255.0:
            values /= 257.0
        grey = np.rint(np.clip(values, 0.0, 255.0)).astype(np.uint8)
        return Image.fromarray(grey).convert("RGBA")
    if image.mode in ("CMYK", "YCbCr", "LAB", "HSV"):
        image = image.convert("RGB")
    return image.convert("RGBA")


@contextmanager
def picture_file(
    path: str, formats: tuple[str, ...] = FORMATS, *, span: Span | None = None
) -> Generator[Image.Image, None, None]:
    """The only way in which image files are opened: the header is read and within the limits, the pixels are not read
    yet.

    Every failure inside is a `ScriptError`.
    """
    try:
        status = os.stat(path)
        if not stat.S_ISREG(status.st_mode):  # a folder, a pipe that would never end, a device
            what = "a folder, not an image" if os.path.isdir(path) else "not a regular file"
            raise _error("asset/unreadable", f"`{path}` is {what}", span)
        if status.st_size > MAX_SPRITE_BYTES:  # some decoders read a whole file before they look at it
            raise _too_large(path, f"{status.st_size:,} bytes", span)
        with warnings.catch_warnings():
            # Pillow warns about pictures above a limit of its own; ours is lower and says more
            warnings.simplefilter("ignore")
            with Image.open(path, formats=formats) as image:
                width, height = image.size
                if width * height > MAX_SPRITE_PIXELS:
                    raise _too_large(path, f"{width} x {height} = {width * height:,} pixels", span)
                yield image
    except (ScriptError, KeyboardInterrupt):
        raise
    except Image.DecompressionBombError as error:
        raise _too_large(path, "too many pixels", span) from error
    except (FileNotFoundError, NotADirectoryError) as error:
        raise _error("asset/missing", f"there is no file `{path}`", span) from error
    except UnidentifiedImageError as error:
        raise _error("asset/unreadable", f"`{path}` is not an image in a supported format", span, _CONVERT) from error
    except MemoryError as error:
        raise _too_large(path, "more than fits into memory", span) from error
    except Exception as error:  # decoders of broken files raise nearly anything
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise _error("asset/unreadable", f"`{path}` cannot be read: {reason or type(error).__name__}", span) from error


_CONVERT = "convert it to PNG, GIF, JPEG, WebP, BMP or TIFF"


def _error(code: str, message: str, span: Span | None, *helps: str) -> ScriptError:
    return ScriptError([Diagnostic(code, Severity.ERROR, message, span, helps=helps)])


def _too_large(path: str, size: str, span: Span | None) -> ScriptError:
    return ScriptError(
        [
            Diagnostic(
                "limit/pixels",
                Severity.ERROR,
                f"the image `{path}` is too large: {size}",
                span,
                notes=(f"the limit for one image is {MAX_SPRITE_PIXELS:,} pixels in {MAX_SPRITE_BYTES:,} bytes",),
                helps=("make the image smaller",),
            )
        ]
    )
