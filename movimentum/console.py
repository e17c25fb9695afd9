"""The command line's output for people: messages and progress on stderr, errors as exit codes.

Nothing here prints on stdout, which is for requested output only.
"""

from __future__ import annotations

import errno
import os
import re
import sys
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType, TracebackType
from typing import Any, Protocol, TextIO

from movimentum.budget import DEFAULT_MEGABYTES, LEAST_ROOM_MIB, OverBudget, ShortOfRoom, is_nearly_full
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import MovimentumError
from movimentum.output.files import FULL, unwritable
from movimentum.output.partial_files import discard, has_parts
from movimentum.signals import Interruption, Terminated, handled_signals, ignored_signals
from movimentum.source import SourceText
from movimentum.terminal import visible_json, visible_lines

DONE = 0
USAGE = 2
NO_SOLUTION = 3
BUG = 70
INTERRUPTED = 130

_PATIENCE_S = 1.0
"""Shorter work gets no progress bar."""
_WORDS_S = (10, 60, 300, 1800)
"""When a message says, without a terminal, that the work goes on."""


_HOW_TO_REPORT = (
    "run the same command with --debug, and report what it prints together with the script and the output of "
    '`movimentum --version -v` (README, "Reporting a bug")'
)


class ReaderClosed(Exception):
    """The reader of our standard output closed it early (``| head``)."""


class Console:
    """Where messages go. ``quiet`` keeps only diagnostics, ``verbose`` shows notes among them too; ``debug`` shows
    tracebacks.
    """

    def __init__(
        self, *, quiet: bool = False, verbose: bool = False, debug: bool = False, stream: TextIO | None = None
    ) -> None:
        self.quiet = quiet
        self.verbose = verbose
        self.debug = debug
        self.megabytes = DEFAULT_MEGABYTES
        self._stream = stream
        self._busy: tuple[str, float] | None = None
        self._bar: _Bar | None = None
        self._shown_s = 0
        self.left = "nothing was written"
        """The line that is left when Ctrl-C ends the command."""

    @property
    def stream(self) -> TextIO | None:
        """stderr as it is now (None in a process that has none)."""
        return self._stream if self._stream is not None else sys.stderr

    def say(self, text: str) -> None:
        """A message; nothing with ``--quiet``."""
        if not self.quiet:
            self.write(text + "\n")

    def show(self, diagnostics: Iterable[Diagnostic], source: SourceText | None) -> None:
        """Diagnostics as text, with the lines of ``source`` that they are about; notes only if they are wanted."""
        from movimentum.diagnostics import render_text

        shown = [item for item in diagnostics if self.verbose or item.severity is not Severity.NOTE]
        if shown:
            self._put(render_text(shown, source or SourceText("movimentum", ""), color=wants_color(self.stream)))

    def note(self, diagnostics: Iterable[Diagnostic], source: SourceText | None) -> None:
        """Notes that answer what was asked on the command line; nothing with ``--quiet``."""
        from movimentum.diagnostics import render_text

        for item in () if self.quiet else diagnostics:
            self._put(render_text([item], source or SourceText("movimentum", ""), color=wants_color(self.stream)))

    def trace(self, error: BaseException) -> None:
        """The traceback, with ``--debug``."""
        if self.debug:
            import traceback

            self.write("".join(traceback.format_exception(error)))

    def fail(self, error: MovimentumError) -> int:
        """Show an error that a user can cause; its exit code."""
        self.trace(error)
        self.show(error.diagnostics, error.source)
        return error.exit_code

    def show_bug(self, error: BaseException) -> None:
        """A bug in Movimentum, and how to report it."""
        self.trace(error)
        self.show([bug(error)], None)

    def write(self, text: str) -> None:
        """Write plain ``text``; characters that a terminal would obey are shown instead."""
        self._put(visible_lines(text))

    @contextmanager
    def working(self, what: str) -> Generator[None, None, None]:
        """While ``what`` goes on, `tick` reports it."""
        self._busy = what, time.monotonic()
        try:
            yield
        finally:
            self._busy = None
            self._wipe()

    def tick(self) -> None:
        """Called about thirty times a second. On a terminal, it shows how long the work has taken, once that is a
        second; elsewhere it writes a line now and then.

        It may come in the middle of any operation, so it writes past Python's buffers.
        """
        stream = self.stream
        if self.quiet or self._busy is None or stream is None or (self._bar is not None and self._bar.begun):
            return
        what, began = self._busy
        seconds = int(time.monotonic() - began)
        with suppress(OSError, ValueError):
            if is_terminal(stream):
                if seconds >= _PATIENCE_S and seconds != self._shown_s:
                    self._shown_s = seconds
                    os.write(stream.fileno(), f"\r{what}: {seconds} s\x1b[K".encode())
            elif seconds >= _WORDS_S[0] and seconds in _WORDS_S and seconds != self._shown_s:
                self._shown_s = seconds
                os.write(stream.fileno(), f"still {what} after {seconds} s; Ctrl-C ends it\n".encode())

    def _wipe(self) -> None:
        """Remove what `tick` left on the terminal."""
        stream = self.stream
        if self._shown_s and stream is not None and is_terminal(stream):
            with suppress(OSError, ValueError):
                os.write(stream.fileno(), b"\r\x1b[K")
        self._shown_s = 0

    def _put(self, text: str) -> None:
        """Write what is safe to show, even if nobody reads it any more."""
        stream = self.stream
        if stream is None:
            return
        self._wipe()
        try:
            _encoded(stream, text)
            stream.flush()
        except (OSError, ValueError):
            pass

    @contextmanager
    def progress(self, what: str) -> Generator[Callable[[int, int], None], None, None]:
        """A function to call with (done, total): shows a bar on a terminal once the work has taken a second."""
        bar = _Bar(what, self.stream) if not self.quiet and is_terminal(self.stream) else None
        self._bar = bar

        def update(done: int, total: int) -> None:
            if bar is not None:
                self._wipe()  # the bar begins on an empty line
                bar.update(done, total)

        try:
            yield update
        finally:
            self._bar = None
            if bar is not None:
                bar.close()


