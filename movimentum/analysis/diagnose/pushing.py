"""Reports about pushing: jams, overlaps at the start, and when things touch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from movimentum.analysis.contact_events import ContactEvent, contact_events
from movimentum.analysis.diagnose.locations import constraint_of
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.expressions.walk import symbols
from movimentum.scene.model import AnchorCoordinate, Constraint, ThingAngle
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.pushing.overlap_removal import FreePlace
from movimentum.solver.pushing.phases import MOST_EVENTS
from movimentum.solver.pushing.tracks import EventKind, PushEnd, PushTrack
from movimentum.solver.segment_motion import Failure, FailureKind, SegmentMotion
from movimentum.solver.start.early_checks import Rejection
from movimentum.text import counted, listed, number, time_text
from movimentum.tolerances import SAME_INSTANT

TIMES_SHOWN = 6
"""So many times are listed."""


def push_failure(motion: PathMotion, segment_motion: SegmentMotion, failure: Failure) -> tuple[Diagnostic, int] | None:
    """The diagnostic for a motion that ends where something pushes, and the exit code; None for any other trouble."""
    if failure.kind is FailureKind.SELECTOR and failure.selector is not None:
        selector = segment_motion.plan.system.selectors[failure.selector]
        found = constraint_of(segment_motion, selector.constraint)
        if not selector.pushes or found is None:
            return None
        return _driven(segment_motion, found, failure.begin), 3
    rejected = () if failure.selection is None else failure.selection.rejections
    for rejection in rejected:
        if rejection.selector is not None and (found := _driven_overlap(segment_motion, rejection, failure)):
            return found, 1
    track = _track_of(segment_motion, failure)
    if track is None:
        return None
    said = [(constraint_of(segment_motion, n), things) for n, things in track.jammed]
    stated = [constraint for constraint, _ in said if constraint is not None]
    when = _at(segment_motion, failure.begin)
    match track.end:
        case PushEnd.OVERLAP:
            return _overlap(segment_motion, track, when), 1
        case PushEnd.CONTRADICTION:
            first = segment_motion.segment.step == 0
            return _contradiction(stated, when, first=first), 1 if first else 3
        case PushEnd.JAM:
            names = _names(motion, [things for _, things in said])
            return _jam(track, stated, names, when), 3
        case PushEnd.BUDGET:
            return _accumulated(motion, segment_motion, track, when), 3
        case _:
            return None


def _at(segment_motion: SegmentMotion, tau: float) -> str:
    start, end = float(segment_motion.segment.start), float(segment_motion.segment.end)
    return time_text(start if tau <= SAME_INSTANT * (end - start) else start + tau)


def _track_of(segment_motion: SegmentMotion, failure: Failure) -> PushTrack | None:
    if failure.kind is not FailureKind.GAP or failure.block is None:
        return None
    for piece in segment_motion.pieces:
        if isinstance(piece, Piece) and piece.begin <= failure.begin <= max(piece.end, failure.begin):
            track = piece.tracks[failure.block]
            if isinstance(track, PushTrack) and track.end is not PushEnd.NONE:
                return track
    return None


def _names(motion: PathMotion, pairs: Sequence[tuple[int, int] | None]) -> list[str]:
    things = motion.timeline.scene.things
    return list(dict.fromkeys(f"`{things[t].name}`" for pair in pairs if pair is not None for t in pair))


def _driven(segment_motion: SegmentMotion, constraint: Constraint, tau: float) -> Diagnostic:
    """The error for two driven sides: nothing can give way."""
    when = _at(segment_motion, tau)
    scene = segment_motion.plan.system.scene
    names = [f"`{scene.things[side.thing].name}`" for pair in constraint.gaps[:1] for side in pair]
    who = f"{listed(names)} bind" if names else "it binds"
    notes, helps = _stays(segment_motion, constraint)
    return Diagnostic(
        code="solve/binds",
        severity=Severity.ERROR,
        message=f"{who} at t = {when}: nothing that this could push is free",
        span=constraint.span,
        notes=notes or ("everything in it is driven by equations",),
        helps=(*helps, "leave one of these equations out, or drive one thing less far"),
    )


def _driven_overlap(segment_motion: SegmentMotion, rejection: Rejection, failure: Failure) -> Diagnostic | None:
    """The error for driven things that overlap as they begin to push."""
    selector = segment_motion.plan.system.selectors[rejection.selector or 0]
    constraint = constraint_of(segment_motion, selector.constraint)
    if not selector.pushes or constraint is None or not constraint.gaps:
        return None
    things = segment_motion.plan.system.scene.things
    one, other = (things[side.thing].name for side in constraint.gaps[0])
    by = f" by {number(abs(rejection.amount))}" if np.isfinite(rejection.amount) else ""
    notes, helps = _stays(segment_motion, constraint)
    return Diagnostic(
        code="contact/start",
        severity=Severity.ERROR,
        message=f"`{one}` and `{other}` overlap{by} at t = {_at(segment_motion, failure.begin)}, as they push",
        span=constraint.span,
        notes=notes or ("everything in it is driven by equations, so that nothing can give way",),
        helps=("draw or drive one of them elsewhere", *helps),
    )


def _stays(segment_motion: SegmentMotion, push: Constraint) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Which things of a push stay as they are drawn, for no statement moves them; and what lets them give way."""
    stated = [
        leaf
        for constraint in segment_motion.segment.active
        if not constraint.gaps
        for leaf in symbols(*constraint.left, *constraint.right)
    ]
    about = {leaf.thing for leaf in stated if isinstance(leaf, AnchorCoordinate | ThingAngle)}
    things = segment_motion.plan.system.scene.things
    still = [things[t] for t in dict.fromkeys(side.thing for pair in push.gaps for side in pair) if t not in about]
    notes = tuple(f"`{thing.name}` stays as it is drawn: a gap alone frees nothing" for thing in still)
    helps = (f"`{thing.name}.{thing.anchors[0].name} = [_, _];` lets `{thing.name}` give way" for thing in still)
    return notes, tuple(helps)


