"""The tables that a script reads of files, for `.table`."""

from __future__ import annotations

import os
from collections.abc import Sequence

from movimentum.diagnostics import Diagnostic
from movimentum.expressions.tables import Ends
from movimentum.records import dataclass, field, replace
from movimentum.scene.expansion.scopes import Scope
from movimentum.scene.findings import Findings
from movimentum.scene.tables import ReadTable, TableColumn, Tables
from movimentum.source import SourceText, folder
from movimentum.syntax.expression_tree import TableUse
from movimentum.syntax.tree import Text


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
