"""One palette for a whole film, and pictures as indices into it.

Known colours of the film (see `encoding.tints`) have places of their own; the rest goes to the colours of sampled
frames: edges, which are mixtures, and images. If all of them fit, all are exact. Otherwise they are split by variance
(in the spirit of Wu 1991: always split the group with the largest scatter, across its principal axis), followed by a
few rounds of k-means. docs/decisions compares other ways. There is no dithering: it doubles the file and flickers.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from movimentum.records import dataclass
from movimentum.rendering.stamps import Box, Frame
from movimentum.tolerances import LEAST_WEIGHT_OF_COLORS, ONE_COLOR

Floats = NDArray[np.float32]
Keys = NDArray[np.uint32]

MOST = 255
"""Colours; index 0 is kept for "transparent"."""
CLOSE = 2
"""Levels of a channel: colours closer than that share a place, because fewer colours make smaller files."""
_KNOWN = 192  # places for the colours that are known; the others are for edges and images
_OPAQUE = 0x80000000
_COLOR = 0xFFFFFF
_SAMPLES = 500_000  # pixels that a palette is chosen from
_FEW = 20_000  # different colours; of more, those alike in 6 bits a channel are taken together
_ROUNDS = 4
_EDGE = 16.0  # pixels that a mixture at an edge counts for where it is not seen
_PAIRED = 32  # colours of which any two may meet
NO_KEYS: Keys = np.zeros(0, dtype=np.uint32)


@dataclass(frozen=True, slots=True)
class Palette:
    """Colour number k of ``colors`` (n, 3) uint8, n <= 255, has index k + 1."""

    colors: NDArray[np.uint8]

    @property
    def bits(self) -> int:
        """Of an index, at least 2."""
        return max(2, len(self.colors).bit_length())

    def table(self) -> bytes:
        """Red, green, blue of all indices that have so many bits."""
        whole = np.zeros((1 << self.bits, 3), dtype=np.uint8)
        whole[1 : len(self.colors) + 1] = self.colors
        return whole.tobytes()


class Samples:
    """What is seen of some pictures of a film (all RGB, or all RGBA), which have so many ``pixels`` together: of each,
    pixels that are evenly distributed, and every colour that opaque ones have.
    """

    def __init__(self, pixels: int) -> None:
        self._step = max(1, math.ceil(math.sqrt(pixels / _SAMPLES)))
        self._pixels: list[Keys] = []
        self._every: list[Keys] = []
        self.first: tuple[Keys, NDArray[np.intp]] = NO_KEYS, np.zeros(0, dtype=np.intp)
        """The colours of the first picture, and how many pixels have each."""

    @classmethod
    def of(cls, images: Sequence[Image.Image]) -> Samples:
        """All of some pictures."""
        made = cls(sum(image.width * image.height for image in images))
        for image in images:
            made.see(Frame(image, (Box(0, 0, *image.size),)))
        return made

    def see(self, frame: Frame) -> None:
        """Take in a picture, which differs from the one before in what ``frame`` tells."""
        image, step = frame.image, self._step
        if step > 1:
            few = -(-image.width // step), -(-image.height // step)
            aside = 0.5 - 0.5 * step  # the middle of a pixel, of the first of so many
            thin = image.transform(few, Image.Transform.AFFINE, (step, 0.0, aside, 0.0, step, aside))
            self._pixels.append(_opaque(thin))
        else:
            self._pixels.append(_opaque(image))
        if not self._every:
            self.first = _counted(words_of(image))
            self._every.append(_only_opaque(self.first[0], image.mode))
        elif frame.changed:
            self._every.append(distinct(_opaque(*map(image.crop, frame.changed))))

    def colors(self) -> tuple[Keys, NDArray[np.intp]]:
        """The colours of the pixels that are evenly distributed, and how many of them have each."""
        return _counted(np.concatenate([NO_KEYS, *self._pixels]))

    def every(self) -> Keys:
        """All colours."""
        return distinct(np.concatenate([NO_KEYS, *self._every]))


def _opaque(*images: Image.Image) -> Keys:
    """The colours of the pixels of some pictures that are not transparent."""
    return _only_opaque(words_of(*images), images[0].mode)


def _only_opaque(words: Keys, mode: str) -> Keys:
    return (words[words >= _OPAQUE] if mode == "RGBA" else words) & np.uint32(_COLOR)


def choose_palette(
    samples: Samples, known: Keys = NO_KEYS, ground: Sequence[int] = (255, 255, 255), tolerance: int = CLOSE
) -> Palette:
    """A palette for pictures like ``samples`` and for areas of the colours ``known`` (`packed`) on ``ground``.

    With ``tolerance``, no more colours than are needed for errors of that many levels a channel.
    """
    keys, counts = samples.colors()
    known = distinct(known)
    fixed = channels(known).astype(np.float32)
    edges = _edges(fixed, fixed[~np.isin(known, keys, assume_unique=True)], ground)
    if len(known) > _KNOWN:
        fixed = _chosen(fixed, np.ones(len(known), np.float32), _KNOWN, 0, fixed[:0])
    elif tolerance <= CLOSE and np.isin(known, keys, assume_unique=True).all():
        whole = distinct(np.concatenate([known, samples.every()]))
        fixed = channels(whole).astype(np.float32) if len(whole) <= MOST else fixed
    many = len(keys) > _FEW
    colors, weights = _cells(keys, counts) if many else (channels(keys).astype(np.float32), counts.astype(np.float32))
    colors, weights = np.concatenate([colors, edges]), np.concatenate([weights, np.full(len(edges), _EDGE)])
    others = _chosen(colors, np.sqrt(weights).astype(np.float32), MOST - len(fixed), tolerance, fixed)
    found = np.concatenate([fixed, others])
    if not len(found):
        return Palette(np.zeros((1, 3), dtype=np.uint8))
    return Palette(found[_by_use(found, *samples.first)].astype(np.uint8))


class Mapper:
    """Pictures -> indices of one palette, each the nearest.

    The nearest colour of each colour is searched when it first occurs. Distances are whole numbers that single
    precision holds exactly, so the answer depends only on the colour.
    """

    def __init__(self, palette: Palette) -> None:
        self._colors = palette.colors.astype(np.float32)
        self._squares = (self._colors * self._colors).sum(axis=1)
        # by red, green and blue, 8 bits each; 0: not looked up yet. Only touched pages take memory.
        self._table = np.zeros(1 << 24, dtype=np.uint8)
        self._off = np.zeros(1 << 24, dtype=np.uint8)
        self._most = np.zeros(MOST + 1, dtype=np.uint8)  # by index: of its colours so far

    def indices(self, image: Image.Image) -> NDArray[np.uint8]:
        """(rows, columns) indices; 0 where an RGBA picture is less than half opaque."""
        return self.looked_up(words_of(image), image.mode).reshape(image.height, image.width)

    def looked_up(self, words: Keys, mode: str) -> NDArray[np.uint8]:
        """The same of pixels, as `words_of` gives them."""
        keys = words & np.uint32(_COLOR)
        found = self._table.take(keys)
        if not found.all():
            self._look_up(distinct(keys[found == 0]))
            found = self._table.take(keys)
        if mode == "RGBA":
            found[words < _OPAQUE] = 0
        return found

    def off(self, words: Keys, found: NDArray[np.uint8], above: int) -> NDArray[np.uint8]:
        """The greatest differences of a channel that are greater than ``above``, of pixels and their indices."""
        off = self._off.take(words[(self._most > above)[found]] & np.uint32(_COLOR))
        return off[off > above]

    def _look_up(self, keys: Keys) -> None:
        for start in range(0, len(keys), 4096):
            part = keys[start : start + 4096]
            wanted = channels(part).astype(np.float32)
            nearest = (self._squares - 2.0 * (wanted @ self._colors.T)).argmin(axis=1)
            off = np.abs(wanted - self._colors[nearest]).max(axis=1)
            self._table[part], self._off[part] = nearest + 1, off
            np.maximum.at(self._most, nearest + 1, off.astype(np.uint8))


def words_of(*images: Image.Image) -> Keys:
    """Pixels as red | green << 8 | blue << 16 | alpha << 24 (alpha: 255 in an RGB picture), of one after the other."""
    parts = [image.tobytes("raw", "RGBA" if image.mode == "RGBA" else "RGBX") for image in images]
    return np.frombuffer(parts[0] if len(parts) == 1 else b"".join(parts), dtype="<u4")


def distinct(keys: Keys) -> Keys:
    """The same as `numpy.unique`, which imports a lot."""
    return _counted(keys)[0]


def channels(keys: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """(n, 3) red, green, blue."""
    return np.stack([keys & 255, keys >> 8 & 255, keys >> 16 & 255], axis=-1).astype(np.uint32)


def packed(colors: NDArray[np.uint8]) -> Keys:
    """(n,) of (n, 3): red | green << 8 | blue << 16."""
    wide = colors.astype(np.uint32)
    return (wide[:, 0] | wide[:, 1] << 8 | wide[:, 2] << 16).astype(np.uint32)


def _counted(keys: Keys) -> tuple[Keys, NDArray[np.intp]]:
    ordered = np.sort(keys)
    begin = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]])) if len(ordered) else np.zeros(0, int)
    return ordered[begin], np.diff(np.append(begin, len(ordered)))


def _by_use(colors: Floats, words: Keys, counts: NDArray[np.intp]) -> NDArray[np.intp]:
    """The order in which the colours of a picture (the first frame) come first: it needs smaller numbers."""
    near = [((colors - each) ** 2).sum(axis=1).argmin() for each in channels(words).astype(np.float32)[:_FEW]]
    return np.argsort(-np.bincount(near, weights=counts[: len(near)], minlength=len(colors)), kind="stable")


def _cells(keys: Keys, counts: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Means and weights of colours that are alike in 6 bits a channel."""
    cells = (keys >> 2 & 0x3F) | (keys >> 4 & 0xFC0) | (keys >> 6 & 0x3F000)
    weights = np.bincount(cells, weights=counts, minlength=1 << 18)
    used = np.flatnonzero(weights)
    sums = [np.bincount(cells, weights=each * counts, minlength=1 << 18)[used] for each in channels(keys).T]
    return (np.stack(sums, axis=1) / weights[used, None]).astype(np.float32), weights[used].astype(np.float32)


