"""Where a motion leaves a table that it follows."""

from __future__ import annotations

import numpy as np

from movimentum.analysis.diagnose.places import span_of_blocks
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import walk
from movimentum.expressions.tables import Table
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.solver.block.closed_form import State
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.text import number
from movimentum.tolerances import BEYOND_TABLE


def table_left(segment_motion: SegmentMotion, block: Block, tau: float) -> Diagnostic | None:
    """What a table is asked beyond its ends at or just after an offset from the segment's start; None if it is not."""
    plan = segment_motion.plan
    equations = [plan.system.equations[e] for e in block.equations]
    nodes = walk(*(each.residual for each in equations), *(each.original for each in equations if each.original))
    asked = [(node.payload, node.args[0]) for node in nodes if isinstance(node.payload, Table)]
    if not asked:
        return None
    start, length = segment_motion.segment.start, float(segment_motion.segment.end - segment_motion.segment.start)
    pieces = [each for each in segment_motion.pieces if isinstance(each, Piece) and each.begin <= tau]
    piece = pieces[-1] if pieces else Piece(plan, start, tau, tau)
    moments = np.minimum(tau + length * np.array(BEYOND_TABLE), length)
    instants = piece.instants(moments)
    state: State = piece.before(block.number, instants) if pieces else [None] * len(plan.system.unknowns)
    with np.errstate(all="ignore"):
        try:
            arguments = compiled([argument for _, argument in asked], Clocks(plan.clocks))(state, instants.clocks)
        except (NotImplementedError, TypeError, IndexError):  # of what is not known there
            return None
    for (table, _), values in zip(asked, arguments, strict=True):
        out = [value for value in np.broadcast_to(values, moments.shape).tolist() if table.outside(value)]
        if not out:
            continue
        when = number(float(start) + tau, 7)
        first, last = table.span
        if not table.spelled[0]:
            return Diagnostic(
                "contact/end",
                Severity.ERROR,
                f"from t = {when} on this asks for a place beyond an end of an open curve",
                span=span_of_blocks(segment_motion, (block.number,)),
                notes=("its places go from 0, where it begins, to 1, where it ends",),
                helps=(f"keep the place between 0 and 1, make the curve longer, or end the step before t = {when}",),
            )
        end, beyond = ("begins", first) if out[0] < first else ("ends", last)
        file, column, rest = table.spelled
        return Diagnostic(
            "table/outside",
            Severity.ERROR,
            f"`{column}` of {file} {end} at {number(beyond)}, and from t = {when} on it is asked beyond that",
            notes=(f"the table goes from {number(first)} to {number(last)}",),
            helps=(
                f"`.table(…){rest}.held` keeps its first and last values, `.periodic` repeats it",
                "or add rows to the file",
            ),
        )
    return None
