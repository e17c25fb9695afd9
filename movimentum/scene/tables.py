"""Which tables a script reads of files."""

from __future__ import annotations

from collections.abc import Callable

from movimentum.diagnostics import Diagnostic
from movimentum.expressions.tables import Ends, Table
from movimentum.records import dataclass
from movimentum.syntax.printer import table_options, text_literal

POINTS = "points of a curve"
"""The ``column`` of a file that is read as points: its first two columns (or those called x and y), in any order."""


@dataclass(frozen=True, slots=True)
class TableColumn:
    """A column of a file as a function of another one, ``over`` (empty: the first): what a `Table` is made of.

    ``shown`` is the file as the script names it.
    """

    path: str
    shown: str
    column: str
    over: str = ""
    smooth: bool = False
    ends: Ends = Ends.NOTHING

    @property
    def spelled(self) -> tuple[str, str, str]:
        """How a script says it, for `Table.spelled`."""
        over = text_literal(self.over) if self.over else ""
        return self.shown, self.column, table_options(over, self.smooth, self.ends)


Tables = dict[TableColumn, Table]

ReadTable = Callable[[TableColumn], "Table | Diagnostic"]
"""Reads a table; the diagnostic says what is wrong with its file."""
