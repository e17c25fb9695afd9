"""What drawing costs and gains: time per frame against the error, compared with a heavily supersampled picture."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from statistics import median

import numpy as np
from PIL import Image

from movimentum.drawing.options import PictureOptions, Quality
from movimentum.encoding.palette import Mapper, Samples, choose_palette
from movimentum.records import dataclass, replace
from movimentum.rendering.painter import Painter, PaintSession, make_painter
from movimentum.rendering.stream import PoseSource
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses

FINEST = 8
LARGEST = 48_000_000
"""Pixels of the supersampled truth; if it would have more, it is supersampled less."""
RUNS = 3


@dataclass(frozen=True, slots=True)
class PictureCost:
    """One way to draw. ``frame``: seconds per frame; ``error``: root mean square over pixels and channels, of 255."""

    name: str
    frame: float
    error: float


@dataclass(frozen=True, slots=True)
class PictureTrade:
    """``size`` in pixels at scale 1; ``frames`` compared with a truth drawn ``supersampling`` times as large."""

    size: tuple[int, int]
    frames: int
    supersampling: int
    costs: tuple[PictureCost, ...]


def measure_pictures(
    scene: Scene, source: PoseSource, some: Poses, progress: Callable[[int, int], None]
) -> PictureTrade:
    """Draw the frames ``some`` in every way; ``source`` is the whole film, to which the canvas fits."""
    plain = make_painter(scene, source, PictureOptions())
    width, height = plain.size
    finest = max(2, min(FINEST, int((LARGEST / (width * height)) ** 0.5)))
    fine = replace(make_painter(scene, source, PictureOptions(scale=finest)), traces=())
    # one at a time: the truth of a frame may have tens of millions of pixels
    truth = [_reduced([image.convert("RGB")], (width, height))[0] for image in PaintSession(fine).frames(some)]
    progress(1, 4)
    costs: list[PictureCost] = []
    standard: list[Image.Image] = []
    for quality in Quality:
        painter = make_painter(scene, source, PictureOptions(quality=quality))
        images, seconds = _drawn(painter, some)
        costs.append(PictureCost(f"quality {quality}", seconds, _rms(images, truth)))
        standard = images if quality is Quality.STANDARD else standard
    progress(2, 4)
    for scale in (0.5, 2.0):
        images, seconds = _drawn(make_painter(scene, source, PictureOptions(scale=scale)), some)
        costs.append(PictureCost(f"scale {scale:g}", seconds, _rms(_reduced(images, (width, height)), truth)))
    progress(3, 4)
    begin = time.perf_counter()
    palette = choose_palette(Samples.of(standard))
    mapper = Mapper(palette)
    mapped = [_mapped(mapper, palette.table(), image) for image in standard]
    seconds = (time.perf_counter() - begin) / len(standard)
    costs.append(PictureCost("palette (GIF)", seconds, _rms(mapped, standard)))
    progress(4, 4)
    return PictureTrade((width, height), len(some.frames), finest, tuple(costs))


def _drawn(painter: Painter, poses: Poses) -> tuple[list[Image.Image], float]:
    """The pictures, and the median seconds per frame of drawing them."""
    painter = replace(painter, traces=())
    seconds: list[float] = []
    images: list[Image.Image] = []
    while len(seconds) < RUNS and sum(seconds) < 1.0:
        begin = time.perf_counter()
        images = [image.convert("RGB") for image in PaintSession(painter).frames(poses)]
        seconds.append(time.perf_counter() - begin)
    return images, median(seconds) / len(images)


def _reduced(images: Sequence[Image.Image], size: tuple[int, int]) -> list[Image.Image]:
    """Pictures brought to ``size``: averaged if they are larger, interpolated if they are smaller."""
    return [
        image.resize(size, Image.Resampling.BOX if image.width > size[0] else Image.Resampling.BICUBIC)
        for image in images
    ]


def _mapped(mapper: Mapper, table: bytes, image: Image.Image) -> Image.Image:
    indices = mapper.indices(image)
    colors = np.frombuffer(table, dtype=np.uint8).reshape(-1, 3)
    return Image.fromarray(colors[indices])


def _rms(images: Sequence[Image.Image], truth: Sequence[Image.Image]) -> float:
    total = 0.0
    for image, right in zip(images, truth, strict=True):
        off = np.asarray(image, dtype=np.float64) - np.asarray(right, dtype=np.float64)
        total += float(np.mean(off * off))
    return (total / len(images)) ** 0.5
