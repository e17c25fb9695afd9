"""Things that no statement mentions: nothing is said about a backdrop, but a part that was forgotten is reported."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.scene.model import Scene, Thing
from movimentum.solver.motion import PathMotion
from movimentum.text import listed
from movimentum.tolerances import AT_ONE_PLACE, MOVED_AWAY

MOST_NOTES = 8
"""Up to this many things have a note each; more are reported together."""
SOON = Fraction(1, 16)
"""Of the film: by this time, a joint that leaves a thing behind has moved."""


def forgotten(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for each thing that no statement mentions and that nevertheless looks like a part.

    It looks like one if its name is like that of a mentioned thing (`Rod2` beside `Rod1`), or if one of its anchors is
    drawn where an anchor of another thing begins and then moves away at once.
    """
    scene = motion.timeline.scene
    still = [thing for thing in scene.things if thing.is_body and thing.number not in scene.mentioned]
    if not still:
        return
    left = _left_behind(motion, still)
    found = [(thing, why) for thing in still if (why := _namesake(scene, thing) or left.get(thing.number))]
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


def _namesake(scene: Scene, thing: Thing) -> str | None:
    """Why a thing's name says that it is a part: numbered or spelled like a mentioned thing."""

    def stem(name: str) -> str:
        return re.sub(r"_?\d+$", "", name).lower()

    for other in scene.things:
        if other.number not in scene.mentioned:
            continue
        if stem(other.name) == stem(thing.name):
            return f"the similarly named `{other.name}` is mentioned: was `{thing.name}` forgotten?"
    return None


def _left_behind(motion: PathMotion, still: list[Thing]) -> dict[int, str]:
    """By thing number: why it looks as if it should have moved with another thing's anchor."""
    timeline = motion.timeline
    scene = timeline.scene
    names: list[str] = []
    paths: list[FloatArray] = []
    poses = motion.poses_at([timeline.start, timeline.start + (timeline.end - timeline.start) * SOON])
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
