"""The debugger's loop: a line in, an answer out. Only `quit` and the end of the input end it; Ctrl-C ends a command."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import redirect_stdout
from difflib import unified_diff
from typing import TYPE_CHECKING, Any

from movimentum.console import answer_json, is_terminal, wants_color
from movimentum.diagnostics import Diagnostic, Severity, render_text, to_json
from movimentum.errors import MovimentumError, UsageError
from movimentum.records import dataclass, field, replace
from movimentum.repl import causes, edit, explain, files, inspect, navigate, over_time, script
from movimentum.repl.command import Answer
from movimentum.repl.helping import help_text
from movimentum.repl.session import Session, refused, typed
from movimentum.repl.told import as_json
from movimentum.signals import signal_handled
from movimentum.source import SourceText
from movimentum.terminal import visible_lines

if TYPE_CHECKING:
    from prompt_toolkit import PromptSession

COMMANDS = {
    **navigate.COMMANDS,
    **over_time.COMMANDS,
    **inspect.COMMANDS,
    **explain.COMMANDS,
    **causes.COMMANDS,
    **edit.COMMANDS,
    **script.COMMANDS,
    **files.COMMANDS,
}
QUIT = ("quit", "exit")
INTERRUPTED = Diagnostic("repl/interrupted", Severity.ERROR, "interrupted; everything is as it was before")
_RELATION = re.compile(r"\s*[=<>~]|\.")


def answer(session: Session, line: str) -> Answer:
    """Carry out a line: a command, or a statement to try. `MovimentumError` if it cannot be done."""
    text = line.strip()
    if not text:
        return session, ""
    word = text.split(None, 1)[0].rstrip("?;")
    rest = text[len(word) :]
    if text in QUIT:
        return replace(session, ended=True), ""
    if word in ("help", "") or text.endswith("?"):
        return session, _help(word if text.endswith("?") and word else rest.strip(" ?"))
    # `free = 3` is about a variable of that name, `free` is the command
    if word in COMMANDS and not _RELATION.match(rest) and (not rest or rest[0] in " \t;"):
        return COMMANDS[word].run(session, rest.strip().removesuffix(";").rstrip())
    part = script.typed_part(session, text)
    return edit.try_statement(session, text, _words()) if part is None else part


def _words() -> list[str]:
    """Everything that may begin a line."""
    return [*COMMANDS, "help", "quit", "exit"]


def _help(name: str) -> str:
    text = help_text(COMMANDS, name)
    if text is None:
        raise _unknown(name)
    return text


def _unknown(name: str) -> UsageError:
    near = [f"did you mean `{other}`?" for other in edit.near_commands(name, _words())]
    return refused("unknown-command", f"there is no command `{name}`", *near, "help")


def say(text: str) -> None:
    """An answer, on standard output."""
    _put(visible_lines(text))


def _put(text: str) -> None:
    """The text made safe to show."""
    if not text or sys.stdout is None:  # pyright: ignore[reportUnnecessaryComparison]
        return
    encoding = sys.stdout.encoding or "ascii"  # perhaps a terminal without Braille
    sys.stdout.write(text.encode(encoding, "replace").decode(encoding) + "\n")
    sys.stdout.flush()


def complain(diagnostics: Iterable[Diagnostic], source: SourceText | None = None) -> None:
    """A refusal, in the form of all diagnostics."""
    _put(render_text(diagnostics, source or typed(""), color=wants_color(sys.stdout)).rstrip("\n"))


@dataclass(slots=True)
class Teller:
    """How answers are shown: as text, each after its question if ``asked``, or as a line of JSON each; ``record`` keeps
    them as text.
    """

    json: bool = False
    asked: bool = False
    record: list[str] = field(default_factory=list[str])

    def tell(self, session: Session, line: str, text: str, problem: MovimentumError | None = None) -> None:
        """The answer to ``line``, or the ``problem`` with it."""
        question = f"> {line.strip()}"
        if problem is not None:
            source = problem.source or session.work.source
            text = render_text(problem.diagnostics, source).rstrip("\n")
        self.record += [question, *filter(None, [visible_lines(text)]), ""]
        if self.json:
            time = float(session.time) if session.work.moves else None
            found = None if problem is None else to_json(problem.diagnostics, problem.source or session.work.source)
            answer_json(as_json(line.strip(), time, text if problem is None else None, found))
            return
        if self.asked and (text or problem is not None):
            say(question)
        if problem is None:
            say(text)
        else:
            complain(problem.diagnostics, problem.source or session.work.source)


def step(session: Session, line: str, teller: Teller | None = None) -> tuple[Session, bool]:
    """Carry out one line and show its answer; whether it could be done."""
    teller = teller or Teller()
    try:
        after, text = answer(session, line)
    except MovimentumError as error:
        teller.tell(session, line, "", error)
        return session, False
    except (OSError, RecursionError, ArithmeticError, NotImplementedError, MemoryError) as error:
        message = f"this could not be done: {str(error) or type(error).__name__}"
        teller.tell(session, line, "", UsageError([Diagnostic("repl/failed", Severity.ERROR, message)], typed("")))
        return session, False
    teller.tell(after, line, text)
    return after, True


def greet(session: Session) -> Session:
    """The errors of the script, if any, and where the session begins."""
    diagnostics = [d for d in session.advice if d.severity is not Severity.NOTE]
    if diagnostics:
        session, text = edit.told(session, diagnostics)
        say(text)
    try:
        say(navigate.where(session))
    except MovimentumError:
        say("the script has errors, so there is no motion to look at; `help` lists the commands")
    return session


def split(commands: str) -> list[str]:
    """``-c 'COMMAND; …'``: the commands, separated by ``;`` or a line end outside quotes."""
    return [part for part in re.findall(r"(?:[^;'\r\n]|'[^']*'?)+", commands) if part.strip()]


def interact(session: Session, commands: str | None, teller: Teller | None = None) -> int:
    """Run ``commands``, or lines from standard input until it ends; returns 0, or 1 if any line of ``commands`` (or of
    an input that is not a terminal) could not be done.
    """
    teller = teller or Teller(asked=commands is not None)
    typed = commands is None and is_terminal(sys.stdin)
    lines: Iterator[str]
    if commands is not None:
        lines = iter(split(commands))
    elif typed:
        session = greet(session)
        return _typed(session, teller)
    else:
        lines = _piped()
    failed = False
    for line in lines:
        try:
            session, done = step(session, line, teller)
        except KeyboardInterrupt:
            if commands is not None:  # commands given together end together
                raise
            signal_handled()
            done = False
            complain([INTERRUPTED])
        failed |= not done
        if session.ended:
            break
    return 1 if failed else 0


def _piped() -> Iterator[str]:
    """The lines of standard input, if there is one; bytes that are not text are shown as escapes. `UsageError` if it
    cannot be read.
    """
    stream = sys.stdin
    if stream is None:  # pyright: ignore[reportUnnecessaryComparison]
        return
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors="backslashreplace")
    try:
        for line in stream:
            yield line.rstrip("\r\n")
    except OSError as problem:
        message = f"cannot read commands from standard input: {(problem.strerror or str(problem)).lower()}"
        raise UsageError([Diagnostic("usage/input", Severity.ERROR, message, helps=("-c 'help'",))]) from problem


def _typed(session: Session, teller: Teller) -> int:
    from prompt_toolkit.patch_stdout import patch_stdout

    from movimentum.repl.prompt import make_prompt

    def reply_to(question: str | None = None) -> str | None:
        """The typed line; None for the end of the input, empty for Ctrl-C."""
        try:
            with patch_stdout():
                return str(prompt.prompt() if question is None else prompt.prompt(question))
        except EOFError:
            return None
        except KeyboardInterrupt:
            signal_handled()
            return ""
        finally:
            prompt.message = message  # otherwise a question asked in between stays

    current = [replace(session, tell=say, ask=reply_to)]
    prompt: PromptSession[Any] = make_prompt(lambda: current[0], [*COMMANDS, "help", "quit"])
    message = prompt.message

    while True:
        line = reply_to()
        if line is None or line.strip().rstrip(";") in QUIT:
            if current[0].text == current[0].original:
                return 0
            reply = reply_to("there are unsaved changes, which `write` would save; quit anyway? [y/N] ")
            if reply is None or reply.strip().lower() in ("y", "yes", *QUIT):
                return 0
            continue
        try:
            current[0], _ = step(current[0], line, teller)
        except KeyboardInterrupt:  # the session is as it was before the command
            signal_handled()
            complain([INTERRUPTED])


def replay(session: Session, recorded: str, name: str, teller: Teller) -> int:
    """Ask the questions of a recorded session again; 1, with the differences, if the answers are others now."""
    shown = io.StringIO()
    for line in recorded.splitlines():
        if line.startswith("> "):
            with redirect_stdout(shown):
                session, _ = step(session, line[2:], teller)
    now = "\n".join(teller.record)
    lines = list(unified_diff(recorded.splitlines(), now.splitlines(), name, "the answers now", "", "", 2, ""))
    say("\n".join(lines) or f"the answers are those of {name}")
    return 1 if lines else 0
