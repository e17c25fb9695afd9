"""Reports jumps: things that are suddenly elsewhere, within the film or between its end and its beginning."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from movimentum.cancellation import look
from movimentum.diagnostics import Diagnostic, Fix, Severity, insertion
from movimentum.records import dataclass
from movimentum.scene.model import Relation, Scene, Thing
from movimentum.solver.basis.pose_state import PoseState, Snapshot
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import PathBeginning, PathReason, SegmentMotion
from movimentum.source import Edit, Span
from movimentum.text import number, time_text
from movimentum.things.kinds.disc import DISC
from movimentum.things.kinds.toothed import GEAR
from movimentum.tolerances import LEAST_JUMP, LOOKS_SAME

DIGITS = 7
"""Of a value that a help tells: less than that is not seen as a jump."""
_EQUALS = re.compile(r"\s*=\s*")
FRAMES_OF_A_JUMP = 1.5
"""The distance that things move in this many frames is not a jump."""


@dataclass(frozen=True, slots=True, eq=False)
class Jump:
    """Something that is suddenly elsewhere where the path ``beginning`` begins: ``thing`` goes or turns by ``amount``;
    ``note`` tells how fast it moves there anyway.
    """

    beginning: PathBeginning
    thing: int
    amount: str
    note: str


def jumps(motion: PathMotion, index: int) -> Iterator[Diagnostic]:
    """A warning for each jump in segment number ``index``."""
    for jump in found_jumps(motion, index):
        told = _diagnostic(motion.segments[index], jump.beginning, jump.thing, jump.amount, jump.note)
        yield told.advised(*_goes_there(motion.segments[index], jump.beginning))


def found_jumps(motion: PathMotion, index: int) -> Iterator[Jump]:
    """For each beginning of a path in segment number ``index`` where something jumps: the anchor that goes farthest,
    and the thing of one anchor that turns most (no anchor shows that).
    """
    segment_motion = motion.segments[index]
    scene = motion.timeline.scene
    for beginning in segment_motion.beginnings:
        if beginning.reason is PathReason.REACH:
            continue  # the return of a solution is reported with the time without one
        if beginning.reason is PathReason.STEP and (index == 0 or segment_motion.segment.step == 0):
            continue
        after = _after(segment_motion, beginning)
        if after is None:
            continue
        carry = beginning.carry
        over = beginning.reason is PathReason.INEQUALITY
        seen = segment_motion.segment.visible if over else motion.segments[index - 1].segment.visible
        least = LEAST_JUMP * motion.size
        far, thing = _farthest(scene, carry.now, after, seen)
        travel = _travel_per_frame(motion, beginning)
        jumped: int | None = None
        if thing is not None and far > (least if over else max(FRAMES_OF_A_JUMP * travel, least)):
            jumped = thing
            yield Jump(beginning, thing, number(far), f"it moves {number(travel)} per frame there")
        turned, thing = _most_turned(scene, carry.now, after, seen)
        if thing is None or thing == jumped:
            continue
        before = carry.before
        turning = 0.0 if before is None else _turn(before, carry.now, thing) * _frames(motion, carry)
        if turned > (LEAST_JUMP if over else max(FRAMES_OF_A_JUMP * turning, LEAST_JUMP)):
            degrees = f"{number(float(np.degrees(turned)))} degrees"
            slow = number(float(np.degrees(turning)))
            yield Jump(beginning, thing, degrees, f"it turns {slow} degrees per frame there")


def _goes_there(segment_motion: SegmentMotion, beginning: PathBeginning) -> Iterator[Fix]:
    """What lets things move to where the statements of a step put them."""
    segment, scene = segment_motion.segment, segment_motion.plan.system.scene
    if beginning.reason is not PathReason.STEP:
        return
    places: list[tuple[int, str]] = []
    told = ""
    for constraint in segment.active:
        sides = constraint.left, constraint.right
        if constraint.step != segment.step or constraint.relation is not Relation.EQUAL:
            continue
        if not all(each.op == "symbol" for each in sides[0]) or any(each.value is None for each in sides[1]):
            continue
        equals = _EQUALS.match(scene.source.slice(Span(constraint.left_span.end, constraint.span.end)))
        now = beginning.carry.now.read(scene, sides[0], segment.start, {})
        if equals is None or all(
            abs(a - float(b.value or 0.0)) < LEAST_JUMP for a, b in zip(now, sides[1], strict=True)
        ):
            continue
        values = [number(each, DIGITS) for each in now]
        before = values[0] if len(values) == 1 else f"[{', '.join(values)}]"
        places.append((constraint.left_span.end + equals.end(), f"{before} -> "))
        statement = scene.source.slice(Span(constraint.left_span.start, constraint.span.end)).removesuffix(";")
        at = places[-1][0] - constraint.left_span.start
        told = told or f"{statement[:at]}{before} -> {statement[at:]};"
    if places:
        yield Fix(f"`{told}` moves there", tuple(Edit(Span(at, at), text) for at, text in places))


def _after(segment_motion: SegmentMotion, beginning: PathBeginning) -> Snapshot | None:
    """The pose in which a path begins; None if none does."""
    if beginning.selection.choices is None:
        return None
    piece = segment_motion.piece_from(beginning.time)
    if piece is None:
        return None
    from movimentum.solver.pose_assembly import snapshot

    state, _ = piece.solve(piece.instants(np.array([beginning.time])))
    return snapshot(segment_motion.plan, state, segment_motion.base.now, 0)


def _diagnostic(
    segment_motion: SegmentMotion, beginning: PathBeginning, thing: int, amount: str, note: str
) -> Diagnostic:
    scene = segment_motion.plan.system.scene
    name = scene.things[thing].name
    when = time_text(float(segment_motion.segment.start) + beginning.time)
    span: Span | None
    if beginning.reason is PathReason.INEQUALITY:
        selector = segment_motion.plan.system.selectors[beginning.selector or 0]
        constraint = selector.constraint if selector.constraint is not None else selector.equation_of
        span = next((c.span for c in segment_motion.segment.active if c.number == constraint), None)
        how = "the motion would violate this, so it switches to another solution"
        notes = ()
    else:
        span, how, notes = scene.steps[segment_motion.segment.step].span, "this step begins", (note,)
    return Diagnostic(
        code="solve/jump",
        severity=Severity.WARNING,
        message=f"`{name}` jumps {amount} at t = {when}, where {how}",
        span=span,
        notes=notes,
    )


def _most_turned(scene: Scene, before: Snapshot, after: Snapshot, things: frozenset[int]) -> tuple[float, int | None]:
    """The largest turn (radians, at most half a turn) of a thing that has one anchor or none, and that thing."""
    turns = [(_turn(before, after, t), t) for t in sorted(things) if _one_point(scene, t)]
    turned, thing = max(turns, key=lambda item: item[0], default=(0.0, None))
    return turned, thing


def _one_point(scene: Scene, thing: int) -> bool:
    body = scene.things[thing]
    return body.is_body and len({anchor.local for anchor in body.anchors}) < 2


def _turn(before: Snapshot, after: Snapshot, thing: int) -> float:
    """How far a thing turns between two moments, in radians from 0 to pi."""
    return abs(after.things[thing].turned_from(before.things[thing]))


def _farthest(scene: Scene, before: Snapshot, after: Snapshot, things: frozenset[int]) -> tuple[float, int | None]:
    """The longest way that an anchor goes between two moments, and its thing."""
    best, owner = 0.0, None
    for t in sorted(things):
        a, b = before.things[t], after.things[t]
        for anchor in scene.things[t].anchors:
            way = b.far_from(a, *anchor.local)
            if way > best:
                best, owner = way, t
    return best, owner


def _travel_per_frame(motion: PathMotion, beginning: PathBeginning) -> float:
    """How far the fastest anchor moves in a frame just before."""
    carry = beginning.carry
    if carry.before is None:
        return 0.0
    everything = frozenset(range(len(motion.timeline.scene.things)))
    return _farthest(motion.timeline.scene, carry.before, carry.now, everything)[0] * _frames(motion, carry)


def _frames(motion: PathMotion, carry: PoseState) -> float:
    """The length of a frame in units of the time between the carried moments."""
    return 1.0 / carry.span / float(motion.timeline.fps) if carry.span > 0.0 else 0.0


INSTANTS_EXAMINED = 16
"""Instants between beginning and end, to see whether anything moves at all."""


@dataclass(frozen=True, slots=True)
class _Difference:
    """How far a thing is at one instant from where it is at another: pixels, degrees, and what its looks differ by."""

    thing: Thing
    distance: float
    turn: float
    looks: float

    def amount(self, size: float) -> float:
        """In units of what still looks the same."""
        return max(self.distance / size, np.radians(abs(self.turn)), self.looks) / LOOKS_SAME


def film_loops(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for a film that could begin again at its end, a warning for one that does so with a jump."""
    timeline = motion.timeline
    scene, length = timeline.scene, timeline.end - timeline.start
    if not length:
        return
    times = [timeline.start + length * Fraction(k, INSTANTS_EXAMINED) for k in range(INSTANTS_EXAMINED + 1)]
    poses = motion.poses_at(times, angles=False)
    if not poses.solved.all():
        return
    things = [thing for thing in scene.things if thing.is_body and not thing.hidden]
    worst = _largest(poses, 0, INSTANTS_EXAMINED, things, motion.size)
    if scene.loop is not None:
        if worst is not None and worst.amount(motion.size) > 1.0:
            yield _seam(worst, motion)
        return
    if worst is None or worst.amount(motion.size) > 1.0:
        return
    moved = (_largest(poses, 0, k, things, motion.size) for k in range(1, INSTANTS_EXAMINED))
    if not any(each is not None and each.amount(motion.size) > 1.0 for each in moved):
        return  # a still picture
    last = scene.steps[-1].span
    yield Diagnostic(
        code="loop/possible",
        severity=Severity.NOTE,
        message="the film ends as it begins, so its last frame is the first one again",
        span=last,
    ).advised(insertion("`.loop;` in the last step makes it one film without end", last.end, " .loop;"))