class _Bar:
    """A progress bar that does not exist (and imports nothing) for the first second."""

    def __init__(self, what: str, stream: TextIO | None) -> None:
        self._what = what
        self._stream = stream
        self._started = time.monotonic()
        self._bar: Any = None

    @property
    def begun(self) -> bool:
        """Whether it shows."""
        return self._bar is not None

    def update(self, done: int, total: int) -> None:
        if self._bar is None:
            if time.monotonic() - self._started < _PATIENCE_S or done >= total:
                return
            from click import progressbar

            self._bar = progressbar(length=total, label=self._what, show_pos=True, file=self._stream)
        self._bar.length = total
        with suppress(OSError, ValueError):  # a terminal that was closed
            self._bar.update(done - self._bar.pos)

    def close(self) -> None:
        """Nothing of it stays; the cursor, which it hides, comes back."""
        if self._bar is not None and self._stream is not None:
            with suppress(OSError, ValueError):
                self._stream.write("\r\x1b[K\x1b[?25h")
                self._stream.flush()


def answer(text: str) -> None:
    """Write the requested text on standard output, safe for a terminal (see `terminal`). It is no error if nobody reads
    it: the exit code is the answer then.
    """
    _to_stdout(lambda stream: _encoded(stream, text))


def answer_json(text: str) -> None:
    """Write JSON and a line end on standard output; its meaning does not depend on the encoding of the stream."""
    _to_stdout(lambda stream: stream.write(visible_json(text, stream.encoding) + "\n"))


def _to_stdout(write: Callable[[TextIO], object]) -> None:
    """Call ``write`` with standard output, which may be missing, or closed by its reader (``| head``)."""
    try:
        if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison]
            write(sys.stdout)
    except BrokenPipeError:
        _drop_stdout()


