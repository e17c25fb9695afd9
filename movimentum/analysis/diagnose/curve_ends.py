"""Reports where a contact reaches the end of an open curve."""

from __future__ import annotations

from movimentum.analysis.diagnose.locations import constraint_of, span_of_blocks
from movimentum.analysis.diagnose.reach import KEEP_OR_SKIP, until_when
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.expressions import symbols
from movimentum.planning.blocks.kinds import Block
from movimentum.scene.leaves import ContactPlace
from movimentum.scene.model import AnchorCoordinate, Thing, ThingAngle
from movimentum.scene.outlines import outline_of
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import carried_at
from movimentum.solver.segment_motion import Failure, FailureKind, SegmentMotion
from movimentum.text import number, time_text
from movimentum.tolerances import AT_OUTLINE_END


def end_of_curve(motion: PathMotion, segment_motion: SegmentMotion, failure: Failure) -> Diagnostic | None:
    """A contact that leaves an open curve at one of its ends, or begins beyond it; None if that is not the trouble."""
    plan = segment_motion.plan
    if failure.kind is FailureKind.START:
        refused = () if failure.selection is None else failure.selection.rejections
        blocks = [plan.blocks[each.block] for each in refused if each.past_end and each.block is not None]
        found = next((place for block in blocks for place in _open_places(segment_motion, block)), None)
        return None if found is None else _at_end(motion, segment_motion, failure, found, "would be beyond an end")
    if failure.kind is not FailureKind.GAP or failure.block is None:
        return None
    pieces = [each for each in segment_motion.pieces if isinstance(each, Piece) and each.begin <= failure.begin]
    if not pieces:
        return None
    carry = carried_at(segment_motion, pieces[-1], failure.begin, segment_motion.base)
    for place in _open_places(segment_motion, plan.blocks[failure.block]):
        value = carry.now.others.get(place)
        outline = place.touch.outline
        first, last = (0.0, outline.length) if place.along else (outline.first, outline.last)
        near = AT_OUTLINE_END * (last - first)
        if value is not None and (value <= first + near or value >= last - near):
            which = "its beginning" if value <= first + near else "its end"
            return _at_end(motion, segment_motion, failure, place, f"leaves it at {which}")
    return None


def _open_places(segment_motion: SegmentMotion, block: Block) -> list[ContactPlace]:
    payloads = [segment_motion.plan.system.unknowns[n].payload for n in block.unknowns]
    return [each for each in payloads if isinstance(each, ContactPlace) and not each.touch.outline.closed]


def _at_end(
    motion: PathMotion, segment_motion: SegmentMotion, failure: Failure, place: ContactPlace, what: str
) -> Diagnostic:
    plan = segment_motion.plan
    things = plan.system.scene.things
    curve = _thing_of(place, things)
    equations = [plan.system.equations[e] for e in plan.blocks[plan.owner[plan.system.number_of[place]]].equations]
    chosen = [item for each in equations if (item := constraint_of(segment_motion, each.constraint)) is not None]
    item = next((each for each in chosen if each.touches), None)
    start = float(segment_motion.segment.start)
    when = time_text(start + failure.begin)
    name = "the curve" if curve is None else f"`{curve.name}`"
    return Diagnostic(
        "contact/end",
        Severity.ERROR,
        f"what touches {name} {what} at t = {when}: there is no contact from then"
        f" {until_when(motion, segment_motion, failure)}",
        span=item.span
        if item is not None
        else span_of_blocks(segment_motion, (plan.owner[plan.system.number_of[place]],)),
        labels=() if curve is None else (Label(curve.span, "it is open"),),
        notes=(f"it is {number(place.touch.outline.length, 4)} px long, and ends where it is drawn to end",),
        helps=(
            f"make {name} longer, leave out `.open`, or end the step before t = {when}",
            KEEP_OR_SKIP,
        ),
    )


def _thing_of(place: ContactPlace, things: tuple[Thing, ...]) -> Thing | None:
    numbers = [leaf.thing for leaf in symbols(*place.pose) if isinstance(leaf, AnchorCoordinate | ThingAngle)]
    return next((things[n] for n in dict.fromkeys(numbers) if outline_of(things[n]) == place.touch.outline), None)
