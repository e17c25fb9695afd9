"""What blocks came to before, for a timeline that is mostly the same.

A block's path depends on the block, on what it begins with, and on the paths of the blocks before it. Where all of that
is as it was, so is the path, to the last bit. The memory is that of the calling thread's context, for it would
otherwise be an argument of every function between a timeline and its blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar, cast

from movimentum.kept import Kept
from movimentum.solver.basis.effort import is_limited

T = TypeVar("T")


class Memory(Kept[object]):
    """What was found, by everything that it depends on."""


_memory: ContextVar[Memory | None] = ContextVar("_memory", default=None)


@contextmanager
def remembering(memory: Memory) -> Generator[None, None, None]:
    """Inside, `remembered` looks into ``memory``."""
    token = _memory.set(memory)
    try:
        yield
    finally:
        _memory.reset(token)


def remembered(key: Callable[[], Hashable], find: Callable[[], T]) -> T:
    """What ``find`` gives, found only once for each ``key``; a key of None is never looked up.

    What is tried out with limited effort is always done: whether it is given up must not depend on what was found
    before.
    """
    memory = _memory.get()
    if memory is None or is_limited():
        return find()
    place = key()
    if place is None:
        return find()
    known = memory.get(place)
    if known is None:
        known = find()
        memory.keep(place, known)
    return cast("T", known)
