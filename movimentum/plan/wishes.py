"""Wishes of a free block: what its free motion is drawn toward."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from movimentum.expressions import Expr, substitute, symbol
from movimentum.plan.blocks import Block
from movimentum.plan.calculus import with_respect_to
from movimentum.plan.codegen import Clocks, compiled
from movimentum.plan.equations import Wish
from movimentum.plan.unknowns import symbol_numbers


def with_wishes(block: Block, wishes: Iterable[Wish], known: set[int], clocks: Clocks) -> Block:
    """``block`` with the errors of the wishes that speak of its core and of what is ``known`` before it."""
    core = set(block.core)
    memo: dict[Expr, Expr] = {} if block.linear is None else {symbol(n): e for n, e in block.linear.explicit}
    errors: list[Expr] = []
    speeds: list[tuple[int, int, float]] = []
    for wish in wishes:
        inner = [substitute(error, lambda _: None, memo) for error in wish.errors]
        reads = symbol_numbers(*inner)
        if reads & core and reads <= core | known:
            if wish.speed is not None:
                speeds.append((len(errors), len(errors) + len(inner), wish.speed))
            errors.extend(inner)
    if not errors:
        return block
    entries: list[tuple[int, int]] = []
    slopes: list[Expr] = []
    for i, error in enumerate(errors):
        present = symbol_numbers(error)
        for j, n in enumerate(block.core):
            if n in present:
                entries.append((i, j))
                slopes.append(with_respect_to(error, n))
    return replace(
        block,
        wishes=compiled(errors, clocks),
        wish_count=len(errors),
        wish_slopes=compiled(slopes, clocks),
        wish_entries=tuple(entries),
        wish_speeds=tuple(speeds),
        inputs=block.inputs | (symbol_numbers(*errors) - core),
        moving=True,  # it goes toward the wish even if nothing else moves
    )
