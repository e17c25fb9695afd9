"""How much memory a command may take, and a word about the time that it takes.

A timer looks some thirty times a second at what the process holds: measuring is exact where guessing what a script
will need is not, and costs nothing. It works between two operations of Python; a single one may take more than the
limit for its moment. What worker processes hold for themselves counts, and is looked at now and then.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol

DEFAULT_MEGABYTES = 1000
PERIOD_S = 0.03
_STATM = "/proc/self/statm"
WORKERS_EVERY = 8
"""Looks between two at what worker processes hold: the system collects that page by page."""


class OverBudget(MemoryError):
    """The process holds more memory than ``--max-memory`` allows."""

    def __init__(self, megabytes: int) -> None:
        self.megabytes = megabytes
        super().__init__(f"more than {megabytes:,} MB")


class Budget(Protocol):
    """Who sets the limit (it may change) and says a word now and then."""

    megabytes: int

    def tick(self) -> None:
        """Called some thirty times a second."""
        ...


@contextmanager
def watched(budget: Budget) -> Generator[None, None, None]:
    """Raise `OverBudget` inside when this process holds more than ``budget.megabytes``, and call ``budget.tick``.

    Only on systems with interval timers, and in the main thread; elsewhere nothing is watched. Where the system does
    not tell what a process holds, only ``tick`` is called.
    """
    owner = os.getpid()
    looks = elsewhere = 0

    def look(number: int, frame: FrameType | None) -> None:
        nonlocal looks, elsewhere
        if os.getpid() != owner:
            return
        looks += 1
        if looks % WORKERS_EVERY == 0:
            elsewhere = held_by_workers()
        if held() + elsewhere > budget.megabytes * 1_000_000:
            signal.setitimer(signal.ITIMER_REAL, 2.0, PERIOD_S)  # time to clean up
            raise OverBudget(budget.megabytes)
        budget.tick()

    try:
        if signal.getsignal(signal.SIGALRM) is not signal.SIG_DFL:
            raise ValueError("somebody else's timer")
        signal.signal(signal.SIGALRM, look)
    except (AttributeError, ValueError):  # no such signal, not the main thread, or somebody else's
        yield
        return
    signal.setitimer(signal.ITIMER_REAL, PERIOD_S, PERIOD_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)


def held() -> int:
    """The bytes of memory that this process holds; 0 where that is not told."""
    try:
        with open(_STATM, "rb") as stream:
            return int(stream.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return 0


def held_by_workers() -> int:
    """The bytes that the processes which this one has started hold for themselves (what they share with it since they
    were forked is counted here already); 0 where that is not told.
    """
    total = 0
    for process in _children():
        try:
            with open(f"/proc/{process}/smaps_rollup", "rb") as stream:
                fields = (line.split() for line in stream)
                total += sum(int(some[1]) * 1024 for some in fields if some[0].startswith(b"Private_"))
        except (OSError, ValueError, IndexError):  # it has ended meanwhile
            continue
    return total


def _children() -> list[int]:
    try:
        with open(f"/proc/self/task/{os.getpid()}/children", "rb") as stream:
            return [int(process) for process in stream.read().split()]
    except (OSError, ValueError):
        return []
