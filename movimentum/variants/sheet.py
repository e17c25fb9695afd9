"""The contact sheet of a sweep: what some variants look like."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path

import numpy as np

from movimentum.advice import Choose
from movimentum.errors import MovimentumError, usage_error
from movimentum.output.files import refuse_unwritable, whole_file
from movimentum.records import replace
from movimentum.rendering.small_multiples import SheetCell, write_small_multiples
from movimentum.settings import FailurePolicy
from movimentum.text import number
from movimentum.variants.outcomes import OUTCOMES
from movimentum.variants.single import Variants
from movimentum.variants.sweep import SweepJob
from movimentum.workflow.animate import animate
from movimentum.workflow.choices import Picture, Progress

MOST_CELLS = 100


def check_sheet(target: Path) -> None:
    """Raise `UsageError` if no sheet can be written there."""
    if target.suffix.lower() != ".png":
        raise usage_error("usage/output", f"{target}: a sheet is a .png", Choose.SHEET.to(target.with_suffix(".png")))
    refuse_unwritable(target)


def write_sheet(job: SweepJob, target: Path, progress: Progress) -> int:
    """Write pictures of at most `MOST_CELLS` variants, evenly chosen, to ``target``; returns how many. A variant that
    does not move has a red frame, and the picture of where it stops, if it has one.
    """
    total = len(job.grid)
    count = min(total, MOST_CELLS)
    numbers = np.unique(np.linspace(0, total - 1, count).round().astype(np.int64))
    shape = job.grid.shape
    columns = shape[-1] if total <= MOST_CELLS and len(shape) > 1 and 2 <= shape[-1] <= 12 else None
    with tempfile.TemporaryDirectory() as folder, whole_file(target) as part:
        cells: list[SheetCell] = []
        for cell in _cells(job, numbers.tolist(), Path(folder)):
            cells.append(cell)
            progress(len(cells), len(numbers))
        write_small_multiples(cells, columns, part)
    return len(numbers)


def _cells(job: SweepJob, numbers: list[int], folder: Path) -> Iterator[SheetCell]:
    variants = Variants(job.source, job.choices, job.grid.names, job.measures)
    values = job.grid.rows(np.array(numbers))
    for place, row in enumerate(values.tolist()):
        chosen = dict(zip(job.grid.names, row, strict=True))
        outcome, _, _ = variants.row(chosen)
        caption = "  ".join(f"{name} = {number(value)}" for name, value in chosen.items())
        caption += "" if outcome is OUTCOMES[0] else f"  ({outcome})"
        picture = folder / f"{place}.png"
        yield SheetCell(picture if drawn(variants, chosen, picture) else None, caption, not outcome.moves)


def drawn(variants: Variants, values: Mapping[str, float], picture: Path, at: Fraction | None = None) -> bool:
    """Draw a variant (``at`` an instant) into ``picture``, a .png; False if it has none to show."""
    choices = replace(variants.choices_of(values), on_failure=FailurePolicy.HOLD)
    try:
        animate(variants.source, picture, choices, Picture(at=at), lambda done, total: None)
    except MovimentumError:
        return False
    return picture.exists()
