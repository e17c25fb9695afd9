"""The images of a film embedded in the file, each once: outlines of drawings, and pixels."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.model import ImageMark
from movimentum.encoding.gif_notes import RASTER
from movimentum.encoding.pieces import saved
from movimentum.geometry import Affine, image_to_local
from movimentum.records import dataclass
from movimentum.rendering.images import is_drawing
from movimentum.rendering.marks import PreparedMark
from movimentum.rendering.prepare import PreparedDrawing
from movimentum.rendering.sprites import Sprite

if TYPE_CHECKING:  # few films have drawings
    from movimentum.vector.drawings import Outlines


@dataclass(frozen=True, slots=True)
class Embedded:
    """A picture in a file. ``drawn``: its outlines, if it has any, else it is pixels. ``to_local`` maps what is in the
    file (y down) to the thing's local frame; ``size`` is how much that is, (width, height).
    """

    sprite: Sprite
    drawn: Outlines | None
    to_local: Affine
    size: tuple[int, int]

    @property
    def data(self) -> str:
        """The picture as a data URI."""
        if self.drawn is not None:
            return f"data:image/svg+xml;base64,{_base64(self.drawn.document.encode())}"
        return f"data:image/png;base64,{_base64(saved(self.sprite.image.convert('RGBA'), 'PNG', optimize=True))}"


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def embedded(prepared: PreparedDrawing) -> tuple[list[Embedded], dict[int, int]]:
    """The pictures of all images among a drawing's marks; and mark number -> number of its picture."""
    pictures: list[Embedded] = []
    known: dict[int, int] = {}
    places: dict[int, int] = {}
    for number, item in enumerate((*prepared.things, *prepared.beside)):
        sprite = item.sprite
        if sprite is None or sprite.image.mode == "L":  # a text
            continue
        if id(sprite) not in known:
            known[id(sprite)] = len(pictures)
            pictures.append(_picture(item, sprite, f"d{len(pictures)}", prepared))
        places[number] = known[id(sprite)]
    return pictures, places


def _picture(item: PreparedMark, sprite: Sprite, name: str, prepared: PreparedDrawing) -> Embedded:
    mark = item.mark
    if isinstance(mark, ImageMark) and is_drawing(mark.path):
        found = _outlines(mark, name, prepared)
        if found.text:
            to_local = image_to_local(found.size[1], mark.pixel)
            return Embedded(sprite, found, to_local if mark.placed is None else mark.placed @ to_local, found.size)
    return Embedded(sprite, None, sprite.to_local, sprite.image.size)


def _outlines(mark: ImageMark, name: str, prepared: PreparedDrawing) -> Outlines:
    from movimentum.vector.drawings import outlines

    fine = mark.pixel * prepared.view.scale * prepared.closest
    return outlines(mark.path, name, max(0, 2 + math.ceil(math.log10(fine))))


def rastered(prepared: PreparedDrawing, kind: str) -> Iterator[Diagnostic]:
    """A note for each drawing that is pixels in a file of a ``kind`` that could have its outlines."""
    reported: set[str] = set()
    marks: Sequence[PreparedMark] = (*prepared.things, *prepared.beside)
    for item in marks:
        mark = item.mark
        if not isinstance(mark, ImageMark) or not is_drawing(mark.path) or mark.path in reported:
            continue
        reported.add(mark.path)
        reason = _outlines(mark, "d", prepared).reason
        if reason:
            yield Diagnostic(
                RASTER,
                Severity.NOTE,
                f"`{Path(mark.path).name}` is made of pixels in the {kind}, because it has {reason}",
                mark.span,
                helps=(
                    Advised("save it with plain paths and colours only, or draw it larger: `", Choose.SCALE.to(2), "`"),
                ),
            )
