"""Work that is given up if it takes too long: for libraries whose time cannot be predicted."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

STACK = 64 * 1024 * 1024
"""Bytes: a deep expression needs as much stack in a thread as it has in the main one."""


class _GivenUp(BaseException):
    """Raised inside the work when its time is up."""


def within(seconds: float, work: Callable[[], T]) -> T | None:
    """What ``work`` returns, or None if it takes longer than ``seconds`` of wall clock; raises what it raises.

    The work runs in a separate thread and is ended between two of its Python instructions, on every system. It must not
    leave anything important half done.
    """
    results: list[T] = []
    errors: list[BaseException] = []

    ending = threading.Lock()
    ended = False

    def run() -> None:
        nonlocal ended
        try:
            try:
                results.append(work())
            except _GivenUp:
                raise
            except BaseException as error:  # handed on to the caller, whatever it is
                errors.append(error)
            with ending:
                ended = True
        except _GivenUp:  # raised only before `ended`, so never outside of this block
            pass

    before = threading.stack_size(STACK)
    try:
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
    finally:
        threading.stack_size(before)
    try:
        thread.join(seconds)
    finally:  # also where the user interrupts
        with ending:
            if not ended and thread.ident is not None:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident), ctypes.py_object(_GivenUp))
    if errors:
        raise errors[0]
    return results[0] if results else None
