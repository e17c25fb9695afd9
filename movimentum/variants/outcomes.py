"""Outcomes of variants (moves, binds, cannot be assembled, jumps), and tables of them as CSV, NPZ or Parquet.

A table has one row for each variant and is written some rows at a time. Columns: the constants, the measures,
``outcome`` and ``time``. If there is no motion, the measures are empty (CSV), null (Parquet) or nan (NPZ); so is the
time of a variant that is ok.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable, Iterator
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO, TextIO, cast

import numpy as np
from numpy.typing import NDArray

from movimentum.advice import Choose
from movimentum.arrays import FloatArray, IntArray
from movimentum.errors import usage_error
from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import FailureKind


class VariantOutcome(StrEnum):
    """In the order of their codes in arrays.

    ``ok``: it moves as the script says, all the time. ``binds``: from some time on it has no solution, or
    something is at infinity then. ``cannot be
    assembled``: it has none to begin with. ``jumps``: it moves, but something is suddenly elsewhere.
    """

    OK = "ok"
    BINDS = "binds"
    UNASSEMBLED = "cannot be assembled"
    JUMPS = "jumps"

    @property
    def code(self) -> int:
        """Its number in arrays of outcomes."""
        return tuple(VariantOutcome).index(self)

    @property
    def moves(self) -> bool:
        """Whether there is a motion, all the time."""
        return self in (VariantOutcome.OK, VariantOutcome.JUMPS)


OUTCOMES = tuple(VariantOutcome)


@dataclass(frozen=True, slots=True, eq=False)
class VariantRows:
    """V variants: the values of the constants (V, C), of the measures (V, M; nan where there is no motion), the
    outcomes' codes (V,), and the time (V,) at which a variant binds or jumps (nan where it does not).
    """

    constants: FloatArray
    measures: FloatArray
    outcomes: IntArray
    times: FloatArray

    def __len__(self) -> int:
        return len(self.outcomes)


def joined(parts: list[VariantRows]) -> VariantRows:
    """All rows of at least one part, in order."""
    return VariantRows(
        np.concatenate([part.constants for part in parts]),
        np.concatenate([part.measures for part in parts]),
        np.concatenate([part.outcomes for part in parts]),
        np.concatenate([part.times for part in parts]),
    )


def outcome_of(motion: PathMotion) -> tuple[VariantOutcome, float]:
    """The outcome of one motion, and its time (nan if it is ok). What only the drawing says (a claim that fails, a
    thing outside the picture) does not count.
    """
    from movimentum.analysis.diagnose.jumps import found_jumps
    from movimentum.analysis.diagnose.meshing import misplaced_gears
    from movimentum.analysis.diagnose.verify import first_unsolved_frame

    start = float(motion.timeline.start)
    for number, segment_motion in enumerate(motion.segments):
        if segment_motion.failures:
            failure = min(segment_motion.failures, key=lambda item: item.begin)
            first = number == 0 and failure.kind is FailureKind.START and failure.begin == 0.0
            kind = VariantOutcome.UNASSEMBLED if first else VariantOutcome.BINDS
            return kind, float(segment_motion.segment.start) + (failure.begin if failure.pole is None else failure.pole)
    with np.errstate(all="ignore"):
        if next(iter(misplaced_gears(motion)), None) is not None:
            return VariantOutcome.UNASSEMBLED, start
        missing = first_unsolved_frame(motion)
        if missing is not None:
            return VariantOutcome.BINDS, float(motion.timeline.frame_time(missing.frame))
        for number, segment_motion in enumerate(motion.segments):
            jump = next(found_jumps(motion, number), None)
            if jump is not None:
                return VariantOutcome.JUMPS, float(segment_motion.segment.start) + jump.beginning.time
    return VariantOutcome.OK, float("nan")


TABLE_SUFFIXES = (".csv", ".npz", ".parquet")
_CELL = max(map(len, OUTCOMES))

RowSource = Callable[[], Iterable[VariantRows]]
"""The rows, some at a time, from the first one on whenever it is called."""


def check_table(path: Path) -> None:
    """Raise `UsageError` if a table of that name cannot be written here."""
    suffix = path.suffix.lower()
    if suffix not in TABLE_SUFFIXES:
        message = f"{path}: a table of variants ends in one of {', '.join(TABLE_SUFFIXES)}"
        raise usage_error(
            "usage/output", message, Choose.OUTPUT.to(path.with_suffix(".csv") if path.name else "table.csv")
        )
    if suffix == ".parquet":
        _pyarrow()


def _pyarrow() -> Any:
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError as problem:
        message = "Parquet needs pyarrow, which is not installed"
        raise usage_error(
            "usage/extra", message, "pip install 'movimentum[parquet]'", Choose.OUTPUT.to("table.csv")
        ) from problem


def write_table(names: list[str], rows: RowSource, count: int, path: Path, suffix: str) -> None:
    """Write ``count`` rows in the format that ``suffix`` names; ``names`` are the constants and the measures."""
    match suffix.lower():
        case ".csv":
            with path.open("w", encoding="utf-8", newline="\n") as stream:
                write_csv(names, rows(), stream)
        case ".npz":
            _write_npz(names, rows, count, path)
        case _:
            _write_parquet(names, rows(), path)


def write_csv(names: list[str], rows: Iterable[VariantRows], stream: TextIO) -> None:
    """Write a header line and a line for each row."""
    stream.write(",".join(map(_quoted, [*names, "outcome", "time"])) + "\n")
    for some in rows:
        write_lines(some, stream)


def write_lines(some: VariantRows, stream: TextIO) -> None:
    """A line for each row. Numbers are in the shortest form that reads back exactly."""
    table: list[list[float]] = (np.column_stack([some.constants, some.measures, some.times]) + 0.0).tolist()
    codes: list[int] = some.outcomes.tolist()
    for row, code in zip(table, codes, strict=True):
        cells: list[str] = ["" if value != value else repr(value) for value in row]
        cells.insert(-1, str(OUTCOMES[code]))
        stream.write(",".join(cells) + "\n")


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name


def _columns(names: list[str]) -> list[tuple[str, np.dtype[Any], Callable[[VariantRows], NDArray[Any]]]]:
    def value(place: int) -> Callable[[VariantRows], FloatArray]:
        def read(rows: VariantRows) -> FloatArray:
            width = rows.constants.shape[1]
            return rows.constants[:, place] if place < width else rows.measures[:, place - width]

        return read

    texts = np.array([outcome.value for outcome in OUTCOMES], dtype=f"<U{_CELL}")
    number = np.dtype("<f8")
    return [
        *((name, number, value(place)) for place, name in enumerate(names)),
        ("outcome", texts.dtype, lambda rows: texts[rows.outcomes]),
        ("time", number, lambda rows: rows.times),
    ]


def _write_npz(names: list[str], rows: RowSource, count: int, path: Path) -> None:
    """NumPy's format, one array for each column; the rows are gone through once for each."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, dtype, read in _columns(names):
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))  # the same sweep, the same bytes
            with archive.open(entry, "w", force_zip64=True) as member:
                header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": (count,)}
                np.lib.format.write_array_header_1_0(cast("BinaryIO", member), header)
                for some in rows():
                    member.write(np.ascontiguousarray(read(some), dtype=dtype).tobytes())


def _write_parquet(names: list[str], rows: Iterable[VariantRows], path: Path) -> None:
    arrow, parquet = _pyarrow()
    columns = _columns(names)
    fields = [arrow.field(name, arrow.string() if name == "outcome" else arrow.float64()) for name, _, _ in columns]
    schema = arrow.schema(fields)
    with parquet.ParquetWriter(str(path), schema) as writer:
        for some in _batched(rows):
            arrays: list[Any] = []
            for _, dtype, read in columns:
                values = read(some)
                if dtype.kind == "U":
                    arrays.append(arrow.array(values.tolist(), type=arrow.string()))
                else:
                    arrays.append(arrow.array(values, type=arrow.float64(), mask=np.isnan(values)))
            writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))


def _batched(rows: Iterable[VariantRows]) -> Iterator[VariantRows]:
    """The rows without empty groups."""
    yield from (some for some in rows if len(some))
