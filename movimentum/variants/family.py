"""The variants of one script, solved together as far as they are alike, and the others one by one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.variants.axes import Grid
from movimentum.variants.outcomes import VariantRows
from movimentum.variants.single import Variants


@dataclass(eq=False)
class Family:
    """Solves variants of ``grid``. ``alone`` counts those that were solved one by one."""

    variants: Variants
    grid: Grid
    alone: int = field(default=0, init=False)

    def rows(self, constants: FloatArray) -> VariantRows:
        """(V, C) values of the constants -> the rows of these variants."""
        return self._one_by_one(constants)

    def _one_by_one(self, constants: FloatArray) -> VariantRows:
        names = self.variants.names
        count = len(constants)
        measures = np.full((count, len(self.variants.measures.measures)), np.nan)
        outcomes = np.zeros(count, dtype=np.int64)
        times = np.full(count, np.nan)
        for place, values in enumerate(constants.tolist()):
            outcome, times[place], measures[place] = self.variants.row(dict(zip(names, values, strict=True)))
            outcomes[place] = outcome.code
        self.alone += count
        return VariantRows(constants, measures, outcomes, times)
