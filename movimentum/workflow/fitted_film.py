"""Fits a film to a place's limits: its size, rate, length and number of frames."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

from movimentum.advice import Advised, Choose
from movimentum.encoding.gif_notes import largest_scale, short
from movimentum.records import dataclass, field
from movimentum.text import counted, number
from movimentum.workflow.places import Taken

RATES = tuple(map(Fraction, (60, 50, 30, 25, 20, 15, 12, 10, 8, 6, 5, 4, 3, 2, 1))) + tuple(
    Fraction(1, slow) for slow in (2, 5, 10, 20, 50, 100)
)
"""Rates that are chosen, where one has to be: whole hundredths of a second, mostly."""


@dataclass(frozen=True, slots=True)
class FilmShape:
    """A film as it would be: its size in world pixels, the frames asked for (``start`` to ``stop``, of ``count``) and
    their rate. ``scale`` and ``fps`` are what the user has asked for, ``chosen``: whether frames were.
    """

    width: float
    height: float
    start: int
    stop: int
    count: int
    own_fps: Fraction
    scale: float | None
    fps: Fraction | None
    chosen: bool
    still: bool

    @property
    def seconds(self) -> Fraction:
        """How long it is."""
        return (self.stop - self.start) / self.own_fps

    def size(self, scale: float) -> tuple[int, int]:
        """The picture's, at a scale."""
        return max(1, round(self.width * scale)), max(1, round(self.height * scale))


@dataclass(slots=True)
class FilmFit:
    """How a film is drawn for a place: ``canvas`` is the whole picture where the film is in the middle of one,
    ``seconds`` how much of it is shown, ``repeats`` how often. ``broken``: what the user's own options do not let it
    keep, with an option that would; ``refused``: why this format is not for this film.
    """

    scale: float
    fps: Fraction
    seconds: Fraction
    canvas: tuple[int, int] | None = None
    repeats: int = 1
    reasons: list[str] = field(default_factory=list[str])
    broken: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    refused: str = ""

    def frames(self, shape: FilmShape) -> int:
        """How many, at most."""
        return 1 if shape.still else (math.ceil(self.seconds * self.fps) + 1) * self.repeats


def fitted(taken: Taken, shape: FilmShape, smaller: float = 1.0) -> FilmFit:
    """How a film fits. ``smaller``: it turned out to be too heavy, and is drawn that much smaller."""
    made = FilmFit(1.0, shape.fps or shape.own_fps, shape.seconds)
    if not shape.still:
        _timed(taken, shape, made)
    _sized(taken, shape, made, smaller)
    if not shape.still:
        _numbered(taken, shape, made)
        _in_area(taken, shape, made)
    return made


def _timed(taken: Taken, shape: FilmShape, made: FilmFit) -> None:
    least, most = taken.rate
    if shape.fps is None:
        made.fps = min(max(made.fps, least), most)
        if made.fps != shape.own_fps:
            word = "highest" if made.fps == most else "lowest"
            made.reasons.append(f"{number(float(made.fps))} frames a second is the {word} rate accepted")
    elif not least <= shape.fps <= most:
        bounds = f"{float(least):g} to {float(most):g}" if least else f"at most {float(most):g}"
        made.broken.append(
            (f"{float(shape.fps):g} frames a second are requested, and {bounds} are accepted", Choose.FPS.to(25))
        )
    shortest, longest = taken.seconds
    if longest is not None and shape.seconds > longest:
        fits = int(longest * shape.own_fps)
        if shape.chosen:
            long = f"{number(float(shape.seconds))} s are requested, and at most {longest} s are accepted"
            made.broken.append((long, Choose.FRAMES.to(f"{shape.start}:{shape.start + fits}")))
        else:
            made.seconds = longest
            made.reasons.append(
                Advised(
                    f"of {number(float(shape.seconds))} s, the first {longest} are used: ",
                    Choose.FRAMES.to(),
                    " chooses others",
                )
            )
    if 0 < made.seconds < shortest and shape.stop - shape.start > 1:
        made.repeats = math.ceil(shortest / made.seconds)
        made.reasons.append(f"it is played {made.repeats} times, as films of less than {shortest} s are not accepted")


