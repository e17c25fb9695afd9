"""The entry to this stage: a painter and poses become a file (or numbered files).

::

    painter = make_painter(scene, source, PictureOptions(...))  # movimentum.rendering.painter
    report = write_animation(painter, source, Path("out.gif"), fps=timeline.fps, loop=0, workers=None, progress=show)

``source`` is a `Poses` of all frames, or anything that yields `Poses` in order and can be iterated more than once. Wrap
a generator in `movimentum.rendering.stream.Spool` (temporary file); then a million frames need not be in memory::

    with Spool(solve_in_chunks(...)) as source:
        painter = make_painter(scene, source, options)
        report = write_animation(painter, source, ...)
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from fractions import Fraction
from io import BytesIO
from pathlib import Path

from PIL import Image

from movimentum.budget import held
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.encoding import gif, webp
from movimentum.encoding.apng import ApngCoder, ApngWriter
from movimentum.encoding.gif import GifCoder, GifWriter
from movimentum.encoding.palette import choose_palette
from movimentum.encoding.pieces import Coder, FrameClock, FramePiece, PieceWriter
from movimentum.encoding.runs import Elsewhere, coded_runs, timed_frames, workers_that_pay
from movimentum.encoding.stills import JPEG_LARGEST, SequenceWriter, coder_of
from movimentum.encoding.video import write_video
from movimentum.encoding.webp import WebpCoder, WebpWriter
from movimentum.errors import usage_error
from movimentum.output.files import whole_file, whole_folder
from movimentum.rendering.painter import Painter, PaintSession
from movimentum.rendering.stream import PoseSource, chunks, count, kept_frames, pieces, thinned
from movimentum.solver.poses import Poses
from movimentum.terminal import typed

SUFFIXES = (".gif", ".png", ".jpg", ".jpeg", ".apng", ".webp", ".svg", ".html", ".mp4", ".webm")
_STILLS = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg"}
STILL_KINDS = frozenset(_STILLS.values())
"""The kinds that `check_output` returns for a file with one picture."""
VECTOR_KINDS = frozenset({"svg", "html"})
"""The kinds that are not made of pixels: the stage `vector` writes them."""
_SAMPLES = 8  # frames that a palette is chosen from
_WORTH_TIMING = 60  # frames: fewer are drawn in this process without measuring

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class WriteReport:
    """What was written: ``files``, ``frames`` shown (a GIF faster than 50 a second has fewer than were given), the
    picture's ``size`` (width, height) in pixels, the total ``duration`` in seconds as in the file, the number of
    ``workers`` that drew (1: this process), and ``diagnostics`` (warnings).
    """

    files: tuple[Path, ...]
    frames: int
    size: tuple[int, int]
    duration: Fraction
    workers: int
    diagnostics: tuple[Diagnostic, ...] = ()


def check_output(path: Path, frames: int | None = None, *, transparent: bool = False) -> str:
    """The kind of file that ``path`` asks for: ``"sequence"`` for numbered pictures, one of `STILL_KINDS` for a single
    one, else its suffix without the dot.

    `UsageError`: ``output/format`` for a suffix that is not supported, ``output/pattern`` for a number pattern that
    cannot be filled, ``output/one-picture`` for more than one frame into one picture, ``output/opaque`` for a
    ``transparent`` background in a JPEG.
    """
    suffix, name = path.suffix.lower(), path.name
    if suffix not in SUFFIXES:
        from difflib import get_close_matches

        known = ", ".join(SUFFIXES)
        near = [f"-o {typed(path.with_suffix(near))}" for near in get_close_matches(suffix, SUFFIXES, 1)]
        message = f"cannot tell a format from `{name}`: known are {known}"
        raise usage_error("output/format", message, *(near or ["-o out.gif"]))
    if suffix not in _STILLS:
        return suffix[1:]
    if transparent and suffix != ".png":
        raise usage_error("output/opaque", "a JPEG has no transparency", f"-o {typed(path.with_suffix('.png'))}")
    if "%" not in name:
        if frames is not None and frames > 1:
            raise usage_error(
                "output/one-picture",
                f"{frames} frames do not fit into one picture `{name}`",
                f"-o {typed(path.with_name(path.stem + '-%04d' + path.suffix))}",
                f"-o {typed(path.with_suffix('.apng'))}",
                "--at 0",
            )
        return _STILLS[suffix]
    if not re.fullmatch(r"[^%]*%0?\d{0,2}d[^%]*", name):
        raise usage_error(
            "output/pattern",
            f"`{name}` must have one %d (or %04d) for the frame's number",
            f"-o out-%04d{path.suffix}",
        )
    return "sequence"


def write_animation(
    painter: Painter,
    source: PoseSource,
    path: Path,
    *,
    fps: Fraction,
    loop: int = 0,
    workers: int | None = None,
    progress: Progress | None = None,
    elsewhere: Elsewhere | None = None,
) -> WriteReport:
    """Draw all frames of ``source`` and write them to ``path``, whose suffix gives the format (see `check_output`).

    Frame k (by position in ``source``) is shown from k / ``fps``. ``loop``: how often the animation is played, 0 for
    ever (not in video). ``workers``: processes that draw; None: chosen automatically. The bytes written do not depend
    on it, nor on whether they are drawn ``elsewhere``. ``progress`` is called with (frames done, frames in all) about
    every 30 frames.

    The file appears whole or not at all, whatever goes wrong. `UsageError`: see `check_output`; a file that cannot be
    written or a full disk (``output/unwritable``); no frames (``output/no-frames``); a picture larger than the format
    allows (``limit/pixels``); video without PyAV (``output/video``).
    """
    total = count(source)
    kind = check_output(path, total, transparent=painter.transparent)
    if total == 0:
        raise usage_error("output/no-frames", "there is no frame to draw")
    job = _Job(painter, source, total, fps, loop, workers, progress, elsewhere)
    match kind:
        case "gif":
            return _write_gif(job, path)
        case "png" | "jpeg":
            return _write_still(job, path)
        case "sequence":
            return _write_sequence(job, path)
        case "mp4" | "webm":
            return _write_video(job, path, kind)
        case _:
            return _write_box_format(job, path, kind)


@dataclass(frozen=True, slots=True)
class _Job:
    """The arguments of `write_animation`, with the number of frames."""

    painter: Painter
    source: PoseSource
    total: int
    fps: Fraction
    loop: int
    workers: int | None
    progress: Progress | None
    elsewhere: Elsewhere | None

    def report(self, files: list[Path], duration: Fraction, workers: int, *diagnostics: Diagnostic) -> WriteReport:
        return WriteReport(tuple(files), self.total, self.painter.size, duration, workers, diagnostics)

    def tell(self, done: int) -> None:
        if self.progress is not None:
            self.progress(done, self.total)

    def choose_workers(self, coder: Coder, images: list[Image.Image] | None, seconds: float) -> int:
        """As asked; otherwise by the measured time of a frame, because an estimate from sizes is no better. 0 stands
        for elsewhere.
        """
        if self.elsewhere is not None:
            if images is None:
                images, seconds = timed_frames(self.painter, self.source, sorted({0, self.total // 2}))
            began = time.perf_counter()
            coder.code(images[-1], images[0])
            if self.elsewhere.takes((seconds + time.perf_counter() - began) * self.total):
                return 0
        if self.workers is not None:
            return max(1, self.workers)
        if self.total < _WORTH_TIMING:
            return 1
        if images is None:
            images, seconds = timed_frames(self.painter, self.source, [0, self.total // 2])
        began = time.perf_counter()
        coder.code(images[-1], images[-2])
        return workers_that_pay(seconds + time.perf_counter() - began, self.total, held())


@dataclass(frozen=True, slots=True)
class _Thinned:
    """Frames at most ``limit`` a second: a source that can be iterated again."""

    source: PoseSource
    fps: Fraction
    limit: int
    keep: int

    def __iter__(self) -> Iterator[Poses]:
        return thinned(self.source, self.fps, self.limit, self.keep)


def _write_gif(job: _Job, path: Path) -> WriteReport:
    warnings: list[Diagnostic] = []
    _refuse_larger(job.painter, gif.LARGEST, "GIF")
    end = FrameClock(job.fps, 100).at(job.total)
    clock = FrameClock(job.fps, 100)
    if job.fps > gif.FASTEST:
        keep = kept_frames(job.total, job.fps, gif.FASTEST)
        warnings.append(_too_fast(job.fps))
        thin = _Thinned(job.source, job.fps, gif.FASTEST, keep)
        job = _Job(job.painter, thin, keep, Fraction(gif.FASTEST), job.loop, job.workers, job.progress, job.elsewhere)
        clock = FrameClock(job.fps, 100)
    painter = job.painter
    end = max(end, clock.at(job.total))
    positions = sorted({number * job.total // _SAMPLES for number in range(_SAMPLES)})
    images, seconds = timed_frames(painter, job.source, positions)
    palette = choose_palette(images, None if painter.transparent else painter.background)
    coder = GifCoder(palette)
    workers = job.choose_workers(coder, images, seconds)
    del images
    with whole_file(path) as part, part.open("wb") as stream:
        writer = GifWriter(stream, painter.size, palette, clock, (job.total, end), job.loop, painter.transparent)
        _write_pieces(job, writer, coder, workers)
    return job.report([path], Fraction(end, 100), workers, *warnings)


def _write_box_format(job: _Job, path: Path, kind: str) -> WriteReport:
    painter = job.painter
    if kind == "webp":
        _refuse_larger(painter, webp.LARGEST, "WebP")
    with whole_file(path) as part, part.open("wb") as stream:
        coder = WebpCoder() if kind == "webp" else ApngCoder()
        make = WebpWriter if kind == "webp" else ApngWriter
        writer = make(stream, painter.size, painter.mode, job.fps, job.loop)
        workers = job.choose_workers(coder, None, 0.0)
        _write_pieces(job, writer, coder, workers)
    return job.report([path], job.total / job.fps, workers)


def _write_still(job: _Job, path: Path) -> WriteReport:
    _refuse_large_jpeg(job.painter, path)
    with whole_file(path) as part:
        poses = next(chunks(job.source))
        piece = coder_of(path.suffix).code(job.painter.frame(poses, 0), None)
        part.write_bytes(piece.data if piece else b"")
    job.tell(1)
    return job.report([path], 1 / job.fps, 1)


def _write_sequence(job: _Job, path: Path) -> WriteReport:
    _refuse_large_jpeg(job.painter, path)
    numbers = [int(number) for chunk in chunks(job.source) for number in chunk.frames]
    with whole_folder(path) as folder:
        writer = SequenceWriter(folder, path.name, numbers)
        coder = coder_of(path.suffix)
        workers = job.choose_workers(coder, None, 0.0)
        _write_pieces(job, writer, coder, workers)
    return job.report([path.with_name(name) for name in writer.files], job.total / job.fps, workers)


def _write_video(job: _Job, path: Path, kind: str) -> WriteReport:
    painter = job.painter
    warnings: list[Diagnostic] = []
    if painter.transparent:
        message = f"{kind.upper()} files have no transparency here: the background is used"
        warnings.append(Diagnostic("render/no-transparency", Severity.WARNING, message, helps=("-o out.webp",)))
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if done % 30 == 0 or done == job.total:
            job.tell(done)

    coder = coder_of(".png")
    far = job.elsewhere is not None and job.choose_workers(coder, None, 0.0) == 0

    def images() -> Iterator[Image.Image]:
        if far:  # whole pictures, without loss, come back
            image = Image.new(painter.mode, painter.size)
            with closing(_coded(job, coder, 0)) as coded:
                for run in coded:
                    for piece in run:  # without one, the picture stays as it was
                        image = image if piece is None else Image.open(BytesIO(piece.data))
                        yield image
            return
        session = PaintSession(painter)
        for piece in pieces(chunks(job.source), 30):
            yield from session.frames(piece)

    with whole_file(path) as part:
        write_video(images(), part, kind, painter.size, job.fps, painter.background, step)
    return job.report([path], job.total / job.fps, 0 if far else 1, *warnings)


def _coded(job: _Job, coder: Coder, workers: int) -> Generator[list[FramePiece | None], None, None]:
    """The pieces of all runs, by so many workers (0: elsewhere)."""
    if workers == 0 and job.elsewhere is not None:
        return job.elsewhere.coded(job.painter, coder, job.source)
    return coded_runs(job.painter, coder, job.source, workers)


def _write_pieces(job: _Job, writer: PieceWriter, coder: Coder, workers: int) -> None:
    """All frames; a frame that changes nothing makes the one before it longer."""
    writer.begin()
    shown: FramePiece | None = None
    since = done = 0
    with closing(_coded(job, coder, workers)) as coded:
        for run in coded:
            for piece in run:
                if piece is not None:
                    if shown is not None:
                        writer.add(shown, since, done)
                    shown, since = piece, done
                done += 1
            job.tell(done)
    if shown is not None:
        writer.add(shown, since, done)
    writer.end()


def _refuse_large_jpeg(painter: Painter, path: Path) -> None:
    if path.suffix.lower() != ".png":
        _refuse_larger(painter, JPEG_LARGEST, "JPEG")


def _refuse_larger(painter: Painter, limit: int, name: str) -> None:
    if max(painter.size) > limit:
        width, height = painter.size
        raise usage_error(
            "limit/pixels", f"{width} x {height} pixels: the limit of {name} is {limit} each way", "--scale 0.5"
        )


def _too_fast(fps: Fraction) -> Diagnostic:
    return Diagnostic(
        "render/gif-rate",
        Severity.WARNING,
        f"GIF shows at most {gif.FASTEST} frames a second: {float(fps):g} are thinned out to {gif.FASTEST}",
        notes=("browsers slow faster animations down to 10 frames a second",),
        helps=(f"--fps {gif.FASTEST}", "-o out.webp"),
    )
