"""Reports what became of wishes that pull free motion: reached, blocked, or stuck where no velocity leads nearer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.analysis.diagnose.remedies import without_constraint
from movimentum.analysis.freedom.frozen_blocks import frozen_block, pulled_by
from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.planning.blocks.kinds import wishes_drawing
from movimentum.planning.lowering.equations import Wish
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.records import dataclass
from movimentum.scene.model import Constraint
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.free.velocity import FOLLOWING_RATE
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.text import listed, number, time_text
from movimentum.tolerances import WISH_ASIDE, WISH_REACHED, WISH_STANDS_STILL

SAMPLES = 200


MOST_WISHES = 50
"""Wishes that are examined one by one."""


@dataclass(frozen=True, slots=True)
class _WishSpan:
    """Where a wish pulls free motion: segments with the numbers of its errors in `Plan.wishes`."""

    constraint: Constraint
    segments: list[tuple[SegmentMotion, list[int]]]


def wish_diagnostics(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note (a warning where it is stuck) for each wish that pulls free motion, for the first `MOST_WISHES` of
    them.
    """
    lives = _wish_spans(motion)
    evaluated = _Evaluated()
    for life in lives[:MOST_WISHES]:
        found = _diagnostic(motion, life, evaluated)
        if found is not None:
            yield found
    if len(lives) > MOST_WISHES:
        message = f"only the first {MOST_WISHES} of {len(lives):,} wishes are reported"
        yield Diagnostic("limit/messages", Severity.NOTE, message)


def _wish_spans(motion: PathMotion) -> list[_WishSpan]:
    lives: dict[int, _WishSpan] = {}
    for segment_motion in motion.segments:
        plan = segment_motion.plan
        for i, wish in enumerate(plan.system.wishes):
            if not any(i in wishes_drawing(block) for block in plan.blocks):
                continue
            constraint = next(c for c in segment_motion.segment.active if c.number == wish.constraint)
            errors = [place for place, owner in enumerate(plan.wish_of) if owner == i]
            life = lives.setdefault(wish.constraint, _WishSpan(constraint, []))
            life.segments.append((segment_motion, errors))
    return list(lives.values())


class _Evaluated:
    """Pieces evaluated at evenly spread moments: wishes that pull the same part of a scene share the last result."""

    def __init__(self) -> None:
        self._of: tuple[Piece, tuple[int, ...]] | None = None
        self._found: tuple[State, NDArray[np.bool_]] = [], np.zeros(0, dtype=np.bool_)

    def at(self, piece: Piece, instants: Instants, unknowns: Iterable[int]) -> tuple[State, NDArray[np.bool_]]:
        """The state as far as ``unknowns`` need it, and where there is none; ``instants`` are the piece's own."""
        blocks = piece.finders(unknowns)
        if self._of is None or self._of[0] is not piece or self._of[1] != blocks:
            self._of, self._found = (piece, blocks), piece.evaluate(instants, blocks)
        return self._found


def _diagnostic(motion: PathMotion, life: _WishSpan, evaluated: _Evaluated) -> Diagnostic | None:
    times: list[FloatArray] = []
    offs: list[FloatArray] = []
    for segment_motion, errors in life.segments:
        for piece in segment_motion.pieces:
            if isinstance(piece, UnsolvedInterval):
                return None  # a time without a solution is reported itself
            tau = np.linspace(piece.begin, piece.end, SAMPLES if piece.end > piece.begin else 1)
            off, bad = _off(piece, errors, tau, evaluated)
            if bad.any():
                return None
            times.append(tau + float(segment_motion.segment.start))
            offs.append(off)
    time, off = np.concatenate(times), np.concatenate(offs)
    last = float(off[-1])
    left = life.constraint.left_span
    name = motion.timeline.scene.source.slice(left)
    tolerance = WISH_REACHED * motion.size
    if last <= tolerance:
        late = np.nonzero(off > tolerance)[0]
        begin = int(late[-1]) + 1 if len(late) else 0
        worst = float(np.max(off[begin:]))
        when = f"at t = {time_text(round(float(time[begin]), 4))}" if begin else "from the beginning"
        return Diagnostic(
            "wish/reached",
            Severity.NOTE,
            f"`{name}` {'reaches its goal' if begin else 'is at its goal'} {when}, to within {number(worst, 2)}",
            life.constraint.span,
        )
    return _why_missed(motion, life, last, name)


