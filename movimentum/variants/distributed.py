"""Sweeps on a cluster: groups of variants go out, their rows come back."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from movimentum.arrays import IntArray
from movimentum.records import dataclass, replace
from movimentum.variants.family import Family, block_size
from movimentum.variants.outcomes import VariantRows
from movimentum.variants.sweep import Solver, SweepJob, pieces
from movimentum.workflow.clusters import done_by, threads_of, unpacked

LARGEST = 16
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
        size = min(max(total // (PIECES * threads_of(self.client) * block), 1), LARGEST) * block
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
