"""Counts work, so that trials can be given up; allows more for integrals at times.

It counts linearizations: every Newton step, every step toward a starting pose, and every step of a free motion. The
limit is stored in the calling thread's context, as it would otherwise be an argument of every function between a trial
and its steps.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

from movimentum.cancellation import look


class EffortExceeded(Exception):
    """What was tried out takes more work than it may."""


_remaining: ContextVar[list[int] | None] = ContextVar("_left", default=None)
_spent: ContextVar[list[int] | None] = ContextVar("_spent", default=None)


@contextmanager
def limit_effort(count: int) -> Generator[list[int], None, None]:
    """Raise `EffortExceeded` inside once ``count`` linearizations are done; yields a list with how many are left.

    They count for a limit around this one too.
    """
    around, left = _remaining.get(), [count]
    token = _remaining.set(left)
    try:
        yield left
    finally:
        _remaining.reset(token)
        if around is not None:
            around[0] -= count - left[0]


@contextmanager
def count_effort() -> Generator[list[int], None, None]:
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
    return _remaining.get() is not None


def charge_effort(count: int = 1) -> None:
    """Count linearizations; raises `EffortExceeded` where there are too many, `Cancelled` where nobody waits any
    more.
    """
    look()
    spent, left = _spent.get(), _remaining.get()
    if spent is not None:
        spent[0] += count
    if left is not None:
        left[0] -= count
        if left[0] < 0:
            raise EffortExceeded


_factor: ContextVar[float] = ContextVar("_factor", default=1.0)


@contextmanager
def tighten_steps(factor: float) -> Generator[None]:
    """Free motion and differential equations that are solved inside have steps whose error is ``factor`` as large."""
    token = _factor.set(factor)
    try:
        yield
    finally:
        _factor.reset(token)


def step_tightening() -> float:
    """The factor that `tighten_steps` gave, 1 outside."""
    return _factor.get()
