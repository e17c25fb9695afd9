"""Deadlines for calls into libraries whose running time cannot be predicted."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from movimentum.signals import dropped_silently

T = TypeVar("T")

STACK = 64 * 1024 * 1024
"""Bytes: a deep expression needs as much stack in a thread as it has in the main one."""


AGAIN_S, TIMES = 0.05, 40
"""Seconds after which the exception that ends the work is raised again if it has come to nothing (Python drops it in a
finalizer or in a callback of the garbage collector), and how often.
"""


class _GivenUp(SystemExit):
    """Raised inside the work when its time is up. (A thread that a `SystemExit` ends says nothing.)"""


def within(seconds: float, work: Callable[[], T], clock: Callable[[], float] = time.monotonic) -> T | None:
    """What ``work`` returns, or None if it takes longer than ``seconds`` by a clock (of the wall; `time.process_time`
    is that of this process, which a busy machine does not change); raises what it raises.

    The work runs in a separate thread and is ended between two of its Python instructions, on every system. It must not
    leave anything important half done.
    """
    results: list[T] = []
    errors: list[BaseException] = []

    ending = threading.Lock()
    begun = ended = False

    def run() -> None:
        nonlocal begun, ended
        for _ in range(TIMES + 1):  # one exception may follow the other
            try:
                if not begun:
                    begun = True
                    try:
                        results.append(work())
                    except _GivenUp:
                        raise
                    except BaseException as error:  # handed on to the caller, whatever it is
                        errors.append(error)
                with ending:
                    ended = True
                return
            except _GivenUp:  # raised only before `end_of_upstream`
                continue

    before = threading.stack_size(STACK)
    try:
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
    finally:
        threading.stack_size(before)
    end = clock() + seconds
    try:
        while thread.is_alive() and (left := end - clock()) > 0.0:
            thread.join(left)
    finally:  # also where the user interrupts
        with dropped_silently(_GivenUp):
            for _ in range(TIMES):
                with ending:
                    if ended or thread.ident is None or not thread.is_alive():
                        break
                    number, given_up = ctypes.c_ulong(thread.ident), ctypes.py_object(_GivenUp)
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(number, given_up)
                thread.join(AGAIN_S)
    if errors:
        raise errors[0]
    return results[0] if results else None
