"""Included files: their constants and parts."""

from __future__ import annotations

import os
from collections.abc import Callable

from movimentum.diagnostics import Diagnostic, Label
from movimentum.errors import MovimentumError
from movimentum.records import replace
from movimentum.scene.expansion.declaring import Declarer
from movimentum.scene.expansion.scopes import Scope
from movimentum.source import SourceText, Span, Unfolding, folder
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Include, Item, Let, PartDefinition

ReadText = Callable[[str], SourceText]
"""From a file's path to its text; raises a `MovimentumError` that says what is wrong with it."""

MAX_FILES = 100


class Includer:
    """Reads included files, each once."""

    def __init__(self, declarer: Declarer, unfolding: Unfolding, read: ReadText) -> None:
        self.declarer = declarer
        self.unfolding = unfolding
        self.read = read
        self._taken: set[str] = set()

    def take(self, items: tuple[Item, ...], scope: Scope, script: Scope, chain: tuple[str, ...]) -> None:
        """Put the constants and parts of all files that ``items`` include into the names of ``script``."""
        findings = self.declarer.findings
        for item in items:
            if not isinstance(item, Include):
                continue
            span = scope.place(item.path.span)
            path = os.path.normpath(os.path.join(folder(scope.file), item.path.text)) if item.path.text else ""
            if path in chain:
                names = " → ".join(f"'{os.path.basename(each)}'" for each in (*chain[chain.index(path) :], path))
                findings.error("name/cycle", f"the file includes itself: {names}", span)
                continue
            if path in self._taken:
                continue
            if len(self._taken) >= MAX_FILES:
                findings.error("limit/files", f"a script may include {MAX_FILES} files", span)
                return
            self._taken.add(path)
            file = self._read(path, item, span)
            if file is not None:
                self._take_file(file, path, span, script, chain)

    def _read(self, path: str, item: Include, span: Span) -> SourceText | None:
        findings = self.declarer.findings
        if not item.path.text or "\0" in item.path.text:
            findings.error("asset/missing", "an included file needs a name", span)
            return None
        try:
            return self.read(path)
        except MovimentumError as error:
            for found in error.diagnostics:
                code = "asset/missing" if found.code.startswith("usage/") else found.code
                findings.add(replace(found, code=code, span=span, helps=()))
            return None

    def _take_file(self, file: SourceText, path: str, span: Span, script: Scope, chain: tuple[str, ...]) -> None:
        self.unfolding.files.append(file)
        shift = self.unfolding.enter(file, Span(0, len(file.text)), "", span)
        scope = Scope(file, shift, outer=script)
        try:
            tree = parse(file)
        except MovimentumError as error:
            for found in error.diagnostics:
                self.declarer.findings.add(_shifted(found, scope))
            return
        for item in tree.items:
            if isinstance(item, Let):
                self.declarer.let(item, script, written=scope)
            elif isinstance(item, PartDefinition):
                self.declarer.part(item, script, written=scope)
        self.take(tree.items, scope, script, (*chain, path))


def _shifted(item: Diagnostic, scope: Scope) -> Diagnostic:
    labels = tuple(Label(scope.place(label.span), label.message) for label in item.labels)
    return replace(item, span=None if item.span is None else scope.place(item.span), labels=labels, fixes=())
