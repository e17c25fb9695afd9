"""The debugger's loop: a line in, an answer out. Only `quit` and the end of the input end it; Ctrl-C ends a command."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from movimentum.console import is_terminal, wants_color
from movimentum.diagnostics import Diagnostic, Severity, render_text
from movimentum.errors import MovimentumError, UsageError
from movimentum.records import replace
from movimentum.repl import causes, edit, explain, files, inspect, navigate, over_time
from movimentum.repl.command import Answer, table
from movimentum.repl.session import Session, refused, typed
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
    return edit.try_statement(session, text, _words())


def _words() -> list[str]:
    """Everything that may begin a line."""
    return [*COMMANDS, "help", "quit", "exit"]


def _help(name: str) -> str:
    if name:
        command = COMMANDS.get(name)
        if command is None:
            raise _unknown(name)
        return f"{command.usage}\n  {command.help}"
    rows = [[command.usage, command.help] for command in COMMANDS.values()]
    rows.append(["STATEMENT;", "try it: it takes effect at once, at this step, under the key convention"])
    rows.append(["help [COMMAND], COMMAND?", "this list, or help for one command"])
    rows.append(["quit", "end (so does the end of the input); in a terminal, it asks if changes are not saved"])
    return table(rows)


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


def step(session: Session, line: str) -> tuple[Session, bool]:
    """Carry out one line and show its answer; whether it could be done."""
    try:
        session, text = answer(session, line)
        say(text)
    except MovimentumError as error:
        complain(error.diagnostics, error.source or session.work.source)
        return session, False
    except (OSError, RecursionError, ArithmeticError, NotImplementedError, MemoryError) as error:
        message = f"this could not be done: {str(error) or type(error).__name__}"
        complain([Diagnostic("repl/failed", Severity.ERROR, message)])
        return session, False
    return session, True


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


def interact(session: Session, commands: str | None) -> int:
    """Run ``commands``, or lines from standard input until it ends; returns 0, or 1 if any line of ``commands`` (or of
    an input that is not a terminal) could not be done.
    """
    typed = commands is None and is_terminal(sys.stdin)
    lines: Iterator[str]
    if commands is not None:
        lines = iter(split(commands))
    elif typed:
        session = greet(session)
        return _typed(session)
    else:
        lines = _piped()
    failed = False
    for line in lines:
        try:
            session, done = step(session, line)
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


def _typed(session: Session) -> int:
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
            current[0], _ = step(current[0], line)
        except KeyboardInterrupt:  # the session is as it was before the command
            signal_handled()
            complain([INTERRUPTED])
