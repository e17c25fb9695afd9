"""Remembers the results of blocks, for a timeline that is mostly the same.

A block's path depends on the block, its starting state, and the paths of the blocks before it. If all of these are
unchanged, so is the path, to the last bit. The memory is stored in the calling thread's context, as it would otherwise
be an argument of every function between a timeline and its blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from fractions import Fraction
from typing import TypeVar, cast

from movimentum.expressions import Expr
from movimentum.memo import Memo
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.solver.basis.effort import charge_effort, count_effort

T = TypeVar("T")


_memo: ContextVar[Memo | None] = ContextVar("_memory", default=None)


@contextmanager
def use_memo(memory: Memo) -> Generator[None, None, None]:
    """Inside, `memoized` looks into ``memory``."""
    token = _memo.set(memory)
    try:
        yield
    finally:
        _memo.reset(token)


def memoized(key: Callable[[], Hashable], find: Callable[[], T]) -> T:
    """What ``find`` gives, found only once for each ``key``; a key of None is never looked up.

    What is tried out with limited effort counts what it took when it was found: whether it is given up must not depend
    on what was found before.
    """
    memory = _memo.get()
    place = None if memory is None else key()
    if memory is None or place is None:
        return find()
    known = memory.get("found", place)  # with how many linearizations that took
    if known is not None:
        charge_effort(known[1])
        return cast("T", known[0])
    with count_effort() as spent:
        found = find()
    memory.keep("found", place, (found, spent[0]))
    return found


def code_of(outputs: Sequence[Expr], clocks: Sequence[Fraction]) -> Compiled:
    """`compiled`, with the ``clocks`` of a plan, for what is asked at one instant: much of it was asked before."""
    some, starts = tuple(outputs), tuple(clocks)
    return memoized(lambda: ("code", some, starts), lambda: compiled(some, Clocks(starts)))
