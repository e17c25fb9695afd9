"""What the language server knows: the open texts, what they name, and what was found about them."""

from __future__ import annotations

from collections.abc import Callable

from lsprotocol import types

from movimentum.diagnostics import Diagnostic, Severity, real
from movimentum.editing.about import NO_FACTS, Facts
from movimentum.editing.project import Project
from movimentum.lsp.texts import EditedFiles, OpenText, Texts, uri_of
from movimentum.lsp.work import BackgroundSolver, KnownText
from movimentum.source import FarSpan, Span

_SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.NOTE: types.DiagnosticSeverity.Information,
}
Publish = Callable[[types.PublishDiagnosticsParams], None]


class State:
    """One session. ``publish`` is called in the thread of the server, and so is everything here but `_told`."""

    def __init__(self, publish: Publish, soon: Callable[[Callable[[], None]], None]) -> None:
        self.texts = Texts()
        self.project = Project(self.texts.text)
        self.found: dict[str, tuple[str, tuple[Diagnostic, ...]]] = {}
        """The text, and all that was last found about it."""
        self.facts: dict[str, Callable[[str], Facts]] = {}
        self.told: dict[str, KnownText] = {}
        self._publish = publish
        self.solver = BackgroundSolver(
            lambda: EditedFiles(edited=self.texts), lambda told: soon(lambda: self._take(told))
        )

    # --- texts

    def put(self, path: str, text: OpenText) -> None:
        """A document was opened."""
        self.texts.open[path] = text
        self.typed(path)

    def typed(self, path: str) -> None:
        """A document has another text: it is solved anew, and so is every open one that includes it."""
        self.project.changed(path)
        for other in list(self.texts.open):
            if other != path and any(each.path == path for each in self.project.included(other)):
                self.solver.give(other, self.texts.open[other].text)
        self.solver.give(path, self.texts.open[path].text)

    def close(self, path: str) -> None:
        """A document was closed: what is on the disk holds again."""
        self.texts.open.pop(path, None)
        self.solver.forget(path)
        for known in (self.found, self.facts, self.told):
            known.pop(path, None)
        self.project.changed(path)
        self._publish(types.PublishDiagnosticsParams(uri_of(path), []))
        self.disk_changed()

    def disk_changed(self) -> None:
        """Files have changed elsewhere."""
        self.project = Project(self.texts.text)
        for path, text in self.texts.open.items():
            self.solver.give(path, text.text)

    def known(self, path: str) -> Callable[[str], Facts]:
        """The facts of the last text of a document that was solved."""
        return self.facts.get(path, lambda _name: NO_FACTS)

    # --- diagnostics

    def _take(self, told: KnownText) -> None:
        """Something was found out about a text, which may be outdated."""
        text = self.texts.open.get(told.path)
        if text is None or text.text != told.revision.source.text:
            return
        if told.facts is not None:
            self.facts[told.path], self.told[told.path] = told.facts, told
            return
        found = self._real(told)
        if told.whole:
            self.found[told.path] = text.text, found
        elif told.path in self.found:
            found = (*found, *self._kept(told.path, text.text, found))
        shown = [self._diagnostic(text, each) for each in found]
        self._publish(types.PublishDiagnosticsParams(text.uri, shown, text.version))

    def _real(self, told: KnownText) -> tuple[Diagnostic, ...]:
        scene = told.revision.scene if told.revision.moves else None
        return told.found if scene is None else tuple(real(item, scene.source) for item in told.found)

    def _kept(self, path: str, text: str, now: tuple[Diagnostic, ...]) -> list[Diagnostic]:
        """What was found last time and is not touched by what was typed since: it may still hold."""
        from movimentum.records import replace

        old, found = self.found[path]
        first = next((n for n, (a, b) in enumerate(zip(old, text, strict=False)) if a != b), min(len(old), len(text)))
        same = 0
        while same < min(len(old), len(text)) - first and old[-1 - same] == text[-1 - same]:
            same += 1
        codes = {item.code for item in now}
        kept: list[Diagnostic] = []
        for item in found:
            if item.code in codes or item.span is None or item.severity is Severity.ERROR:
                continue
            if item.span.end <= first:
                kept.append(replace(item, labels=(), fixes=()))
            elif item.span.start >= len(old) - same:
                shift = len(text) - len(old)
                span = Span(item.span.start + shift, item.span.end + shift)
                kept.append(replace(item, span=span, labels=(), fixes=()))
        return kept

    def _diagnostic(self, text: OpenText, item: Diagnostic) -> types.Diagnostic:
        lines = [item.message, *(f"note: {note}" for note in item.notes), *(f"help: {text}" for text in item.helps)]
        span = item.span if item.span is not None and not isinstance(item.span, FarSpan) else Span(0, 0)
        related = [
            types.DiagnosticRelatedInformation(self._location(text, label.span), label.message or item.message)
            for label in item.labels
        ]
        if isinstance(item.span, FarSpan):
            related.insert(0, types.DiagnosticRelatedInformation(self._location(text, item.span), item.message))
        return types.Diagnostic(
            text.range(span),
            "\n".join(lines),
            severity=_SEVERITIES[item.severity],
            code=item.code,
            source="movimentum",
            related_information=related or None,
        )

    def _location(self, text: OpenText, span: Span) -> types.Location:
        if isinstance(span, FarSpan):
            other = self.texts.at(span.file.path) or OpenText(uri_of(span.file.path), span.file.text, 0)
            return types.Location(other.uri, other.range(span))
        return types.Location(text.uri, text.range(span))
