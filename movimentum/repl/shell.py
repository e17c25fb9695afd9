"""The debugger's loop: a line in, an answer out. Only `quit` and the end of the input end it; Ctrl-C ends a command."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import redirect_stdout
from difflib import unified_diff
from functools import partial
from typing import TYPE_CHECKING, Any

from movimentum.console import answer_json, is_terminal, wants_color
from movimentum.diagnostics import Diagnostic, Severity, render_text, to_json
from movimentum.errors import MovimentumError, ScriptError, UsageError
from movimentum.records import dataclass, field, replace
from movimentum.repl import causes, edit, explain, files, inspect, lines, navigate, script
from movimentum.repl.helping import help_text
from movimentum.repl.lines import command_of, logical_lines, unfinished
from movimentum.repl.pager import in_pager, is_long
from movimentum.repl.session import Answer, Session, as_json, refused, typed
from movimentum.signals import signal_handled
from movimentum.source import SourceText
from movimentum.terminal import visible_lines
from movimentum.text import counted

if TYPE_CHECKING:
    from prompt_toolkit import PromptSession

COMMANDS = {
    **navigate.COMMANDS,
    **inspect.COMMANDS,
    **explain.COMMANDS,
    **causes.COMMANDS,
    **edit.COMMANDS,
    **script.COMMANDS,
    **files.COMMANDS,
    **lines.COMMANDS,
}
QUIT = ("quit", "exit")
INTERRUPTED = Diagnostic("repl/interrupted", Severity.ERROR, "interrupted; everything is as it was before")


def answer(session: Session, line: str) -> Answer:
    """Carry out a line: a command, or a statement to try. `MovimentumError` if it cannot be done."""
    text = line.strip()
    if not text:
        return session, ""
    word = text.split(None, 1)[0].rstrip("?;")
    rest = text[len(word) :]
    found = command_of(text, COMMANDS)
    if text in QUIT:
        return replace(session, ended=True), ""
    if word in ("help", "") or text.endswith("?"):
        return session, _help(word if text.endswith("?") and word else rest.strip(" ?"))
    if found is not None:
        return found[0].run(session, found[1])
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
    them as text. ``paged``: what is longer than the terminal goes through a pager. ``depth``: 2 for lines of a file
    that is read, 3 for one that this reads.
    """

    json: bool = False
    asked: bool = False
    paged: bool = False
    depth: int = 1
    record: list[str] = field(default_factory=list[str])

    def tell(self, session: Session, line: str, text: str, problem: MovimentumError | None = None) -> None:
        """The answer to ``line``, or the ``problem`` with it."""
        question = f"{'>' * self.depth} {' '.join(line.splitlines()).strip()}" if line else ""
        if problem is not None:
            source = problem.source or session.work.source
            text = render_text(problem.diagnostics, source).rstrip("\n")
        kept = re.sub(r"(?m)^>", " >", visible_lines(text))  # `list` marks lines as questions are marked
        self.record += [*filter(None, [question]), *filter(None, [kept]), ""]
        if self.json:
            time = float(session.time) if session.work.moves else None
            found = None if problem is None else to_json(problem.diagnostics, problem.source or session.work.source)
            answer_json(as_json(line.strip(), time, text if problem is None else None, found))
            return
        if self.asked and question and (text or problem is not None):
            say(question)
        if self.paged and is_long(text):
            in_pager(visible_lines(text))
        elif problem is None:
            say(text)
        else:
            complain(problem.diagnostics, problem.source or session.work.source)


def step(session: Session, line: str, teller: Teller | None = None) -> tuple[Session, bool]:
    """Carry out one line, and what it wants to be carried out next, and show the answers; whether all could be done."""
    teller = teller or Teller()
    if line.strip():
        session = replace(session, lines=(*session.lines, line.strip()))
    try:
        after, text = answer(session, line)
    except MovimentumError as error:
        if error.source is None or error.source.path == session.work.source.path:
            shown = ScriptError(edit.briefly(session, error.diagnostics), error.source)
            already_shown = {(item.code, item.message) for item in error.diagnostics}
            session = replace(session, already_shown=session.already_shown | already_shown)
            error = shown
        teller.tell(session, line, "", error)
        return session, False
    except (OSError, RecursionError, ArithmeticError, NotImplementedError, MemoryError) as error:
        message = f"this could not be done: {str(error) or type(error).__name__}"
        teller.tell(session, line, "", UsageError([Diagnostic("repl/failed", Severity.ERROR, message)], typed("")))
        return session, False
    teller.tell(after, line, text)
    if not after.pending:
        return after, True
    lines, after = logical_lines(after.pending, COMMANDS), replace(after, pending="")
    after, done = steps(after, lines, replace(teller, asked=True, depth=teller.depth + 1))
    return replace(after, reading=session.reading), done


def steps(session: Session, lines: Sequence[str], teller: Teller) -> tuple[Session, bool]:
    """Carry out lines one after the other, up to the first that fails; whether all could be done."""
    for place, line in enumerate(lines, 1):
        session, done = step(session, line, teller)
        if session.ended:
            break
        if not done:
            if place < len(lines):
                rest = counted(len(lines) - place, "line")
                were = "was" if len(lines) - place == 1 else "were"
                message = f"stopped at `{' '.join(line.split())}`: {rest} after it {were} not carried out"
                teller.tell(session, "", "", refused("stopped", message))
            return session, False
    return session, True


def greet(session: Session) -> Session:
    """The errors of the script, if any, and where the session begins."""
    diagnostics = [d for d in session.advice if d.severity is not Severity.NOTE]
    if diagnostics:
        session, text = edit.reported(session, diagnostics)
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

    from movimentum.repl import terminal_pictures
    from movimentum.repl.history import opened_history
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

    how = terminal_pictures.protocol()
    draw = None if how is None else partial(terminal_pictures.show, how=how)
    current = [replace(session, tell=say, ask=reply_to, draw=draw)]
    teller = replace(teller, paged=True)
    history = opened_history()
    prompt: PromptSession[Any] = make_prompt(
        lambda: current[0], [*COMMANDS, "help", "quit"], history, lambda text: unfinished(text, COMMANDS)
    )
    message = prompt.message

    kept = list(history.load_history_strings())
    current[0] = replace(current[0], lines=tuple(reversed(kept)))
    while True:
        line = reply_to()
        current[0] = replace(current[0], ended=line is None or line.strip().rstrip(";") in QUIT)
        if line is not None and not current[0].ended:
            try:
                lines = logical_lines(line, COMMANDS)
                current[0], _ = steps(current[0], lines, replace(teller, asked=len(lines) > 1))
            except KeyboardInterrupt:  # the session is as it was before the command
                signal_handled()
                complain([INTERRUPTED])
        if current[0].ended:
            if current[0].text == current[0].original:
                return 0
            reply = reply_to("there are unsaved changes, which `write` would save; quit anyway? [y/N] ")
            if reply is None or reply.strip().lower() in ("y", "yes", *QUIT):
                return 0


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
