"""How much work is done: counted, so that what is only tried out can be given up, and more for integrals at times.

The count is of linearizations: of every Newton step, every step toward a pose to begin with, and every step of a
free motion. The limit is that of the calling thread's context, for it would otherwise be an argument of every function
between a trial and the step that it costs.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

from movimentum.cancellation import look


class GivenUp(Exception):
    """What was tried out takes more work than it may."""


_left: ContextVar[list[int] | None] = ContextVar("_left", default=None)
_spent: ContextVar[list[int] | None] = ContextVar("_spent", default=None)


@contextmanager
def limited(count: int) -> Generator[list[int], None, None]:
    """Raise `GivenUp` inside once ``count`` linearizations are done; yields a list with how many are left.

    They count for a limit around this one too.
    """
    around, left = _left.get(), [count]
    token = _left.set(left)
    try:
        yield left
    finally:
        _left.reset(token)
        if around is not None:
            around[0] -= count - left[0]


@contextmanager
def counted() -> Generator[list[int], None, None]:
    """Yields a list with how many linearizations were done inside so far, whatever limits there are."""
    around, spent = _spent.get(), [0]
    token = _spent.set(spent)
    try:
        yield spent
    finally:
        _spent.reset(token)
        if around is not None:
            around[0] += spent[0]


def is_limited() -> bool:
    """Whether linearizations are counted against a limit."""
    return _left.get() is not None


def charge(count: int = 1) -> None:
    """Count linearizations; raises `GivenUp` where there are too many, `Cancelled` where nobody waits any more."""
    look()
    spent, left = _spent.get(), _left.get()
    if spent is not None:
        spent[0] += count
    if left is not None:
        left[0] -= count
        if left[0] < 0:
            raise GivenUp


_factor: ContextVar[float] = ContextVar("_factor", default=1.0)


@contextmanager
def tightened(factor: float) -> Generator[None]:
    """Free motion and differential equations that are solved inside have steps whose error is ``factor`` as large."""
    token = _factor.set(factor)
    try:
        yield
    finally:
        _factor.reset(token)


def tightening() -> float:
    """The factor that `tightened` gave, 1 outside."""
    return _factor.get()
