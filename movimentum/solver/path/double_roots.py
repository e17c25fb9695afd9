"""Blocks whose two roots are one all the time, with an equation beside them that says the same better.

A rod over three parallel cranks is placed by two circles that touch, and a third equation, which the plan has left over
as a check, crosses both. A double root loses half of all digits; all rows together, by least squares, lose none.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from movimentum.planning.blocks.build import dense_block
from movimentum.planning.blocks.kinds import Block, Quadratic
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.plan import Plan
from movimentum.planning.structure.decompose import Group
from movimentum.records import replace
from movimentum.solver.block import closed_form
from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.path.follow import instant
from movimentum.tolerances import DISCRIMINANT_ZERO


def with_redundant_rows(plan: Plan, start: Fraction, ahead: float, choices: list[Choice]) -> Plan | None:
    """``plan`` with such blocks solved together with their checks; None where there is none.

    ``choices`` hold at the segment's ``start``; a root that is double there and ``ahead`` of it counts as one that
    always is.
    """
    if not plan.checks:
        return None
    piece = instant(plan, start, 0.0, choices)
    instants = piece.instants(np.array([0.0, ahead]))
    state, _ = piece.evaluate(instants)
    blocks = list(plan.blocks)
    checks = list(plan.checks)
    owner = {n: block.number for block in blocks for n in block.unknowns}
    for block in plan.blocks:
        if not block.moving or not isinstance(block, Quadratic):
            continue
        with np.errstate(all="ignore"):
            margin = closed_form.quadratic(block, state, instants.clocks).margin
        if not (np.abs(margin) <= DISCRIMINANT_ZERO).all():
            continue
        mine = [e for e in checks if max(owner.get(n, -1) for n in plan.system.equations[e].unknowns) == block.number]
        if mine:
            blocks[block.number] = _with_rows(plan, block, mine)
            checks = [e for e in checks if e not in mine]
    if len(checks) == len(plan.checks):
        return None
    kept = [plan.checks.index(e) for e in checks]
    values = tuple(plan.check_values[i] for i in kept)
    return replace(plan, blocks=tuple(blocks), checks=tuple(checks), check_values=values)


def _with_rows(plan: Plan, block: Block, checks: list[int]) -> Block:
    """``block`` solved by Newton's method, with the equations ``checks`` too."""
    group = Group(block.unknowns, tuple(sorted((*block.equations, *checks))))
    made = dense_block(plan.system, group, Clocks(plan.clocks))
    return replace(made, number=block.number, moving=True)
