"""The state of a debugging session: the original and the current script, an instant, and the lines typed so far.

It also defines answers (words with the data behind them, also as JSON) and the kinds of input: commands, and statements
to try out.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable, Sequence
from enum import Enum
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

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
UNHURRIED = 5.0
"""The `Session.patience` of sessions that are recorded or replayed: on a slow machine too, answers are the same."""


def typed(text: str) -> SourceText:
    """The typed text as a source, for messages."""
    return SourceText("<prompt>", text)


def refused(code: str, message: str, *helps: str) -> UsageError:
    """The error for a command that cannot be done, without a place in a text."""
    return UsageError([Diagnostic(f"repl/{code}", Severity.ERROR, message, helps=helps)], typed(""))


@dataclass(frozen=True)
class Session(Inspector):
    """``file`` is the script's path, ``original`` its text there; ``work`` has the text as it is now.

    ``patience`` multiplies the time limits of answers. ``time`` is the moment looked at. ``watches`` are expressions
    shown after every move, ``breaks`` the conditions at which `run` stops. ``past`` and ``future`` are the texts that
    undo and redo go to. ``suggestions`` are what `apply` does, numbered from 1: fixes, and statements that it puts in
    at this step.
    """

    file: str
    original: str
    patience: float = 1.0
    watches: tuple[str, ...] = ()
    breaks: tuple[str, ...] = ()
    past: tuple[str, ...] = ()
    future: tuple[str, ...] = ()
    suggestions: tuple[str | Fix, ...] = ()
    ended: bool = False
    lines: tuple[str, ...] = ()
    """The typed lines, the latest last."""
    pending: str = ""
    """Lines that the last command wants to be carried out next."""
    reading: tuple[str, ...] = ()
    """The files of commands that are being read, each inside the one before."""
    already_shown: frozenset[tuple[str, str]] = frozenset()
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
        return self.work.advice(self.patience * PATIENCE_S)

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
        """A remark that there is no pose at the moment, and why; empty if there is one."""
        standing = self.standing
        if standing.solved:
            return ""
        return f"there is no pose at t = {time_text(float(self.time))}{f': {standing.reason}' * bool(standing.reason)}"

    @property
    def caveat(self) -> str:
        """A remark to show before places if there is no pose at the moment: which pose is shown."""
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


def opened(path: str, choices: Choices, patience: float = 1.0) -> Session:
    """A session with the script at ``path``; `UsageError` or `ScriptError` if it cannot be read as text."""
    source = read(path)
    session = Session(Engine(choices).revise(source), Fraction(0), source.path, source.text, patience)
    try:
        return session.at(session.work.timeline.start)
    except MovimentumError:
        return session


LEFT_OUT = frozenset({"pose", "edits", "tried_on"})
"""Fields of data that are for programs inside: whole poses, places in a text."""


class AnswerWithData(str):
    """An answer in words, and its ``data``: records, numbers, lists of them."""

    __slots__ = ("data",)
    data: Any

    def __new__(cls, text: str, data: Any) -> AnswerWithData:
        """``text`` with its ``data``."""
        made = super().__new__(cls, text)
        made.data = data
        return made


def plain_data(value: Any) -> Any:
    """Data as JSON has it: records are objects, exact times are numbers, what is no finite number is null."""
    match value:
        case AnswerWithData():
            return plain_data(value.data)
        case Enum():
            return value.value
        case None | bool() | int() | str():
            return value
        case Fraction():
            return float(value)
        case float():
            return value if math.isfinite(value) else None
        case np.ndarray() | np.generic():
            return plain_data(value.tolist())  # pyright: ignore[reportUnknownArgumentType]
        case Fix():
            return value.title
        case dict():
            items = cast("dict[Any, Any]", value)
            return {str(key): plain_data(item) for key, item in items.items()}
        case list() | tuple():
            return [plain_data(item) for item in cast("Sequence[Any]", value)]
        case _ if dataclasses.is_dataclass(value) or hasattr(value, "__dataclass_fields__"):
            names = [name for name in value.__dataclass_fields__ if name not in LEFT_OUT]
            return {name: plain_data(getattr(value, name)) for name in names}
        case _:
            return str(value)


Problem = list[dict[str, Any]]
"""Diagnostics as `check --format json` has them."""


def as_json(command: str, time: float | None, answer: str | None, problem: Problem | None) -> str:
    """The line about one command: ``answer`` has its text and data, ``diagnostics`` why it could not be done."""
    line: dict[str, Any] = {"command": command, "done": problem is None, "time": time}
    if answer is not None:
        line["text"] = str(answer)
        if isinstance(answer, AnswerWithData):
            line["answer"] = plain_data(answer)
    if problem is not None:
        line["diagnostics"] = problem
    return json.dumps(line, ensure_ascii=False)


Answer = tuple[Session, str]
"""The session afterwards, and the answer."""


@dataclass(frozen=True, slots=True)
class Command:
    """``usage`` shows its arguments, ``help`` is a line about it; ``run`` gets the text after the name."""

    usage: str
    help: str
    run: Callable[[Session, str], Answer]


class CommandTable(dict[str, Command]):
    """Commands by name, in the order of the list that `help` shows. The docstring of a command is its help."""

    def add(self, usage: str) -> Callable[[Callable[[Session, str], Answer]], Callable[[Session, str], Answer]]:
        """Decorates the command that ``usage`` begins with."""

        def added(run: Callable[[Session, str], Answer]) -> Callable[[Session, str], Answer]:
            self[usage.split()[0]] = Command(usage, " ".join((run.__doc__ or "").split()), run)
            return run

        return added


def table(columns: Sequence[Sequence[str]], *, right: frozenset[int] = frozenset()) -> str:
    """Rows of texts, aligned."""
    widths = [max(map(len, column)) for column in zip(*columns, strict=True)] if columns else []
    lines: list[str] = []
    for row in columns:
        cells = [
            cell.rjust(w) if i in right else cell.ljust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return AnswerWithData("\n".join(lines), columns)


def split_output(argument: str, suffixes: Sequence[str]) -> tuple[str, str | None]:
    """The text before ``-o FILE``, and FILE."""
    found = re.fullmatch(r"(.*?)(?:^|\s)-o\s+(\S+)\s*", argument, re.DOTALL)
    if found is None:
        return argument.strip(), None
    if not found[2].lower().endswith(tuple(suffixes)):
        raise refused("file", f"`{found[2]}` is not a {' or '.join(suffixes)} file", f"-o plot{suffixes[0]}")
    return found[1].strip(), found[2]


def plain(argument: str, command: str) -> None:
    """Refuse an argument for a command that takes none."""
    if argument.strip():
        raise refused("argument", f"`{command}` takes no argument, found `{argument.strip()}`")
