"""What the command line says to a person: messages and progress on stderr, errors as exit codes.

Nothing here prints on stdout, which belongs to what was asked for.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Protocol, TextIO

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import MovimentumError
from movimentum.files import FULL, unwritable
from movimentum.source import SourceText

if TYPE_CHECKING:
    from rich.progress import Progress

DONE = 0
USAGE = 2
NO_SOLUTION = 3
BUG = 70
INTERRUPTED = 130
TERMINATED = 143

_PATIENCE_S = 1.0
"""Work that takes less gets no progress bar."""


_HOW_TO_REPORT = (
    "run the same command with --debug, and report what it prints together with the script and the output of "
    '`movimentum --version` (README, "Reporting a bug")'
)


class ReaderGone(Exception):
    """Who reads our standard output has seen enough (``| head``)."""


class Terminated(BaseException):
    """Somebody asked us to end (SIGTERM): clean up as after Ctrl-C."""


class Console:
    """Where messages go. ``quiet`` keeps everything but diagnostics; ``debug`` shows tracebacks."""

    def __init__(self, *, quiet: bool = False, debug: bool = False, stream: TextIO | None = None) -> None:
        self.quiet = quiet
        self.debug = debug
        self._stream = stream

    @property
    def stream(self) -> TextIO | None:
        """stderr as it is now (None in a process that has none)."""
        return self._stream if self._stream is not None else sys.stderr

    def say(self, text: str) -> None:
        """A message; nothing with ``--quiet``."""
        if not self.quiet:
            self.write(text + "\n")

    def show(self, diagnostics: Iterable[Diagnostic], source: SourceText | None) -> None:
        """Diagnostics as text, with the lines of ``source`` that they are about; notes are for `check` only."""
        from movimentum.diagnostics import render_text

        shown = [item for item in diagnostics if item.severity is not Severity.NOTE]
        if shown:
            self.write(render_text(shown, source or SourceText("movimentum", ""), color=wants_color(self.stream)))

    def note(self, diagnostics: Iterable[Diagnostic], source: SourceText | None) -> None:
        """Notes that answer what was asked on the command line; nothing with ``--quiet``."""
        from movimentum.diagnostics import render_text

        for item in () if self.quiet else diagnostics:
            self.write(render_text([item], source or SourceText("movimentum", ""), color=wants_color(self.stream)))

    def trace(self, error: BaseException) -> None:
        """The traceback, with ``--debug``."""
        if self.debug:
            import traceback

            self.write("".join(traceback.format_exception(error)))

    def show_bug(self, error: BaseException) -> None:
        """A fault of our own, and how to report it."""
        self.trace(error)
        self.show([bug(error)], None)

    def write(self, text: str) -> None:
        """Write ``text``, whatever characters the terminal knows and even where nobody listens any more."""
        stream = self.stream
        if stream is None:
            return
        try:
            try:
                stream.write(text)
            except UnicodeEncodeError:
                stream.write(text.encode(stream.encoding or "ascii", "backslashreplace").decode(stream.encoding))
            stream.flush()
        except OSError:
            pass

    @contextmanager
    def progress(self, what: str) -> Generator[Callable[[int, int], None], None, None]:
        """A function to call with (done, total): shows a bar on a terminal once the work has taken a second."""
        bar = _Bar(what, self.stream) if not self.quiet and is_terminal(self.stream) else None
        try:
            yield bar.update if bar is not None else lambda done, total: None
        finally:
            if bar is not None:
                bar.close()


class _Bar:
    """A progress bar that does not exist (and imports nothing) for the first second."""

    def __init__(self, what: str, stream: TextIO | None) -> None:
        self._what = what
        self._stream = stream
        self._started = time.monotonic()
        self._bar: Progress | None = None

    def update(self, done: int, total: int) -> None:
        if self._bar is None:
            if time.monotonic() - self._started < _PATIENCE_S or done >= total:
                return
            self._bar = self._begun()
        self._bar.update(self._bar.task_ids[0], completed=done, total=total)

    def _begun(self) -> Progress:
        from rich.console import Console as RichConsole
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        bar = Progress(*columns, console=RichConsole(file=self._stream), transient=True)
        bar.add_task(self._what)
        bar.start()
        return bar

    def close(self) -> None:
        if self._bar is not None:
            self._bar.stop()


class _HasIsatty(Protocol):
    def isatty(self) -> bool: ...


def is_terminal(stream: _HasIsatty | None) -> bool:
    """Whether a person is looking at ``stream``."""
    try:
        return stream is not None and stream.isatty() and os.environ.get("TERM") != "dumb"
    except ValueError:  # closed
        return False


def wants_color(stream: _HasIsatty | None) -> bool:
    """Whether to colour what is written to ``stream``: a terminal, and no ``NO_COLOR`` (any value but an empty one)."""
    return is_terminal(stream) and not os.environ.get("NO_COLOR")


def guarded(work: Callable[[], int], console: Console) -> int:
    """The exit code of ``work``: what it returns, or what the exception that ended it stands for.

    An exception never becomes a traceback, unless ``--debug`` asks for one.
    """
    _end_on_sigterm()
    try:
        code = work()
        if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison]
            sys.stdout.flush()
        return code
    except (BrokenPipeError, ReaderGone):
        # Not an error. Python would complain again when it closes stdout, so that is pointed elsewhere.
        if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison]
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except KeyboardInterrupt:
        console.write("\ninterrupted; nothing was written\n")
        return INTERRUPTED
    except Terminated:
        return TERMINATED
    except MovimentumError as error:
        console.trace(error)
        console.show(error.diagnostics, None)
        return error.exit_code
    except MemoryError as error:
        console.trace(error)
        console.show([_out_of_memory()], None)
        return 1
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FULL:
            console.trace(error)
            console.show(unwritable("the output", (error.strerror or "the disk is full").lower()).diagnostics, None)
            return USAGE
        console.show_bug(error)
        return BUG


def bug(error: BaseException) -> Diagnostic:
    """What we say about a fault of our own."""
    where = "".join(f" at {frame.f_globals.get('__name__', '?')}:{line}" for frame, line in _last(error.__traceback__))
    return Diagnostic(
        "internal/bug",
        Severity.ERROR,
        f"this is a bug in Movimentum, not in your script: {type(error).__name__}: {error}{where}",
        helps=(_HOW_TO_REPORT,),
    )


def _out_of_memory() -> Diagnostic:
    return Diagnostic(
        "limit/memory",
        Severity.ERROR,
        "this needs more memory than there is",
        helps=("make the picture smaller (`--scale 0.5`), or render fewer frames at once (`--frames 0:100`)",),
    )


def _last(trace: TracebackType | None) -> Iterator[tuple[FrameType, int]]:
    import traceback

    yield from list(traceback.walk_tb(trace))[-1:]


def _end_on_sigterm() -> None:
    """SIGTERM unwinds the stack, so that half-written files are removed."""
    owner = os.getpid()

    def handler(number: int, frame: FrameType | None) -> None:
        if os.getpid() != owner:  # a worker that inherited this handler owns no files: it just goes
            os._exit(TERMINATED)
        raise Terminated

    try:
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, handler)
    except ValueError:  # not the main thread: somebody else's process, somebody else's signals
        pass