def _edges(colors: Floats, unseen: Floats, ground: Sequence[int]) -> Floats:
    """What edges may show: of colours that no sample has, on the ground; and if there are few, of each on each."""
    above, below = unseen, np.array(ground, dtype=np.float32)[None].repeat(len(unseen), axis=0)
    if len(colors) <= _PAIRED:
        first, second = np.triu_indices(len(colors), 1)
        above, below = np.concatenate([above, colors[first]]), np.concatenate([below, colors[second]])
    return np.concatenate([np.rint(below + share * (above - below)) for share in np.arange(0.125, 1.0, 0.125)])


def _chosen(colors: Floats, weight: Floats, count: int, tolerance: int, fixed: Floats) -> Floats:
    """(n <= count, 3) whole colours that stand for ``colors``, beside those that are ``fixed``, with little error in
    the mean square.
    """
    if len(fixed) and len(colors):
        near = np.concatenate([_distances(colors[at : at + 4096], fixed) for at in range(0, len(colors), 4096)])
        colors, weight = colors[near > tolerance], weight[near > tolerance]
    if not len(colors) or count < 1:
        return fixed[:0]
    centres, all_near = _split(colors, weight, count, tolerance)
    for _ in range(0 if all_near else _ROUNDS):
        every = np.concatenate([centres, fixed])
        squares = (every * every).sum(axis=1)
        label = np.concatenate(
            [(squares - 2.0 * colors[at : at + 4096] @ every.T).argmin(axis=1) for at in range(0, len(colors), 4096)]
        )
        total = np.bincount(label, weights=weight, minlength=len(every))[: len(centres)]
        for axis in range(3):
            moved = np.bincount(label, weights=weight * colors[:, axis], minlength=len(every))[: len(centres)]
            centres[:, axis] = np.where(total > 0, moved / np.maximum(total, LEAST_WEIGHT_OF_COLORS), centres[:, axis])
    return np.rint(centres).clip(0, 255)