def _seam(worst: _Difference, motion: PathMotion) -> Diagnostic:
    name = worst.thing.name
    parts: list[str] = []
    if worst.distance > LOOKS_SAME * motion.size:
        parts.append(f"{number(worst.distance)} pixels away")
    if np.radians(abs(worst.turn)) > LOOKS_SAME:
        parts.append(f"turned by {number(worst.turn)} degrees")
    if worst.looks > LOOKS_SAME:
        parts.append("of another colour, opacity or size, or not there")
    return Diagnostic(
        code="loop/seam",
        severity=Severity.WARNING,
        message=f"the film begins again with a jump: at its end, `{name}` is {' and '.join(parts)}",
        span=motion.timeline.scene.loop,
        notes=("compared with the first frame; full turns do not count",),
        helps=("end the film where everything is as in the first frame, or leave `.loop` out",),
    )


def _largest(poses: Poses, i: int, k: int, things: list[Thing], size: float) -> _Difference | None:
    found = [_difference(poses, i, k, thing) for thing in things]
    return max(found, key=lambda each: each.amount(size), default=None)


def _difference(poses: Poses, i: int, k: int, thing: Thing) -> _Difference:
    look()
    t = thing.number
    if not (poses.visible[t, i] and poses.visible[t, k]):
        switched = (t, "visible") in poses.properties  # which is at once wherever it is
        return _Difference(thing, 0.0, 0.0, float(poses.visible[t, i] != poses.visible[t, k] and not switched))
    points = [anchor.local for anchor in thing.anchors] or [(0.0, 0.0)]
    (c0, s0), (c1, s1) = poses.direction[t, i].tolist(), poses.direction[t, k].tolist()
    (x0, y0), (x1, y1) = poses.origin[t, i].tolist(), poses.origin[t, k].tolist()
    dx, dy, dc, ds = x1 - x0, y1 - y0, c1 - c0, s1 - s0
    distance = max(math.hypot(dx + dc * x - ds * y, dy + ds * x + dc * y) for x, y in points)
    turn = _seen_turn(thing, math.degrees(math.atan2(c0 * s1 - s0 * c1, c0 * c1 + s0 * s1)))
    looks = 0.0
    for (of, name), values in poses.properties.items():
        if of == t and name not in ("visible", "layer"):
            looks = max(looks, abs(float(values[k] - values[i])) / (1.0 if name in ("opacity", "scale") else 255.0))
    return _Difference(thing, distance, turn, looks)


def _seen_turn(thing: Thing, turn: float) -> float:
    """The visible part of a turn, in degrees: none for a round thing, less than a tooth for a gear.

    A second anchor may be where something else is, so things that have one must be back as they were.
    """
    if len(thing.anchors) > 1:
        return turn
    if thing.kind is DISC:
        return 0.0
    if thing.kind is GEAR:
        pitch = 360.0 / thing.toothed.teeth
        return turn - pitch * round(turn / pitch)
    return turn
