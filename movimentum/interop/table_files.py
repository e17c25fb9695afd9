"""Tables of numbers in text files, as `.table` of a script reads them: the first line names the columns.

Cells are separated by commas, semicolons or tabs. Empty lines, and lines that begin with `#`, do not count. In a file
without a first line of names, columns are called 1, 2, ….
"""

from __future__ import annotations

import csv
import io
import math
import os
import warnings
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions.tables import Ends, Table
from movimentum.output.files import read_limited
from movimentum.records import dataclass
from movimentum.scene.expansion.table_files import POINTS, TableColumn
from movimentum.syntax.suggest import nearest
from movimentum.text import listed

MAX_BYTES = 256 * 2**20
KEPT = 8
"""Tables that are kept in memory while their files do not change: the next command of an editor reads them again."""


def read_table(column: TableColumn) -> Table | Diagnostic:
    """The table that ``column`` names, or what is wrong with its file: ``asset/missing``, ``asset/unreadable``,
    ``table/column`` (its label is "over" for the column of arguments), ``table/value``, ``table/order``,
    ``table/short`` or ``table/periodic``.
    """
    try:
        about = os.stat(column.path)
    except FileNotFoundError:
        beside = os.path.dirname(column.path) or "."
        names = [name for name in os.listdir(beside) if "." in name] if os.path.isdir(beside) else []
        guess = nearest(os.path.basename(column.path), names)
        helps = (f"did you mean `{guess}`?",) if guess else ()
        return _wrong("asset/missing", f"there is no file {column.path}", *helps)
    except (OSError, ValueError) as problem:
        return _unreadable(column.path, getattr(problem, "strerror", None) or str(problem))
    if column.column == POINTS and column.over:
        return _path(column)
    try:
        return _read(column, about.st_mtime_ns, about.st_size)
    except _Fault as fault:
        return fault.diagnostic


class _Fault(Exception):
    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def _wrong(code: str, message: str, *helps: str, label: str = "") -> Diagnostic:
    return Diagnostic(code, Severity.ERROR, message, label=label, helps=helps)


def _unreadable(path: str, reason: str, *helps: str) -> Diagnostic:
    return _wrong("asset/unreadable", f"cannot read {path}: {reason[:1].lower() + reason[1:]}", *helps)


@lru_cache(maxsize=KEPT)
def _read(column: TableColumn, changed: int, size: int) -> Table:
    """``changed`` and ``size`` are those of the file."""
    path = column.path
    try:
        text = read_limited(Path(path), MAX_BYTES).decode("utf-8-sig")
    except OSError as problem:
        raise _Fault(_unreadable(path, problem.strerror or str(problem))) from problem
    except UnicodeDecodeError as problem:
        helps = "save it as CSV in UTF-8"
        raise _Fault(_unreadable(path, "it is not text in UTF-8", helps)) from problem
    sheet = _Sheet.of(path, text)
    if column.column == POINTS:
        return _points(sheet)
    given = sheet.place(column.over, "over") if column.over else 0
    place = sheet.place(column.column, "")
    x, y = sheet.columns(given, place)
    return _table(column, sheet, x, y, given)


@dataclass(frozen=True, slots=True)
class _Sheet:
    """A file's text; ``names`` of its columns, ``separator``, and the number of its first line of numbers."""

    path: str
    text: str
    names: tuple[str, ...]
    separator: str
    first: int

    @staticmethod
    def of(path: str, text: str) -> _Sheet:
        """The sheet; `_Fault` if it is empty."""
        for number, line in enumerate(io.StringIO(text, newline=None), 1):
            if not line.strip() or line.startswith("#"):
                continue
            counts = {each: line.count(each) for each in "\t;,"}
            separator = next((each for each in "\t;" if counts[each]), ",")
            cells = [cell.strip() for cell in _cells(path, number, line, separator)]
            if all(_number(cell.replace(",", ".")) is not None for cell in cells):
                return _Sheet(path, text, tuple(str(k + 1) for k in range(len(cells))), separator, number)
            return _Sheet(path, text, tuple(cells), separator, number + 1)
        raise _Fault(_wrong("table/short", f"{path} has no rows"))

    def place(self, name: str, which: str) -> int:
        """Which column is called ``name``."""
        count = self.names.count(name)
        if count == 1:
            return self.names.index(name)
        if count:
            raise _Fault(_wrong("table/column", f"{self.path} has {count} columns `{name}`", label=which))
        guess = nearest(name, self.names)
        has = listed([f"`{_shown(each)}`" for each in self.names], 8)
        helps = (f"did you mean `{guess}`?",) if guess else ()
        raise _Fault(_wrong("table/column", f"{self.path} has no column `{name}`; it has {has}", *helps, label=which))

    def columns(self, *places: int) -> tuple[FloatArray, ...]:
        """The values of columns (N,) each, all finite."""
        order = sorted(set(places))
        lines = io.StringIO(self.text, newline=None)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # a file without rows
                found = np.loadtxt(
                    lines, delimiter=self.separator, comments=None, ndmin=2, skiprows=self.first - 1, usecols=order
                )
        except (ValueError, IndexError, UserWarning):
            found = None
        if found is not None and np.isfinite(found).all():
            return tuple(np.ascontiguousarray(found[:, order.index(place)]) for place in places)
        rows = [[self._value(number, cells, place) for place in places] for number, cells in self.rows()]
        return tuple(np.array(column, dtype=np.float64) for column in zip(*rows, strict=True)) or (np.empty(0),) * 2

    def rows(self) -> Iterator[tuple[int, Sequence[str]]]:
        """The number of each line of numbers, and its cells."""
        lines = io.StringIO(self.text, newline=None)
        for number, line in enumerate(lines, 1):
            if number >= self.first and line.strip() and not line.startswith("#"):
                yield number, _cells(self.path, number, line, self.separator)

    def _value(self, number: int, cells: Sequence[str], place: int) -> float:
        cell = cells[place].strip() if place < len(cells) else ""
        value = _number(cell)
        if value is not None:
            return value
        where = f"{self.path}, line {number}: "
        if _number(cell.replace(",", ".", 1)) is not None:
            message = f"{where}`{_shown(cell)}` has a decimal comma"
            raise _Fault(_wrong("table/value", message, f"write `{cell.replace(',', '.')}`"))
        if cell:
            message = f"{where}`{_shown(cell)}` is not a number for `{self.names[place]}`"
        else:
            message = f"{where}there is no number for `{self.names[place]}`"
        raise _Fault(_wrong("table/value", message, "write a number, or leave out the row"))


