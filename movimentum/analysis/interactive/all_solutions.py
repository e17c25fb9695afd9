"""All solutions at one moment, whether or not the path leads to them."""

from __future__ import annotations

import numpy as np

from movimentum.analysis.diagnose.ambiguity import loose_variables, shown_unknowns, solutions_of
from movimentum.analysis.diagnose.inequalities import candidate_at, described, selecting_inequalities, selecting_wish
from movimentum.arrays import first_of
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, replace
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.basis.pose_state import Snapshot, as_drawn
from movimentum.solver.block.closed_form import State
from movimentum.solver.path.follow import follow_path
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import snapshot
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.segment_start import integral_totals
from movimentum.solver.start.candidates import Part
from movimentum.solver.start.search import select
from movimentum.tolerances import INEQUALITY_MET, LISTED_AHEAD, SAME_POSE


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """One solution of one independent part: in words, the statement that selects it (None: none was found), whether the
    motion is in it, and the pose of the whole scene with it.
    """

    words: str
    selects: str | None
    current: bool
    pose: Snapshot


@dataclass(frozen=True, slots=True)
class Rejecting:
    """A statement (the ``constraint`` of that number) that a solution violates, ``by`` so much."""

    constraint: int
    by: float


@dataclass(frozen=True, slots=True, eq=False)
class Rejected:
    """A solution of the equations that inequalities turn down: in words, and which."""

    words: str
    by: tuple[Rejecting, ...]
    pose: Snapshot


@dataclass(frozen=True, slots=True, eq=False)
class Alternatives:
    """The solutions of one part of the scene that is solved independently of others, and those that inequalities
    reject; ``complete``: these are all.
    """

    things: tuple[int, ...]
    solutions: tuple[Alternative, ...]
    rejected: tuple[Rejected, ...]
    complete: bool


def alternatives(segment_motion: SegmentMotion, piece: Piece | None, tau: float) -> list[Alternatives]:
    """Every solution at offset ``tau`` of a segment, part by part, and what its inequalities say of it. ``piece``: the
    path there, if there is one.
    """
    plan = segment_motion.plan
    bare = _without_inequalities(plan)
    start = segment_motion.segment.start
    now: State = []
    with np.errstate(all="ignore"):
        totals = integral_totals(plan, segment_motion.base)
        if piece is not None:
            now, _ = piece.evaluate(piece.instants(np.array([tau])))
            totals = {n: first_of(now[n]) for block in plan.blocks for n in block.unknowns if now[n] is not None}
        found = select(bare, start, tau, LISTED_AHEAD, as_drawn(plan.system.scene), totals)
        if piece is None:
            if found.choices is None:
                return []
            there, _ = follow_path(bare, start, tau, tau, found.choices)
            now, _ = there.evaluate(there.instants(np.array([tau])))
    return [made for part in found.parts if (made := _of_part(segment_motion, part, now, piece, tau)) is not None]


def _of_part(
    segment_motion: SegmentMotion, part: Part, now: State, piece: Piece | None, tau: float
) -> Alternatives | None:
    """The solutions of one part where all others are as in ``now``; None without any."""
    plan = segment_motion.plan
    groups = solutions_of(plan, part)
    if not groups:
        return None
    loose = loose_variables(plan, groups)
    part = replace(part, candidates=tuple(group[0] for group in groups))
    states = [_with(now, part, index) for index in range(len(part.candidates))]
    followed = [candidate_at(plan, segment_motion, part, state).without(loose) for state in states]
    words = described(plan, part.candidates, followed, loose)
    poses = [snapshot(plan, state, segment_motion.base.now, 0) for state in states]
    turned_down = [_rejecting(segment_motion, part, state, tau) for state in states]
    kept = [index for index, by in enumerate(turned_down) if not by]
    texts: list[str | None] = [None] * len(kept)
    if len(kept) > 1:
        wished = replace(part, candidates=tuple(part.candidates[index] for index in kept))
        texts = selecting_inequalities(plan, [followed[index] for index in kept])
        texts = [text or selecting_wish(plan, wished, place, loose) for place, text in enumerate(texts)]
    unknowns = [n for number in part.blocks for n in plan.blocks[number].unknowns]
    shown = shown_unknowns(plan, part) or unknowns
    apart = [max((_apart(plan.size, now[n], states[index][n]) for n in shown), default=0.0) for index in kept]
    nearest = int(np.argmin(apart)) if apart and piece is not None else -1
    return Alternatives(
        tuple(sorted({t for n in unknowns if (t := plan.system.unknowns[n].thing) is not None})),
        tuple(
            Alternative(words[index], text, place == nearest and apart[place] < SAME_POSE, poses[index])
            for place, (index, text) in enumerate(zip(kept, texts, strict=True))
        ),
        tuple(Rejected(words[index], by, poses[index]) for index, by in enumerate(turned_down) if by),
        part.complete,
    )


def _without_inequalities(plan: Plan) -> Plan:
    """The same plan without the inequalities of the script; those that a length or an angle brings stay."""
    numbers = [i for i, selector in enumerate(plan.system.selectors) if selector.constraint is None]
    system = replace(plan.system, selectors=tuple(plan.system.selectors[i] for i in numbers))
    return replace(plan, system=system, selectors=tuple(plan.selectors[i] for i in numbers))


def _rejecting(segment_motion: SegmentMotion, part: Part, state: State, tau: float) -> tuple[Rejecting, ...]:
    """The inequalities about a part that a state of it violates, the worst first."""
    plan = segment_motion.plan
    clocks = at_offsets(plan.clocks, segment_motion.segment.start, np.array([tau])).clocks
    inside = {n for number in part.blocks for n in plan.blocks[number].unknowns}
    found: list[Rejecting] = []
    for selector, function in zip(plan.system.selectors, plan.selectors, strict=True):
        read = symbol_numbers(selector.value)
        if selector.constraint is None or inside.isdisjoint(read) or any(state[n] is None for n in read):
            continue
        with np.errstate(all="ignore"):
            value = first_of(function(state, clocks)[0])
        if value < -INEQUALITY_MET * plan.size:
            found.append(Rejecting(selector.constraint, -value))
    return tuple(sorted(found, key=lambda item: -item.by))


def _with(now: State, part: Part, index: int) -> State:
    state = list(now)
    for n, value in part.candidates[index].values.items():
        state[n] = np.array([value])
    return state


def _apart(size: float, a: object, b: object) -> float:
    one, other = first_of(np.asarray(a, dtype=float)), first_of(np.asarray(b, dtype=float))
    return abs(one - other) / max(1.0, size, abs(one))
