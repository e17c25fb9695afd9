"""Wishes of a free block: what its free motion is drawn toward."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from movimentum.expressions import Expr, add, call, const, sub, substitute, symbol
from movimentum.plan.blocks import Block
from movimentum.plan.calculus import with_respect_to
from movimentum.plan.codegen import Clocks, compiled
from movimentum.plan.equations import System, Wish
from movimentum.plan.unknowns import PoseCos, PoseSin, symbol_numbers
from movimentum.scene.model import ThingAngle


def by_directions(system: System, driven: frozenset[int], expr: Expr) -> Expr:
    """``expr``, in which angles of things that are not ``driven`` are taken from their directions, which move first.

    A direction knows no full turns: an angle that stands alone in ``expr`` is meant modulo 360 then.
    """
    alone = True
    memo: dict[Expr, Expr] = {}
    for n in symbol_numbers(expr):
        payload = system.unknowns[n].payload
        if not isinstance(payload, ThingAngle) or payload.thing in driven:
            continue
        c, s = (system.number_of.get(kind(payload.thing)) for kind in (PoseCos, PoseSin))
        if c is not None and s is not None:
            cosine, sine = system.frame(payload.thing).turn_of(symbol(c), symbol(s))
            memo[symbol(n)] = call("atan2d", sine, cosine)
            alone &= with_respect_to(expr, n).value in (1.0, -1.0)
    if not memo:
        return expr
    turned = substitute(expr, lambda _: None, memo)
    half = const(180.0)
    return sub(call("mod", add(turned, half), const(360.0)), half) if alone else turned


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
