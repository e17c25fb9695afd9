"""What statements about looks say that nobody means: things that are never seen, values that are neither yes nor no."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.scene.model import Thing
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import SEEN, Poses
from movimentum.text import number
from movimentum.things.kinds.motion import TRACE
from movimentum.tolerances import LOOKS_SAME

LOOKED_AT = 400
"""Frames that are looked at."""


def odd_looks(motion: PathMotion) -> Iterator[Diagnostic]:
    """Warnings about things that are never seen, negative scales and pens that are never down; a note about what is
    neither visible nor invisible.
    """
    timeline, scene = motion.timeline, motion.timeline.scene
    pens = [thing for thing in scene.things if thing.kind is TRACE and thing.values and not thing.hidden]
    if not pens and not scene.changes("visible") and not scene.changes("scale"):
        return
    count = timeline.frame_count
    times = [timeline.frame_time(frame) for frame in range(0, count, max(1, count // LOOKED_AT))]
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
        from movimentum.analysis.live import shown_values  # few films have a pen that lifts

        rows = shown_values(motion, thing, poses, times)
        if not np.logical_and.reduce([row >= SEEN for row in rows.values()]).any():
            yield Diagnostic(
                "look/pen", Severity.WARNING, f"`{thing.name}` draws nothing: its `.while` never holds", thing.span
            ).advised("its conditions must all be true, or 1, for the pen to be down")


def _visibility(thing: Thing, values: FloatArray, poses: Poses) -> Iterator[Diagnostic]:
    if not (values >= SEEN).any() or not (thing.kind.gathers or poses.visible[thing.number].any()):
        first = int(np.argmax(values < SEEN))
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
            f"a thing is seen from {SEEN:g} on, and else not",
            thing.span,
        ).advised(f"to fade it, state `{thing.name}.opacity`")
