"""A picture of the script as it is in the editor."""

from __future__ import annotations

import itertools
from fractions import Fraction
from pathlib import Path

from movimentum.lsp.shapes import EditedFiles, Texts
from movimentum.source import SourceText
from movimentum.workflow.animate import animate
from movimentum.workflow.choices import Choices, Picture
from movimentum.workflow.stages import arranged, solved, understand

_NUMBERS = itertools.count(1)


def picture(path: str, text: str, time: Fraction | None, folder: Path, texts: Texts) -> Path:
    """Render the script to a file in ``folder``: the film as a GIF, or the instant ``time`` as a PNG.

    Raises `MovimentumError` with what is wrong with the script.
    """
    source, choices = SourceText(path, text), Choices()
    scene = understand(source, choices, files=EditedFiles(edited=texts))
    solution = solved(arranged(scene, choices), choices)
    stem = "".join(letter for letter in Path(path.strip("<>")).stem if letter.isalnum() or letter in "-_") or "script"
    target = folder / f"{stem}-{next(_NUMBERS)}{'.gif' if time is None else '.png'}"
    animate(source, target, choices, Picture(at=time, workers=1), lambda _done, _all: None, solution)
    return target