def _drop_stdout() -> None:
    """Nothing more is written to standard output: Python would complain again when it closes it."""
    if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison]
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _encoded(stream: TextIO, text: str) -> None:
    """Write ``text``, with escapes for characters that the stream's encoding does not have."""
    try:
        stream.write(text)
    except UnicodeEncodeError:
        encoding = stream.encoding or "ascii"
        stream.write(text.encode(encoding, "backslashreplace").decode(encoding))


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
    wanted = is_terminal(stream) and not os.environ.get("NO_COLOR")
    if wanted and os.name == "nt":
        os.system("")  # older consoles of Windows obey escape sequences from then on
    return wanted


def guarded(work: Callable[[], int], console: Console) -> int:
    """The exit code of ``work``: what it returns, or what the exception that ended it stands for.

    An exception never becomes a traceback, except with ``--debug``.
    """
    with handled_signals() as interruption:
        try:
            return _exit_code(work, console, interruption)
        except KeyboardInterrupt:
            console.write(f"\ninterrupted; {console.left}\n")
            return INTERRUPTED
        except Terminated as ending:
            return ending.code
        finally:
            if has_parts():  # memory was short, or one signal followed the other
                with ignored_signals():
                    discard()


def _exit_code(work: Callable[[], int], console: Console, interruption: Interruption) -> int:
    try:
        code = work()
        _to_stdout(lambda stream: stream.flush())
        return code
    except (BrokenPipeError, ReaderClosed):  # a stream that nobody reads to its end is no error
        _drop_stdout()
        return DONE
    except MovimentumError as error:
        return console.fail(error)
    except Exception as error:
        if interruption.pressed and isinstance(error, (ImportError, SystemError, RuntimeError)):
            raise KeyboardInterrupt from error
        if _is_out_of_memory(error):
            console.trace(error)
            console.show([_out_of_memory(error)], None)
            return 1
        if isinstance(error, OSError) and error.errno in FULL:
            console.trace(error)
            console.show(unwritable("the output", (error.strerror or "the disk is full").lower()).diagnostics, None)
            return USAGE
        if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
            console.trace(error)
            console.show([_OUT_OF_FILES], None)
            return 1
        console.show_bug(error)
        return BUG


_OUT_OF_FILES = Diagnostic(
    "limit/files",
    Severity.ERROR,
    "this needs more open files than the system allows",
    helps=("ulimit -n 256",),
)


def bug(error: BaseException) -> Diagnostic:
    """The message about a bug in Movimentum."""
    where = "".join(f" at {frame.f_globals.get('__name__', '?')}:{line}" for frame, line in _last(error.__traceback__))
    return Diagnostic(
        "internal/bug",
        Severity.ERROR,
        f"this is a bug in Movimentum, not in your script: {type(error).__name__}: {error}{where}",
        helps=(_HOW_TO_REPORT,),
    )


def _is_out_of_memory(error: BaseException | None) -> bool:
    """Whether memory was short. A library that cannot be loaded for this reason reports it in its own way."""
    while error is not None:
        if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
            return True
        if isinstance(error, ImportError) and (
            re.search("map segment|allocate memory|object descriptor", str(error)) or is_nearly_full()
        ):
            return True
        error = error.__cause__ or error.__context__
    return False


def _out_of_memory(error: Exception) -> Diagnostic:
    if isinstance(error, OverBudget):
        return Diagnostic(
            "limit/memory",
            Severity.ERROR,
            f"this takes more memory than the limit of {error.megabytes:,} MB",
            helps=(f"`--max-memory {2 * error.megabytes}` allows more",),
        )
    if isinstance(error, ShortOfRoom):
        return Diagnostic(
            "limit/memory",
            Severity.ERROR,
            f"the system lets this process have only {error.megabytes} MiB of addresses; the libraries alone need "
            f"{LEAST_ROOM_MIB}",
            helps=("ulimit -v unlimited",),
        )
    return Diagnostic(
        "limit/memory",
        Severity.ERROR,
        "this needs more memory than is available",
        helps=("make the picture smaller (`--scale 0.5`), or render fewer frames at once (`--frames 0:100`)",),
    )


def _last(trace: TracebackType | None) -> Iterator[tuple[FrameType, int]]:
    import traceback

    yield from list(traceback.walk_tb(trace))[-1:]
