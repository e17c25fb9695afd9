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
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from PIL import Image, ImageChops

from movimentum.advice import Advised, Choose
from movimentum.budget import memory_used
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.style import Color
from movimentum.encoding import gif, gif_notes, webp
from movimentum.encoding.apng import ApngCoder, ApngWriter
from movimentum.encoding.gif import GifCoder, GifWriter
from movimentum.encoding.palette import CLOSE, Samples, choose_palette
from movimentum.encoding.pieces import Coder, FrameClock, FramePiece, PieceWriter
from movimentum.encoding.runs import Elsewhere, coded_runs, timed_frames, workers_that_pay
from movimentum.encoding.stills import JPEG_LARGEST, JpegCoder, PngCoder, SequenceWriter
from movimentum.encoding.tints import tints
from movimentum.encoding.video import write_video
from movimentum.encoding.webp import WebpCoder, WebpWriter
from movimentum.errors import usage_error
from movimentum.output.files import whole_file, whole_folder
from movimentum.records import dataclass, replace
from movimentum.rendering.painter import Painter, PaintSession
from movimentum.rendering.stamps import Box, Frame
from movimentum.rendering.stream import PoseSource, chunks, count, kept_frames, pieces, thinned
from movimentum.solver.poses import Poses
from movimentum.terminal import typed

_WORTH_TIMING = 60  # frames: fewer are drawn in this process without measuring

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class OutputFormat:
    """A format of output: its ``name``, and what ``write``s it (None: it is not made of pixels, and the stage `vector`
    writes it), with the ``coder`` of its pictures and the ``writer`` of its pieces, where it has one of these.

    ``largest``: pixels each way. ``still``: a file holds one picture. ``opaque``: it has no transparency.
    ``instead_of``: suffixes of formats that we do not have, to which this one comes nearest.
    """

    name: str
    write: Callable[[_Job, Path], WriteReport] | None
    coder: Callable[[], Coder] = PngCoder
    writer: Callable[[BinaryIO, tuple[int, int], str, Fraction, int], PieceWriter] | None = None
    largest: int | None = None
    still: bool = False
    opaque: bool = False
    instead_of: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """What `check_output` calls it."""
        return self.name.lower()


