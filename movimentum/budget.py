"""The memory limit of a command, and messages about the time that it takes.

A timer measures about thirty times a second how much memory the process uses. Measuring costs nothing and is exact; an
estimate of a script's needs is neither. The timer runs between two Python operations, so a single operation may briefly
exceed the limit. The memory of worker processes counts too, and is measured less often.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Generator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Protocol

from movimentum.signals import raise_pending

DEFAULT_MEGABYTES = 1000
PERIOD_S = 0.03
_STATM = "/proc/self/statm"
LEAST_ROOM_MIB = 192
"""Python, NumPy and Pillow with their libraries take up to 170 MiB of addresses. With fewer, a library that cannot be
loaded, or finds no room for its tables, ends the process in its own way.
"""
NEARLY_FULL = 8 * 2**20
"""Bytes of addresses: where fewer are left, what could not be imported did not find room."""
WORKERS_EVERY = 8
"""Workers are measured once in this many measurements: the system collects their figures page by page."""


KEPT_BLOCK = 32 * 2**20
"""Freed blocks up to this size are used again: the largest that glibc allows (Pillow takes 16 MB at a time)."""
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # glibc's numbers, from malloc.h


class OverBudget(MemoryError):
    """The process holds more memory than ``--max-memory`` allows."""

    def __init__(self, megabytes: int) -> None:
        self.megabytes = megabytes
        super().__init__(f"more than {megabytes:,} MB")


class ShortOfRoom(MemoryError):
    """The system lets the process have too few addresses to load the libraries (``ulimit -v``)."""

    def __init__(self, megabytes: int) -> None:
        self.megabytes = megabytes
        super().__init__(f"only {megabytes:,} MiB")


class Budget(Protocol):
    """Sets the limit (which may change) and reports now and then."""

    megabytes: int

    def tick(self) -> None:
        """Called about thirty times a second."""
        ...


@contextmanager
def watched(budget: Budget) -> Generator[None, None, None]:
    """Raise `OverBudget` inside when this process holds more than ``budget.megabytes``, and call ``budget.tick``.

    A signal's exception that Python has dropped is raised again.

    Only on systems with interval timers, and in the main thread; elsewhere nothing is measured. If the system does not
    report the memory of a process, only ``tick`` is called.
    """
    owner = os.getpid()
    looks = elsewhere = 0

    def look(number: int, frame: FrameType | None) -> None:
        nonlocal looks, elsewhere
        if os.getpid() != owner:
            return
        raise_pending()
        looks += 1
        if looks % WORKERS_EVERY == 0:
            elsewhere = memory_of_workers()
        if memory_used() + elsewhere > budget.megabytes * 1_000_000:
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


def require_room() -> None:
    """Raise `ShortOfRoom` if this process may have fewer than `LEAST_ROOM_MIB` of addresses."""
    room = _room()
    if room is not None and room < LEAST_ROOM_MIB * 2**20:
        raise ShortOfRoom(room // 2**20)


def is_nearly_full() -> bool:
    """Whether this process has nearly as many addresses as the system lets it have."""
    room = _room()
    if room is None:
        return False
    with suppress(OSError, ValueError, IndexError), open(_STATM, "rb") as stream:
        return room - int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE") < NEARLY_FULL
    return False


def _room() -> int | None:
    """The addresses that the system lets this process have; ``None`` without a limit."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    room, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if room == resource.RLIM_INFINITY else room


def memory_used() -> int:
    """The bytes of memory that this process holds; 0 if the system does not report it."""
    try:
        with open(_STATM, "rb") as stream:
            return int(stream.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return 0


def memory_of_workers() -> int:
    """The bytes that the processes which this one has started hold for themselves (what they share with it since they
    were forked is already counted here); 0 if the system does not report it.
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


def keep_freed_memory() -> None:
    """Let this process keep freed memory and use it again: for work that takes and frees megabytes all the time.

    Otherwise glibc gives large blocks back to the system and takes new pages for the next ones: 10 page faults for each
    variant of a sweep. Dask starts its workers with ``MALLOC_TRIM_THRESHOLD_=65536``, and there it is 45 for a variant
    and 7,700 for a picture of 960 × 880 pixels, which then takes 1.6 times as long. Without glibc nothing is changed.
    """
    import ctypes  # 2 ms that a short command does not need

    try:
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, KEPT_BLOCK)
        library.mallopt(_M_TRIM_THRESHOLD, 2 * KEPT_BLOCK)
    except (OSError, AttributeError, TypeError):  # another library, or (Windows) none that is called so
        return
