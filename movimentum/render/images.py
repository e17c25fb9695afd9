"""Image files: what is refused before it costs anything, and pictures as straight 8-bit RGBA.

Only the first picture of an animated file is used. A camera's orientation tag is obeyed.
"""

from __future__ import annotations

import os
import stat
import warnings
from collections.abc import Generator
from contextlib import contextmanager

import numpy as np
from PIL import Image, UnidentifiedImageError

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.render.options import MAX_SPRITE_PIXELS
from movimentum.source import Span

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


def image_size(path: str, span: Span | None = None) -> tuple[int, int] | Diagnostic:
    """(width, height) of an image file from its header alone, as it will be drawn; or what is wrong with it.

    The diagnostic is ``asset/missing``, ``asset/unreadable`` or ``limit/pixels``, at ``span``.
    """
    try:
        with _opened(path, span) as image:
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
    """The first picture of a file as straight 8-bit RGBA; `ScriptError` as `image_size` tells it."""
    with _opened(path, span) as image:
        orientation = _orientation(image)
        image.load()
        turn = _TURNS.get(orientation)
        rgba = _as_rgba(image)
        return rgba if turn is None else rgba.transpose(turn)


def _orientation(image: Image.Image) -> int:
    """The camera's orientation, 1 to 8, without loading pixels (a PNG may carry it behind them: then it is 1)."""
    if image.format == "TIFF" or (image.format == "PNG" and "exif" not in image.info):
        return 1  # Pillow turns a TIFF itself
    try:
        value = image.getexif().get(_ORIENTATION, 1)
    except (OSError, SyntaxError, ValueError, TypeError, KeyError):
        return 1
    return value if value in _TURNS else 1


def _as_rgba(image: Image.Image) -> Image.Image:
    if image.mode.startswith("I") or image.mode == "F":  # 16 or 32 bits of grey
        values = np.asarray(image).astype(np.float64)
        values = np.nan_to_num(values, posinf=0.0, neginf=0.0)
        peak = float(values.max(initial=0.0))
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
def _opened(path: str, span: Span | None) -> Generator[Image.Image, None, None]:
    """The file, its header read and within the limits; every failure inside is a `ScriptError`."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):  # a folder, a pipe that would never end, a device
            what = "a folder" if os.path.isdir(path) else "no regular file"
            raise _error("asset/unreadable", f"`{path}` is {what}, not an image", span)
        with warnings.catch_warnings():
            # Pillow warns about pictures above a limit of its own; ours is below it and says more
            warnings.simplefilter("ignore")
            with Image.open(path) as image:
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
        raise _error("asset/unreadable", f"`{path}` is in no image format that is known", span) from error
    except MemoryError as error:
        raise _too_large(path, "more than fits into memory", span) from error
    except Exception as error:  # decoders of broken files raise nearly anything
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise _error("asset/unreadable", f"`{path}` cannot be read: {reason or type(error).__name__}", span) from error


def _error(code: str, message: str, span: Span | None) -> ScriptError:
    return ScriptError([Diagnostic(code, Severity.ERROR, message, span)])


def _too_large(path: str, size: str, span: Span | None) -> ScriptError:
    return ScriptError(
        [
            Diagnostic(
                "limit/pixels",
                Severity.ERROR,
                f"the image `{path}` is too large: {size}",
                span,
                notes=(f"the limit for one image is {MAX_SPRITE_PIXELS:,} pixels",),
                helps=("make the image smaller",),
            )
        ]
    )
