"""Wishes in terms of the unknowns that can follow them, and their effect on blocks: order, and what pulls each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf

from movimentum.expressions import Expr, add, call, const, div, neg, sub, substitute, symbol
from movimentum.planning.blocks.base import WishRows
from movimentum.planning.blocks.kinds import Block, Free, Ode
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import slopes_of, with_respect_to
from movimentum.planning.lowering.equations import Form, System, Wish
from movimentum.planning.lowering.unknowns import PoseCos, PosePart, PoseSin, PoseX, PoseY, symbol_numbers
from movimentum.planning.structure.decompose import Group
from movimentum.planning.structure.graph import strong_components
from movimentum.planning.structure.rates import RateError, RateProblem, reader_of
from movimentum.records import replace
from movimentum.scene.model import ThingAngle


def with_directions(system: System, driven: frozenset[int], expr: Expr) -> Expr:
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


def rewritten_wish(wish: Wish, rewrite: Callable[[Expr], Expr]) -> Wish:
    """``wish`` in other unknowns: ``rewrite`` does it for an expression."""
    about = symbol_numbers(*(rewrite(symbol(n)) for n in wish.about))
    return replace(wish, errors=tuple(map(rewrite, wish.errors)), about=frozenset(about))


def dependent_formulas(system: System, groups: Iterable[Group]) -> dict[Expr, Expr]:
    """What hangs from free motion without a say in it (``h = Rod.B.y;``), in terms of the unknowns that have one."""
    memo: dict[Expr, Expr] = {}
    loose: set[int] = set()
    for group in groups:
        if group.free:
            loose |= set(group.unknowns)
        elif len(group.unknowns) == len(group.equations) == 1:
            equation, (unknown,) = system.equations[group.equations[0]], group.unknowns
            linear = equation.solved_for(unknown) if equation.unknowns & loose else None
            if linear is not None:
                slope, rest = linear
                loose.add(unknown)
                if equation.form is Form.PLAIN:
                    memo[symbol(unknown)] = substitute(div(neg(rest), slope), lambda _: None, dict(memo))
    return memo


def independent_form(system: System, driven: frozenset[int], measured: Mapping[Expr, Expr], expr: Expr) -> Expr:
    """``expr`` without what is ``measured`` (see there), and `with_directions`."""
    return with_directions(system, driven, substitute(expr, lambda _: None, dict(measured)))


def ordered_groups(groups: Sequence[Group], system: System) -> list[Group]:
    """``groups`` in an order in which a wish's target is found before what it draws, and a free motion before its
    velocity.

    Parts that are drawn by one wish together, or each toward the other, become one group. Raises `RateError` where a
    free motion depends on its own velocity.
    """
    joined = False
    if system.pushes or system.pulls:
        from movimentum.planning.blocks.pushed_groups import with_pushed_groups  # few scripts need that module

        groups, joined = with_pushed_groups(groups, system)
    of = {n: i for i, group in enumerate(groups) for n in group.unknowns}
    depends = [{of[n] for e in group.equations for n in system.equations[e].unknowns if n in of} for group in groups]
    for i, group in enumerate(groups):
        if group.pushed:
            from movimentum.planning.blocks.pushed_groups import unknowns_read_by

            depends[i] |= {of[n] for n in unknowns_read_by(group, system) if n in of} - {i}
    for i, group in enumerate(groups):  # what moves freely moves least, so it has to know how its things turn
        for n in group.unknowns if group.free else ():
            payload = system.unknowns[n].payload
            if isinstance(payload, PosePart):
                parts = (system.number_of.get(kind(payload.thing)) for kind in (PoseX, PoseY, PoseCos, PoseSin))
                depends[i] |= {of[m] for m in parts if m in of} - {i}
    rates = [bool(group.equations) and system.equations[group.equations[0]].form is Form.VELOCITY for group in groups]
    moved = joined or any(rates)
    for wish in system.wishes:
        drawn = sorted({of[n] for n in wish.about if n in of and groups[of[n]].free})
        targets = {of[n] for n in symbol_numbers(*wish.errors) if n in of}.difference(drawn)
        for place, i in enumerate(drawn):
            depends[i] |= {drawn[place - 1]} | targets
            moved |= len(drawn) > 1 or any(target > i for target in targets)
    if not moved:
        return list(groups)
    result: list[Group] = []
    for component in strong_components([sorted(others) for others in depends]):
        if len(component) > 1 and any(rates[i] for i in component):
            fed = {n for i in component if rates[i] for n in groups[i].unknowns}
            thing = system.unknowns[system.differentiated(min(fed))[0]].thing
            raise RateError(RateProblem.FED_BACK, reader_of(system, fed), thing)
        together = [groups[i] for i in component if groups[i].free]
        if together:
            members = tuple(sorted(n for group in together for n in group.unknowns))
            equations = tuple(sorted(e for group in together for e in group.equations))
            result.append(Group(members, equations, free=True, pushed=any(group.pushed for group in together)))
        result.extend(groups[i] for i in sorted(component) if not groups[i].free)
    return result


def with_wishes(block: Block, wishes: Sequence[Wish], known: set[int], clocks: Clocks) -> Block:
    """A ``block`` whose free rows are `drawn`; any other block as it is."""
    rows = block.free_rows
    if rows is None:
        return block
    by = drawn(rows, wishes, known, clocks)
    if isinstance(block, Ode):
        return replace(block, algebraic=by, inputs=block.inputs | (by.inputs - set(block.unknowns)))
    return by


def drawn(block: Free, wishes: Sequence[Wish], known: set[int], clocks: Clocks) -> Free:
    """A free block with the errors of the wishes that are about it, and otherwise only about what is ``known`` before
    it.
    """
    core, members = set(block.core), set(block.unknowns)
    memo: dict[Expr, Expr] = {} if block.linear is None else {symbol(n): e for n, e in block.linear.explicit}
    errors: list[Expr] = []
    speeds: list[tuple[int, int, float]] = []
    numbers: list[int] = []
    for number, wish in enumerate(wishes):
        if wish.about.isdisjoint(members):
            continue
        inner = [substitute(error, lambda _: None, memo) for error in wish.errors]
        reads = symbol_numbers(*inner)
        if reads & core and reads <= core | known:
            numbers.append(number)
            speeds.append((len(errors), len(errors) + len(inner), wish.speed or inf))
            errors.extend(inner)
    if not errors:
        return block
    entries, slopes = slopes_of(errors, block.core)
    rows = WishRows(
        compiled(errors, clocks),
        len(errors),
        compiled(slopes, clocks),
        (*errors, *slopes),
        tuple(entries),
        tuple(speeds),
        tuple(numbers),
    )
    return replace(
        block,
        wishes=rows,
        identity=0,
        inputs=block.inputs | (symbol_numbers(*errors) - core),
        moving=True,  # it goes toward the wish even if nothing else moves
    )
