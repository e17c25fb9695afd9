"""The state of a debugging session: a script as it was and as it is now, an instant, and what was typed before."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.errors import MovimentumError, NoSolutionError, UsageError
from movimentum.output.files import refuse_overwriting
from movimentum.records import dataclass, replace
from movimentum.source import SourceText
from movimentum.text import time_text
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine
from movimentum.workflow.inspector import Inspector
from movimentum.workflow.read import read, reads

if TYPE_CHECKING:
    from movimentum.solver.path.piece import Piece

PATIENCE_S = 2.0
"""The limit for trying all fixes of a script: the user waits for them."""


def typed(text: str) -> SourceText:
    """What was typed, as messages show it."""
    return SourceText("<prompt>", text)


def refused(code: str, message: str, *helps: str) -> UsageError:
    """That the typed command cannot be done; it is about no place in a text."""
    return UsageError([Diagnostic(f"repl/{code}", Severity.ERROR, message, helps=helps)], typed(""))


@dataclass(frozen=True)
class Session(Inspector):
    """``file`` is the script's path, ``original`` its text there; ``work`` has the text as it is now.

    ``time`` is the moment looked at. ``watches`` are expressions shown after every move, ``breaks``
    the conditions at which `run` stops. ``past`` and ``future`` are
    the texts that undo and redo go to. ``suggestions`` are what `apply` does, numbered from 1: fixes, and statements
    that it puts in at this step.
    """

    file: str
    original: str
    watches: tuple[str, ...] = ()
    breaks: tuple[str, ...] = ()
    past: tuple[str, ...] = ()
    future: tuple[str, ...] = ()
    suggestions: tuple[str | Fix, ...] = ()
    ended: bool = False
    lines: tuple[str, ...] = ()
    """What has been typed, the latest last."""
    pending: str = ""
    """Lines that the last command wants to be carried out next."""
    reading: tuple[str, ...] = ()
    """The files of commands that are being read, each inside the one before."""
    heard: frozenset[tuple[str, str]] = frozenset()
    """Codes and texts of the script's messages that have been reported."""
    tell: Callable[[str], None] | None = None
    """In a terminal: shows a part of an answer before the whole of it is known."""
    ask: Callable[[str], str | None] | None = None
    """In a terminal: the answer to a question; None at the end of the input."""
    draw: Callable[[bytes], None] | None = None
    """In a terminal that can: shows a PNG picture."""

    @property
    def text(self) -> str:
        """The script as it is now."""
        return self.work.source.text

    @property
    def advice(self) -> tuple[Diagnostic, ...]:
        """The diagnostics with the fixes that work."""
        return self.work.advice(PATIENCE_S)

    def refuse_overwriting(self, name: str, *, script: bool = True) -> Path:
        """The file ``name`` as an output; `UsageError` if it is one of the script's pictures or the script."""
        read = reads(self.work.source, self.work.scene if self.work.moves else None)
        refuse_overwriting(Path(name), read if script else read[1:])
        return Path(name)

    @property
    def piece(self) -> tuple[Piece, float]:
        """See `Inspector`."""
        try:
            return super().piece
        except NoSolutionError as error:
            raise refused("no-solution", self.no_pose, "conflicts") from error

    @property
    def no_pose(self) -> str:
        """That there is no pose at the moment, and why; empty where there is one."""
        standing = self.standing
        if standing.solved:
            return ""
        return f"there is no pose at t = {time_text(float(self.time))}{f': {standing.reason}' * bool(standing.reason)}"

    @property
    def caveat(self) -> str:
        """What has to be said before places are shown: what they are where there is no pose at the moment."""
        standing = self.standing
        if standing.solved:
            return ""
        when = time_text(float(self.time))
        if standing.last is None:
            return f"there is no pose at t = {when}; as drawn:"
        return f"there is no pose at t = {when}; the last one, of t = {time_text(float(standing.last))}:"

    @property
    def frame(self) -> int:
        """The number of the last frame not after the moment."""
        timeline = self.work.timeline
        return int((self.time - timeline.start) * timeline.fps // 1)

    def at(self, time: Fraction) -> Session:
        """The session at another moment, inside the film."""
        timeline = self.work.timeline
        return replace(self, time=min(max(time, timeline.start), timeline.end))

    def edited(self, text: str) -> Session:
        """The session with another text, which `undo` takes back."""
        return replace(self._with(text), past=(*self.past, self.text), future=())

    def undone(self) -> Session:
        """The text before the last change."""
        if not self.past:
            raise refused("nothing-to-undo", "there is nothing to undo")
        return replace(self._with(self.past[-1]), past=self.past[:-1], future=(self.text, *self.future))

    def redone(self) -> Session:
        """The text before the last undo."""
        if not self.future:
            raise refused("nothing-to-redo", "there is nothing to redo")
        return replace(self._with(self.future[0]), past=(*self.past, self.text), future=self.future[1:])

    def _with(self, text: str) -> Session:
        work = self.work.engine.revise(SourceText(self.work.source.path, text))
        session = replace(self, work=work, suggestions=())
        try:
            return session.at(self.time)
        except MovimentumError:
            return session


def opened(path: str, choices: Choices) -> Session:
    """A session with the script at ``path``; `UsageError` or `ScriptError` if it cannot be read as text."""
    source = read(path)
    session = Session(Engine(choices).revise(source), Fraction(0), source.path, source.text)
    try:
        return session.at(session.work.timeline.start)
    except MovimentumError:
        return session
