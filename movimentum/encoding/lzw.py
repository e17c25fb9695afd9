"""LZW for GIF: Pillow's coder always starts with 8 bits a pixel, so codes are renumbered here if there are fewer
colours.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Codes = NDArray[np.int64]
Indices = NDArray[np.uint8]

_CLEAR, _END, _FIRST, _FULL = 256, 257, 258, 4096
_RUN = _FULL - _FIRST + 1  # codes between two clear codes; the table is full before the last of them


def stream(indices: Indices) -> bytes:
    """The codes of a picture (rows, columns) as Pillow's coder writes them, for pixels of 8 bits."""
    rows, columns = indices.shape
    image = Image.frombuffer("L", (columns, rows), np.ascontiguousarray(indices), "raw", "L", 0, 1)
    try:
        data = image.tobytes("gif", "L", 8, 0)  # not interlaced
    except RuntimeError as error:
        raise MemoryError from error  # the coder has no other trouble
    return b"".join([data[at + 1 : at + 1 + data[at]] for at in range(0, len(data), 256)])


def image_block(indices: Indices, coded: bytes | None = None) -> bytes:
    """The compressed pixels (code size, sub-blocks, terminator) of a GIF; ``coded``: their `stream`, if it is known."""
    coded = stream(indices) if coded is None else coded
    bits = max(2, int(indices.max()).bit_length())
    if bits < 8:
        coded = _packed(_runs(coded), bits)
    blocks = [bytes((len(part),)) + part for at in range(0, len(coded), 255) if (part := coded[at : at + 255])]
    return bytes((bits,)) + b"".join(blocks) + b"\0"


@cache
def _growing(bits: int) -> Codes:
    known = (1 << bits) + 2 + np.maximum(np.arange(_FULL) - 1, 0)
    return np.minimum(12, 1 + np.floor(np.log2(known)).astype(np.int64))


def _widths(count: int, bits: int) -> Codes:
    """(count,) how many bits each code after a clear code has."""
    widths = _growing(bits)[:count]
    return widths if count <= _FULL else np.concatenate([widths, np.full(count - _FULL, 12)])


_PERIOD = int(_widths(_RUN + 1, 8).sum())
"""Bits from one clear code to the end of the next."""


def _runs(coded: bytes) -> list[Codes]:
    """The codes between clear codes, and to the end."""
    data = np.frombuffer(coded + b"\0\0\0", dtype=np.uint8).astype(np.int64)
    widths = _widths(_RUN + 1, 8)
    offsets = np.cumsum(widths) - widths
    found: list[Codes] = []
    while True:
        where = 9 + len(found) * _PERIOD + offsets
        where = where[where + 9 <= 8 * len(coded)]
        at = where >> 3
        words = (data[at] | data[at + 1] << 8 | data[at + 2] << 16) >> (where & 7)
        codes = words & (1 << widths[: len(where)]) - 1
        stops = np.flatnonzero((codes == _END) | (codes == _CLEAR))
        if not len(stops):
            raise AssertionError("Pillow wrote a GIF that cannot be read")
        found.append(codes[: stops[0]])
        if codes[stops[0]] == _END:
            return found


def _packed(runs: list[Codes], bits: int) -> bytes:
    """The stream of ``runs``, with codes for pixels of ``bits``."""
    codes, widths = [np.array([_CLEAR])], [np.array([bits + 1])]
    for number, run in enumerate(runs):
        codes.append(np.append(run, _END if number == len(runs) - 1 else _CLEAR))
        widths.append(_widths(len(run) + 1, bits))
    every = np.concatenate(codes)
    every -= np.where(every >= _CLEAR, _CLEAR - (1 << bits), 0)
    each = np.unpackbits(every.astype("<u2").view(np.uint8), bitorder="little").reshape(-1, 16)
    return np.packbits(each[_MASKS[np.concatenate(widths)]], bitorder="little").tobytes()


_MASKS = np.arange(16) < np.arange(13)[:, None]
"""[width]: which of 16 bits a code of so many has."""
