"""Cancels work that nobody waits for any more, at its next check, a few milliseconds later.

Whoever starts such work provides the test; the solver calls it at every linearization and the planner at every block.
The test is stored in the calling thread's context, as it would otherwise be an argument of every function in between.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar


class Cancelled(BaseException):
    """Nobody waits for this work any more. Like `KeyboardInterrupt`, no error: what handles errors lets it through."""


_asked: ContextVar[Callable[[], bool] | None] = ContextVar("_asked", default=None)


@contextmanager
def cancellable(unwanted: Callable[[], bool]) -> Generator[None, None, None]:
    """Raise `Cancelled` inside, at the next `look`, once ``unwanted`` is true, or what was asked around this."""
    around = _asked.get()
    token = _asked.set(unwanted if around is None else lambda: unwanted() or around())
    try:
        look()
        yield
    finally:
        _asked.reset(token)


def look() -> None:
    """Raise `Cancelled` if the work that this thread does is unwanted."""
    unwanted = _asked.get()
    if unwanted is not None and unwanted():
        raise Cancelled
