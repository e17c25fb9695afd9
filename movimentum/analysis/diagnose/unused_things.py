"""Reports things that no statement mentions, and looks that are never seen."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.scene.model import Scene, Thing
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import VISIBLE_FROM, Poses
from movimentum.text import listed, number
from movimentum.things.kinds.trace import TRACE
from movimentum.tolerances import AT_ONE_PLACE, LOOKS_SAME, MOVED_AWAY

MOST_NOTES = 8
"""Up to this many things have a note each; more are reported together."""
MOVED_BY = Fraction(1, 16)
"""Of the film: by this time, a joint that leaves a thing behind has moved."""


def unmentioned_things(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for each thing that no statement mentions and that nevertheless looks like a part.

    It looks like one if its name is like that of a mentioned thing (`Rod2` beside `Rod1`), or if one of its anchors is
    drawn where an anchor of another thing begins and then moves away at once.
    """
    scene = motion.timeline.scene
    still = [thing for thing in scene.things if thing.is_body and thing.number not in scene.mentioned]
    if not still:
        return
    left = _things_left_behind(motion, still)
    found = [(thing, why) for thing in still if (why := _similar_name(scene, thing) or left.get(thing.number))]
    if len(found) > MOST_NOTES:
        yield Diagnostic(
            code="constraint/free-motion",
            severity=Severity.NOTE,
            message=f"no constraint mentions {listed([f'`{thing.name}`' for thing, _ in found], 4)};"
            " they stay where they are drawn",
            span=found[0][0].name_span,
        )
        return
    for thing, why in found:
        yield Diagnostic(
            code="constraint/free-motion",
            severity=Severity.NOTE,
            message=f"no constraint mentions `{thing.name}`; it stays where it is drawn",
            span=thing.name_span,
            notes=(why,),
        )


def _similar_name(scene: Scene, thing: Thing) -> str | None:
    """Why a thing's name says that it is a part: numbered or spelled like a mentioned thing."""

    def stem(name: str) -> str:
        return re.sub(r"_?\d+$", "", name).lower()

    for other in scene.things:
        if other.number not in scene.mentioned:
            continue
        if stem(other.name) == stem(thing.name):
            return f"the similarly named `{other.name}` is mentioned: was `{thing.name}` forgotten?"
    return None


def _things_left_behind(motion: PathMotion, still: list[Thing]) -> dict[int, str]:
    """By thing number: why it looks as if it should have moved with another thing's anchor."""
    timeline = motion.timeline
    scene = timeline.scene
    names: list[str] = []
    paths: list[FloatArray] = []
    poses = motion.poses_at([timeline.start, timeline.start + (timeline.end - timeline.start) * MOVED_BY])
    for thing in scene.things:
        if thing.number in scene.mentioned and thing.is_body and poses.visible[thing.number, 0]:
            for anchor in thing.anchors:
                names.append(f"{thing.name}.{anchor.name}")
                paths.append(poses.world(thing.number, anchor.local))
    if not names:
        return {}
    starts = np.array([path[0] for path in paths])
    leaves = np.array([float(np.hypot(*(path[1] - path[0]))) > MOVED_AWAY * motion.size for path in paths])
    found: dict[int, str] = {}
    for thing in still:
        for anchor in thing.anchors:
            touched = np.nonzero(leaves & (np.hypot(*(starts - anchor.local).T) <= AT_ONE_PLACE * motion.size))[0]
            if len(touched):
                found.setdefault(
                    thing.number,
                    f"`{thing.name}.{anchor.name}` is drawn where `{names[int(touched[0])]}` begins, which leaves it"
                    " behind: was it forgotten?",
                )
    return found


FRAMES_EXAMINED = 400
"""Frames that are looked at."""


def unseen_looks(motion: PathMotion) -> Iterator[Diagnostic]:
    """Warnings about things that are never seen, negative scales and pens that are never down; a note about what is
    neither visible nor invisible.
    """
    timeline, scene = motion.timeline, motion.timeline.scene
    pens = [thing for thing in scene.things if thing.kind is TRACE and thing.values and not thing.hidden]
    if not pens and not scene.changes("visible") and not scene.changes("scale"):
        return
    count = timeline.frame_count
    times = [timeline.frame_time(frame) for frame in range(0, count, max(1, count // FRAMES_EXAMINED))]
    poses = motion.poses_at(times)
    for of, name in sorted(scene.changing):
        thing, values = scene.things[of], poses.properties.get((of, name))
        if values is None:
            continue
        if name == "visible":
            yield from _visibility(thing, values, poses)
        if name == "scale" and (values < 0.0).any():
            first = int(np.argmax(values < 0.0))
            by, at = number(float(values[first])), number(float(poses.times[first]))
            yield Diagnostic(
                "look/scale",
                Severity.WARNING,
                f"`{thing.name}` is scaled by {by} at t = {at}, and is not drawn",
                thing.span,
            ).advised("a thing is never mirrored: its scale is 0 or more")
    for thing in pens:
        from movimentum.analysis.shown_numbers import shown_values  # few films have a pen that lifts

        rows = shown_values(motion, thing, poses, times)
        if not np.logical_and.reduce([row >= VISIBLE_FROM for row in rows.values()]).any():
            yield Diagnostic(
                "look/pen", Severity.WARNING, f"`{thing.name}` draws nothing: its `.while` never holds", thing.span
            ).advised("its conditions must all be true, or 1, for the pen to be down")


def _visibility(thing: Thing, values: FloatArray, poses: Poses) -> Iterator[Diagnostic]:
    if not (values >= VISIBLE_FROM).any() or not (thing.kind.gathers or poses.visible[thing.number].any()):
        first = int(np.argmax(values < VISIBLE_FROM))
        yield Diagnostic(
            "look/never-seen",
            Severity.WARNING,
            f"`{thing.name}` is never seen",
            thing.span,
            notes=(f"`{thing.name}.visible` is {number(float(values[first]))} from the step that first mentions it",),
        ).advised(f"state `{thing.name}.visible = 1;` in an earlier step, or write `.hidden` in its definition")
        return
    between = np.abs(values - np.rint(np.clip(values, 0.0, 1.0))) > LOOKS_SAME
    if between.any():
        first = int(np.argmax(between))
        yield Diagnostic(
            "look/between",
            Severity.NOTE,
            f"`{thing.name}.visible` is {number(float(values[first]))} at t = {number(float(poses.times[first]))}: "
            f"a thing is seen from {VISIBLE_FROM:g} on, and else not",
            thing.span,
        ).advised(f"to fade it, state `{thing.name}.opacity`")
