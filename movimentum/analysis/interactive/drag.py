"""Pulling at something in a scene at one moment, while all statements stay true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from movimentum.analysis.freedom.frozen import HeldBlock, drawn_by
from movimentum.expressions import Expr, const, sub
from movimentum.planning.blocks.kinds import Free, simultaneous
from movimentum.planning.blocks.wishes import in_what_moves
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.equations import Wish
from movimentum.planning.lowering.system import lowered_expressions
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.solver.assembly import snapshot
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import Stretch

MOST_STEPS = 400
MET = 1e-9
"""Of the scene's size: at a smaller distance, it has arrived."""
STILL = 1e-3
ASIDE = 1e-3


class DragResult(StrEnum):
    """The outcome: nothing is free to move, arrived, held back, or in a pose where no velocity leads nearer."""

    FIXED = "fixed"
    REACHED = "reached"
    BLOCKED = "blocked"
    SINGULAR = "singular"


@dataclass(frozen=True, slots=True)
class Drag:
    """``moments`` from the first pose to the last one; ``off`` is the remaining distance."""

    outcome: DragResult
    off: float
    moments: list[Snapshot]


def drag(stretch: Stretch, piece: Piece, tau: float, left: Sequence[Expr], target: Sequence[float]) -> Drag:
    """Pull the expressions ``left`` of the scene toward ``target`` at offset ``tau``, while time stands still.

    Velocities are least, and all constraints are restored after every step, as for wishes (`solver.free.velocity`).
    """
    plan = stretch.plan
    lowered = lowered_expressions(plan.system, left)
    errors = [
        in_what_moves(plan.system, frozenset(), plan.measured, sub(expr, const(value)))
        for expr, value in zip(lowered, target, strict=True)
    ]
    functions = [compiled([error], Clocks(plan.clocks)) for error in errors]
    reads = symbol_numbers(*errors)
    block = next((b for b in plan.blocks if b.free and reads & set(b.unknowns)), None)
    block = None if block is None else simultaneous(block)
    if not isinstance(block, Free):
        instants = piece.instants(np.array([tau]))
        state, _ = piece.evaluate(instants)
        values = [float(np.ravel(function(state, instants.clocks)[0])[0]) for function in functions]
        return Drag(DragResult.FIXED, float(np.sqrt(np.sum(np.square(values)))), [])
    wish = Wish(tuple(errors), -1, frozenset(reads))
    held = HeldBlock(piece, drawn_by(plan, block, wish), tau, functions, range(len(plan.system.unknowns)))
    x = held.x
    moments = [snapshot(plan, held.placed(x)[0], stretch.base.now, 0)]
    off = held.off(x)
    for y in held.pulled(held.x, MOST_STEPS):
        x = y
        moments.append(snapshot(plan, held.placed(x)[0], stretch.base.now, 0))
        before, off = off, held.off(x)
        if off <= MET * plan.size or before - off <= 1e-9 * plan.size:
            break
    if off <= 1e-6 * plan.size:
        return Drag(DragResult.REACHED, off, moments)
    stuck = held.approach(x) <= STILL * min(off, plan.size) and held.stuck(np.array(x), ASIDE * plan.size)
    return Drag(DragResult.SINGULAR if stuck else DragResult.BLOCKED, off, moments)
