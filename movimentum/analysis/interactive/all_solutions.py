"""All solutions at one moment, whichever path leads there."""

from __future__ import annotations

import numpy as np

from movimentum.analysis.diagnose.equal_solutions import loose_variables, shown_unknowns, solutions_of
from movimentum.analysis.diagnose.inequalities import described, followed_at, selecting_inequalities, selecting_wish
from movimentum.arrays import first_of
from movimentum.records import dataclass, replace
from movimentum.solver.assembly import snapshot
from movimentum.solver.basis.pose_state import Snapshot, as_drawn
from movimentum.solver.block.closed_form import State
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.start.candidates import Part
from movimentum.solver.start.search import select
from movimentum.tolerances import LISTED_AHEAD, SAME_POSE


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """One solution of one independent part: in words, the statement that selects it (None: none was found), whether the
    motion is in it, and the pose of the whole scene with it.
    """

    words: str
    selects: str | None
    current: bool
    pose: Snapshot


@dataclass(frozen=True, slots=True, eq=False)
class Alternatives:
    """The solutions of one part of the scene that is solved independently of others; ``complete``: these are all."""

    things: tuple[int, ...]
    solutions: tuple[Alternative, ...]
    complete: bool


def alternatives(segment_motion: SegmentMotion, piece: Piece, tau: float) -> list[Alternatives]:
    """Every solution at offset ``tau`` of a segment that its inequalities allow, part by part."""
    plan = segment_motion.plan
    scene = plan.system.scene
    with np.errstate(all="ignore"):
        now, _ = piece.evaluate(piece.instants(np.array([tau])))
        totals = {n: first_of(now[n]) for block in plan.blocks for n in block.unknowns if now[n] is not None}
        found = select(plan, segment_motion.segment.start, tau, LISTED_AHEAD, as_drawn(scene), totals)
    result: list[Alternatives] = []
    for part in found.parts:
        groups = solutions_of(plan, part)
        loose = loose_variables(plan, groups) if groups else []
        part = replace(part, candidates=tuple(group[0] for group in groups))
        states = [_with(now, part, index) for index in range(len(part.candidates))]
        followed = [followed_at(plan, segment_motion, part, state).without(loose) for state in states]
        texts = selecting_inequalities(plan, followed) if len(states) > 1 else [None] * len(states)
        words = described(plan, part.candidates, followed, loose) if followed else []
        unknowns = [n for number in part.blocks for n in plan.blocks[number].unknowns]
        shown = shown_unknowns(plan, part) or unknowns
        apart = [max((_apart(plan.size, now[n], state[n]) for n in shown), default=0.0) for state in states]
        nearest = int(np.argmin(apart)) if apart else -1
        made = tuple(
            Alternative(
                what,
                text or (selecting_wish(plan, part, index, loose) if len(states) > 1 else None),
                index == nearest and apart[index] < SAME_POSE,
                snapshot(plan, state, segment_motion.base.now, 0),
            )
            for index, (what, text, state) in enumerate(zip(words, texts, states, strict=True))
        )
        things = sorted({t for n in unknowns if (t := plan.system.unknowns[n].thing) is not None})
        result.append(Alternatives(tuple(things), made, part.complete))
    return result


def _with(now: State, part: Part, index: int) -> State:
    state = list(now)
    for n, value in part.candidates[index].values.items():
        state[n] = np.array([value])
    return state


def _apart(size: float, a: object, b: object) -> float:
    one, other = first_of(np.asarray(a, dtype=float)), first_of(np.asarray(b, dtype=float))
    return abs(one - other) / max(1.0, size, abs(one))
