"""LZW as GIF has it: Pillow's coder, and what it leaves undone.

Pillow's coder is fast, but takes 8 bits a pixel to begin with, and empties its table of strings as soon as that is
full. If there are fewer colours, codes are renumbered here. And when little of a picture is left, it is shorter to keep
the full table, to the end or for a while, which no reader minds: only what comes after it is coded anew.
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
_MOST = 3  # clear codes: of longer pictures, the end is too small a part
_LONGEST = 200_000  # pixels that are coded anew: more take longer than drawing them
_PARTS, _FINEST = 6, 0.01  # places where a table that was kept may be emptied after all
_SIDE = 65535  # pixels of a row, for Pillow


def stream(indices: Indices) -> bytes:
    """The codes of a picture (rows, columns) as Pillow's coder writes them, for pixels of 8 bits."""
    rows, columns = indices.shape
    image = Image.frombuffer("L", (columns, rows), np.ascontiguousarray(indices), "raw", "L", 0, 1)
    try:
        data = image.tobytes("gif", "L", 8, 0)  # not interlaced
    except RuntimeError as error:
        raise MemoryError from error  # the coder has no other trouble
    return b"".join([data[at + 1 : at + 1 + data[at]] for at in range(0, len(data), 256)])


def image_block(indices: Indices, coded: bytes | None = None, keep_table: bool = True) -> tuple[bytes, int | None]:
    """The compressed pixels (code size, sub-blocks, terminator) of a GIF, and how many bytes a full table saved (None:
    there is none, or too many).

    ``coded``: its `stream`, if it is known. ``keep_table``: look for what is shorter with a full table.
    """
    coded = stream(indices) if coded is None else coded
    bits = max(2, int(indices.max()).bit_length())
    saved = None
    if keep_table and 0 < (8 * len(coded) - 9 - 12) // _PERIOD <= _MOST:
        runs = _runs(coded)
        kept = _with_full_table(runs, indices)
        saved = (_size(runs) - _size(kept)) // 8
        if saved or bits < 8:
            coded = _packed(kept, bits)
    elif bits < 8:
        coded = _packed(_runs(coded), bits)
    blocks = [bytes((len(part),)) + part for at in range(0, len(coded), 255) if (part := coded[at : at + 255])]
    return bytes((bits,)) + b"".join(blocks) + b"\0", saved


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


def _size(runs: list[Codes]) -> int:
    """The bits of ``runs``."""
    return sum(int(_widths(len(run) + 1, 8).sum()) for run in runs)


def _with_full_table(runs: list[Codes], indices: Indices) -> list[Codes]:
    """The same pixels, with the last full table kept to the end or for a while, if that is shorter."""
    *before, kept, last = runs
    left = int(_Strings(last).lengths[last].sum())
    if left > _LONGEST:
        return runs
    pixels = indices.ravel()[-left:]
    table = _Strings(kept)
    found = table.parsed(pixels)
    at = np.cumsum(table.lengths[found])
    least, best = _size([last]), None
    where, step = 0.0, 1.0 / _PARTS
    tries = [part * step for part in range(1, _PARTS + 1)]
    while step > _FINEST:
        for share in tries:
            count = round(share * len(found))
            rest = left - int(at[count - 1])
            if not count or rest > _SIDE:
                continue
            after = stream(pixels[left - rest :][None]) if rest else b""
            size = 12 * count + max(0, 8 * len(after) - 9)
            if size < least:
                least, best, where = size, (count, after), share
        step /= 2.0
        tries = [share for share in (where - step, where + step) if 0.0 < share < 1.0]
    if best is None:
        return runs
    count, after = best
    return [*before, np.concatenate([kept, found[:count]]), *(_runs(after) if after else [])]


class _Strings:
    """The strings that ``codes`` (after a clear code) define. Each but the last code defines one: its own string, and
    the first pixel of the next code's.
    """

    def __init__(self, codes: Codes) -> None:
        self._codes = codes
        parent = np.arange(_FIRST + max(len(codes) - 1, 0))
        parent[_FIRST:] = codes[:-1]
        root, self.lengths = _climbed(parent)
        self._parent, self._last = parent, np.append(np.arange(_FIRST), root[codes[1:]])

    def parsed(self, pixels: Indices) -> Codes:
        """The codes of ``pixels``, of the longest strings that there are, one after the other.

        It goes from run to run of equal pixels: strings that differ in how often their last pixel is repeated are one
        line, along which it jumps.
        """
        parent, last = self._parent, self._last
        # the beginning of each string's line, and its place in it
        head, place = _climbed(np.where(last[parent] == last, parent, np.arange(len(parent))))
        order = np.lexsort((place, head))
        where = np.empty_like(order)
        where[order] = np.arange(len(order))
        room = np.bincount(head, minlength=len(head))[head] - place + 1
        line, at, more = order.tolist(), where.tolist(), room.tolist()
        longer = dict(zip((parent << 8 | last)[_FIRST:].tolist(), range(_FIRST, len(parent)), strict=True)).get
        ends = np.append(np.flatnonzero(pixels[1:] != pixels[:-1]) + 1, len(pixels))
        found: list[int] = []
        code = -1
        for pixel, count in zip(pixels[ends - 1].tolist(), np.diff(ends, prepend=0).tolist(), strict=True):
            while count:
                follower = longer(code << 8 | pixel)
                if follower is None:
                    found.append(code)
                    follower = pixel
                step = min(more[follower], count) - 1
                code = line[at[follower] + step]
                count -= step + 1
        return np.array([*found[1:], code])


def _climbed(parent: Codes) -> tuple[Codes, Codes]:
    """The ends of all ways up (what has no ``parent`` is its own), and how many there are on each way."""
    steps = np.ones(len(parent), dtype=np.int64)
    steps[parent == np.arange(len(parent))] = 0
    while (up := parent[parent]).tobytes() != parent.tobytes():
        steps += steps[parent]
        parent = up
    return parent, steps + 1
