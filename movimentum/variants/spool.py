"""Finished variants, stored beside the future table, so that a sweep can be resumed.

The file has one line of JSON, which identifies the sweep, and then one record of float64 for each variant: the
outcome's code plus one (0: not finished), the time, the measures. The constants follow from the number.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.arrays import FloatArray, IntArray
from movimentum.errors import usage_error
from movimentum.records import dataclass
from movimentum.terminal import typed
from movimentum.variants.axes import VariantGrid
from movimentum.variants.outcomes import VariantRows

CHUNK = 16_384
"""Rows read at a time."""


def signature(parts: list[str], grid: VariantGrid) -> str:
    """The identity of a sweep: texts, and every value of every axis."""
    found = hashlib.sha256(json.dumps(parts).encode())
    for axis in grid.axes:
        found.update(json.dumps([*axis.names, len(axis)]).encode())
        found.update(np.ascontiguousarray(axis.values).tobytes())
    return found.hexdigest()


def spool_path(target: Path) -> Path:
    """The file of finished variants for the table ``target``."""
    return target.with_name(f"{target.name}.unfinished")


@dataclass(slots=True, eq=False)
class VariantSpool:
    """An open file of finished variants of ``grid`` with ``columns`` measures."""

    stream: BinaryIO
    begin: int
    grid: VariantGrid
    columns: int

    @property
    def _width(self) -> int:
        return self.columns + 2

    def write(self, first: int, rows: VariantRows) -> None:
        """Keep the variants ``first``, ``first + 1``, …"""
        table = np.column_stack([rows.outcomes + 1.0, rows.times, rows.measures])
        self.stream.seek(self.begin + first * self._width * 8)
        self.stream.write(np.ascontiguousarray(table, dtype="<f8").tobytes())
        self.stream.flush()

    def _table(self, first: int, stop: int) -> FloatArray:
        self.stream.seek(self.begin + first * self._width * 8)
        data = self.stream.read((stop - first) * self._width * 8)
        table = np.zeros((stop - first) * self._width)
        found = np.frombuffer(data[: len(data) // 8 * 8], dtype="<f8")
        table[: len(found)] = found
        return table.reshape(stop - first, self._width)

    def rows(self) -> Iterator[VariantRows]:
        """All variants in order, some at a time; those that are not finished are left out."""
        for first in range(0, len(self.grid), CHUNK):
            stop = min(first + CHUNK, len(self.grid))
            table = self._table(first, stop)
            done = table[:, 0] > 0.0
            numbers = np.arange(first, stop, dtype=np.int64)[done]
            table = table[done]
            outcomes = table[:, 0].astype(np.int64) - 1
            yield VariantRows(self.grid.rows(numbers), table[:, 2:], outcomes, table[:, 1])

    def waiting(self) -> Iterator[IntArray]:
        """The numbers of the variants that are not finished, some at a time."""
        for first in range(0, len(self.grid), CHUNK):
            stop = min(first + CHUNK, len(self.grid))
            left = np.nonzero(self._table(first, stop)[:, 0] == 0.0)[0]
            if len(left):
                yield first + left.astype(np.int64)

    def finished(self) -> int:
        """How many variants are finished."""
        return sum(len(rows) for rows in self.rows())


def open_spool(path: Path, key: str, grid: VariantGrid, columns: int, *, resume: bool) -> VariantSpool:
    """The file of finished variants at ``path``; with ``resume``, what is in it stays, if it is of the same sweep.

    Raises `UsageError` (``usage/resume``) if it is of another one, and if it cannot be written.
    """
    header = (json.dumps({"movimentum": "sweep", "key": key, "variants": len(grid)}) + "\n").encode()
    try:
        if resume and path.exists():
            stream = path.open("r+b")
            first = stream.readline(4096)
            if first != header:
                stream.close()
                message = f"{path} is from another sweep: its script, values or measures were different"
                again = Advised("leave out ", Choose.RESUME.to(), " to solve everything again")
                raise usage_error("usage/resume", message, again, f"rm {typed(path)}")
            return VariantSpool(stream, len(header), grid, columns)
        stream = path.open("w+b")
        stream.write(header)
        stream.flush()
    except OSError as problem:
        from movimentum.output.files import unwritable

        raise unwritable(path, (problem.strerror or str(problem)).lower()) from problem
    return VariantSpool(stream, len(header), grid, columns)


def remove_spool(path: Path) -> None:
    """Remove a file of finished variants, which are in their table now."""
    with suppress(OSError):
        os.unlink(path)
