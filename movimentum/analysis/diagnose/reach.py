"""Reports where a motion ends: a mechanism driven past its reach, or a value that runs away to infinity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.analysis.diagnose.locations import constraint_of, span_of_blocks
from movimentum.analysis.diagnose.remedies import with_length, with_other_pins
from movimentum.arrays import first_of
from movimentum.diagnostics import Diagnostic, Fix, Label, Severity
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.scene.model import Constraint, Scene, Thing
from movimentum.settings import Advice, FailurePolicy
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import carried_at
from movimentum.solver.segment_motion import Failure, FailureKind, SegmentMotion
from movimentum.solver.start.candidates import Selection
from movimentum.text import listed, number, time_text
from movimentum.tolerances import AT_FRAME, AT_INFINITY, AWAY_FOR, LEAST_ROUNDED, SAME_LENGTH, STRETCHED

if TYPE_CHECKING:
    from movimentum.analysis.diagnose.conflict import Conflict


LENGTH_MOMENTS = tuple(k / 8 for k in range(1, 9))
"""Where, in the time without a solution, lengths are looked at that would do."""
FEW_UNKNOWNS = 200
"""Unknowns up to which they are."""
LENGTH_MARGIN = 0.8
"""Of the last digit of a suggested length: how far it must be from one that is just enough."""
DECIMALS = 11
"""A time is shown with at most this many decimals of the step's length."""

KEEP_OR_SKIP = Advised.of(
    "`{}` keeps the last good pose, `{}` leaves the frames out",
    *(Choose.ON_FAILURE.to(policy) for policy in (FailurePolicy.HOLD, FailurePolicy.SKIP)),
)
"""The help for frames without a solution, whatever the reason."""


def driven_past(segment_motion: SegmentMotion, selection: Selection) -> bool:
    """Whether there is no solution at the beginning because a reach is exceeded: something has as many equations as
    unknowns and no real solution, and it is driven there by time or by a later step's statement.

    Redundant equations that disagree, and a first step's constants, are contradictions.
    """
    if any(rejection.check is not None for rejection in selection.rejections):
        return False
    blocks = [segment_motion.plan.blocks[r.block] for r in selection.rejections if r.block is not None]
    return any(block.moving or (segment_motion.segment.step > 0 and not block.free) for block in blocks)


def binding_constraints(
    motion: PathMotion, segment_motion: SegmentMotion, failure: Failure, advice: Advice
) -> Diagnostic | None:
    """A path ended, or could not begin: which constraints bind, and their errors at the next frame.

    None if it could not begin and nothing shows that there is no solution: the search only found none.
    """
    plan = segment_motion.plan
    block = _block(segment_motion, failure)
    length = float(segment_motion.segment.end - segment_motion.segment.start)
    piece = next((p for p in segment_motion.pieces if isinstance(p, Piece) and p.begin <= failure.begin <= p.end), None)
    carry = (
        segment_motion.base if piece is None else carried_at(segment_motion, piece, failure.begin, segment_motion.base)
    )
    until = until_when(motion, segment_motion, failure)
    tau, conflict = _conflict(motion, segment_motion, failure, block, carry)
    if failure.kind is FailureKind.START and block.iterative and conflict is None:
        return None
    where, label, labels = "", "binds", list[Label]()
    chosen: list[Constraint] = []
    if conflict is not None:
        chosen = [c for n in conflict.constraints if (c := constraint_of(segment_motion, n)) is not None]
        amount = _amount(plan.system.scene, conflict)
        where = f"; at t = {time_in_step(segment_motion, tau, length)} {amount}" if amount else ""
        labels = [Label(c.span, off_text(conflict, c.number)) for c in chosen[:-1]]
        labels += [Label(plan.system.scene.things[t].span, "rigid") for t in conflict.things]
        label = off_text(conflict, conflict.constraints[-1]) if conflict.constraints else "binds"
    if not chosen:
        numbers = [plan.system.equations[e].constraint for e in block.equations]
        chosen = [c for n in numbers if (c := constraint_of(segment_motion, n)) is not None]
    things = {t for n in block.unknowns if (t := plan.system.unknowns[n].thing) is not None}
    names = ", ".join(f"`{plan.system.scene.things[t].name}`" for t in sorted(things))
    return Diagnostic(
        code="solve/unreachable",
        severity=Severity.ERROR,
        message=f"{names or 'the scene'} bind{'s' if ',' not in names else ''} at"
        f" t = {time_in_step(segment_motion, failure.begin, length)}: there is no solution from then {until}{where}",
        span=chosen[-1].span if chosen else None,
        label=label,
        labels=tuple(labels),
        notes=(_last_good(motion, segment_motion, failure),),
        fixes=()
        if conflict is None or advice is not Advice.FULL
        else (
            *_long_enough(segment_motion, failure, block, carry, conflict),
            *with_other_pins(plan.system.scene, chosen, segment_motion.segment.active),
        ),
        helps=(KEEP_OR_SKIP,),
    )


