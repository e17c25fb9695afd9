"""Solving in the background: one thread for all documents, the one that was typed in last first."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from threading import Condition, Thread

from movimentum.cancellation import Cancelled, cancellable
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.editing.facts import KnownFacts
from movimentum.errors import MovimentumError
from movimentum.records import dataclass
from movimentum.source import SourceText
from movimentum.workflow.engine import Engine, Revision, Stage
from movimentum.workflow.read import ScriptFiles

ADVICE_S = 3.0
"""How long fixes are tried: nobody waits for them."""
SWITCH_S = 0.002
"""How soon the thread that answers gets its turn while another one solves."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownText:
    """What is known of a text: ``found`` so far; ``whole``: after everything was examined. ``facts`` of the last text
    that was solved.
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
