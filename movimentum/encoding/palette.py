"""One palette for a whole animation, and pictures as indices into it.

If the sampled frames have few colours, all are kept exactly. Otherwise the palette is split by variance (in the spirit
of Wu 1991: always split the group whose colours scatter most, across its principal axis), with a few rounds of k-means.
docs/decisions compares other ways. There is no dithering: it doubles the file and flickers.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float32]
Keys = NDArray[np.uint32]

MOST = 255  # colours; index 0 is kept for "transparent"
_EXACT = 0xFFFFFF
_COARSE = 0xFCFCFC  # 6 bits a channel: fewer nearest colours to look for, an error of at most 2 levels
_SAMPLES = 500_000  # pixels that a palette is chosen from
_ROUNDS = 4


@dataclass(frozen=True, slots=True)
class Palette:
    """Colour number k of ``colors`` (n, 3) uint8, n <= 255, has index k + 1. ``background`` is kept exactly."""

    colors: NDArray[np.uint8]
    exact: bool
    background: int | None = None

    def table(self) -> bytes:
        """768 bytes: red, green, blue of the indices 0 to 255."""
        whole = np.zeros((256, 3), dtype=np.uint8)
        whole[1 : len(self.colors) + 1] = self.colors
        return whole.tobytes()


def choose_palette(samples: Sequence[Image.Image], background: tuple[int, int, int] | None) -> Palette:
    """A palette for pictures like ``samples`` (all RGB, or all RGBA); ``background`` is in it exactly if given."""
    kept = None if background is None else background[0] | background[1] << 8 | background[2] << 16
    few = _few_colors(samples, kept)
    if few is not None:
        return Palette(_channels(few).astype(np.uint8), True, kept)
    step = math.ceil(math.sqrt(sum(image.width * image.height for image in samples) / _SAMPLES))
    chosen: list[Keys] = []
    for image in samples:
        keys = _words(image).reshape(image.height, image.width)[::step, ::step].ravel()
        chosen.append((keys[keys >= 0x80000000] if image.mode == "RGBA" else keys) & np.uint32(_EXACT))
    colors = _quantised(np.concatenate(chosen), MOST if background is None else MOST - 1)
    if background is not None:
        colors = np.concatenate([np.array([background], dtype=np.uint8), colors])
    return Palette(colors, False, kept)


class Mapper:
    """Pictures -> indices of one palette.

    The nearest colour of each colour is searched when it first occurs. Distances are whole numbers that single
    precision holds exactly, so the answer depends only on the colour.
    """

    def __init__(self, palette: Palette) -> None:
        self._mask = np.uint32(_EXACT if palette.exact else _COARSE)
        self._middle = 0.0 if palette.exact else 3.0  # twice the offset of a cell's middle
        self._colors = palette.colors.astype(np.float32)
        self._squares = (self._colors * self._colors).sum(axis=1)
        # by red, green and blue, 8 bits each; 0: not looked up yet. Only touched pages take memory.
        self._table = np.zeros(1 << 24, dtype=np.uint8)
        if palette.background is not None:
            exact = np.flatnonzero(_packed(palette.colors) == palette.background)
            self._table[palette.background & int(self._mask)] = exact[0] + 1

    def indices(self, image: Image.Image) -> NDArray[np.uint8]:
        """(rows, columns) indices; 0 where an RGBA picture is less than half opaque."""
        words = _words(image)
        keys = words & self._mask
        found = self._table.take(keys)
        if not found.all():
            self._look_up(_distinct(keys[found == 0]))
            found = self._table.take(keys)
        if image.mode == "RGBA":
            found[words < 0x80000000] = 0
        return found.reshape(image.height, image.width)

    def _look_up(self, keys: Keys) -> None:
        for start in range(0, len(keys), 4096):
            part = keys[start : start + 4096]
            doubled = 2.0 * _channels(part).astype(np.float32) + np.float32(self._middle)
            self._table[part] = (self._squares - doubled @ self._colors.T).argmin(axis=1) + 1


def _words(image: Image.Image) -> Keys:
    """Pixels as red | green << 8 | blue << 16 | alpha << 24 (alpha: anything in an RGB picture)."""
    return np.frombuffer(image.tobytes("raw", "RGBA" if image.mode == "RGBA" else "RGBX"), dtype="<u4")


def _distinct(keys: Keys) -> Keys:
    """The same as `numpy.unique`, which imports a lot."""
    ordered = np.sort(keys)
    return ordered[np.concatenate([[True], ordered[1:] != ordered[:-1]])] if len(ordered) else ordered


def _channels(keys: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """(n, 3) red, green, blue."""
    return np.stack([keys & 255, keys >> 8 & 255, keys >> 16 & 255], axis=-1).astype(np.uint32)


def _packed(colors: NDArray[np.uint8]) -> Keys:
    wide = colors.astype(np.uint32)
    return (wide[:, 0] | wide[:, 1] << 8 | wide[:, 2] << 16).astype(np.uint32)


def _few_colors(samples: Sequence[Image.Image], background: int | None) -> Keys | None:
    """All colours, sorted, if there are no more than a palette holds."""
    seen: set[int] = set() if background is None else {background}
    for image in samples:
        if image.mode == "RGBA":  # what is less than half opaque has no colour in the file
            words = _distinct(_words(image))
            seen |= set((words[words >= 0x80000000] & _EXACT).tolist())
        else:
            found = image.getcolors(MOST + 1)
            if found is None:
                return None
            seen |= {r | g << 8 | b << 16 for _, (r, g, b) in found}  # type: ignore[misc]
        if len(seen) > MOST:
            return None
    return np.array(sorted(seen or {0}), dtype=np.uint32)


def _quantised(keys: Keys, count: int) -> NDArray[np.uint8]:
    """(n <= count, 3) colours that stand for ``keys`` with little error in the mean square."""
    cells = (keys >> 2 & 0x3F) | (keys >> 4 & 0xFC0) | (keys >> 6 & 0x3F000)
    weights = np.bincount(cells, minlength=1 << 18)
    used = np.flatnonzero(weights)
    weight = weights[used].astype(np.float32)
    sums = [np.bincount(cells, weights=channel, minlength=1 << 18)[used] for channel in _channels(keys).T]
    mean = (np.stack(sums, axis=1) / weight[:, None]).astype(np.float32)
    centres = _split(mean, weight, count)
    for _ in range(_ROUNDS):
        squares = (centres * centres).sum(axis=1)
        label = np.concatenate(
            [(squares - 2.0 * mean[at : at + 4096] @ centres.T).argmin(axis=1) for at in range(0, len(mean), 4096)]
        )
        total = np.bincount(label, weights=weight, minlength=len(centres))
        for axis in range(3):
            moved = np.bincount(label, weights=weight * mean[:, axis], minlength=len(centres))
            centres[:, axis] = np.where(total > 0, moved / np.maximum(total, 1e-9), centres[:, axis])
    return np.rint(centres).clip(0, 255).astype(np.uint8)


def _split(mean: Floats, weight: Floats, count: int) -> Floats:
    """(n <= count, 3) means of groups, made by splitting the group of greatest variance until there are enough."""

    def group(chosen: NDArray[np.intp]) -> tuple[float, Floats, Floats]:
        share = weight[chosen]
        middle = (mean[chosen] * share[:, None]).sum(axis=0) / share.sum()
        offset = mean[chosen] - middle
        scatter = (offset * share[:, None]).T @ offset
        return -float(np.trace(scatter)), middle, scatter

    everything = np.arange(len(mean))
    first, middle, scatter = group(everything)
    heap = [(first, 0, everything, middle, scatter)]
    made = 0
    while len(heap) < count and heap[0][0] < -1e-3:
        _, _, chosen, middle, scatter = heapq.heappop(heap)
        axis = np.linalg.eigh(scatter)[1][:, -1]
        below = (mean[chosen] - middle) @ axis <= 0.0
        if below.all() or not below.any():  # equal but for rounding
            made += 1
            heapq.heappush(heap, (0.0, made, chosen, middle, scatter))
            continue
        for part in (chosen[below], chosen[~below]):
            made += 1
            spread, part_middle, part_scatter = group(part)
            heapq.heappush(heap, (spread, made, part, part_middle, part_scatter))
    return np.stack([entry[3] for entry in heap])
