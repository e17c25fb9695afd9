"""Reports where a motion leaves a table that it follows, and how accurate differential equations are or where they
failed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.analysis.diagnose.locations import span_of_blocks
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import walk
from movimentum.expressions.tables import Table
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.scene.model import VariableComponent
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.tracks import OdeFailure, OdeTrack
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import Failure, SegmentMotion
from movimentum.text import listed, number, time_text
from movimentum.tolerances import BEYOND_TABLE, UNCERTAIN_STATE


def table_exceeded(segment_motion: SegmentMotion, block: Block, tau: float) -> Diagnostic | None:
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
            f"`{column}` of {file} {end} at {number(beyond)}, and from t = {when} on a value beyond that is needed",
            notes=(f"the table goes from {number(first)} to {number(last)}",),
            helps=(
                f"`.table(…){rest}.held` keeps its first and last values, `.periodic` repeats it",
                "or add rows to the file",
            ),
        )
    return None


def uncertain_solution(segment_motion: SegmentMotion, block: Block, track: OdeTrack) -> Iterator[Diagnostic]:
    """The error of a differential equation's solution, where it is more than `UNCERTAIN_STATE`."""
    if not np.any(track.errors > UNCERTAIN_STATE):
        return
    begin = float(segment_motion.segment.start)
    first = begin + float(track.times[int(np.argmax(track.errors > UNCERTAIN_STATE))])
    worst = int(np.argmax(track.errors))
    error, when = float(track.errors[worst]), time_text(begin + float(track.times[worst]))
    yield Diagnostic(
        code="solve/inaccurate",
        severity=Severity.WARNING,
        message=f"{_names(segment_motion, block)}: the error of the differential equation grows to {number(error, 1)} "
        "of the largest value",
        span=span_of_blocks(segment_motion, (block.number,)),
        notes=(f"it is more than 1e-9 from t = {time_text(first)} on, and largest at t = {when}",),
        helps=("make the film shorter: a chaotic motion magnifies the smallest difference",),
    )


def failed_integration(segment_motion: SegmentMotion, failure: Failure) -> Diagnostic | None:
    """A differential equation whose integration was given up."""
    if failure.block is None:
        return None
    block = segment_motion.plan.blocks[failure.block]
    tracks = [piece.tracks[failure.block] for piece in segment_motion.pieces if isinstance(piece, Piece)]
    why = {track.failure for track in tracks if isinstance(track, OdeTrack)}
    when = time_text(float(segment_motion.segment.start) + failure.begin)
    code = "solve/not-converged"
    if OdeFailure.SWITCHES in why:
        message = f"a switch in the equation of {_names(segment_motion, block)} is undone at once, again and again"
        note = f"each side leads straight back to the other, so there is no solution from t = {when} on"
        help_ = "replace the switch by a steep slope: `.min(1, .max(-1, v/0.01))` instead of `{ v > 0 : 1; -1 }`"
    elif OdeFailure.WORK in why:
        message = f"the differential equation of {_names(segment_motion, block)} takes too many steps"
        note = f"the solver gave up at t = {when}: something turns or switches very often in this time"
        help_ = "make the film shorter, or the oscillations slower"
    elif OdeFailure.AWAY in why:
        verb = "run" if " and " in _names(segment_motion, block) else "runs"
        code, message = "solve/runs-away", f"{_names(segment_motion, block)} {verb} away to infinity at t = {when}"
        note = "it grows ever faster: no solution of the equation goes beyond this time"
        help_ = f"end the film before t = {when}"
    else:
        return None
    return Diagnostic(
        code=code,
        severity=Severity.ERROR,
        message=message,
        span=span_of_blocks(segment_motion, (block.number,)),
        notes=(note,),
        helps=(help_, Advised("`", Choose.ON_FAILURE.to("hold"), "` keeps the last good pose")),
    )


def _names(segment_motion: SegmentMotion, block: Block) -> str:
    unknowns = (segment_motion.plan.system.unknowns[n] for n in block.unknowns)
    return listed([f"`{u.name}`" for u in unknowns if isinstance(u.payload, VariableComponent)]) or "what moves here"
