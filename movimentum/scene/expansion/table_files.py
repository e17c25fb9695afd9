"""The tables that a script reads from files, for `.table`."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

from movimentum.diagnostics import Diagnostic
from movimentum.expressions.tables import Ends, Table
from movimentum.records import dataclass, field, replace
from movimentum.scene.expansion.scopes import Scope
from movimentum.scene.findings import Findings
from movimentum.source import SourceText, folder
from movimentum.syntax.expression_tree import TableUse
from movimentum.syntax.printer import table_options, text_literal
from movimentum.syntax.tree import Text

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


@dataclass(slots=True, eq=False)
class TableFiles:
    """Reads the tables of a script; ``found`` are those that were there."""

    findings: Findings
    source: SourceText
    read_table: ReadTable | None = None
    found: Tables = field(default_factory=Tables)

    def read(self, reads: TableUse, texts: Sequence[Text | None], scope: Scope) -> TableUse | None:
        """``reads`` with its table, and its ``texts`` as they are meant in ``scope``; None after an error. A file is
        beside the one that names it.
        """
        said = [text for text in texts if text is not None]
        if len(said) < len(texts):
            return None
        file, column, *over = said
        if not file.text or "\0" in file.text or self.read_table is None:
            self.findings.error("asset/missing", "a table needs a file", file.span)
            return None
        path = os.path.join(folder(scope.file) if scope.file.path else folder(self.source), file.text)
        home = folder(self.source) or "."
        shown = file.text
        if os.path.normpath(os.path.join(home, shown)) != os.path.normpath(path):
            shown = os.path.relpath(path, home).replace(os.sep, "/")
        key = TableColumn(path, shown, column.text, over[0].text if over else "", reads.smooth, Ends(reads.ends))
        made = self.read_table(key)
        if isinstance(made, Diagnostic):
            place = column if made.code == "table/column" else file
            at = over[0] if over and made.label == "over" else place
            self.findings.add(replace(made, span=at.span, label=""))
            return None
        self.found[key] = made
        return replace(reads, texts=(replace(file, text=shown), *said[1:]), table=made)
