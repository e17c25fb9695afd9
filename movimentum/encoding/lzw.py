"""LZW as GIF has it: Pillow's coder, and what it leaves undone.

Pillow's coder is fast, but takes 8 bits a pixel to begin with, and empties its table of strings as soon as that is
full. If there are fewer colours, codes are renumbered here. And when little of a picture is left, it is shorter to keep
the full table, to the end or for a while, which no reader minds: only what comes after it is coded anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import GifImagePlugin, Image

Codes = NDArray[np.int64]

_CLEAR, _END, _FIRST, _FULL = 256, 257, 258, 4096
_RUN = _FULL - _FIRST + 1  # codes between two clear codes; the table is full before the last of them
_MOST = 3  # clear codes: of longer pictures, the end is too small a part
_ALIKE = 1.005  # ways that are so near the shortest are tried, too
_LONGEST = 200_000  # pixels that are coded anew: more take longer than drawing them
_PARTS, _FINEST = 6, 0.01  # places where a table that was kept may be emptied after all
_SIDE = 65535  # pixels of a row, for Pillow
LARGE = 200_000  # pixels: a picture that is coded once, in the way that a part of it tells
_LOOKED_AT, _STRIPS = 12_000, 6  # pixels that tell which ways of a large picture are tried in full, and where they are


def image_block(ways: Sequence[NDArray[np.uint8]]) -> bytes:
    """The compressed pixels (code size, sub-blocks, terminator) of a GIF: of that of ``ways`` (rows, columns) to say
    the same that is shortest.
    """
    if len(ways) > 1 and ways[0].size > 2 * _LOOKED_AT:
        parts = [_by_pillow(_rows_of(indices)) for indices in ways]
        best = sorted(range(len(ways)), key=lambda k: len(parts[k]))
        ways = [ways[k] for k in best[: 1 if ways[0].size > LARGE else 4]]
    coded = sorted(((_by_pillow(indices), indices) for indices in ways), key=lambda each: len(each[0]))
    stream, indices = coded[0]
    bits = max(2, int(indices.max()).bit_length())
    clears = (8 * len(stream) - 9 - 12) // _PERIOD
    if 0 < clears <= _MOST:
        alike = [each for each in coded[: 2 if clears == 1 else 1] if len(each[0]) <= _ALIKE * len(stream)]
        kept = [_with_full_table(_runs(each), way) for each, way in alike]
        stream = _packed(min(kept, key=_size), bits)
    elif bits < 8:
        stream = _packed(_runs(stream), bits)
    blocks = [bytes((len(part),)) + part for at in range(0, len(stream), 255) if (part := stream[at : at + 255])]
    return bytes((bits,)) + b"".join(blocks) + b"\0"


def _rows_of(indices: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Some strips of a picture, one above the other."""
    rows, columns = indices.shape
    height = max(1, _LOOKED_AT // _STRIPS // columns)
    first = np.linspace(0, max(0, rows - height), _STRIPS).astype(np.intp)
    return np.ascontiguousarray(indices[(first[:, None] + np.arange(min(height, rows))).ravel()])


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


def _by_pillow(indices: NDArray[np.uint8]) -> bytes:
    try:
        _, bits, *parts, end = GifImagePlugin.getdata(Image.fromarray(indices), interlace=0)
    except OSError as error:
        raise MemoryError from error  # the coder has no other trouble
    data = b"".join(parts)
    if bits != b"\x08" or end != b"\0":
        raise AssertionError("Pillow wrote a GIF that cannot be read")
    blocks: list[bytes] = []
    at = 0
    while at < len(data):
        blocks.append(data[at + 1 : at + 1 + data[at]])
        at += data[at] + 1
    return b"".join(blocks)


def _runs(stream: bytes) -> list[Codes]:
    """The codes between clear codes, and to the end."""
    data = np.frombuffer(stream + b"\0\0\0", dtype=np.uint8).astype(np.int64)
    widths = _widths(_RUN + 1, 8)
    offsets = np.cumsum(widths) - widths
    found: list[Codes] = []
    while True:
        where = 9 + len(found) * _PERIOD + offsets
        where = where[where + 9 <= 8 * len(stream)]
        at = where >> 3
        words = (data[at] | data[at + 1] << 8 | data[at + 2] << 16) >> (where & 7)
        codes = words & (1 << widths[: len(where)]) - 1
        stops = np.flatnonzero((codes == _END) | (codes == _CLEAR))
        if not len(stops):
            raise AssertionError("Pillow wrote a GIF that cannot be read")
        found.append(codes[: stops[0]])
        if codes[stops[0]] == _END:
            return found


def _packed(runs: Sequence[Codes], bits: int) -> bytes:
    """The stream of ``runs``, with codes for pixels of ``bits``."""
    codes, widths = [np.array([_CLEAR])], [np.array([bits + 1])]
    for number, run in enumerate(runs):
        codes.append(np.append(run, _END if number == len(runs) - 1 else _CLEAR))
        widths.append(_widths(len(run) + 1, bits))
    every = np.concatenate(codes)
    every -= np.where(every >= _CLEAR, _CLEAR - (1 << bits), 0)
    place = np.arange(12)
    shown = place < np.concatenate(widths)[:, None]
    return np.packbits((every[:, None] >> place & 1)[shown].astype(np.uint8), bitorder="little").tobytes()


def _size(runs: Sequence[Codes]) -> int:
    """The bits of ``runs``."""
    return sum(int(_widths(len(run) + 1, 8).sum()) for run in runs)


def _with_full_table(runs: list[Codes], indices: NDArray[np.uint8]) -> list[Codes]:
    """The same pixels, with the last full table kept to the end or for a while, if that is shorter."""
    if len(runs) == 1:
        return runs
    *before, kept, last = runs
    _, lengths = _strings(last)
    left = int(np.array(lengths)[last].sum())
    if left > _LONGEST:
        return runs
    pixels = indices.tobytes()[-left:]
    first, lengths = _strings(kept)
    found = np.array(_coded(pixels, kept, first))
    at = np.cumsum(np.array(lengths)[found])
    best, least, where, step = [kept, last], _size([kept, last]), 0.0, 1.0 / _PARTS
    tries = [part * step for part in range(1, _PARTS + 1)]
    while step > _FINEST:
        for share in tries:
            count = round(share * len(found))
            rest = left - int(at[count - 1])
            if not count or rest > _SIDE:
                continue
            after = _runs(_by_pillow(np.frombuffer(pixels[left - rest :], dtype=np.uint8)[None])) if rest else []
            tried = [np.concatenate([kept, found[:count]]), *after]
            if (size := _size(tried)) < least:
                best, least, where = tried, size, share
        step /= 2.0
        tries = [share for share in (where - step, where + step) if 0.0 < share < 1.0]
    return [*before, *best]


def _strings(codes: Codes) -> tuple[list[int], list[int]]:
    """The first pixel and the length of the string of each code that these codes define."""
    first, length = [*range(256), 0, 0], [1] * _FIRST
    each: list[int] = codes.tolist()
    for code in each:
        first.append(first[code])
        length.append(length[code] + 1)
    return first, length


def _coded(pixels: bytes, kept: Codes, first: list[int]) -> list[int]:
    """The codes of ``pixels`` with the table that ``kept`` has filled; ``first``: of its strings."""
    codes: list[int] = kept.tolist()
    table = {codes[k] << 8 | first[codes[k + 1]]: _FIRST + k for k in range(_RUN - 1)}
    get = table.get
    found: list[int] = []
    code = pixels[0]
    for pixel in pixels[1:]:
        longer = get(code << 8 | pixel)
        if longer is None:
            found.append(code)
            code = pixel
        else:
            code = longer
    return [*found, code]
