"""What the editor is helped with while somebody writes: completion, what a name is, other names, layout.

It has a thread of its own, so that answers come while the worker solves. Only questions about the newest text are
answered.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Any

from movimentum import messages
from movimentum.diagnostics import Diagnostic
from movimentum.editing import about, completion, renaming
from movimentum.editing.project import Project, text_on_disk
from movimentum.errors import MovimentumError
from movimentum.formatting.format import formatted, line_edits
from movimentum.source import Edit, SourceText
from movimentum.studio import messages as m
from movimentum.studio.worker import Worker

MOST_PROPOSALS = 400
"""More are cut: nobody reads them, and the next letter leaves fewer."""


class Assistant:
    """The help for one page. ``worker`` has the script's path and folder, and what is known of names."""

    def __init__(self, worker: Worker, send: Callable[[Any], None]) -> None:
        self._worker, self._send = worker, send
        self._rev, self._text = 0, ""
        self._path = ""
        self._project = Project(self._read)
        self._waiting: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._answers: dict[type, Callable[[Any], None]] = {
            m.ProposalsAsked: self._complete,
            m.AboutAsked: self._explain,
            m.MeaningAsked: self._mean,
            m.NamingAsked: self._name,
            m.RenameAsked: self._rename,
            m.FormatAsked: self._format,
        }
        self._thread = Thread(target=self._work, name="studio-assistant", daemon=True)
        self._thread.start()

    # --- called from the server's thread

    def typed(self, message: m.TextTyped) -> None:
        """The script has another text."""
        self._rev, self._text = message.rev, message.text
        self._waiting.put(lambda: self._take(message.rev, message.text))

    def disk_changed(self) -> None:
        """A file that the script uses is another one."""
        self._waiting.put(self._forget)

    def take(self, message: m.FromPage) -> bool:
        """Answer a message, if it is a question about the text."""
        answer = self._answers.get(type(message))
        if answer is not None:
            self._waiting.put(lambda: self._answer(answer, message))
        return answer is not None

    def close(self) -> None:
        """The page is gone."""
        self._waiting.put(None)

    # --- the assistant's thread

    def _work(self) -> None:
        while (task := self._waiting.get()) is not None:
            try:
                task()
            except Exception as problem:  # the editor goes on
                traceback.print_exception(problem, file=sys.stderr)
                self._send(m.Notice(f"a bug in Movimentum: {type(problem).__name__}: {problem}", "error"))

    def _take(self, rev: int, text: str) -> None:
        if rev != self._rev:
            return  # a newer one follows
        self._follow()
        self._project.changed(self._path)
        completion.proposals(self._project, self._path, len(text), self._names)  # before somebody asks

    def _follow(self) -> None:
        """The script may be another file by now."""
        path = os.path.abspath(self._worker.path)
        if path != self._path:
            self._path = path
            self._forget()

    def _forget(self) -> None:
        self._project = Project(self._read)

    def _read(self, path: str) -> str | None:
        """The script's text is the page's; of other files only those below its folder are read."""
        if path == self._path:
            return self._text
        return text_on_disk(path) if self._inside(path) else None

    def _inside(self, path: str) -> bool:
        try:
            return Path(path).resolve().is_relative_to(self._worker.folder.resolve())
        except (OSError, RuntimeError, ValueError):
            return False

    def _names(self, folder: str) -> list[str]:
        return completion.names_in(folder) if self._inside(folder) else []

    def _answer(self, answer: Callable[[Any], None], message: Any) -> None:
        if message.rev == self._rev:
            self._follow()
            answer(message)

    def _complete(self, asked: m.ProposalsAsked) -> None:
        found = completion.proposals(self._project, self._path, asked.place, self._names)[:MOST_PROPOSALS]
        span = found[0].span if found else None
        told = [
            {"label": each.label, "what": each.kind, "text": each.text, "detail": each.detail, "help": each.help}
            for each in found
            if each.span == span
        ]
        place = (asked.place, asked.place) if span is None else (span.start, span.end)
        self._send(m.ProposalsTold(asked.rev, asked.place, place, told))

    def _explain(self, asked: m.AboutAsked) -> None:
        found = about.about(self._project, self._path, asked.place, self._worker.facts)
        if found is None:
            self._send(m.AboutTold(asked.rev, asked.place, (asked.place, asked.place), "", []))
            return
        span = (found.span.start, found.span.end)
        self._send(m.AboutTold(asked.rev, asked.place, span, found.written, list(found.paragraphs)))

    def _mean(self, asked: m.MeaningAsked) -> None:
        text = "\n\n\n".join(each.text for each in messages.find(asked.code))
        self._send(m.MeaningTold(asked.rev, asked.code, text or "Nothing is written about this code."))

    def _name(self, asked: m.NamingAsked) -> None:
        use = renaming.renamable(self._project, self._path, asked.place)
        if use is None or use.symbol is None:
            words = "What stands here has no name of its own: go to the name of a thing, an anchor or a value."
            self._send(m.NamingTold(asked.rev, asked.place, "", [], words))
            return
        uses = [each.piece for each in self._project.all_uses(use.symbol) if each.path == self._path]
        spans = [(piece.start, piece.end) for piece in uses]
        self._send(m.NamingTold(asked.rev, asked.place, use.symbol.name, spans))

    def _rename(self, asked: m.RenameAsked) -> None:
        try:
            edits = dict(renaming.renamed(self._project, self._path, asked.place, asked.name))
        except MovimentumError as error:
            self._edit(asked.rev, [], _words(error.diagnostics[0]))
            return
        here = edits.pop(self._path, [])
        if edits:
            names = " and ".join(sorted(os.path.basename(path) for path in edits))
            words = f"{names} has this name too, and the studio changes no other file: rename it in an editor"
            self._edit(asked.rev, [], f"{words} (`movimentum lsp`).")
            return
        self._edit(asked.rev, here)

    def _format(self, asked: m.FormatAsked) -> None:
        source = SourceText(self._path, self._text)
        try:
            edits = line_edits(source.text, formatted(source))
        except MovimentumError as error:
            found = error.diagnostics[0]
            line = f"line {source.position(found.span.start).line}: " if found.span is not None else ""
            self._edit(asked.rev, [], f"Only a script without errors can be laid out. {line}{found.message}")
            return
        self._edit(asked.rev, edits, "" if edits else "The layout is as it should be.")

    def _edit(self, rev: int, edits: list[Edit], words: str = "") -> None:
        told = [{"from": edit.span.start, "to": edit.span.end, "text": edit.text} for edit in edits]
        self._send(m.TextEdited(rev, told, [], words))


def _words(found: Diagnostic) -> str:
    return "; ".join([found.message, *found.helps])
