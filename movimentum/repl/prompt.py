"""The prompt in a terminal: history, completion and colours."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from prompt_toolkit import PromptSession
from prompt_toolkit.application import get_app
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.filters import Condition
from prompt_toolkit.history import History
from prompt_toolkit.lexers import Lexer

from movimentum.errors import MovimentumError
from movimentum.repl.inspect import shown_values
from movimentum.repl.session import Session
from movimentum.terminal import visible_lines
from movimentum.text import time_text

_WORD = re.compile(r"[A-Za-z_.][A-Za-z0-9_.]*$")


def names(session: Session) -> list[str]:
    """Everything that can be named: things, their anchors and angles, variables."""
    try:
        scene = session.work.scene
    except MovimentumError:
        return []
    found = [
        name for t in scene.things for name in (t.name, *(f"{t.name}.{a.name}" for a in t.anchors), f"{t.name}.angle")
    ]
    return [*found, *scene.variables]


def keys(session: Session) -> list[str]:
    """The keys under which something is in force."""
    try:
        timeline = session.work.timeline
    except MovimentumError:
        return []
    return list(dict.fromkeys(c.key for c in timeline.segments[timeline.segment_at(session.time)].active))


class SessionCompleter(Completer):
    """Commands at the beginning of a line, names after them, and keys where a key is expected."""

    def __init__(self, session: Callable[[], Session], commands: Sequence[str]) -> None:
        self._session = session
        self._commands = commands

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterator[Completion]:
        """See the class."""
        text = document.text_before_cursor
        session = self._session()
        words = text.split()
        if words and words[0] in ("drop", "constraints") and len(text) > len(words[0]):
            begun = text[len(words[0]) :].lstrip()
            for key in keys(session):
                if key.startswith(begun):
                    yield Completion(key, -len(begun))
            return
        found = _WORD.search(text)
        begun = found[0] if found else ""
        first = text.strip() == begun
        options = [*self._commands, *names(session)] if first else names(session)
        for option in options:
            if option.startswith(begun) and option != begun:
                yield Completion(option, -len(begun))


def make_prompt(
    session: Callable[[], Session], commands: Sequence[str], history: History, unfinished: Callable[[str], bool]
) -> PromptSession[Any]:
    """The prompt, which shows the time that is looked at, and completes ``commands`` and names. Behind an
    ``unfinished`` line the input goes on; an empty line ends it.
    """

    @Condition
    def goes_on() -> bool:
        text = get_app().current_buffer.text
        return bool(text.rpartition("\n")[2].strip()) and unfinished(text)

    def message() -> str:
        now = session()
        if not now.work.moves:
            return "(errors) "
        return f"{_watched(now)}t={time_text(float(now.time))}> "

    return PromptSession(
        message,
        history=history,
        multiline=goes_on,
        prompt_continuation=lambda width, _line, _wrapped: ". ".rjust(width),
        completer=SessionCompleter(session, commands),
        complete_while_typing=False,
        lexer=_colours(),
    )


def _watched(session: Session) -> str:
    """The expressions that are watched, a line each, above the prompt."""
    if not session.watches:
        return ""
    try:
        return visible_lines(shown_values(session, session.watches)) + "\n"
    except MovimentumError:
        return ""


def _colours() -> Lexer | None:
    """The colours of scripts, if Pygments is installed."""
    try:
        from prompt_toolkit.lexers import PygmentsLexer

        from movimentum.highlight import MovimentumLexer
    except ImportError:
        return None
    return PygmentsLexer(MovimentumLexer)