@dataclass(frozen=True, slots=True)
class WriteReport:
    """The result of writing: ``files``, ``frames`` shown (a GIF faster than 50 a second has fewer than were given), the
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
    """The kind of file that ``path`` asks for: ``"sequence"`` for numbered pictures, else that of its `OutputFormat`.

    `UsageError`: ``output/format`` for a suffix that is not supported, ``output/pattern`` for a number pattern that
    cannot be filled, ``output/one-picture`` for more than one frame into one picture, ``output/opaque`` for a
    ``transparent`` background in a JPEG.
    """
    suffix, name = path.suffix.lower(), path.name
    if suffix not in FORMATS:
        message = f"cannot tell a format from `{name}`: known are {', '.join(FORMATS)}"
        near = _nearest(suffix)
        instead = typed(path.with_suffix(near)) if near else "out.gif"
        raise usage_error("output/format", message, Choose.OUTPUT.to(instead))
    found = FORMATS[suffix]
    if not found.still:
        return found.kind
    if transparent and found.opaque:
        message = f"a {found.name} has no transparency"
        raise usage_error("output/opaque", message, Choose.OUTPUT.to(typed(path.with_suffix(".png"))))
    if "%" not in name:
        if frames is not None and frames > 1:
            raise usage_error(
                "output/one-picture",
                f"{frames} frames do not fit into one picture `{name}`",
                Choose.OUTPUT.to(typed(path.with_name(path.stem + "-%04d" + path.suffix))),
                Choose.OUTPUT.to(typed(path.with_suffix(".apng"))),
                Choose.AT.to(0),
            )
        return found.kind
    if not re.fullmatch(r"[^%]*%0?\d{0,2}d[^%]*", name):
        message = f"`{name}` must have one %d (or %04d) for the frame's number"
        raise usage_error("output/pattern", message, Choose.OUTPUT.to(f"out-%04d{path.suffix}"))
    return "sequence"


def write_animation(
    painter: Painter,
    source: PoseSource,
    path: Path,
    *,
    fps: Fraction,
    loop: int = 0,
    lossy: int = 0,
    matte: Color | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    elsewhere: Elsewhere | None = None,
) -> WriteReport:
    """Draw all frames of ``source`` and write them to ``path``, whose suffix gives the format (see `check_output`).

    Frame k (by position in ``source``) is shown from k / ``fps``. ``loop``: how often the film is played, 0 for
    ever (not in video). Of a GIF, ``lossy``: levels of a channel by which its colours may be off, so that it is
    smaller; ``matte``: the colour that half-transparent pixels are blended with. ``workers``: processes that
    draw; None: chosen automatically. The bytes written do not depend on it, nor on whether they are drawn
    ``elsewhere``. ``progress`` is called with (frames done, frames in all) about every 30 frames.

    The file appears whole or not at all, whatever goes wrong. `UsageError`: see `check_output`; a file that cannot be
    written or a full disk (``output/unwritable``); no frames (``output/no-frames``); a picture larger than the format
    allows (``limit/pixels``); video without PyAV (``output/video``).
    """
    total = count(source)
    kind = check_output(path, total, transparent=painter.transparent)
    if total == 0:
        raise usage_error("output/no-frames", "there is no frame to draw")
    found = format_of(path)
    write = _write_sequence if kind == "sequence" else found.write
    assert write is not None, f"{found.kind} is not made of pixels"
    if lossy and found.kind != "gif":
        message = Advised(Choose.LOSSY.to(), f" is for GIFs: a {found.name} is as exact as its format allows")
        raise usage_error("output/lossy", message, Choose.OUTPUT.to(typed(path.with_suffix(".gif"))))
    if found.largest is not None and max(painter.size) > found.largest:
        width, height = painter.size
        message = f"{width} x {height} pixels: the limit of {found.name} is {found.largest} each way"
        raise usage_error("limit/pixels", message, Choose.SCALE.to("0.5"))
    return write(_Job(found, painter, source, total, fps, loop, lossy, matte, workers, progress, elsewhere), path)


def _nearest(suffix: str) -> str | None:
    """The suffix of a format that is like the one that ``suffix`` names, or is spelled like it."""
    from difflib import get_close_matches

    alike = [known for known, each in FORMATS.items() if suffix in each.instead_of]
    return next(iter(alike or get_close_matches(suffix, FORMATS, 1)), None)


@dataclass(frozen=True, slots=True)
class _Job:
    """The arguments of `write_animation`, with the format and the number of frames."""

    format: OutputFormat
    painter: Painter
    source: PoseSource
    total: int
    fps: Fraction
    loop: int
    lossy: int
    matte: Color | None
    workers: int | None
    progress: Progress | None
    elsewhere: Elsewhere | None

    def report(self, files: list[Path], duration: Fraction, workers: int, *diagnostics: Diagnostic) -> WriteReport:
        return WriteReport(tuple(files), self.total, self.painter.size, duration, workers, diagnostics)

    def picture_coder(self) -> Coder:
        """The coder of single pictures, which may tell their scale."""
        coder = self.format.coder()
        return replace(coder, scale=self.painter.view.scale) if isinstance(coder, PngCoder) else coder

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
            if self.elsewhere.takes((seconds + _coding(coder, images[-1], images[0])) * self.total):
                return 0
        if self.workers is not None:
            return max(1, self.workers)
        if self.total < _WORTH_TIMING:
            return 1
        if images is None:
            images, seconds = timed_frames(self.painter, self.source, [0, self.total // 2])
        return workers_that_pay(seconds + _coding(coder, images[-1], images[-2]), self.total, memory_used())


@dataclass(frozen=True, slots=True)
class _Thinned:
    """Frames at most ``limit`` a second: a source that can be iterated again."""

    source: PoseSource
    fps: Fraction
    limit: int
    keep: int

    def __iter__(self) -> Iterator[Poses]:
        return thinned(self.source, self.fps, self.limit, self.keep)


def _coding(coder: Coder, image: Image.Image, before: Image.Image) -> float:
    """The seconds that a frame takes to be coded after another one."""
    coder.see(Frame(before, (Box(0, 0, *before.size),)))
    box = ImageChops.difference(image, before).getbbox(alpha_only=False)
    began = time.perf_counter()
    coder.code(Frame(image, () if box is None else (Box(*box),)))
    return time.perf_counter() - began


def _write_gif(job: _Job, path: Path) -> WriteReport:
    warnings: list[Diagnostic] = []
    clock = FrameClock(job.fps, 100)
    end = clock.at(job.total)
    if job.fps > gif.FASTEST:
        keep = kept_frames(job.total, job.fps, gif.FASTEST)
        warnings.append(gif_notes.too_fast(job.fps))
        thin = _Thinned(job.source, job.fps, gif.FASTEST, keep)
        job = replace(job, source=thin, total=keep, fps=Fraction(gif.FASTEST))
        clock = FrameClock(job.fps, 100)
    painter = job.painter
    end = max(end, clock.at(job.total))
    found = tints(painter, job.source, job.total)
    matte = job.matte if painter.transparent else None
    samples = Samples(len(found.positions) * painter.size[0] * painter.size[1])

    def see(frame: Frame) -> None:
        samples.see(frame if matte is None else frame._replace(image=gif.blended(frame.image, matte)))

    images, seconds = timed_frames(painter, job.source, found.positions, see)
    palette = choose_palette(samples, found.colors, matte or painter.background, max(CLOSE, job.lossy))
    coder = GifCoder(palette, matte)
    workers = job.choose_workers(coder, images, seconds)
    del images
    with whole_file(path) as part, part.open("wb") as stream:
        writer = GifWriter(stream, painter.size, palette, clock, (job.total, end), job.loop, painter.transparent)
        _write_pieces(job, writer, coder, workers)
        size = stream.tell()
    warnings += gif_notes.colors(writer, job.lossy, path)
    warnings += gif_notes.weight(size, path, job.total, painter.size, job.fps, job.lossy)
    warnings += gif_notes.area(path, writer.frames, painter.size, painter.view.scale, job.fps)
    return job.report([path], Fraction(end, 100), workers, *warnings)


def _write_boxes(job: _Job, path: Path) -> WriteReport:
    painter, coder = job.painter, job.format.coder()
    assert job.format.writer is not None
    with whole_file(path) as part, part.open("wb") as stream:
        writer = job.format.writer(stream, painter.size, painter.mode, job.fps, job.loop)
        if isinstance(writer, ApngWriter):
            writer.scale = painter.view.scale
        workers = job.choose_workers(coder, None, 0.0)
        _write_pieces(job, writer, coder, workers)
    return job.report([path], job.total / job.fps, workers)


def _write_still(job: _Job, path: Path) -> WriteReport:
    with whole_file(path) as part:
        poses = next(chunks(job.source))
        image = job.painter.frame(poses, 0)
        piece = job.picture_coder().code(Frame(image, (Box(0, 0, *image.size),)))
        part.write_bytes(piece.data if piece else b"")
    job.tell(1)
    return job.report([path], 1 / job.fps, 1)


def _write_sequence(job: _Job, path: Path) -> WriteReport:
    numbers = [int(number) for chunk in chunks(job.source) for number in chunk.frames]
    with whole_folder(path) as folder:
        writer = SequenceWriter(folder, path.name, numbers)
        coder = job.picture_coder()
        workers = job.choose_workers(coder, None, 0.0)
        _write_pieces(job, writer, coder, workers)
    return job.report([path.with_name(name) for name in writer.files], job.total / job.fps, workers)


def _write_video(job: _Job, path: Path) -> WriteReport:
    painter, kind = job.painter, job.format.kind
    warnings: list[Diagnostic] = []
    if painter.transparent:
        message = f"{kind.upper()} files have no transparency here: the background is used"
        helps = (Choose.OUTPUT.to("out.webp"),)
        warnings.append(Diagnostic("render/no-transparency", Severity.WARNING, message, helps=helps))
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if done % 30 == 0 or done == job.total:
            job.tell(done)

    coder = job.format.coder()
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


_PNG = OutputFormat("PNG", _write_still, still=True, instead_of=(".bmp", ".tif", ".tiff", ".tga", ".ppm", ".ico"))
_JPEG = OutputFormat("JPEG", _write_still, JpegCoder, largest=JPEG_LARGEST, still=True, opaque=True)

FORMATS: dict[str, OutputFormat] = {
    ".gif": OutputFormat("GIF", _write_gif, largest=gif.LARGEST),
    ".png": _PNG,
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".apng": OutputFormat("APNG", _write_boxes, ApngCoder, ApngWriter),
    ".webp": OutputFormat("WebP", _write_boxes, WebpCoder, WebpWriter, largest=webp.LARGEST, instead_of=(".avif",)),
    ".svg": OutputFormat("SVG", None),
    ".pdf": OutputFormat("PDF", None, instead_of=(".eps", ".ps")),
    ".html": OutputFormat("HTML", None, instead_of=(".htm", ".xhtml")),
    ".mp4": OutputFormat("MP4", _write_video, instead_of=(".avi", ".mov", ".mkv", ".mpg", ".mpeg", ".m4v")),
    ".webm": OutputFormat("WebM", _write_video, instead_of=(".ogv",)),
}
"""Every format that a film or a picture is written in, by suffix."""


def format_of(path: Path) -> OutputFormat:
    """The format that the suffix of ``path`` names; `check_output` refuses others."""
    return FORMATS[path.suffix.lower()]
