"""What is integrated can be integrated more accurately than usual, to measure the error that is usual."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

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