def _jam(track: PushTrack, stated: Sequence[Constraint], names: Sequence[str], when: str) -> Diagnostic:
    who = f"{listed(names)} jam" if len(names) > 1 else "it jams"
    return Diagnostic(
        code="solve/binds",
        severity=Severity.ERROR,
        message=f"{who} at t = {when}: from then on nothing that they push can give way",
        span=stated[-1].span if stated else None,
        labels=tuple(Label(constraint.span, "pushes against it") for constraint in stated[:-1]),
        notes=(f"the loop that jams has {counted(len(track.jammed), 'contact')}, and what drives it",),
        helps=("let one of these things yield, drive it less far, or end one of these statements with `_`",),
    )


def _contradiction(stated: Sequence[Constraint], when: str, *, first: bool) -> Diagnostic:
    return Diagnostic(
        code="constraint/conflict" if first else "solve/binds",
        severity=Severity.ERROR,
        message=f"no pose satisfies {counted(len(stated), 'inequality', 'inequalities')} that push at t = {when}",
        span=stated[-1].span if stated else None,
        labels=tuple(Label(constraint.span, "against this") for constraint in stated[:-1]),
        helps=("change or drop one of them",),
    )


def _overlap(segment_motion: SegmentMotion, track: PushTrack, when: str) -> Diagnostic:
    found = track.overlaps[0]
    scene = segment_motion.plan.system.scene
    one, other = (scene.things[t] for t in found.things)
    constraint = constraint_of(segment_motion, found.push)
    free = [_place(segment_motion, each) for each in track.free[:TIMES_SHOWN]]
    known = "what pushes never lets things overlap"
    return Diagnostic(
        code="contact/start",
        severity=Severity.ERROR,
        message=f"`{one.name}` and `{other.name}` overlap by {number(found.depth)} at t = {when}, as they push",
        span=None if constraint is None else constraint.span,
        labels=(Label(one.name_span, f"`{one.name}`"), Label(other.name_span, f"`{other.name}`")),
        notes=(known,) if free else (known, "no pose was found that is free and keeps the equations"),
        helps=(f"it is free with {listed(free)}: draw it there" if free else "draw them apart, or free more things",),
    )