def _path(column: TableColumn) -> Table | Diagnostic:
    """The control points of an element's path, four for each piece, from the drawing's lower-left corner, y up; its
    ``spelled`` ends with whether it is closed. It is no function.
    """
    from movimentum.rendering.svg_paths import path_of  # few scripts have any

    found = path_of(column.path, column.over)
    if isinstance(found, Diagnostic):
        return found
    pieces, closed, height = found
    if not pieces:
        return _wrong("asset/element", f"the path of `#{column.over}` in {column.path} is empty")
    points = np.array(pieces).reshape(-1, 2)
    return Table(points[:, 0].copy(), height - points[:, 1], spelled=(column.shown, column.over, "closed" * closed))


def _points(sheet: _Sheet) -> Table:
    """The points of a curve: the columns called x and y, else the first two. It is no function."""
    places = [sheet.names.index(name) for name in ("x", "y")] if {"x", "y"} <= set(sheet.names) else [0, 1]
    if len(sheet.names) < 2:
        raise _Fault(_wrong("table/column", f"{sheet.path} has one column, and points have two: x and y"))
    x, y = sheet.columns(*places)
    return Table(x, y)


def _cells(path: str, number: int, line: str, separator: str) -> Sequence[str]:
    """The cells of a line; `_Fault` if the reader of CSV refuses it, such as for a cell of 131,073 characters."""
    try:
        return next(csv.reader([line], delimiter=separator))
    except csv.Error as error:
        raise _Fault(_wrong("table/value", f"{path}, line {number} is no line of a table: {error}")) from None


def _shown(text: str) -> str:
    """A cell as messages show it: of a long one, its beginning."""
    return text if len(text) <= 40 else f"{text[:39]}…"


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in text else None


def _table(column: TableColumn, sheet: _Sheet, x: FloatArray, y: FloatArray, given: int) -> Table:
    name = sheet.names[given]
    if len(x) < 2:
        message = f"{sheet.path} has {'one row' if len(x) else 'no rows'}, and a function needs two"
        raise _Fault(_wrong("table/short", message, "write more rows"))
    steps = np.diff(x)
    if (steps <= 0.0).any():
        at = int(np.argmax(steps <= 0.0)) + 1
        line = [number for number, _ in sheet.rows()][at]
        what = "again" if steps[at - 1] == 0.0 else f"after {x[at - 1]:g}"
        message = f"{sheet.path}, line {line}: `{name}` is {x[at]:g} {what}, and it must increase from row to row"
        helps = f"sort the rows by `{name}`" if steps[at - 1] < 0.0 else f"keep one row for {x[at]:g}"
        raise _Fault(_wrong("table/order", message, helps))
    if column.ends is Ends.PERIODIC and y[0] != y[-1]:
        message = f"`{column.column}` begins with {y[0]:g} and ends with {y[-1]:g}, so it does not repeat"
        raise _Fault(_wrong("table/periodic", message, "end the table with its first value, or leave out `.periodic`"))
    table = Table(x, y, smooth=column.smooth, ends=column.ends, spelled=column.spelled)
    with np.errstate(all="ignore"):
        if not all(np.isfinite(c[1:-1]).all() for c in table.pieces.coefficients):
            raise _Fault(_wrong("table/value", f"{sheet.path}: `{column.column}` is too steep to be a function"))
    return table
