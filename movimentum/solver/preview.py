"""The pose at one instant, before the path to it is known: by Newton's method from the pose on show.

It satisfies everything that the script states for that instant, inequalities included (it is judged like the frames of
a motion). If there are several such poses, the path may lead to another one; the path then decides.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from movimentum.arrays import BoolArray
from movimentum.expressions import symbols
from movimentum.records import replace
from movimentum.scene.leaves import StoredValue
from movimentum.scene.model import Scene, ThingProperty, VariableComponent
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.effort import EffortExceeded, limit_effort
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import PoseState, Snapshot
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.block.closed_form import State
from movimentum.solver.edited_parts import edited_part
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.follow import instant_piece
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import at_rest, carried_at
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import PathBeginning, PathReason, SegmentMotion, UnsolvedInterval
from movimentum.solver.segment_start import plan_and_start
from movimentum.solver.solver_cache import SolverCache, scene_key, segment_key
from movimentum.solver.stored_values import with_stored_values
from movimentum.timeline.model import Segment, Timeline

PREVIEW_EFFORT = 400
"""Linearizations after which it is quicker to wait for the path."""


class PreviewPiece(Piece):
    """A piece of one instant that is looked at once: block by block, for making one function of all takes longer."""

    __slots__ = ()

    def solve(self, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
        """As `Piece.solve`, but for rounding."""
        del windings
        return self.evaluate(instants)


def preview_pose(
    timeline: Timeline,
    time: Fraction,
    near: PoseState,
    known: SolverCache,
    shown: PathMotion | None = None,
    stored_values: Mapping[StoredValue, float] | None = None,
) -> Poses | None:
    """The poses (F = 1) at ``time``, nearest to ``near``; None where none is found with little work.

    ``near`` is in terms of the timeline's scene (see `carried_to_scene`); plans are taken from ``known``, and kept
    there. Where it is the pose of ``shown`` at that time, what is stated as it was there is not solved again.
    ``stored_values``: the values that statements keep from earlier times, if ``shown`` does not have them.
    """
    scene = timeline.scene
    whole = timeline.segments[timeline.segment_at(time)]
    if timeline.stored_values:
        try:
            whole = with_stored_values(whole, stored_values or ({} if shown is None else shown.stored_values))
        except KeyError:  # that has to be awaited
            return None
    segment = _edited_part(shown, time, scene, whole)
    size = scene_size(scene)
    key = known.memo.number(segment_key(known.memo.number(scene_key(scene)), segment, scene.source.text))
    tau = float(time - segment.start)
    try:
        with limit_effort(PREVIEW_EFFORT):
            plan, selection = plan_and_start(scene, segment, key, known, size, replace(near, is_shown=True), tau)
            if selection.choices is None:  # what is next to the pose on show is on the wrong side, perhaps
                plan, selection = plan_and_start(scene, segment, key, known, size, near, tau)
            if selection.choices is None:
                return None
            piece = instant_piece(plan, segment.start, tau, selection.choices)
            piece = PreviewPiece(plan, segment.start, tau, tau, piece.tracks, piece.nodes)
    except EffortExceeded:
        return None
    segment_motion = SegmentMotion(
        segment, plan, near, [piece], [PathBeginning(tau, selection, near, PathReason.STEP)], []
    )
    alone = replace(timeline, segments=(segment,))
    poses = PathMotion(alone, (segment_motion,), size, uncertain=True).poses_at([time])
    if segment is not whole:
        leaves = symbols(*(side for constraint in whole.active for side in (*constraint.left, *constraint.right)))
        stated = {leaf.name for leaf in leaves if isinstance(leaf, VariableComponent)}
        poses = replace(poses, missing={name: rows for name, rows in poses.missing.items() if name not in stated})
    return poses if bool(poses.solved.all()) else None


def _edited_part(shown: PathMotion | None, time: Fraction, scene: Scene, segment: Segment) -> Segment:
    """``segment`` with what has to be solved when the pose of ``shown`` at ``time`` is known."""
    if shown is None or shown.uncertain or not shown.timeline.start <= time <= shown.timeline.end:
        return segment
    before = shown.segments[shown.timeline.segment_at(time)]
    if before.failures:
        return segment
    return edited_part((shown.timeline.scene, before.segment), (scene, segment)) or segment


def pose_at_rest(motion: PathMotion, time: Fraction) -> PoseState:
    """The pose at ``time``, at rest, as something to begin from."""
    timeline = motion.timeline
    clipped = min(max(time, timeline.start), timeline.end)
    segment_motion = motion.segments[timeline.segment_at(clipped)]
    tau = float(clipped - segment_motion.segment.start)
    piece = next((each for each in segment_motion.pieces if tau <= each.end), segment_motion.pieces[-1])
    if isinstance(piece, UnsolvedInterval):
        return at_rest(piece.carry)
    return at_rest(carried_at(segment_motion, piece, max(tau, piece.begin), segment_motion.base))


def carried_to_scene(carry: PoseState, before: Scene, after: Scene) -> PoseState:
    """The same pose for another scene: things are the same if their names are; new ones are as drawn."""
    now = carry.now
    number = {thing.name: thing.number for thing in before.things}
    old = [number.get(thing.name) for thing in after.things]
    if old == list(range(len(before.things))):
        return carry
    of_new = {place: new for new, place in enumerate(old) if place is not None}
    things = tuple(BodyPose() if place is None else now.things[place] for place in old)
    others = {
        replace(payload, thing=of_new[payload.thing]) if isinstance(payload, ThingProperty) else payload: value
        for payload, value in now.others.items()
        if not isinstance(payload, ThingProperty) or payload.thing in of_new
    }
    return PoseState(Snapshot(things, others, frozenset(of_new[t] for t in now.known if t in of_new)))