def _place(segment_motion: SegmentMotion, place: FreePlace) -> str:
    system = segment_motion.plan.system
    thing = system.scene.things[place.thing]
    x, y = (number(v + s, 9) for v, s in zip(place.place, system.shift, strict=True))
    at = [f"`{thing.name}.{thing.anchors[0].name}` at [{x}, {y}]"] if place.moves else []
    return listed([*at, *([f"`{thing.name}.angle` at {number(place.turn, 9)}"] if place.turns else [])])


def _accumulated(motion: PathMotion, segment_motion: SegmentMotion, track: PushTrack, when: str) -> Diagnostic:
    last = track.events[-1] if track.events else None
    constraint = None if last is None else constraint_of(segment_motion, last.push)
    names = _names(motion, [None if last is None else last.things])
    who = f"between {listed(names)} " if names else ""
    return Diagnostic(
        code="limit/contacts",
        severity=Severity.ERROR,
        message=f"contacts {who}begin and end again and again at t = {when}; what comes after was not looked at",
        span=None if constraint is None else constraint.span,
        notes=(f"at most {MOST_EVENTS:,} events of a step are followed, and no endless series of them",),
        helps=("wishes that pull against each other cause this: make one of them `.weak`, or `.weak(2)`",),
    )


def undecided_contacts(motion: PathMotion) -> Iterator[Diagnostic]:
    """A warning for each pair whose corners meet so that it is a matter of chance how they go on."""
    scene = motion.timeline.scene
    spans = {item.number: item.span for item in scene.constraints()}
    times: dict[tuple[int, tuple[int, int] | None], list[float]] = {}
    for event in contact_events(motion):
        if event.kind is EventKind.UNDECIDED:
            times.setdefault(event.pair, []).append(event.time)
    for (push, things), when in times.items():
        names = listed([f"`{scene.things[t].name}`" for t in things or ()])
        first, *rest = map(time_text, when)
        again = (f"again at t = {', '.join(rest[:TIMES_SHOWN])}",) if rest else ()
        yield Diagnostic(
            code="contact/undecided",
            severity=Severity.WARNING,
            message=f"corners of {names} meet at t = {first}, and may pass on either side of each other",
            span=spans.get(push),
            notes=(*again, "the film shows one of the two; what follows depends on it"),
            helps=("draw one of them a little to the side on which it should pass",),
        )


def contact_notes(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for each pair that comes to touch, and for each that parts."""
    scene = motion.timeline.scene
    spans = {item.number: item.span for item in scene.constraints()}
    grouped: dict[tuple[EventKind, int, tuple[int, int] | None], list[ContactEvent]] = {}
    for event in contact_events(motion):
        if event.kind in (EventKind.BEGINS, EventKind.ENDS):
            grouped.setdefault((event.kind, *event.pair), []).append(event)
    for (happening, push, things), events in grouped.items():
        names = None if things is None else [f"`{scene.things[t].name}`" for t in things]
        first, *rest = [time_text(event.time) for event in events]
        begins = happening is EventKind.BEGINS
        if names is None:
            message = f"this takes effect from t = {first} on" if begins else f"this has no effect from t = {first} on"
        else:
            message = f"{listed(names)} touch from t = {first} on" if begins else f"{listed(names)} part at t = {first}"
        notes: tuple[str, ...] = ()
        if rest:
            more = len(rest) - TIMES_SHOWN
            notes = (
                f"again at t = {', '.join(rest[:TIMES_SHOWN])}" + (f", and {more} times more" if more > 0 else ""),
            )
        yield Diagnostic(
            code=f"contact/{happening}",
            severity=Severity.NOTE,
            message=message,
            span=spans.get(push),
            notes=notes,
        )