def _sized(taken: Taken, shape: FilmShape, made: FilmFit, smaller: float) -> None:
    box = taken.box
    if taken.shapes:
        box = min(taken.shapes, key=lambda some: abs(math.log(some[0] / some[1] * shape.height / shape.width)))
    if smaller < 1.0 and taken.shapes:
        box = (_even(box[0] * smaller), _even(box[1] * smaller))
        smaller = 1.0
    fits = min(box[0] / shape.width, box[1] / shape.height)
    if shape.scale is None:
        made.scale = short(min(fits, max(1.0, taken.enlarged)) * smaller)
        if made.scale != 1.0:
            made.reasons.append(f"{made.scale:.4g} times its own size, to fit into {box[0]} x {box[1]} pixels")
    else:
        made.scale = shape.scale
        size = shape.size(shape.scale)
        if size[0] > box[0] or size[1] > box[1]:
            text = f"{size[0]} x {size[1]} pixels are requested, and at most {box[0]} x {box[1]} are accepted"
            made.broken.append((text, Choose.SCALE.to(number(short(fits), 6))))
    if taken.shapes:
        size = shape.size(made.scale)
        grown = max(1.0, size[0] / box[0], size[1] / box[1])
        made.canvas = (_even(box[0] * grown), _even(box[1] * grown))


def _numbered(taken: Taken, shape: FilmShape, made: FilmFit) -> None:
    """A lower rate, for fewer frames."""
    if taken.frames is None or made.frames(shape) <= taken.frames:
        return
    if shape.fps is not None:
        text = f"{made.frames(shape):,} frames are requested, and at most {taken.frames} are accepted"
        made.broken.append((text, Choose.FPS.to(_typed(_slower(made, shape, taken.frames)))))
        return
    made.fps = _slower(made, shape, taken.frames)
    made.reasons.append(f"{_typed(made.fps)} frames a second, for at most {taken.frames} frames")


def _slower(made: FilmFit, shape: FilmShape, frames: float) -> Fraction:
    """The highest rate with no more frames."""
    slower = FilmFit(made.scale, made.fps, made.seconds, repeats=made.repeats)
    for rate in _rates_below(made.fps):
        slower.fps = rate
        if slower.frames(shape) <= frames:
            break
    return slower.fps


def _rates_below(fps: Fraction) -> Iterator[Fraction]:
    yield from (rate for rate in RATES if rate < fps)


def _in_area(taken: Taken, shape: FilmShape, made: FilmFit) -> None:
    """Smaller pictures and then fewer of them, for no more pixels in all of them together."""
    if taken.area is None:
        return
    before = made.scale, made.fps
    if not _fits(taken, shape, made) and shape.scale is None:
        made.scale = max(_scale_for(taken, shape, made), min(made.scale, _readable(taken, shape)))
    if not _fits(taken, shape, made) and shape.fps is None:
        least = max(taken.smooth, taken.rate[0])
        made.fps = max(_slower(made, shape, taken.area / _area(shape, made.scale)), min(least, made.fps))
    if not _fits(taken, shape, made) and shape.scale is None:
        made.scale = _scale_for(taken, shape, made)
        if taken.readable > 1:
            size = shape.size(made.scale)
            made.refused = f"it would have only {size[0]} x {size[1]} pixels, to stay within the limit"
    if not _fits(taken, shape, made):
        pixels = made.frames(shape) * _area(shape, made.scale)
        text = f"{pixels / 1e6:,.0f} megapixels in all frames are requested, and at most {taken.area / 1e6:,.0f} play"
        made.broken.append((text, Choose.SCALE.to(number(_scale_for(taken, shape, made), 6))))
    elif before != (made.scale, made.fps):
        pixels = before[0] ** 2 * shape.width * shape.height * math.ceil(made.seconds * before[1])
        made.reasons.append(f"at its full size and rate it would have {pixels / 1e6:,.0f} megapixels")


def _readable(taken: Taken, shape: FilmShape) -> float:
    return taken.readable / max(shape.width, shape.height)


def _area(shape: FilmShape, scale: float) -> int:
    width, height = shape.size(scale)
    return width * height


def _fits(taken: Taken, shape: FilmShape, made: FilmFit) -> bool:
    return taken.area is None or made.frames(shape) * _area(shape, made.scale) <= taken.area


def _scale_for(taken: Taken, shape: FilmShape, made: FilmFit) -> float:
    """The largest scale with no more pixels in all frames."""
    assert taken.area is not None
    return largest_scale(shape.size, made.frames(shape), made.scale, taken.area)


def _even(value: float) -> int:
    return max(2, 2 * round(value / 2))


def _typed(rate: Fraction) -> str:
    return str(rate) if rate.denominator > 1 and rate < 1 else f"{float(rate):g}"


def summary(shape: FilmShape, made: FilmFit, size: tuple[int, int], frames: int) -> str:
    """``400 x 320 pixels, 50 frames, 25 a second, 2 s``."""
    picture = f"{size[0]} x {size[1]} pixels"
    if shape.still:
        return picture
    length = number(float(frames / made.fps))
    return f"{picture}, {counted(frames, 'frame')}, {number(float(made.fps))} a second, {length} s"
