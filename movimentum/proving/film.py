"""The film's part in a proof: the solved unknowns at an instant, and expressions in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.expressions import ZERO, Expr, substitute
from movimentum.planning.lowering.system import lowered_expressions
from movimentum.planning.lowering.unknowns import PoseX, PoseY
from movimentum.proving.tower import NotAlgebraic
from movimentum.scene.model import AnchorCoordinate, ThingAngle
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval


def state_at(motion: SegmentMotion, tau: float) -> list[float | None]:
    """The unknowns' values at an offset; `NotAlgebraic` where there is no solution."""
    piece = next((p for p in reversed(motion.pieces) if p.begin <= tau), motion.pieces[0])
    if isinstance(piece, UnsolvedInterval):
        raise NotAlgebraic("there is no solution at this time")
    state, bad = piece.solve(piece.instants(np.array([tau])))
    if bad[0]:
        raise NotAlgebraic("there is no solution at this time")
    return [None if value is None else float(np.ravel(value)[0]) for value in state]


def lowered(motion: SegmentMotion, expressions: Sequence[Expr]) -> list[Expr]:
    """Expressions of the scene in the unknowns of a segment's system; things that no constraint mentions are where they
    are drawn.
    """
    system = motion.plan.system

    def leaf(node: Expr) -> Expr | None:
        payload = node.payload
        if node.op != "symbol" or not isinstance(payload, AnchorCoordinate | ThingAngle):
            return None
        if {PoseX(payload.thing), PoseY(payload.thing)} & system.number_of.keys():
            return None
        thing = system.scene.things[payload.thing]
        pose = motion.base.now.things[payload.thing]
        if (pose.x, pose.y, pose.c, pose.s) != (0.0, 0.0, 1.0, 0.0):
            raise NotAlgebraic(f"where `{thing.name}` is was left by an earlier step")
        if isinstance(payload, ThingAngle):
            return ZERO
        return thing.anchors[payload.anchor].coordinates[payload.axis]

    try:
        return lowered_expressions(system, [substitute(each, leaf) for each in expressions])
    except (ValueError, TypeError) as error:
        rate = str(error).startswith(".d(")
        raise NotAlgebraic("it is about a rate" if rate else f"nothing is solved for `{error}` in this step") from error