def _off(
    piece: Piece, errors: list[int], tau: FloatArray, evaluated: _Evaluated
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """(F,) the distance of a wish from its goal, and where it is unknown."""
    instants = piece.instants(tau)
    plan = piece.plan
    wish = plan.system.wishes[plan.wish_of[errors[0]]]  # evaluating everything else for each wish would be quadratic
    with np.errstate(all="ignore"):
        state, bad = evaluated.at(piece, instants, symbol_numbers(*wish.errors))
        values = [np.broadcast_to(plan.wishes[i](state, instants.clocks)[0], len(tau)) for i in errors]
    off = np.sqrt(np.sum(np.square(values), axis=0))
    return off, bad | ~np.isfinite(off)


def _why_missed(motion: PathMotion, life: _WishSpan, last: float, name: str) -> Diagnostic:
    """Why a wish has not reached its goal at the end: it is under way, blocked, or stuck."""
    segment_motion, errors = life.segments[-1]
    plan = segment_motion.plan
    piece = segment_motion.pieces[-1]
    assert isinstance(piece, Piece)
    number_of_wish = plan.wish_of[errors[0]]
    wish = plan.system.wishes[number_of_wish]
    block = next(rows for rows in plan.free_rows if number_of_wish in wishes_drawing(rows))
    watched, reads = [piece.plan.wishes[i] for i in errors], symbol_numbers(*wish.errors)
    held = frozen_block(piece, block, piece.end, watched, reads)
    speed = held.approach(held.x)
    wanted = min(FOLLOWING_RATE * last, wish.speed or np.inf)
    if speed > WISH_STANDS_STILL * wanted:
        return Diagnostic(
            "wish/under-way",
            Severity.NOTE,
            f"`{name}` is {number(last)} from its goal when the wish ends, and coming nearer",
            life.constraint.span,
            helps=("a later end or a greater `.speed(…)` lets it arrive",),
        )
    if len(wishes_drawing(block)) > 1:
        held = frozen_block(piece, pulled_by(plan, block, wish), piece.end, watched, reads)
        if held.approach(held.x) > WISH_STANDS_STILL * wanted:
            return _opposed(motion, life, last, name, [plan.system.wishes[i] for i in wishes_drawing(block)])
    if held.stuck(held.x, WISH_ASIDE * motion.size):
        return Diagnostic(
            "wish/singular",
            Severity.WARNING,
            f"`{name}` is stuck {number(last)} from its goal: in this pose no velocity brings it nearer,"
            " but in a nearby pose one does",
            life.constraint.span,
            notes=("a dead centre, or a straight chain that is pushed along its line",),
            helps=("a wish a little to one side, or another pose to begin with, gets it moving",),
        )
    return Diagnostic(
        "wish/blocked",
        Severity.NOTE,
        f"`{name}` is blocked {number(last)} from its goal: the other statements let it come no nearer",
        life.constraint.span,
    )


def _opposed(motion: PathMotion, life: _WishSpan, last: float, name: str, wishes: Sequence[Wish]) -> Diagnostic:
    """Other wishes of the same part hold it back."""
    scene = motion.timeline.scene
    others = {wish.constraint for wish in wishes} - {life.constraint.number}
    opposing = [c for c in scene.constraints() if c.number in others]
    keys = [scene.source.slice(c.left_span) for c in opposing]
    quoted = [f"`{key}`" for key in keys]
    return Diagnostic(
        "wish/blocked",
        Severity.NOTE,
        f"other wishes hold `{name}` {number(last)} from its goal: those for {listed(quoted)}",
        life.constraint.span,
        helps=(f"`{keys[0]} ~ _;` ends {'that' if len(keys) == 1 else 'one'}",),
        fixes=tuple(without_constraint(scene.source, constraint) for constraint in opposing),
    )