def _distances(colors: Floats, fixed: Floats) -> Floats:
    """(n,) the least of the greatest differences of a channel."""
    return np.abs(colors[:, None] - fixed[None]).max(axis=2).min(axis=1)


def _split(colors: Floats, weight: Floats, count: int, tolerance: int) -> tuple[Floats, bool]:
    """(n <= count, 3) middles of groups, made by splitting the group of greatest variance until there are enough, and
    whether all colours are within ``tolerance`` of them.
    """

    def group(chosen: NDArray[np.intp]) -> tuple[float, Floats, Floats]:
        share, some = weight[chosen], colors[chosen]
        low, high = some.min(axis=0), some.max(axis=0)
        if (high - low).max() <= 2 * tolerance:
            return 0.0, np.floor((low + high) / 2.0), np.zeros((3, 3), np.float32)
        middle = (some * share[:, None]).sum(axis=0) / share.sum()
        offset = some - middle
        scatter = (offset * share[:, None]).T @ offset
        return -float(np.trace(scatter)), middle, scatter

    everything = np.arange(len(colors))
    first, middle, scatter = group(everything)
    heap = [(first, 0, everything, middle, scatter)]
    made = 0
    while len(heap) < count and heap[0][0] < -ONE_COLOR:
        _, _, chosen, middle, scatter = heapq.heappop(heap)
        axis = np.linalg.eigh(scatter)[1][:, -1]
        below = (colors[chosen] - middle) @ axis <= 0.0
        if below.all() or not below.any():  # equal but for rounding
            made += 1
            heapq.heappush(heap, (0.0, made, chosen, middle, scatter))
            continue
        for part in (chosen[below], chosen[~below]):
            made += 1
            spread, part_middle, part_scatter = group(part)
            heapq.heappush(heap, (spread, made, part, part_middle, part_scatter))
    return np.stack([entry[3] for entry in heap]), heap[0][0] >= -ONE_COLOR
