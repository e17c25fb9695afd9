"""`sweep`: many variants of one script, in batches, and their table.

On a cluster, groups of variants go out and their rows come back.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.output.files import explained, refuse_overwriting, refuse_unwritable, whole_file
from movimentum.records import dataclass, field, replace
from movimentum.source import SourceText
from movimentum.variants.axes import VariantGrid, check_constants
from movimentum.variants.family import EACH_ALONE, LARGEST, Family, block_size
from movimentum.variants.measures import MeasureSet
from movimentum.variants.outcomes import (
    OUTCOMES,
    VariantOutcome,
    VariantRows,
    check_table,
    write_csv,
    write_lines,
    write_table,
)
from movimentum.variants.single import Variants
from movimentum.variants.spool import VariantSpool, open_spool, remove_spool, signature, spool_path
from movimentum.workflow.choices import Choices, Progress
from movimentum.workflow.clusters import done_by, own_version, threads_of, unpacked
from movimentum.workflow.read import ScriptFiles, reads
from movimentum.workflow.stages import arranged, understand

if TYPE_CHECKING:
    from movimentum.scene.model import Scene


MOST = 64 * LARGEST
"""Numbers of variants that are listed at a time."""


@dataclass(frozen=True, slots=True, eq=False)
class SweepJob:
    """The input of a sweep: a script read with ``choices``, the variants of ``grid``, what is measured. It can be sent
    to other processes, which come to the same rows, with what ``files`` know of others than the script.
    """

    source: SourceText
    choices: Choices
    grid: VariantGrid
    measures: MeasureSet
    files: ScriptFiles = field(default_factory=ScriptFiles)

    @property
    def columns(self) -> list[str]:
        """The constants, then the measures."""
        return [*self.grid.names, *self.measures.names]

    def family(self) -> Family:
        """The solver of its variants."""
        return Family(Variants(self.source, self.choices, self.grid.names, self.measures, self.files), self.grid)


@dataclass(frozen=True, slots=True, eq=False)
class Swept:
    """The result of a sweep: the number of variants of each outcome; their measures (V, M), where they were to be
    kept.
    """

    counts: Counter[VariantOutcome]
    measures: FloatArray | None = None

    @property
    def exit_code(self) -> int:
        """0 where some variant moves, else 3."""
        return 0 if any(outcome.moves for outcome in self.counts) else 3


def prepared(source: SourceText, choices: Choices, grid: VariantGrid, measures: MeasureSet) -> tuple[SweepJob, Scene]:
    """The job of a sweep, checked: the script, its constants and the measures make sense (before anything is solved).

    Raises `ScriptError` and `UsageError`.
    """
    from movimentum.variants.lowered import lower_measures

    job = SweepJob(source, choices, grid, measures)
    scene = understand(source, choices, files=job.files)
    check_constants(grid, scene.constants)
    if measures.measures:
        own = {constant.name: constant for constant in scene.constants}
        variants = Variants(source, choices, grid.names, measures, job.files)
        traced = variants.traced_choices({name: float(own[name].value[0].value) for name in grid.names})
        timeline = arranged(understand(source, traced, files=job.files), traced)
        lower_measures(measures, source, traced, timeline, job.files)
    return job, scene


def solved_chunks(family: Family, waiting: Iterator[IntArray]) -> Iterator[tuple[IntArray, VariantRows]]:
    """The variants ``waiting`` (by their numbers), block by block; fewer at a time where each takes long."""
    size = EACH_ALONE if family.one_by_one else block_size(len(family.grid))
    return ((some, family.rows(some)) for some in pieces(waiting, size))


def sweep_to_file(
    job: SweepJob,
    scene: Scene,
    target: Path,
    progress: Progress,
    *,
    resume: bool = False,
    keep: bool = False,
    solver: Solver | None = None,
) -> Swept:
    """Write the table of a sweep to ``target``. What is finished when it is interrupted is kept beside it; with
    ``resume`` that is not solved again. ``keep``: the measures are wanted in memory, too.
    """
    check_table(target)
    refuse_unwritable(target)
    refuse_overwriting(target, reads(job.source, scene))
    total = len(job.grid)
    path = spool_path(target)
    said = [scene.source.text, repr(sorted(map(str, job.choices.settings))), str(job.choices.fps), own_version()]
    said += [f"{measure.name}={measure.text}" for measure in job.measures.measures]
    spool = open_spool(path, signature(said, job.grid), job.grid, len(job.measures.measures), resume=resume)
    with explained(target, path), spool.stream:
        done = spool.finished() if resume else 0
        solver = solver or Here(job)
        for numbers, rows in solver.solved(spool.waiting()):
            _keep(spool, numbers, rows)
            done += len(numbers)
            progress(done, total)
        with whole_file(target) as part:
            write_table(job.columns, spool.rows, total, part, target.suffix)
        counts = Counter[VariantOutcome]()
        kept: list[FloatArray] = []
        for rows in spool.rows():
            _count(counts, rows)
            kept += [rows.measures] if keep else []
    remove_spool(path)
    return Swept(counts, np.concatenate(kept) if keep else None)


def _keep(spool: VariantSpool, numbers: IntArray, rows: VariantRows) -> None:
    breaks = np.nonzero(np.diff(numbers) != 1)[0] + 1
    for begin, end in zip([0, *breaks.tolist()], [*breaks.tolist(), len(numbers)], strict=True):
        part = slice(begin, end)
        some = VariantRows(rows.constants[part], rows.measures[part], rows.outcomes[part], rows.times[part])
        spool.write(int(numbers[begin]), some)


def sweep_to_stream(job: SweepJob, progress: Progress, *, keep: bool = False, solver: Solver | None = None) -> Swept:
    """Write the table as CSV to standard output, line by line as the variants are finished, in order. ``keep``: see
    `sweep_to_file`.
    """
    from movimentum.output.files import standard_output

    stream = standard_output()
    write_csv(job.columns, (), stream)
    counts = Counter[VariantOutcome]()
    done = 0
    kept: list[FloatArray] = []
    for _, rows in in_order((solver or Here(job)).solved(numbered(len(job.grid)))):
        write_lines(rows, stream)
        _count(counts, rows)
        kept += [rows.measures] if keep else []
        done += len(rows)
        progress(done, len(job.grid))
    return Swept(counts, np.concatenate(kept) if keep else None)


def in_order(parts: Iterator[tuple[IntArray, VariantRows]]) -> Iterator[tuple[IntArray, VariantRows]]:
    """The same parts in the order of their numbers, which begin with 0."""
    waiting: dict[int, tuple[IntArray, VariantRows]] = {}
    expected = 0
    for part in parts:
        waiting[int(part[0][0])] = part
        while expected in waiting:
            found = waiting.pop(expected)
            expected += len(found[0])
            yield found


def sweep_rows(job: SweepJob, solver: Solver | None = None) -> VariantRows:
    """All variants at once, in memory."""
    from movimentum.variants.outcomes import joined

    return joined([rows for _, rows in in_order((solver or Here(job)).solved(numbered(len(job.grid))))])


def numbered(total: int) -> Iterator[IntArray]:
    """The numbers of all variants, some at a time."""
    for first in range(0, total, MOST):
        yield np.arange(first, min(first + MOST, total), dtype=np.int64)


def pieces(waiting: Iterator[IntArray], size: int) -> Iterator[IntArray]:
    """What is ``waiting``, in pieces that end where a number is a multiple of ``size``."""
    for numbers in waiting:
        yield from np.split(numbers, np.nonzero(np.diff(numbers // size))[0] + 1)


@dataclass(frozen=True, slots=True, eq=False)
class Solver:
    """Solves the variants of a job."""

    job: SweepJob

    def solved(self, waiting: Iterator[IntArray]) -> Iterator[tuple[IntArray, VariantRows]]:
        """The variants ``waiting``, by number, in any order."""
        raise NotImplementedError


class Here(Solver):
    """Solves in this process."""

    def solved(self, waiting: Iterator[IntArray]) -> Iterator[tuple[IntArray, VariantRows]]:
        """The variants in order."""
        return solved_chunks(self.job.family(), waiting)


def _count(counts: Counter[VariantOutcome], rows: VariantRows) -> None:
    for code, many in enumerate(np.bincount(rows.outcomes, minlength=len(OUTCOMES)).tolist()):
        if many:
            counts[OUTCOMES[code]] += many


def counts_text(counts: Counter[VariantOutcome]) -> str:
    """``1,200 ok, 113 bind``."""
    words: dict[VariantOutcome, Sequence[str]] = {
        VariantOutcome.OK: ("ok", "ok"),
        VariantOutcome.BINDS: ("binds", "bind"),
        VariantOutcome.UNASSEMBLED: ("cannot be assembled", "cannot be assembled"),
        VariantOutcome.JUMPS: ("jumps", "jump"),
    }
    return ", ".join(f"{counts[kind]:,} {words[kind][counts[kind] != 1]}" for kind in OUTCOMES if counts[kind])


MOST_BLOCKS = 16
"""Blocks of variants (`variants.family.block_size`) in a piece of work, at most; the least is one."""
PIECES = 8
"""For each thread, where there are enough variants."""


@dataclass(frozen=True, slots=True, eq=False)
class OnCluster(Solver):
    """Solves on the workers of ``client``, a `distributed.Client`."""

    client: Any

    def solved(self, waiting: Iterator[IntArray]) -> Iterator[tuple[IntArray, VariantRows]]:
        """The variants in order."""
        total = len(self.job.grid)
        block = block_size(total)
        size = min(max(total // (PIECES * threads_of(self.client) * block), 1), MOST_BLOCKS) * block
        work = ((numbers,) for numbers in pieces(waiting, size))
        job = replace(self.job, files=replace(self.job.files, complete=True))  # the workers need not share our disk
        yield from done_by(self.client, solve_piece, job, work)


@lru_cache(maxsize=1)
def _family(data: bytes) -> Family:
    """The family of the sweep that this worker was last asked for: what it finds out about its variants is kept."""
    job: SweepJob = unpacked(data)
    return job.family()


def solve_piece(data: bytes, numbers: IntArray) -> tuple[IntArray, VariantRows]:
    """The rows of the variants ``numbers``; runs on a worker."""
    family = _family(data)
    return numbers, family.rows(numbers)