def _long_enough(
    segment_motion: SegmentMotion, failure: Failure, block: Block, carry: PoseState, conflict: Conflict
) -> Iterator[Fix]:
    """Each thing that is too short or too long, with a round length that is enough for the whole time without a
    solution, as far as some moments of it show.
    """
    from movimentum.analysis.diagnose.conflict import find_conflict

    plan = segment_motion.plan
    if len(plan.system.unknowns) > FEW_UNKNOWNS:
        return
    end = min(failure.until, float(segment_motion.segment.end - segment_motion.segment.start))
    places = [failure.begin + part * (end - failure.begin) for part in LENGTH_MOMENTS]
    later = [find_conflict(plan, set(block.unknowns), tau, carry) for tau in places]
    for t, factor in sorted(conflict.length_errors.items()):
        thing = plan.system.scene.things[t]
        factors = [
            factor,
            *(found.length_errors[t] for found in later if found is not None and t in found.length_errors),
        ]
        now = _length(thing)
        if len(thing.anchors) != 2 or abs(factor - 1.0) < SAME_LENGTH or now <= 0.0:
            continue
        wanted = _round(now * max(factors), up=True) if factor > 1.0 else _round(now * min(factors), up=False)
        yield from with_length(plan.system.scene, thing, wanted, now)


def _length(thing: Thing) -> float:
    points = [anchor.local for anchor in thing.anchors]
    return max((float(np.hypot(a[0] - b[0], a[1] - b[1])) for a in points for b in points), default=0.0)


def _round(value: float, *, up: bool) -> float:
    """A number of two or three digits that is clearly beyond ``value``."""
    unit = 10.0 ** (np.floor(np.log10(max(value, LEAST_ROUNDED))) - 1)
    return float(unit * (np.ceil(value / unit + LENGTH_MARGIN) if up else np.floor(value / unit - LENGTH_MARGIN)))


def off_text(conflict: Conflict, constraint: int) -> str:
    """The error of a constraint in a contradicting set."""
    off = conflict.errors.get(constraint)
    if off is None:
        return ""
    return f"off by {number(off)} where the others hold" if np.isfinite(off) else "without a finite value"


def _block(segment_motion: SegmentMotion, failure: Failure) -> Block:
    """The block that has no solution: if there are several, the one that comes nearest to having one."""
    if failure.block is not None:
        return segment_motion.plan.blocks[failure.block]
    assert failure.selection is not None
    refused = [r for r in failure.selection.rejections if r.block is not None]
    nearest = max(refused, key=lambda r: r.amount)
    return segment_motion.plan.blocks[nearest.block or 0]


def time_in_step(segment_motion: SegmentMotion, tau: float, length: float) -> str:
    """A time, to a small fraction of the step's length."""
    places = DECIMALS - int(np.floor(np.log10(length))) - 1 if length > 0.0 else DECIMALS
    return number(round(float(segment_motion.segment.start) + tau, places), 15)


def until_when(motion: PathMotion, segment_motion: SegmentMotion, failure: Failure) -> str:
    """When there is a solution again, perhaps because a later step states something else."""
    length = float(segment_motion.segment.end - segment_motion.segment.start)
    end = failure.until
    if end >= length:
        following = motion.segments[motion.segments.index(segment_motion) + 1 :]
        if not following or any(t.kind is FailureKind.START and t.begin == 0.0 for t in following[0].failures):
            return "on"
        end = length
    return f"until t = {time_in_step(segment_motion, end, length)}"


def _conflict(
    motion: PathMotion, segment_motion: SegmentMotion, failure: Failure, block: Block, carry: PoseState
) -> tuple[float, Conflict | None]:
    """The contradiction at the next frame (or in the middle, if there is none before there is a solution again), and
    when that is, as an offset.
    """
    from movimentum.analysis.diagnose.conflict import find_conflict

    timeline = motion.timeline
    start, length = (
        float(segment_motion.segment.start),
        float(segment_motion.segment.end - segment_motion.segment.start),
    )
    end = min(failure.until, length)
    first = float(timeline.start)
    frame = int(np.floor((start + failure.begin - first) * float(timeline.fps) + AT_FRAME)) + 1
    following = first + frame / float(timeline.fps) - start
    if failure.kind is FailureKind.START:
        following = failure.begin
    places = [tau for tau in (following,) if failure.begin <= tau <= end] + [0.5 * (failure.begin + end)]
    for tau in places:
        conflict = find_conflict(segment_motion.plan, set(block.unknowns), tau, carry)
        if conflict is not None:
            return tau, conflict
    return places[0], None


def _amount(scene: Scene, conflict: Conflict) -> str:
    """The thing that is too short or too long, and by how much; otherwise the error of a constraint; "" if neither is
    known.
    """
    short = [(t, f) for t, f in conflict.length_errors.items() if abs(f - 1.0) > STRETCHED]
    if not short:
        most = max(conflict.errors.values(), default=np.nan)
        return f"they are out of reach by {number(most)}" if np.isfinite(most) else ""
    t, factor = max(short, key=lambda item: abs(item[1] - 1.0))
    thing = scene.things[t]
    gap = (factor - 1.0) * _length(thing)
    return f"`{thing.name}` is {number(abs(gap))} too {'short' if gap > 0 else 'long'}"


