"""Many variants from Python: the table of a sweep as arrays."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.api.calls import called
from movimentum.api.output import Written
from movimentum.arrays import BoolArray, FloatArray
from movimentum.errors import UnknownNameError
from movimentum.records import dataclass
from movimentum.syntax.suggest import nearest
from movimentum.variants.outcomes import OUTCOMES, VariantOutcome, VariantRows


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """The variants of a script, one row each: the values of the constants that vary, and what was measured.

    All combinations of the values are solved, the last constant fastest. `Script.sweep` makes it; it never changes.

    >>> import movimentum as mv
    >>> script = mv.loads(".let R = 30;  Arm : .bar O=[0,0] P=[R,0]; @0 Arm.O=[0,0]; Arm.angle=90*.t; @1")
    >>> table = script.sweep(R=[10, 20, 30], measure={"height": ".max(Arm.P.y)"})
    >>> table
    Sweep(<string>: 3 variants, 3 ok)
    >>> table["R"].tolist(), table["height"].round(9).tolist(), table.outcome.tolist()
    ([10.0, 20.0, 30.0], [10.0, 20.0, 30.0], ['ok', 'ok', 'ok'])
    >>> table["heigt"]
    Traceback (most recent call last):
        ...
    movimentum.errors.UnknownNameError: error[name/unknown]: the sweep has no column `heigt`
       = help: did you mean `height`?
    """

    title: str
    constants: tuple[str, ...]
    measures: tuple[str, ...]
    shape: tuple[int, ...]
    rows: VariantRows

    def __len__(self) -> int:
        return len(self.rows)

    @called
    def __getitem__(self, name: str) -> FloatArray:
        """(V,) a constant's values, or a measure's (nan where the variant does not move); `UnknownNameError` for any
        other name.
        """
        if name in self.constants:
            return self.rows.constants[:, self.constants.index(name)].copy()
        if name in self.measures:
            return self.rows.measures[:, self.measures.index(name)].copy()
        from movimentum.diagnostics import Diagnostic, Severity

        guess = nearest(name, self.keys())
        helps = (f"did you mean `{guess}`?",) if guess else (f"its columns are {', '.join(self)}",)
        message = f"the sweep has no column `{name}`"
        raise UnknownNameError([Diagnostic("name/unknown", Severity.ERROR, message, helps=helps)])

    def keys(self) -> list[str]:
        """The names of the constants and of the measures; a loop over a sweep gives the same."""
        return [*self.constants, *self.measures]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self.keys()

    @property
    def outcome(self) -> NDArray[np.str_]:
        """(V,) "ok", "binds", "cannot be assembled" or "jumps"."""
        return np.array([outcome.value for outcome in OUTCOMES])[self.rows.outcomes]

    @property
    def time(self) -> FloatArray:
        """(V,) when a variant binds or jumps, in the script's unit; nan where it is ok."""
        return self.rows.times.copy()

    @property
    def ok(self) -> BoolArray:
        """(V,) whether the outcome is "ok"."""
        return self.rows.outcomes == VariantOutcome.OK.code

    @called
    def grid(self, name: str) -> FloatArray:
        """A column in the shape of the values that were given: one axis for each constant, in their order.

        >>> import movimentum as mv
        >>> script = mv.loads(".let a = 1; .let b = 1; A : .bar O=[0,0] P=[a,b]; @0 A.O=[0,0]; A.angle=0; @1")
        >>> script.sweep(a=[1, 2, 3], b=[1, 2], measure={"x": ".max(A.P.x)"}).grid("x").tolist()
        [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]
        """
        return self[name].reshape(self.shape)

    def columns(self) -> Iterator[tuple[str, NDArray[Any]]]:
        """The columns of the table: constants, measures, ``outcome``, ``time``."""
        for name in self:
            yield name, self[name]
        yield "outcome", self.outcome
        yield "time", self.time

    def to_dataframe(self) -> Any:
        """A pandas DataFrame, a row a variant. Raises ImportError where there is no pandas."""
        try:
            pandas = import_module("pandas")
        except ImportError as problem:
            raise ImportError("to_dataframe() needs pandas: pip install pandas", name="pandas") from problem
        return pandas.DataFrame(dict(self.columns()))

    @called
    def save(self, path: str | os.PathLike[str]) -> Written:
        """Write the table as a ``.csv``, ``.npz`` or ``.parquet`` file; `UsageError` for another, or where it cannot be
        written.
        """
        from movimentum.output.files import whole_file
        from movimentum.variants.tables import check_table, write_table

        target = Path(os.fspath(path))
        check_table(target)
        with whole_file(target) as part:
            write_table(self.keys(), lambda: (self.rows,), len(self), part, target.suffix)
        return Written(target, len(self), ())

    def __repr__(self) -> str:
        return f"Sweep({self.title}: {len(self):,} variants, {int(self.ok.sum()):,} ok)"
