"""The profiles that things cut into each other over a film: from exact poses and rates to outlines."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, add, call, mul, sub, symbol
from movimentum.memo import Memo
from movimentum.outlines.contour import Contour
from movimentum.outlines.envelope import NO_POSES, EnvelopeRun, ToolPoses, envelope
from movimentum.outlines.profile import Profile, cut_profile
from movimentum.outlines.shapes import circle_outline
from movimentum.outlines.swept_regions import SweptOutline, SweptOutlines
from movimentum.planning.lowering.unknowns import PoseX, PoseY
from movimentum.planning.structure.rates import RateError
from movimentum.records import dataclass, replace
from movimentum.scene.cutting import CutJob, CutProfile
from movimentum.scene.model import AnchorCoordinate, Scene, Thing, ThingAngle
from movimentum.scene.outlines import Circle, outer_rings
from movimentum.solver.edited_parts import connected_parts_of
from movimentum.solver.motion import PathMotion
from movimentum.solver.rates.rates import UndefinedRate, rates_up_to
from movimentum.solver.segment_motion import UnsolvedInterval
from movimentum.solver.solver import solve
from movimentum.solver.solver_cache import scene_key, segment_key, thing_key
from movimentum.solver.undercut import fitting_radius, required_offset
from movimentum.timeline.arrange import arrange
from movimentum.timeline.model import Timeline

SCENES_KEPT = 16
"""Scenes after which a profile that none of them has asked for is forgotten."""
_PROFILES = Memo(SCENES_KEPT)


def carve(scene: Callable[[], Scene], jobs: Sequence[CutJob]) -> list[CutProfile]:
    """The profile of each of ``jobs``; see `scene.cutting`. It depends on what is connected with the tool and the
    frame: where nothing of that is stated otherwise, it is found once.
    """
    made = scene()
    timeline = arrange(made)
    text = made.source.text
    numbers = {thing.name: thing for thing in made.things}
    motions: dict[Hashable, PathMotion] = {}
    _PROFILES.begin()
    found: list[CutProfile] = []
    for job in jobs:
        tool, frame = numbers.get(job.tool), numbers.get(job.frame)
        outlines = () if tool is None else outer_rings(tool)
        if tool is None or frame is None or not outlines or not frame.anchors:
            found.append(CutProfile(fault="its motion depends on the profile"))
            continue
        part = timeline
        things: Hashable = scene_key(made)
        if (own := connected_parts_of(made, timeline.segments, (tool.number, frame.number))) is not None:
            part = replace(timeline, segments=tuple(own[0]))
            things = tuple(thing_key(thing, text) for thing in own[1])
        stated: Hashable = things, tuple(segment_key(0, each, text) for each in part.segments)

        def solved(part: Timeline = part, stated: Hashable = stated) -> PathMotion:
            if stated not in motions:
                motions[stated] = solve(part)
            return motions[stated]

        key: Hashable = stated, outlines, job
        profile = _PROFILES.get("profile", key)
        if profile is None:
            profile = _PROFILES.keep("profile", key, _cut(part, solved, outlines, tool, frame, job))
        found.append(profile)
    return found


def _cut(
    timeline: Timeline,
    solved: Callable[[], PathMotion],
    outlines: Sequence[Contour | Circle],
    tool: Thing,
    frame: Thing,
    job: CutJob,
) -> CutProfile:
    try:
        motion = solved()
        if job.needed and _is_free(motion, tool):
            return CutProfile(fault=f"`{tool.name}` is moved by nothing but the profile")
        alone = outlines[0] if len(outlines) == 1 else None
        relative_motion = RelativeMotion(motion, tool, frame, round_=isinstance(alone, Circle))
        cutting = _CutFilm(relative_motion, _smooth_parts(motion), job.outer)
        shapes = [circle_outline(each.radius) if isinstance(each, Circle) else each for each in outlines]
        made = cutting.profile(shapes, alone.radius if isinstance(alone, Circle) else None)
    except (RateError, UndefinedRate):
        return CutProfile(fault="the motion has no velocities")
    if made is None:
        return CutProfile(fault=cutting.fault)
    turned = made.outline.changed(hollow=True) if cutting.outside else made.outline
    if not made.corners:
        return CutProfile(turned)
    first = min(made.corners, key=lambda corner: corner.time)
    x, y = frame.anchors[0].local
    place = x + first.place[0], y + first.place[1]
    radius = away = None
    if isinstance(alone, Circle):
        radius = fitting_radius(relative_motion, cutting.film, alone.radius, outer=job.outer)
    elif alone is not None:
        away = required_offset(relative_motion, cutting.film, tool, alone)
    return CutProfile(turned, time=first.time, place=place, radius=radius, farther=away)


def _is_free(motion: PathMotion, tool: Thing) -> bool:
    """Whether nothing determines how a thing moves."""
    for segment_motion in motion.segments:
        unknowns = segment_motion.plan.system.unknowns
        for block in segment_motion.plan.blocks:
            found = [unknowns[each].payload for each in block.unknowns] if block.moves_least else []
            if any(isinstance(each, PoseX | PoseY) and each.thing == tool.number for each in found):
                return True
    return False


def _smooth_parts(motion: PathMotion) -> list[tuple[Fraction, Fraction]]:
    """From when to when the motion is smooth."""
    found: list[tuple[Fraction, Fraction]] = []
    for segment_motion in motion.segments:
        start, end = segment_motion.segment.start, min(segment_motion.segment.end, motion.timeline.end)
        for piece in segment_motion.pieces:
            if not isinstance(piece, UnsolvedInterval):
                begin, last = start + Fraction(piece.begin), min(start + Fraction(piece.end), end)
                if last > begin:
                    found.append((begin, last))
    return found


class RelativeMotion:
    """How a tool moves in the frame of another thing; of a round one it does not matter how it turns."""

    def __init__(self, motion: PathMotion, tool: Thing, frame: Thing, *, round_: bool) -> None:
        self.motion, self.round = motion, round_
        place = [symbol(AnchorCoordinate(tool.number, 0, axis)) for axis in (0, 1)]
        origin = [symbol(AnchorCoordinate(frame.number, 0, axis)) for axis in (0, 1)]
        angle = symbol(ThingAngle(frame.number))
        c, s = call("cosd", angle), call("sind", angle)
        dx, dy = (sub(a, b) for a, b in zip(place, origin, strict=True))
        self.place: list[Expr] = [add(mul(c, dx), mul(s, dy)), sub(mul(c, dy), mul(s, dx))]
        self.turn = sub(symbol(ThingAngle(tool.number)), angle)

    def rates(self, times: Sequence[Fraction], order: int) -> FloatArray:
        """(order + 1, 3, N): x, y and the angle (in radians), and their rates up to ``order``."""
        asked = self.place if self.round else [*self.place, self.turn]
        found = rates_up_to(self.motion, asked, order, times)
        if self.round:
            return np.concatenate([found, np.zeros((order + 1, 1, len(times)))], axis=1)
        return found * np.array([1.0, 1.0, math.pi / 180.0])[:, None]

    def __call__(self, times: Sequence[Fraction]) -> FloatArray:
        """See `outlines.envelope.ToolMotion`."""
        try:
            place, rate, faster = self.rates(times, 2)
        except UndefinedRate:
            place, rate = self.rates(times, 1)
            faster = np.full((3, len(times)), np.nan)
        x, y, turn = place
        return np.stack([x, y, np.cos(turn), np.sin(turn), *rate, *faster])


@dataclass(slots=True, eq=False)
class _CutFilm:
    relative_motion: RelativeMotion
    parts: list[tuple[Fraction, Fraction]]
    outer: bool
    fault: str = ""
    outside: bool = False
    """Whether what is left is outside of the profile."""
    film: ToolPoses = NO_POSES
    """Where the tool comes."""

    def profile(self, tools: Sequence[Contour], radius: float | None) -> Profile | None:
        runs: list[EnvelopeRun] = []
        swept: list[SweptOutline] = []
        for tool in tools:
            some, self.film = envelope(tool, self.parts, self.relative_motion, max([0, *(run.branch for run in runs)]))
            runs += some
            swept.append(SweptOutline(tool, self.film.poses, radius))
        if not swept[0].poses.shape[1]:
            self.fault = "the film has no motion" if not self.parts else "the motion has no solution"
            return None
        if not runs:
            self.fault = "the tool rests in what it cuts"
            return None
        made = cut_profile(runs, SweptOutlines(tuple(swept)), outer=self.outer)
        if made is None:
            self.fault = "the tool goes over all of it"
        else:
            self.outside = made.outer and made.outline.closed
        return made
