"""The entry to this stage: a prepared drawing and poses become an SVG, a page or a PDF."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from enum import StrEnum
from fractions import Fraction
from pathlib import Path

from movimentum.advice import Choose
from movimentum.encoding.write import Progress, WriteReport
from movimentum.errors import usage_error
from movimentum.output.files import whole_file
from movimentum.records import replace
from movimentum.rendering.prepare import PreparedDrawing
from movimentum.rendering.stream import PoseSource, chunks, concatenate
from movimentum.scene.model import Scene
from movimentum.terminal import typed
from movimentum.text import counted
from movimentum.vector.film import Film, make_film
from movimentum.vector.images import rastered


class TextForm(StrEnum):
    """``outlines``: letters look the same everywhere; ``live``: texts stay texts. If nothing is said, an SVG has
    outlines and a PDF texts (with their letters); a page has outlines.
    """

    OUTLINES = "outlines"
    LIVE = "live"


MAX_POSES = 1_000_000
"""Poses (things times frames) in one file: some 30 MB, which browsers still open."""


def _svg(film: Film) -> Iterator[bytes]:
    from movimentum.vector.svg import svg_document

    return (line.encode() for line in svg_document(film))


def _page(film: Film) -> Iterator[bytes]:
    from movimentum.vector.page import page_document

    return (line.encode() for line in page_document(film))


def _pdf(film: Film) -> Iterator[bytes]:
    from movimentum.vector.pdf import pdf_document

    yield pdf_document(film)


DOCUMENTS: dict[str, Callable[[Film], Iterable[bytes]]] = {".svg": _svg, ".html": _page, ".pdf": _pdf}
"""The writer for each format that is not made of pixels."""


def refuse_too_long(scene: Scene, frames: int, path: Path) -> None:
    """`UsageError` with ``limit/poses`` if a file would hold more than `MAX_POSES`; before anything is solved."""
    poses = frames * len(scene.things)
    if poses > MAX_POSES:
        kind, fewer = path.suffix[1:].upper(), max(1, MAX_POSES // len(scene.things))
        raise usage_error(
            "limit/poses",
            f"{counted(frames, 'frame')} of {counted(len(scene.things), 'thing')} are too much for one {kind} file: the"
            f" limit is {MAX_POSES:,} poses",
            Choose.FRAMES.to(f"0:{fewer}"),
            Choose.OUTPUT.to(typed(path.with_suffix(".gif"))),
        )


def write_film(
    scene: Scene,
    prepared: PreparedDrawing,
    source: PoseSource,
    path: Path,
    *,
    fps: Fraction,
    loop: int = 0,
    progress: Progress | None = None,
    text: TextForm | None = None,
) -> WriteReport:
    """Write all frames of ``source`` to ``path``, whose suffix is one of `DOCUMENTS`; one frame is a still.

    Frame k (by position in ``source``) is shown from k / ``fps`` seconds. ``loop``: how often the film is played,
    0 for ever. ``text``: how texts are written (None: as `TextForm` says). The same film gives the same bytes. The file
    appears whole or not at all; `UsageError` if it cannot be written (``output/unwritable``) or there is no frame
    (``output/no-frames``).
    """
    held = list(chunks(source))
    if not held:
        raise usage_error("output/no-frames", "there is no frame to draw")
    named = scene.source.path
    title = "Movimentum" if named.startswith("<") else Path(named).stem
    film = make_film(scene, prepared, concatenate(held), title, fps, loop)
    live = path.suffix.lower() == ".pdf" if text is None else text is TextForm.LIVE
    film = replace(film, live=live)
    document = DOCUMENTS[path.suffix.lower()](film)
    with whole_file(path) as part, part.open("wb") as stream:
        stream.writelines(document)
    if progress is not None:
        progress(film.frames, film.frames)
    size = (prepared.view.width, prepared.view.height)
    notes = tuple(rastered(prepared, path.suffix[1:].upper()))
    return WriteReport((path,), film.frames, size, film.frames / fps, 1, notes)
