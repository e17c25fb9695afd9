"""Tests two promises on a script: the motion does not depend on the frame rate, and it can be reversed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import Expr, clock, ratio, sub, substitute, walk
from movimentum.records import dataclass, replace
from movimentum.scene.model import Constraint, Relation
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.motion import PathMotion
from movimentum.solver.pose_assembly import carried_at
from movimentum.solver.segment_motion import UnsolvedInterval
from movimentum.solver.solver import solve
from movimentum.text import number, time_text
from movimentum.timeline.arrange import arrange
from movimentum.timeline.model import Timeline
from movimentum.tolerances import INVARIANT

OTHER_RATE = Fraction(17, 11)
"""Of the script's frame rate: its frames rarely coincide with those of the script."""
MOST_TIMES = 2000


@dataclass(frozen=True, slots=True)
class LargestDifference:
    """Where two motions are farthest apart: ``anchor`` by ``amount`` pixels at ``time``; ``first``: when they part."""

    anchor: str
    amount: float
    time: float
    first: float | None


def _largest_difference(
    one: PathMotion, other: PathMotion, times: Sequence[Fraction], backwards: bool = False
) -> LargestDifference:
    """Compare at ``times`` (ascending); ``backwards``: the other motion runs from the end to the beginning.

    A step's own time belongs to that step, whichever way time runs. So the times of steps are left out then.
    """
    timeline = one.timeline
    total = timeline.start + timeline.end
    a = one.poses_at(times)
    b = other.poses_at([total - time for time in reversed(times)] if backwards else times)
    turn = slice(None, None, -1) if backwards else slice(None)
    both = a.solved & b.solved[turn]
    if backwards:
        both &= ~np.isin([float(time) for time in times], [float(s.start) for s in timeline.segments[1:]])
    worst = LargestDifference("", 0.0, float(times[0]), None)
    off = np.zeros(len(times))
    for thing in timeline.scene.things:
        for anchor in thing.anchors if thing.is_body else ():
            there = a.world(thing.number, anchor.local) - b.world(thing.number, anchor.local)[turn]
            far = np.where(both, np.hypot(there[:, 0], there[:, 1]), 0.0)
            off = np.maximum(off, far)
            place = int(np.argmax(far))
            if far[place] > worst.amount or not worst.anchor:
                worst = LargestDifference(f"{thing.name}.{anchor.name}", float(far[place]), float(times[place]), None)
    bad = np.nonzero(off > INVARIANT * one.size)[0]
    first = bad[-1 if backwards else 0] if len(bad) else None
    return replace(worst, first=None if first is None else float(times[int(first)]))


def _times(motion: PathMotion) -> list[Fraction]:
    timeline = motion.timeline
    stride = -(-timeline.frame_count // MOST_TIMES)
    return [timeline.frame_time(frame) for frame in range(0, timeline.frame_count, stride)]


def at_other_rate(motion: PathMotion) -> PathMotion:
    """The same scene solved at another frame rate."""
    timeline = motion.timeline
    return solve(arrange(timeline.scene, fps=timeline.fps * OTHER_RATE, max_frames=10**9))


def frame_rate_diagnostics(
    motion: PathMotion, other: PathMotion, diagnostics: Sequence[Diagnostic], others: Sequence[Diagnostic]
) -> Iterator[Diagnostic]:
    """Compare a motion with that at another frame rate: their ``diagnostics``, and where things are at both
    rates' frame times.
    """
    times = sorted({*_times(motion), *_times(other)})
    rates = [number(float(rate), 6) for rate in (other.timeline.fps, motion.timeline.fps)]
    how = f"at {rates[0]} frames per time unit instead of {rates[1]}"
    here, there = (next((d for d in some if d.severity is Severity.ERROR), None) for some in (diagnostics, others))
    if (None if here is None else here.code) != (None if there is None else there.code):
        what = "nothing is wrong" if there is None else f"there is an error: {there.message}"
        yield Diagnostic("check/fps-invariance", Severity.ERROR, f"{how} {what}", None if there is None else there.span)
        return
    yield _diagnostic("check/fps-invariance", how, _largest_difference(motion, other, times))


def _diagnostic(code: str, how: str, found: LargestDifference) -> Diagnostic:
    same = found.first is None
    amount = f"{number(found.amount, 2)} px at t = {time_text(found.time)}"
    if same:
        farthest = f"the motion is the same: `{found.anchor}` differs most, by {amount}"
        message = f"{how} {farthest if found.anchor else 'nothing differs'}"
        return Diagnostic(code, Severity.NOTE, message)
    return Diagnostic(
        code,
        Severity.ERROR,
        f"{how} the motion differs from t = {time_text(found.first or 0.0)} on: `{found.anchor}` is off by {amount}",
        notes=("the path is not determined well enough there: see what `branch` says in the debugger",),
        helps=("an inequality that holds on only one of the two paths keeps the motion on it",),
    )


# --- backwards -------------------------------------------------------------------------------------------


def reverse_diagnostics(motion: PathMotion) -> Iterator[Diagnostic]:
    """Follow the motion from its end back to its beginning, and compare.

    Some scenes are not reversible and not tried: those with integrals and derivatives (they depend on the direction of
    time), with free motion and wishes (least motion depends on where it comes from), and with jumps from one step to
    the next.
    """
    reason = _irreversible(motion)
    if reason is not None:
        yield Diagnostic("check/reverse", Severity.NOTE, f"the motion cannot be run backwards: {reason}")
        return
    last = motion.segments[-1]
    piece = last.pieces[-1]
    assert not isinstance(piece, UnsolvedInterval)
    carried = carried_at(last, piece, float(last.segment.end - last.segment.start), last.base)
    backwards = solve(_reversed(motion.timeline), PoseState(carried.now))
    yield _diagnostic(
        "check/reverse",
        "run backwards from its end",
        _largest_difference(motion, backwards, _times(motion), backwards=True),
    )


def _irreversible(motion: PathMotion) -> str | None:
    for segment_motion in motion.segments:
        when = f"in the step at t = {time_text(float(segment_motion.segment.start))}"
        if segment_motion.failures or any(isinstance(piece, UnsolvedInterval) for piece in segment_motion.pieces):
            return f"there is no solution all the way {when}"
        if any(b.free for b in segment_motion.plan.blocks):
            return f"something moves freely {when}"
        for item in segment_motion.segment.active:
            if any(node.op in ("integral", "derivative") for node in walk(*item.left, *item.right)):
                return f"there are integrals or derivatives {when}"
            if item.relation is Relation.WISH:
                return f"there are wishes {when}"
    return None


def _reversed(timeline: Timeline) -> Timeline:
    """The timeline run backwards: what happened at T happens at start + end - T."""
    total = timeline.start + timeline.end
    now = clock(Fraction(0))
    memo: dict[Expr, Expr] = {}

    def turned(node: Expr) -> Expr | None:
        return sub(ratio(total - node.start), now) if node.op == "clock" else None

    def of(item: Constraint) -> Constraint:
        sides = (tuple(substitute(part, turned, memo) for part in side) for side in (item.left, item.right))
        left, right = sides
        return replace(item, left=left, right=right)

    segments = tuple(
        replace(s, number=k, start=total - s.end, end=total - s.start, active=tuple(map(of, s.active)))
        for k, s in enumerate(reversed(timeline.segments))
    )
    return Timeline(timeline.scene, segments, timeline.fps, timeline.lifetimes)
