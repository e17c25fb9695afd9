"""Pictures of a sweep: plots of a measure over one constant or two, and the contact sheet of some variants."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.arrays import FloatArray
from movimentum.encoding.heat_map import HeatMap, write_heat_map
from movimentum.encoding.plot import COLORS, write_curves
from movimentum.errors import MovimentumError, usage_error
from movimentum.output.files import refuse_unwritable, whole_file
from movimentum.records import dataclass, replace
from movimentum.rendering.small_multiples import SheetCell, write_small_multiples
from movimentum.settings import FailurePolicy
from movimentum.syntax.suggest import nearest
from movimentum.text import number
from movimentum.variants.axes import VariantGrid
from movimentum.variants.measures import MeasureSet
from movimentum.variants.outcomes import OUTCOMES
from movimentum.variants.single import Variants
from movimentum.variants.sweep import SweepJob
from movimentum.workflow.animate import animate
from movimentum.workflow.choices import Picture, Progress

MOST_PLOTTED = 4_000_000


@dataclass(frozen=True, slots=True)
class Plot:
    """``measure`` (its number) over the constants ``over`` (one or two), to be drawn in ``target``."""

    over: tuple[str, ...]
    measure: int
    target: Path


def read_plots(texts: Sequence[str], grid: VariantGrid, measures: MeasureSet, beside: Path) -> list[Plot]:
    """Plots from texts such as ``crank,b,stride``; `UsageError` (``usage/plot``) for what cannot be drawn.

    Pictures stand ``beside`` the table (or the script), with the measure's name at the end of theirs.
    """
    plots: list[Plot] = []
    for text in texts:
        words = [word.strip() for word in text.split(",")]
        example = Choose.PLOT.to(",".join([*grid.names[:2], *measures.names[:1]] or ["R", "L", "stroke"]))
        if not 2 <= len(words) <= 3:
            raise usage_error("usage/plot", f"`{text}`: a plot is of one or two constants and a measure", example)
        *over, name = words
        for word in over:
            if word not in grid.names:
                guess = nearest(word, grid.names)
                raise usage_error(
                    "usage/plot", f"`{word}` does not vary", f"did you mean `{guess}`?" if guess else example
                )
        if name not in measures.names:
            guess = nearest(name, measures.names)
            raise usage_error(
                "usage/plot", f"there is no measure `{name}`", f"did you mean `{guess}`?" if guess else example
            )
        others = [axis for axis in grid.axes if not set(axis.names) & set(over) and len(axis) > 1]
        most = len(COLORS) if len(over) == 1 else 1
        if int(np.prod([len(axis) for axis in others])) > most:
            names = ", ".join(f"`{axis.names[0]}`" for axis in others)
            message = f"`{text}`: {names} varies too, which this plot cannot show"
            raise usage_error(
                "usage/plot",
                message,
                Advised("one value of it: ", Choose.SET.to(), f" {others[0].names[0]}=…"),
                example,
            )
        if len(grid) > MOST_PLOTTED:
            raise usage_error("usage/plot", f"{len(grid):,} variants are too many for a plot")
        target = beside.with_name(f"{beside.stem}-{re.sub(r'[^A-Za-z0-9_]+', '-', name)}.png")
        refuse_unwritable(target)
        plots.append(Plot(tuple(over), measures.names.index(name), target))
    return plots


def write_plots(plots: Sequence[Plot], grid: VariantGrid, measures: MeasureSet, values: FloatArray) -> None:
    """Draw them; ``values`` (variants, measures)."""
    constants = grid.rows(np.arange(len(grid), dtype=np.int64))
    for plot in plots:
        name = measures.names[plot.measure]
        with whole_file(plot.target) as part:
            if len(plot.over) == 1:
                _lines(plot, grid, constants, values[:, plot.measure], name, part)
            else:
                _map(plot, grid, constants, values[:, plot.measure], name, part)


def _lines(plot: Plot, grid: VariantGrid, constants: FloatArray, values: FloatArray, name: str, path: Path) -> None:
    across = constants[:, grid.names.index(plot.over[0])]
    other = [k for k, each in enumerate(grid.names) if each not in _together(grid, plot.over[0])]
    keys = constants[:, other]
    places = np.unique(across)
    curves: list[tuple[str, list[float]]] = []
    for key in np.unique(keys, axis=0) if other else keys[:1]:
        chosen = (keys == key).all(axis=1) if other else np.ones(len(across), dtype=np.bool_)
        found = dict(zip(across[chosen].tolist(), values[chosen].tolist(), strict=True))
        names = ", ".join(f"{grid.names[k]} = {number(value)}" for k, value in zip(other, key.tolist(), strict=True))
        curves.append((names or name, [found.get(place, np.nan) for place in places.tolist()]))
    write_curves(name, places.tolist(), curves, path, ".png", across_label=plot.over[0])


def _together(grid: VariantGrid, name: str) -> tuple[str, ...]:
    return next(axis.names for axis in grid.axes if name in axis.names)


def _map(plot: Plot, grid: VariantGrid, constants: FloatArray, values: FloatArray, name: str, path: Path) -> None:
    x, y = (constants[:, grid.names.index(each)] for each in plot.over)
    across, up = plot.over
    xs, ys = np.unique(x), np.unique(y)
    if len(xs) * len(ys) == len(values):
        table = np.full((len(ys), len(xs)), np.nan)
        table[np.searchsorted(ys, y), np.searchsorted(xs, x)] = values
        write_heat_map(HeatMap(name, across, up, xs, ys, table), path)
    else:
        write_heat_map(HeatMap(name, across, up, x, y, values), path)


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
