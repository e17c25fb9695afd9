"""The variants of one script: solved together where they are alike, the others one by one."""

from __future__ import annotations

import gc

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.records import dataclass, field
from movimentum.tolerances import SAME_BOTH_WAYS, SAME_BOTH_WAYS_FREE
from movimentum.variants.axes import VariantGrid
from movimentum.variants.outcomes import OUTCOMES, VariantRows, joined
from movimentum.variants.single import Variants
from movimentum.variants.together.batch import Batch
from movimentum.variants.together.preparation import prepare

FEW = 12
"""Variants of one structure below which solving them together does not pay."""
PROVEN = 3
"""Variants that are solved both ways before the others are solved together."""
COLLECTED = 500
"""Variants solved one by one between two collections: each leaves 8 kB in cycles, which commands do not collect."""
BLOCKS, SMALLEST, LARGEST = 16, 128, 1024
"""Blocks that a sweep has at least, and variants in a block, at least and at most."""
EACH_ALONE = 32
"""Variants after which rows go to the table, where each is solved by itself."""


@dataclass(eq=False)
class Family:
    """Solves variants of ``grid``, block by block (see `block_size`): the last digits of what is solved together depend
    on the company, so the company of each variant is always the same, whoever asks for which of them. ``alone`` and
    ``together`` count them by the way they were solved; ``reasons`` tell why a structure is solved one by one.
    """

    variants: Variants
    grid: VariantGrid
    alone: int = field(default=0, init=False)
    together: int = field(default=0, init=False)
    reasons: list[str] = field(default_factory=list[str], init=False)

    def __post_init__(self) -> None:
        low = [float(axis.values[:, k].min()) for axis in self.grid.axes for k in range(len(axis.names))]
        high = [float(axis.values[:, k].max()) for axis in self.grid.axes for k in range(len(axis.names))]
        self._intervals = dict(zip(self.grid.names, zip(low, high, strict=True), strict=True))
        self._structural: tuple[str, ...] | None = None
        self._batches: dict[tuple[float, ...], Batch | None] = {}
        self._whole: Batch | None = None

    def rows(self, numbers: IntArray) -> VariantRows:
        """The rows of the variants ``numbers`` (V,), in rising order."""
        size = block_size(len(self.grid))
        blocks = np.split(numbers, np.nonzero(np.diff(numbers // size))[0] + 1) if len(numbers) else [numbers]
        return joined([self._of_block(some, size) for some in blocks])

    @property
    def one_by_one(self) -> bool:
        """Whether no two variants are solved together, so that blocks do not matter."""
        if len(self.grid) >= FEW and self._structural is None:
            self._structural = self._found_structural()
        return len(self.grid) < FEW or self._structural == self.grid.names

    def _of_block(self, some: IntArray, size: int) -> VariantRows:
        """The rows of some variants of one block."""
        if self.one_by_one or len(some) == 0:
            return self._one_by_one(self.grid.rows(some))
        first = int(some[0]) // size * size
        rows = self._block(self.grid.rows(np.arange(first, min(first + size, len(self.grid)), dtype=np.int64)))
        place = some - first
        return VariantRows(rows.constants[place], rows.measures[place], rows.outcomes[place], rows.times[place])

    def _block(self, constants: FloatArray) -> VariantRows:
        count = len(constants)
        result = VariantRows(
            constants,
            np.full((count, len(self.variants.measures.measures)), np.nan),
            np.zeros(count, dtype=np.int64),
            np.full(count, np.nan),
        )
        left = np.ones(count, dtype=np.bool_)
        for key, chosen in self._groups(constants):
            batch = self._batch(key)
            if batch is not None:
                self._solve(batch, constants, chosen, result, left)
        self._put(result, left, self._one_by_one(constants[left]))
        return result

    def _solve(
        self, batch: Batch, constants: FloatArray, chosen: BoolArray, result: VariantRows, left: BoolArray
    ) -> None:
        places = np.nonzero(chosen)[0]
        columns = [self.grid.names.index(name) for name in batch.pattern.names]
        step = batch.at_once()
        for first in range(0, len(places), step):
            some = places[first : first + step]
            try:
                rows, unsure = batch.rows_refined(constants[some][:, columns])
            except Exception as error:  # see `_batch`
                self.reasons.append(str(error).split("\n")[0])
                continue
            result.measures[some], result.outcomes[some], result.times[some] = rows.measures, rows.outcomes, rows.times
            left[some] = unsure
            self.together += int((~unsure).sum())

    def _put(self, result: VariantRows, where: BoolArray, rows: VariantRows) -> None:
        result.measures[where] = rows.measures
        result.outcomes[where] = rows.outcomes
        result.times[where] = rows.times

    def _groups(self, constants: FloatArray) -> list[tuple[tuple[float, ...], BoolArray]]:
        """The variants by the values of the constants that decide their structure."""
        assert self._structural is not None
        columns = [self.grid.names.index(name) for name in self._structural]
        if not columns:
            return [((), np.ones(len(constants), dtype=np.bool_))]
        keys, inverse = np.unique(constants[:, columns], axis=0, return_inverse=True)
        inverse = np.ravel(inverse)
        return [(tuple(key), inverse == k) for k, key in enumerate(keys.tolist())]

    def _found_structural(self) -> tuple[str, ...]:
        """The constants on which more depends than the numbers in equations."""
        names = self.grid.names
        found: list[str] = []
        (row,) = self.grid.rows(np.array([len(self.grid) // 2])).tolist()
        middle = dict(zip(names, row, strict=True))
        try:
            self._whole = prepare(self.variants, {}, self._intervals)
            return ()
        except Exception as error:  # see `_batch`
            self.reasons.append(str(error).split("\n")[0])
        if len(names) == 1:
            return names
        for name in names:
            fixed = {other: value for other, value in middle.items() if other != name}
            try:
                prepare(self.variants, fixed, {name: self._intervals[name]})
            except Exception as error:
                self.reasons.append(f"{name}: " + str(error).split("\n")[0])
                found.append(name)
        return tuple(found)

    def _batch(self, key: tuple[float, ...]) -> Batch | None:
        """The batch solver for variants of one structure; None if that is impossible, or not worth it."""
        if key in self._batches:
            return self._batches[key]
        assert self._structural is not None
        fixed: dict[str, float] = dict(zip(self._structural, key, strict=True))
        share = len(self.grid)
        for axis in self.grid.axes:
            if set(axis.names) & set(self._structural):
                share //= max(1, len(axis))
        if share < FEW:
            return None
        intervals = {name: each for name, each in self._intervals.items() if name not in fixed}
        try:
            batch = self._whole or prepare(self.variants, fixed, intervals)
            self._batches[key] = batch if self._proven(batch, self._examples(fixed)) else None
        except Exception as error:  # whatever it is, the single solver has the last word
            self.reasons.append(str(error).split("\n")[0])
            self._batches[key] = None
        return self._batches[key]

    def _examples(self, fixed: dict[str, float]) -> FloatArray:
        """(N, C) variants from all over the grid that have the values ``fixed``."""
        columns: list[FloatArray] = []
        for axis in self.grid.axes:
            wanted = [(k, fixed[name]) for k, name in enumerate(axis.names) if name in fixed]
            left = (
                axis.values[np.all([axis.values[:, k] == value for k, value in wanted], axis=0)]
                if wanted
                else axis.values
            )
            columns.append(left[[round(k * (len(left) - 1) / (PROVEN - 1)) for k in range(PROVEN)]])
        return np.unique(np.concatenate(columns, axis=1), axis=0)

    def _proven(self, batch: Batch, examples: FloatArray) -> bool:
        """Whether some variants come out the same both ways."""
        columns = [self.grid.names.index(name) for name in batch.pattern.names]
        rows, unsure = batch.rows(examples[:, columns])
        drifts = any(segment.drifting for segment in batch.pattern.segments)
        same = SAME_BOTH_WAYS_FREE if drifts else SAME_BOTH_WAYS
        for k, example in enumerate(examples.tolist()):
            if unsure[k]:
                continue
            values = dict(zip(self.grid.names, example, strict=True))
            outcome, time, measures = self.variants.row(values)
            off = np.abs(rows.measures[k] - measures) > same * (1.0 + np.abs(measures))
            if (
                OUTCOMES[int(rows.outcomes[k])] is not outcome
                or off.any()
                or abs(rows.times[k] - time) > SAME_BOTH_WAYS
            ):
                self.reasons.append(f"variant {values} gives a different result when solved by itself")
                return False
        return True

    def _one_by_one(self, constants: FloatArray) -> VariantRows:
        names = self.variants.names
        count = len(constants)
        measures = np.full((count, len(self.variants.measures.measures)), np.nan)
        outcomes = np.zeros(count, dtype=np.int64)
        times = np.full(count, np.nan)
        for place, values in enumerate(constants.tolist()):
            if (self.alone + place) % COLLECTED == COLLECTED - 1:
                gc.collect()
            outcome, times[place], measures[place] = self.variants.row(dict(zip(names, values, strict=True)))
            outcomes[place] = outcome.code
        self.alone += count
        return VariantRows(constants, measures, outcomes, times)


def block_size(total: int) -> int:
    """How many of ``total`` variants, from a multiple of that number on, are solved in each other's company."""
    return min(max(total // BLOCKS, SMALLEST), LARGEST)
