"""SVG drawings to pixels, by resvg in a process of its own, so that it cannot hang or crash this one.

Each drawing is rasterised once, at the size at which it is shown.
"""

from __future__ import annotations

import io
import subprocess
import sys
from functools import lru_cache
from importlib.util import find_spec

import numpy as np
from PIL import Image

from movimentum.diagnostics import Diagnostic
from movimentum.drawing.picture_options import MAX_SPRITE_PIXELS
from movimentum.errors import ScriptError
from movimentum.rendering.drawings import Drawing2D, centre_by_shape, cut, drawing, element_of, fault, id_of

SECONDS = 20.0
"""How long drawing one element may take."""
_FINE = 1600
"""Pixels of the longer side of the picture in which an element's outline is measured."""
_WORKER = (
    "import sys, resvg_py\n"
    "text = sys.stdin.buffer.read().decode('utf-8')\n"
    "fonts = '<text' in text or ':text' in text\n"
    "sys.stdout.buffer.write(bytes(resvg_py.svg_to_bytes(svg_string=text, skip_system_fonts=not fonts)))\n"
)


def drawing_size(path: str) -> tuple[int, int] | Diagnostic:
    """(width, height) of a drawing in whole pixels, or what is wrong with it or its element."""
    try:
        _need_library(path)
        return drawing(path).pixels
    except ScriptError as error:
        return error.diagnostics[0]


def element_centre(path: str, name: str) -> tuple[float, float] | Diagnostic:
    """The centre of an element's bounding box in its drawing's pixels, y down; or what is wrong."""
    try:
        _need_library(path)
        made = drawing(path)
        element = element_of(made, name)
        return centre_by_shape(made, element) or _measured(made, name)
    except ScriptError as error:
        return error.diagnostics[0]


def load_drawing(path: str, magnification: float, finer: float = 1.0) -> tuple[Image.Image, tuple[int, int]]:
    """A drawing, or its element, premultiplied, ``magnification`` times as large, ``finer`` pixels where there is room;
    and its own size in pixels.
    """
    _need_library(path)
    made, name = drawing(path), id_of(path)
    width, height = made.pixels
    wide, high = max(1, round(width * magnification)), max(1, round(height * magnification))
    if wide * high > MAX_SPRITE_PIXELS:
        message = f"the drawing `{path}` is shown too large: {wide:,} x {high:,} pixels"
        raise fault("limit/pixels", message, f"the limit is {MAX_SPRITE_PIXELS:,} pixels: a smaller `.scale`")
    finer = max(1.0, min(finer, (MAX_SPRITE_PIXELS / (wide * high)) ** 0.5 * 0.99))
    image = _drawn(made, name, round(wide * finer), round(high * finer))
    if image.getchannel("A").getbbox() is None:
        raise _empty(made, name)
    return image.convert("RGBa"), (width, height)


def _empty(made: Drawing2D, name: str | None) -> ScriptError:
    what = f"`{made.path}`" if name is None else f"`#{name}` of `{made.path}`"
    help_ = "is it hidden, outside the page, or only defined for others to use?"
    return fault("asset/element", f"nothing of {what} is drawn", help_)


def _measured(made: Drawing2D, name: str) -> tuple[float, float]:
    """The middle of everything that is drawn of an element, to about a twentieth of a pixel."""
    width, height = made.pixels
    fine = min(8.0, max(1.0, _FINE / max(width, height)))
    wide, high = round(width * fine), round(height * fine)
    alpha = np.asarray(_drawn(made, name, wide, high).getchannel("A"), dtype=np.float64) / 255.0
    if not alpha.any():
        raise _empty(made, name)

    def middle(most: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        covered = np.flatnonzero(most)
        first, last = int(covered[0]), int(covered[-1])
        return (first + 1.0 - float(most[first]) + last + float(most[last])) / 2.0

    x, y = middle(alpha.max(axis=0)), middle(alpha.max(axis=1))
    return round(x * width / wide, 3), round(y * height / high, 3)


@lru_cache(maxsize=64)
def _drawn(made: Drawing2D, name: str | None, width: int, height: int) -> Image.Image:
    text = cut(made, name, width, height)
    try:
        done = subprocess.run(
            [sys.executable, "-I", "-c", _WORKER],
            input=text.encode("utf-8"),
            capture_output=True,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        message = f"drawing `{made.path}` takes longer than {SECONDS:.0f} seconds"
        raise fault("limit/drawing", message, "make it simpler, or draw it as PNG") from error
    if done.returncode != 0:
        output = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise fault("asset/unreadable", f"`{made.path}` cannot be drawn: {output[-1] if output else 'it crashed'}")
    with Image.open(io.BytesIO(done.stdout), formats=("PNG",)) as image:
        return image.convert("RGBA")


def _need_library(path: str) -> None:
    if find_spec("resvg_py") is None:
        message = f"`{path}` is an SVG, and the library that draws it is not installed"
        raise fault("asset/needs-svg", message, "pip install 'movimentum[svg]'")
