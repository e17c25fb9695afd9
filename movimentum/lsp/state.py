"""The state of the language server: open texts, their names, and what was found about them."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from threading import Condition, Thread

from lsprotocol import types

from movimentum.cancellation import Cancelled, cancellable
from movimentum.diagnostics import Diagnostic, Severity, real
from movimentum.editing.about import NO_FACTS, Facts
from movimentum.editing.facts import KnownFacts
from movimentum.editing.project import Project
from movimentum.errors import MovimentumError
from movimentum.lsp.shapes import EditedFiles, OpenText, Texts, uri_of
from movimentum.records import dataclass
from movimentum.source import FarSpan, SourceText, Span
from movimentum.workflow.engine import Engine, Revision, Stage
from movimentum.workflow.read import ScriptFiles

_SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.NOTE: types.DiagnosticSeverity.Information,
}
Publish = Callable[[types.PublishDiagnosticsParams], None]


class State:
    """One session. ``publish`` is called in the thread of the server, and so is everything else here."""

    def __init__(self, publish: Publish, soon: Callable[[Callable[[], None]], None]) -> None:
        self.texts = Texts()
        self.project = Project(self.texts.text)
        self.found: dict[str, tuple[str, tuple[Diagnostic, ...]]] = {}
        """The text, and all that was last found about it."""
        self.facts: dict[str, Callable[[str], Facts]] = {}
        self.latest: dict[str, KnownText] = {}
        self._publish = publish
        self.solver = BackgroundSolver(
            lambda: EditedFiles(edited=self.texts), lambda known: soon(lambda: self._take(known))
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
        for known in (self.found, self.facts, self.latest):
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

    def _take(self, known: KnownText) -> None:
        """Something was found out about a text, which may be outdated."""
        text = self.texts.open.get(known.path)
        if text is None or text.text != known.revision.source.text:
            return
        if known.facts is not None:
            self.facts[known.path], self.latest[known.path] = known.facts, known
            return
        found = self._real(known)
        if known.whole:
            self.found[known.path] = text.text, found
        elif known.path in self.found:
            found = (*found, *self._kept(known.path, text.text, found))
        shown = [self._diagnostic(text, each) for each in found]
        self._publish(types.PublishDiagnosticsParams(text.uri, shown, text.version))

    def _real(self, known: KnownText) -> tuple[Diagnostic, ...]:
        scene = known.revision.scene if known.revision.moves else None
        return known.found if scene is None else tuple(real(item, scene.source) for item in known.found)

    def _kept(self, path: str, text: str, now: tuple[Diagnostic, ...]) -> list[Diagnostic]:
        """Earlier diagnostics outside the edited text, which may still hold."""
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


# --- solving in the background: one thread for all documents, the one that was typed in last first


ADVICE_S = 3.0
"""How long fixes are tried: nobody waits for them."""
SWITCH_S = 0.002
"""How soon the thread that answers gets its turn while another one solves."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownText:
    """The results for a text: diagnostics ``found`` so far; ``whole``: after everything was examined. ``facts`` of the
    last text that was solved.
    """

    path: str
    revision: Revision
    found: tuple[Diagnostic, ...]
    whole: bool
    facts: KnownFacts | None = None


class BackgroundSolver:
    """Solves what is given to it; ``tell`` is called in its thread."""

    def __init__(self, files: Callable[[], ScriptFiles], tell: Callable[[KnownText], None]) -> None:
        sys.setswitchinterval(SWITCH_S)
        self.files, self.tell = files, tell
        self._engines: dict[str, Engine] = {}
        self._waiting: dict[str, Revision] = {}
        self._condition = Condition()
        self._closed = False
        self._given = 0  # how often something was given
        Thread(target=self._work, name="solver", daemon=True).start()

    def give(self, path: str, text: str) -> Revision:
        """Another text of the document at ``path``; work on an older one is given up."""
        engine = self._engines.setdefault(path, Engine(files=self.files))
        revision = engine.revise(SourceText(path, text))
        with self._condition:
            self._waiting.pop(path, None)
            self._waiting[path] = revision
            self._given += 1
            self._condition.notify()
        return revision

    def forget(self, path: str) -> None:
        """The document at ``path`` was closed."""
        engine = self._engines.pop(path, None)
        if engine is not None:
            engine.revise(SourceText(path, ""))
        with self._condition:
            self._waiting.pop(path, None)

    def close(self) -> None:
        """Nobody asks any more."""
        with self._condition:
            self._closed = True
            self._condition.notify()

    def _work(self) -> None:
        while True:
            with self._condition:
                while not self._waiting and not self._closed:
                    self._condition.wait()
                if self._closed:
                    return
                path, revision = self._waiting.popitem()
            try:
                self._solve(path, revision)
            except Cancelled:
                pass
            except Exception as problem:
                traceback.print_exception(problem, file=sys.stderr)
                words = f"a bug in Movimentum: {type(problem).__name__}: {problem}"
                self.tell(KnownText(path, revision, (Diagnostic("internal/bug", Severity.ERROR, words),), whole=True))

    def _unwanted(self, path: str, revision: Revision, given: int) -> bool:
        """Whether something newer waits: another text of this document, or another document."""
        if revision.outdated or self._closed:
            return True
        if self._given != given and self._waiting:
            with self._condition:
                self._waiting = {path: revision, **self._waiting}  # comes again, after what is newer
            return True
        return False

    def _solve(self, path: str, revision: Revision) -> None:
        facts, given = KnownFacts(revision), self._given
        with cancellable(lambda: self._unwanted(path, revision, given)):
            for report in revision.reports():
                if report.stage is Stage.SCENE or report.final:
                    self.tell(KnownText(path, revision, report.diagnostics, report.final))
                if report.stage is Stage.PATH and not report.final:
                    try:
                        facts.prepare()
                    except MovimentumError:
                        continue
                    self.tell(KnownText(path, revision, report.diagnostics, whole=False, facts=facts))
            if revision.diagnostics:
                self.tell(KnownText(path, revision, revision.advice(ADVICE_S), whole=True))
