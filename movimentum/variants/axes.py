"""The set of variants: ranges, lists and files of values for constants, and Sobol samples of intervals.

An `Axis` is a table of values for constants that change together; the variants are all combinations of the axes' rows,
the last axis fastest. The combinations are never stored: variant number i is computed from i, so memory does not grow.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.arrays import FloatArray, IntArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import UsageError, usage_error
from movimentum.records import dataclass
from movimentum.scene.expansion.product import NamedConstant
from movimentum.syntax.suggest import nearest
from movimentum.text import counted, listed, number, rational

DEFAULT_COUNT = 11
"""Values of a range whose number is not given."""
MAX_VARIANTS = 10_000_000
OWN_COLUMNS = {"outcome": "what comes of a variant", "time": "when a variant binds or jumps"}
"""Columns that every table of variants has, and what they hold."""
MAX_FILE_BYTES = 256 * 2**20
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """``values`` (rows, constants): one column for each of the constants ``names``."""

    names: tuple[str, ...]
    values: FloatArray

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True, slots=True, eq=False)
class VariantGrid:
    """All combinations of the rows of ``axes``."""

    axes: tuple[Axis, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The constants, in the order of the axes."""
        return tuple(name for axis in self.axes for name in axis.names)

    def __len__(self) -> int:
        return math.prod(len(axis) for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of rows of each axis."""
        return tuple(len(axis) for axis in self.axes)

    def rows(self, numbers: IntArray) -> FloatArray:
        """(n, constants) the values of the variants ``numbers`` (n,)."""
        places = np.unravel_index(numbers, self.shape) if self.axes else ()
        columns = [axis.values[place] for axis, place in zip(self.axes, places, strict=True)]
        return np.concatenate(columns, axis=1) if columns else np.zeros((len(numbers), 0))


@dataclass(frozen=True, slots=True)
class _Interval:
    low: float
    high: float


def read_grid(
    vary: Sequence[str], sample: str | None, constants: Sequence[NamedConstant], most: int = MAX_VARIANTS
) -> VariantGrid:
    """The variants that options describe: ``vary`` are texts such as ``R=20:80:61``, ``sample`` is ``sobol:N``.

    Raises `UsageError` with a help for each thing that can be wrong with them.
    """
    axes: list[Axis] = []
    intervals: dict[str, _Interval] = {}
    files: dict[str, tuple[int, list[str]]] = {}
    known = {constant.name: constant for constant in constants}
    seen: set[str] = set()
    for text in vary:
        name, sign, values = (part.strip() for part in text.partition("="))
        if not _NAME.fullmatch(name) or (sign and not values):
            message = f"`{text}` does not say which constant takes which values"
            raise usage_error(
                "usage/vary",
                message,
                Choose.VARY.to("R=20:80:61"),
                Choose.VARY.to("R=20,35,50"),
                Choose.VARY.to("R=@lengths.csv"),
            )
        _check_constant(name, known)
        if name in seen:
            raise usage_error(
                "usage/vary",
                f"`{name}` is varied twice",
                Advised("one ", Choose.VARY.to(), f" for `{name}`: `{name}=a,b,c`"),
            )
        seen.add(name)
        if values.startswith("@"):
            place, columns = files.setdefault(values[1:], (len(axes), []))
            if not columns:
                axes.append(Axis((), np.zeros((0, 0))))
            columns.append(name)
            axes[place] = _from_file(values[1:], columns)
            continue
        found = _values(name, values, known[name], sampled=sample is not None)
        if isinstance(found, _Interval):
            intervals[name] = found
        else:
            axes.append(Axis((name,), found[:, None]))
    if sample is not None:
        axes.append(_sampled(sample, intervals, known, seen))
    if not axes:
        ranged = [name for name, constant in known.items() if _interval(constant) is not None]
        example = Choose.VARY.to(ranged[0]) if ranged else Choose.VARY.to(f"{next(iter(known), 'R')}=20:80:61")
        raise usage_error("usage/vary", "nothing is varied", example)
    return _limited(VariantGrid(tuple(axes)), most)


def grid_of(given: Mapping[str, object]) -> VariantGrid:
    """All combinations of arrays of values by constant; `UsageError` for what is no array of numbers."""
    axes: list[Axis] = []
    for name, values in given.items():
        try:
            table = np.atleast_1d(np.asarray(values, dtype=np.float64))
        except (TypeError, ValueError):
            table = np.zeros(0)
        if table.ndim != 1 or not len(table) or not np.isfinite(table).all():
            message = f"`{name}` takes a number or a sequence of finite numbers"
            raise usage_error("usage/vary", message, f"{name}=np.linspace(20, 80, 61)")
        axes.append(Axis((name,), table[:, None]))
    return _limited(VariantGrid(tuple(axes)), MAX_VARIANTS)


def check_constants(grid: VariantGrid, constants: Sequence[NamedConstant]) -> None:
    """Raise `UsageError` for a constant that is unknown or not a number."""
    known = {constant.name: constant for constant in constants}
    for name in grid.names:
        _check_constant(name, known)


def _limited(grid: VariantGrid, most: int) -> VariantGrid:
    if len(grid) > most:
        factors = " × ".join(f"{size:,}" for size in grid.shape)
        message = f"{factors} are {len(grid):,} variants, more than the limit of {most:,}"
        raise usage_error(
            "limit/variants", message, Advised("`", Choose.MAX_VARIANTS.to(len(grid)), "` raises the limit")
        )
    return grid


def _check_constant(name: str, known: Mapping[str, NamedConstant]) -> None:
    constant = known.get(name)
    if constant is None:
        guess = nearest(name, known)
        names = [f"`{each}`" for each in known]
        helps = f"did you mean `{guess}`?" if guess else f"its constants are {listed(names, 8)}" if names else None
        helps = helps or f"`.let {name} = 50;` in the script makes one"
        raise usage_error("usage/constant", f"the script has no constant `{name}`", helps)
    if name in OWN_COLUMNS:
        message = f"`{name}` cannot be varied: the table's column `{name}` says {OWN_COLUMNS[name]}"
        value = number(float(constant.value[0].value)) if len(constant.value) == 1 else "…"
        both = f"`.let my_{name} = {value}; .let {name} = my_{name};` in the script"
        raise usage_error("usage/vary", message, Advised(f"{both}, and `", Choose.VARY.to(f"my_{name}"), "`"))
    if len(constant.value) != 1:
        message = f"`{name}` is a vector: only numbers are varied"
        raise usage_error("usage/vary", message, f"`.let {name} = [{name}x, {name}y];` and vary `{name}x`")


def _interval(constant: NamedConstant) -> tuple[float, float] | None:
    """The `.range` of a constant."""
    if constant.least is None or constant.most is None:
        return None
    return constant.least, constant.most


def _values(name: str, text: str, constant: NamedConstant, *, sampled: bool) -> FloatArray | _Interval:
    """The values that ``text`` lists, or the interval that is to be sampled."""
    if "," in text:
        return np.array([_number(name, part) for part in text.split(",")])
    parts = [part.strip() for part in text.split(":")] if text else []
    if len(parts) == 1:
        return np.array([_number(name, parts[0])])
    if len(parts) > 3:
        raise usage_error("usage/vary", f"`{name}={text}` has too many colons", Choose.VARY.to(f"{name}=20:80:61"))
    if not parts or not (parts[0] or parts[1]):
        interval = _interval(constant)
        if interval is None:
            message = f"`{name}` has no `.range`, so give its values"
            raise usage_error(
                "usage/vary", message, Choose.VARY.to(f"{name}=20:80:61"), f"`.let {name} = … .range(20, 80);`"
            )
        low, high = interval
    else:
        low, high = _number(name, parts[0]), _number(name, parts[1])
    if len(parts) < 3:
        return _Interval(low, high) if sampled else np.linspace(low, high, DEFAULT_COUNT)
    if not re.fullmatch(r"\d{1,12}", parts[2]) or int(parts[2]) < 1:
        message = f"`{name}={text}`: {parts[2] or 'nothing'} is not a number of values"
        raise usage_error("usage/vary", message, Choose.VARY.to(f"{name}={parts[0]}:{parts[1]}:61"))
    count = int(parts[2])
    if count == 1 and low != high:
        message = f"`{name}={text}`: one value cannot go from {number(low)} to {number(high)}"
        raise usage_error(
            "usage/vary",
            message,
            Choose.VARY.to(f"{name}={parts[0]}:{parts[1]}:2"),
            Choose.VARY.to(f"{name}={parts[0]}"),
        )
    if count > 10**9:
        raise usage_error("limit/variants", f"{count:,} values of `{name}` are more than any limit allows")
    return np.linspace(low, high, count)


def _number(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        shown = f"`{text.strip()}`" if text.strip() else "nothing"
        message = f"{shown} is not a value for `{name}`: values are numbers"
        raise usage_error("usage/vary", message, Choose.VARY.to(f"{name}=20:80:61"), Choose.VARY.to(f"{name}=20,35,50"))
    return value


def _sampled(text: str, intervals: Mapping[str, _Interval], known: Mapping[str, NamedConstant], seen: set[str]) -> Axis:
    """N points of a Sobol sequence (scrambled by Owen's method with a fixed seed, so always the same) in the intervals
    of all constants that have one.
    """
    method, _, size = text.partition(":")
    if method.strip() != "sobol" or not re.fullmatch(r"\s*\d{1,9}\s*", size) or int(size) < 1:
        raise usage_error("usage/sample", f"`{text}` is not a sample", Choose.SAMPLE.to("sobol:4096"))
    chosen = dict(intervals)
    for name, constant in known.items():
        interval = _interval(constant)
        if interval is not None and name not in seen and len(constant.value) == 1:
            _check_constant(name, known)
            chosen[name] = _Interval(*interval)
    if not chosen:
        message = "there is nothing to sample: no constant has a `.range`"
        first = next(iter(known), "R")
        raise usage_error(
            "usage/sample", message, f"`.let {first} = … .range(20, 80);`", Choose.VARY.to(f"{first}=20:80")
        )
    import warnings

    from scipy.stats import qmc

    names = tuple(chosen)
    count = int(size)
    if len(names) > qmc.Sobol.MAXDIM:
        raise usage_error("usage/sample", f"{len(names):,} constants are more than a Sobol sequence has dimensions")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that the number should be a power of two: what is asked for is done
        points = qmc.Sobol(len(names), scramble=True, seed=np.random.default_rng(0)).random(count)  # pyright: ignore[reportCallIssue]
    low = np.array([chosen[name].low for name in names])
    high = np.array([chosen[name].high for name in names])
    return Axis(names, low + (high - low) * points)


def _from_file(path: str, names: Sequence[str]) -> Axis:
    """Columns of a CSV file with a header; a file of one column needs none. Columns of one file go together."""
    from movimentum.output.files import read_limited

    try:
        text = read_limited(Path(path), MAX_FILE_BYTES).decode("utf-8-sig")
    except OSError as problem:
        reason = (problem.strerror or str(problem)).lower()
        raise usage_error("usage/vary", f"cannot read {path}: {reason}") from problem
    except UnicodeDecodeError as problem:
        raise usage_error("usage/vary", f"{path} is not text: it is not UTF-8") from problem
    lines = [
        (number, [cell.strip() for cell in row])
        for number, row in enumerate(csv.reader(text.splitlines()), 1)
        if any(cell.strip() for cell in row)
    ]
    if not lines:
        raise usage_error("usage/vary", f"{path} has no values")
    header = lines[0][1]
    if all(_is_number(cell) for cell in header):
        if len(header) > 1 or len(names) > 1:
            message = f"{path} has {counted(len(header), 'column')} and no header that names them"
            raise usage_error("usage/vary", message, f"a first line such as `{','.join(names)}`")
        columns, rows = [0], lines
    else:
        for name in names:
            if name not in header:
                guess = nearest(name, header)
                found = f"did you mean `{guess}`?" if guess else f"it has {listed([f'`{each}`' for each in header], 8)}"
                raise usage_error("usage/vary", f"{path} has no column `{name}`", found)
        columns, rows = [header.index(name) for name in names], lines[1:]
    if not rows:
        raise usage_error("usage/vary", f"{path} has a header and no values")
    table = np.empty((len(rows), len(names)))
    for place, (line, row) in enumerate(rows):
        for k, column in enumerate(columns):
            cell = row[column] if column < len(row) else ""
            if not _is_number(cell):
                shown = f"`{cell}`" if cell else "nothing"
                message = f"{path}, line {line}: {shown} is not a value for `{names[k]}`"
                raise UsageError([Diagnostic("usage/vary", Severity.ERROR, message, helps=("values are numbers",))])
            table[place, k] = float(cell)
    return Axis(tuple(names), table)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def read_intervals(vary: Sequence[str], constants: Sequence[NamedConstant]) -> dict[str, tuple[float, float]]:
    """Intervals by name from texts such as ``L=60:200``, or ``L``, which takes that of its `.range`; `UsageError`."""
    known = {constant.name: constant for constant in constants}
    found: dict[str, tuple[float, float]] = {}
    for text in vary:
        name, sign, interval = (part.strip() for part in text.partition("="))
        ends = [rational(part, exponents=True) for part in interval.split(":")]
        own = known.get(name)
        if not sign and own is not None and own.least is not None and own.most is not None:
            found[name] = own.least, own.most
        elif not sign and own is not None:
            raise usage_error("usage/vary", f"`{name}` has no `.range`", Choose.VARY.to(f"{name}=10:20"))
        elif not sign or len(ends) != 2 or None in ends:
            if not sign and own is None:
                check_interval(name, 0.0, 1.0, known)
            raise usage_error("usage/vary", f"`{text}` is not an interval", Choose.VARY.to(f"{name or 'L'}=60:200"))
        else:
            low, high = (float(end) for end in ends if end is not None)
            found[name] = low, high
    return found


def check_interval(name: str, low: float, high: float, known: Mapping[str, NamedConstant]) -> None:
    """`UsageError` unless ``name`` is a constant that can be fitted between ``low`` and ``high``."""
    if name not in known:
        guess = nearest(name, known)
        helps = (f"did you mean `{guess}`?",) if guess else (f".let {name} = {low:g} .range({low:g}, {high:g});",)
        raise usage_error("name/unknown", f"the script has no constant `{name}`", *helps)
    if len(known[name].value) != 1:
        message = f"`{name}` is a vector; only numbers are fitted"
        raise usage_error("fit/constant", message, f".let {name} = [{name}x, {name}y]; and fit these two")
    if not low < high:
        raise usage_error(
            "fit/constant", f"`{name}` has no interval from {low:g} to {high:g}", Choose.VARY.to(f"{name}=10:20")
        )
