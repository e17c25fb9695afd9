"""Signals: before a signal ends the process, half-written files are removed."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext, suppress
from types import FrameType
from typing import Any, NoReturn

_NAMES = ("SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")  # the last is Ctrl-Break, on Windows
_ASK_TO_END = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))


class Terminated(BaseException):
    """A signal asked the process to end (a closed terminal, ``kill``): clean up as after Ctrl-C. ``code`` is the exit
    code.
    """

    def __init__(self, number: int) -> None:
        self.code = 128 + number
        super().__init__(number)


class Interruption:
    """Whether Ctrl-C was pressed: an import that it interrupts may end with a different exception."""

    pressed = False


AGAIN_S = 0.5
"""Seconds after which the exception of a signal is raised again if it has come to nothing."""


class _Pending:
    """The last signal's exception, until somebody has caught it.

    Python drops an exception that is raised in a finalizer or around a fork, and so do some imports of compiled
    modules.
    """

    exception: KeyboardInterrupt | Terminated | None = None
    since = 0.0


def signal_handled() -> None:
    """The exception of a signal has been caught: it is not raised again."""
    _Pending.exception = None


def raise_pending() -> None:
    """Raise the exception of a signal again which nobody has caught for `AGAIN_S`. Called by a timer."""
    if _Pending.exception is not None and time.monotonic() > _Pending.since + AGAIN_S:
        _raise(_Pending.exception)


def _raise(exception: KeyboardInterrupt | Terminated) -> NoReturn:
    _Pending.exception, _Pending.since = exception, time.monotonic()
    raise exception.with_traceback(None)


@contextmanager
def dropped_silently(*kinds: type[BaseException]) -> Generator[None, None, None]:
    """Python says nothing about exceptions of these ``kinds`` that it drops; they are raised again."""
    before = sys.unraisablehook

    def hook(report: Any) -> None:
        if not issubclass(report.exc_type, kinds):
            before(report)

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextmanager
def handled_signals() -> Generator[Interruption, None, None]:
    """Signals become exceptions, which unwind the stack: `KeyboardInterrupt` and `Terminated`.

    Handlers that other code has set stay, an ignored signal (``nohup``) stays ignored, and the previous handlers are
    restored at the end. Outside the main thread, nothing is changed.
    """
    owner = os.getpid()
    found = Interruption()

    def interrupt(number: int, frame: FrameType | None) -> None:
        found.pressed = True
        _raise(KeyboardInterrupt())

    def terminate(number: int, frame: FrameType | None) -> None:
        if os.getpid() != owner:  # a worker that inherited this handler owns no files: it just goes
            os._exit(128 + number)
        _raise(Terminated(number))

    before: dict[int, object] = {}
    with suppress(ValueError):  # not the main thread: somebody else's process, somebody else's signals
        if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, at_once):
            before[signal.SIGINT] = signal.getsignal(signal.SIGINT)
            signal.signal(signal.SIGINT, interrupt)
        for number in _ASK_TO_END:
            if signal.getsignal(number) is signal.SIG_DFL:
                before[number] = signal.SIG_DFL
                signal.signal(number, terminate)
    try:
        with dropped_silently(KeyboardInterrupt, Terminated) if before else nullcontext():
            yield found
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)  # pyright: ignore[reportArgumentType]
        if before:
            signal_handled()


@contextmanager
def ignored_signals() -> Generator[None, None, None]:
    """Nothing interrupts the work inside: the removal of a few files."""
    before: dict[int, object] = {}
    with suppress(ValueError):
        for number in (signal.SIGINT, *_ASK_TO_END):
            before[number] = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)  # pyright: ignore[reportArgumentType]


@contextmanager
def interrupts_held_back() -> Generator[None, None, None]:
    """Ctrl-C has its effect at the end of this. Processes that begin meanwhile inherit that it is blocked, and never
    hear it, however early it comes.
    """
    mask = getattr(signal, "pthread_sigmask", None)
    if mask is None:  # Windows
        yield
        return
    before = mask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        mask(signal.SIG_SETMASK, before)


def at_once(number: int, frame: FrameType | None) -> None:
    """Handler for Ctrl-C before there is anything to clean up: end silently, wherever an import is."""
    os._exit(128 + number)


def end_at_once(*before: Callable[[int, Any], None]) -> None:
    """Use `at_once` from here on instead of Python's handler or one of ``before``, unless Ctrl-C is ignored or somebody
    else's.
    """
    with suppress(ValueError):
        if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, *before):
            signal.signal(signal.SIGINT, at_once)


def ignore_interrupts() -> None:
    """Ctrl-C from here on does nothing: the work is done and the process is about to end."""
    with suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
