"""Something that runs away to infinity: a slot that becomes parallel to a guide, a formula that divides by zero."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.analysis.diagnose.places import span_of_blocks
from movimentum.analysis.diagnose.reach import time_in_step, until_when
from movimentum.arrays import first_of
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import Failure, SegmentMotion
from movimentum.text import listed, number, time_text
from movimentum.tolerances import AT_INFINITY, AWAY_FOR

AFAR = 1e4
"""Of the scene's size: what is farther away beside a pole runs away, too."""


def runaway(motion: PathMotion, segment_motion: SegmentMotion, trouble: Failure) -> Diagnostic | None:
    """What is at infinity, when, and where it is in the frames before and after; None if nothing is."""
    pole, block = trouble.pole, trouble.block
    if trouble.selection is not None:
        block = next((rejection.block for rejection in trouble.selection.rejections if rejection.pole), None)
        pole = trouble.begin
    if pole is None or block is None:
        return None
    system = segment_motion.plan.system
    own, things = _away(motion, segment_motion, segment_motion.plan.blocks[block], trouble)
    unknown = system.unknowns[own]
    length = float(segment_motion.segment.end - segment_motion.segment.start)
    when = time_in_step(segment_motion, pole, length)
    is_place = isinstance(unknown.payload, PoseX | PoseY) and unknown.thing is not None
    names = [f"`{system.scene.things[thing].name}`" for thing in things if thing != unknown.thing or not is_place]
    name = system.scene.things[unknown.thing].name if is_place and unknown.thing is not None else unknown.name
    with_it = "" if is_place or not names else f", and {listed(names)} with it"
    back = trouble.until - pole <= 2.0 * max(pole - trouble.begin, AWAY_FOR * length)
    after = "" if back else f"; there is no solution from then {until_when(motion, segment_motion, trouble)}"
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
            if trouble.selection is not None
            else "a drive that stops or turns back before "
            f"t = {number(float(segment_motion.segment.start) + pole)} avoids it",
            Advised("`", Choose.ON_FAILURE.to("skip"), "` draws what comes before and after"),
        ),
    )


def _away(motion: PathMotion, segment_motion: SegmentMotion, block: Block, trouble: Failure) -> tuple[int, list[int]]:
    """The unknown of a block that is farthest away beside the time without a solution, and the things that are far away
    there.
    """
    pieces = [p for p in segment_motion.pieces if isinstance(p, Piece)]
    before = [(piece, trouble.begin) for piece in pieces if piece.end <= trouble.begin]
    after = [(piece, trouble.until) for piece in pieces if piece.begin >= trouble.until]
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
        if isinstance(unknown.payload, PoseX | PoseY) and size.get(unknown.number, 0.0) > AFAR * motion.size
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
