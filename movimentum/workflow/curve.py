"""`curve`: the equation of the path of a point."""

from __future__ import annotations

import time
from fractions import Fraction
from itertools import count
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.errors import script_error
from movimentum.expressions import symbol
from movimentum.workflow.choices import Choices, Outcome
from movimentum.workflow.stages import arranged, solved, understand

if TYPE_CHECKING:
    from pathlib import Path

    from movimentum.proving.curve import PathCurve
    from movimentum.scene.model import Scene
    from movimentum.source import SourceText

MOST_POINTS = 300
"""Of one line in the picture of a curve."""
SHARES = (0.37, 0.61, 0.137, 0.829)


def curve(source: SourceText, choices: Choices, anchor: str, seconds: float) -> PathCurve:
    """The curve on which an anchor (``Thing.P``) moves in the script's first moving step.

    Raises `ScriptError` for an unknown name, and (``curve/unknown``) where no equation was found, with the reason.
    """
    from movimentum.proving.balls import NoBall, as_float, over
    from movimentum.proving.curve import OutOfTime, curve_of
    from movimentum.proving.film import lowered
    from movimentum.proving.intervals import chain_of
    from movimentum.proving.rings import TooMuch
    from movimentum.proving.tower import NotAlgebraic
    from movimentum.scene.model import AnchorCoordinate

    end = time.monotonic() + seconds
    scene = understand(source, choices)
    name, _, spot = anchor.rpartition(".")
    thing = next((each for each in scene.things if each.name == name and each.is_body), None)
    if thing is None:
        known = next((each.name for each in scene.things if each.is_body and each.anchors), None)
        raise script_error("name/unknown-thing", f"there is no `{name or anchor}`", f"for instance `{known}`")
    number = next((k for k, each in enumerate(thing.anchors) if each.name == spot), None)
    if number is None:
        names = ", ".join(f"`{name}.{each.name}`" for each in thing.anchors)
        raise script_error("name/unknown-anchor", f"`{name}` has no anchor `{spot}`", f"it has {names}")
    motion = solved(arranged(scene, choices), choices).motion.path
    segment = next((s for s in motion.segments if s.segment.start < s.segment.end), motion.segments[0])
    length = float(segment.segment.end - segment.segment.start)
    wanted = [symbol(AnchorCoordinate(thing.number, number, axis)) for axis in (0, 1)]
    more = Advised(f"`movimentum curve SCRIPT {anchor} ", Choose.SECONDS.to(), f" {4 * seconds:g}`")
    draws = Advised("`movimentum run SCRIPT ", Choose.TRACE.to(), f" {anchor}` draws it")
    helps = (more,)
    reason: str = Advised("it takes too long; `", Choose.SECONDS.to(), "` gives more time")
    for share in SHARES:
        try:
            spots = lowered(segment, wanted)
            chain = chain_of(segment, spots, share * length, accelerated=None, given={})
            x, y = (chain.lowering.value(each) for each in spots)
            chain.point.settle()
            here = [as_float(over(chain.point.at(each.top), chain.point.at(each.bottom))) for each in (x, y)]
            return curve_of(chain, x, y, here, end)
        except NoBall as special:
            reason, helps = special.reason, (draws,)
        except OutOfTime as late:
            reason = Advised(f"it takes more than {seconds:g} s; `", Choose.SECONDS.to(), "` gives more time")
            reason += f" ({late})" if str(late) else ""
            helps = (more,)
            break
        except (NotAlgebraic, TooMuch) as error:
            reason, helps = str(error) or "it takes too much work", (draws,)
            break
    message = f"no equation was found for the path of `{anchor}`: {reason}"
    raise script_error("curve/unknown", message, *helps)


def draw_curve(source: SourceText, choices: Choices, anchor: str, found: PathCurve, target: Path) -> Outcome:
    """A still of the film with the curve and, over it, the path of the anchor."""
    from movimentum.proving.zero_lines import zero_lines
    from movimentum.source import SourceText
    from movimentum.workflow.animate import animate
    from movimentum.workflow.choices import Picture

    scene = understand(source, choices)
    size = scene.config.size
    box = (0.0, 0.0, float(size[0]), float(size[1])) if size else _about(scene, choices, anchor)
    names = {thing.name for thing in scene.things}
    lines = [
        line[k : k + MOST_POINTS + 1]
        for line in zero_lines(found.equation, box)
        for k in range(0, len(line) - 1, MOST_POINTS)
    ]
    made = [f".line {' '.join(f'[{x:.2f},{y:.2f}]' for x, y in line)} .color('crimson') .width(1.2)" for line in lines]
    made.append(f".trace {anchor} .whole .color('steelblue')")
    free = (name for name in (f"Curve{k}" for k in count(1)) if name not in names)
    text = "\n".join(f"{next(free)} : {one};" for one in made)
    place = scene.steps[0].span.start
    drawn = SourceText(source.path, f"{source.text[:place]}{text}\n{source.text[place:]}")
    return animate(drawn, target, choices, Picture(at=Fraction(0)), lambda done, of: None)


def _about(scene: Scene, choices: Choices, anchor: str) -> tuple[float, float, float, float]:
    """A box about the path of an anchor, with room for the rest of its curve."""
    motion = solved(arranged(scene, choices), choices).motion
    name, _, spot = anchor.rpartition(".")
    thing = next(each for each in scene.things if each.name == name)
    place = next(each.local for each in thing.anchors if each.name == spot)
    path = motion.poses(0, motion.timeline.frame_count).world(thing.number, place).reshape(-1, 2)
    low, high = path.min(axis=0), path.max(axis=0)
    room = 0.25 * float((high - low).max()) + 1.0
    return float(low[0]) - room, float(low[1]) - room, float(high[0]) + room, float(high[1]) + room