def _last_good(motion: PathMotion, segment_motion: SegmentMotion, failure: Failure) -> str:
    """The last frame strictly before the end of the path, and its time."""
    timeline = motion.timeline
    begin = float(segment_motion.segment.start) + failure.begin
    last = int(np.ceil((begin - float(timeline.start)) * float(timeline.fps) - AT_FRAME)) - 1
    if last < 0:
        return "there is no good frame before that"
    return f"the last good frame is {last}, at t = {time_text(float(timeline.frame_time(last)))}"


FAR_AWAY = 1e4
"""Of the scene's size: what is farther away beside a pole runs away, too."""


def value_at_infinity(motion: PathMotion, segment_motion: SegmentMotion, failure: Failure) -> Diagnostic | None:
    """What is at infinity, when, and where it is in the frames before and after; None if nothing is."""
    pole, block = failure.pole, failure.block
    if failure.selection is not None:
        block = next((rejection.block for rejection in failure.selection.rejections if rejection.pole), None)
        pole = failure.begin
    if pole is None or block is None:
        return None
    system = segment_motion.plan.system
    own, things = _away(motion, segment_motion, segment_motion.plan.blocks[block], failure)
    unknown = system.unknowns[own]
    length = float(segment_motion.segment.end - segment_motion.segment.start)
    when = time_in_step(segment_motion, pole, length)
    is_place = isinstance(unknown.payload, PoseX | PoseY) and unknown.thing is not None
    names = [f"`{system.scene.things[thing].name}`" for thing in things if thing != unknown.thing or not is_place]
    name = system.scene.things[unknown.thing].name if is_place and unknown.thing is not None else unknown.name
    with_it = "" if is_place or not names else f", and {listed(names)} with it"
    back = failure.until - pole <= 2.0 * max(pole - failure.begin, AWAY_FOR * length)
    after = "" if back else f"; there is no solution from then {until_when(motion, segment_motion, failure)}"
    shown = unknown.thing if is_place else things[0] if things else None
    places = () if shown is None else tuple(_places(motion, segment_motion, pole, shown))
    return Diagnostic(
        code="solve/runs-away",
        severity=Severity.ERROR,
        message=f"`{name}` runs away to infinity at t = {when}{with_it}{after}",
        span=span_of_blocks(segment_motion, (block,)),
        label="nothing finite satisfies this at that time",
        notes=places,
        helps=(
            "a drive that begins at another place avoids it"
            if failure.selection is not None
            else "a drive that stops or turns back before "
            f"t = {number(float(segment_motion.segment.start) + pole)} avoids it",
            Advised("`", Choose.ON_FAILURE.to("skip"), "` draws what comes before and after"),
        ),
    )


def _away(motion: PathMotion, segment_motion: SegmentMotion, block: Block, failure: Failure) -> tuple[int, list[int]]:
    """The unknown of a block that is farthest away beside the time without a solution, and the things that are far away
    there.
    """
    pieces = [p for p in segment_motion.pieces if isinstance(p, Piece)]
    before = [(piece, failure.begin) for piece in pieces if piece.end <= failure.begin]
    after = [(piece, failure.until) for piece in pieces if piece.begin >= failure.until]
    system = segment_motion.plan.system
    some = [n for n in block.unknowns if not isinstance(system.unknowns[n].payload, PoseCos | PoseSin)]
    if not before and not after:
        return (*some, *block.unknowns)[0], []
    piece, tau = before[-1] if before else after[0]
    with np.errstate(all="ignore"):
        state, _ = piece.evaluate(piece.instants(np.array([tau])))
    size = {n: abs(first_of(value)) for n, value in enumerate(state) if value is not None}
    far = {
        unknown.thing
        for unknown in system.unknowns
        if isinstance(unknown.payload, PoseX | PoseY) and size.get(unknown.number, 0.0) > FAR_AWAY * motion.size
    }
    return max(some or block.unknowns, key=lambda n: size.get(n, 0.0)), sorted(t for t in far if t is not None)


def _places(motion: PathMotion, segment_motion: SegmentMotion, pole: float, thing: int) -> Iterator[str]:
    """Where a thing is in the last frame before ``pole`` and in the first one after."""
    timeline = motion.timeline
    name, (anchor, *_) = timeline.scene.things[thing].name, timeline.scene.things[thing].anchors
    place = (float(segment_motion.segment.start) + pole - float(timeline.start)) * float(timeline.fps)
    before, after = int(np.ceil(place - AT_INFINITY)) - 1, int(np.floor(place + AT_INFINITY)) + 1
    for frame, which in ((before, "the last frame before"), (after, "the first frame after")):
        if not 0 <= frame < timeline.frame_count:
            continue
        poses = motion.poses(frame, frame + 1)
        if poses.solved[0]:
            x, y = poses.world(thing, anchor.local)[0]
            when = time_text(float(timeline.frame_time(frame)))
            yield f"`{name}.{anchor.name}` is at [{number(x)}, {number(y)}] in {which} ({frame}, at t = {when})"
