"""The profiles that things cut into each other over a film: from exact poses and rates to outlines."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.expressions import Expr, add, call, mul, sub, symbol
from movimentum.memo import Memo
from movimentum.outlines.contour import Contour
from movimentum.outlines.envelope import EnvelopeRun, envelope
from movimentum.outlines.profile import Profile, profile
from movimentum.outlines.shapes import circle
from movimentum.outlines.swept import SweptOutline, SweptOutlines
from movimentum.planning.blocks.kinds import Free
from movimentum.planning.lowering.unknowns import PoseX, PoseY
from movimentum.planning.structure.rates import RateError
from movimentum.records import dataclass, replace
from movimentum.scene.cutting import CutJob, CutProfile
from movimentum.scene.model import AnchorCoordinate, Scene, Thing, ThingAngle
from movimentum.scene.outlines import Circle, outer_rings
from movimentum.solver.motion import PathMotion
from movimentum.solver.rates.rates import UndefinedRate, rates_at
from movimentum.solver.reuse import scene_key, segment_key, thing_key
from movimentum.solver.segment_motion import Unsolved
from movimentum.solver.solver import solve
from movimentum.solver.touched import connected
from movimentum.timeline.arrange import arrange
from movimentum.timeline.model import Timeline
from movimentum.tolerances import CUT_ALONG, CUT_CURVED, CUT_WOULD_DO

KEPT = 16
"""Scenes after which a profile that none of them has asked for is forgotten."""
_PROFILES = Memo(KEPT)
INSTANTS = 4000
"""Of a film at which curvatures are asked for, where a profile is undercut."""
COARSE = 4
"""One of so many of these stands for the others, where the way comes near itself."""
CROSSING = 4.0
"""Instants: where there is less room than the way between so many, the way crosses itself."""


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
        if (own := connected(made, timeline.segments, (tool.number, frame.number))) is not None:
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
        course = RelativeMotion(motion, tool, frame, round_=isinstance(alone, Circle))
        cutting = _Cutting(course, _parts(motion), job.outer)
        shapes = [circle(each.radius) if isinstance(each, Circle) else each for each in outlines]
        made = cutting.profile(shapes, alone.radius if isinstance(alone, Circle) else None)
    except (RateError, UndefinedRate):
        return CutProfile(fault="the motion has no velocities")
    if made is None:
        return CutProfile(fault=cutting.fault)
    turned = made.outline.but(hollow=True) if cutting.outside else made.outline
    if not made.corners:
        return CutProfile(turned)
    first = min(made.corners, key=lambda corner: corner.time)
    x, y = frame.anchors[0].local
    place = x + first.place[0], y + first.place[1]
    radius = cutting.radius(alone.radius) if isinstance(alone, Circle) else None
    farther = cutting.farther(tool, alone) if isinstance(alone, Contour) else None
    return CutProfile(turned, time=first.time, place=place, radius=radius, farther=farther)


def _is_free(motion: PathMotion, tool: Thing) -> bool:
    """Whether nothing determines how a thing moves."""
    for segment_motion in motion.segments:
        unknowns = segment_motion.plan.system.unknowns
        for block in segment_motion.plan.blocks:
            free = [unknowns[each].payload for each in block.unknowns] if isinstance(block, Free) else []
            if any(isinstance(each, PoseX | PoseY) and each.thing == tool.number for each in free):
                return True
    return False


def _parts(motion: PathMotion) -> list[tuple[Fraction, Fraction]]:
    """From when to when the motion is smooth."""
    found: list[tuple[Fraction, Fraction]] = []
    for segment_motion in motion.segments:
        start, end = segment_motion.segment.start, min(segment_motion.segment.end, motion.timeline.end)
        for piece in segment_motion.pieces:
            if not isinstance(piece, Unsolved):
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
        """(3, N): of x, y and the angle (in radians)."""
        asked = self.place if self.round else [*self.place, self.turn]
        found = rates_at(self.motion, asked, order, times)
        return np.vstack([found, np.zeros(len(times))]) if self.round else found * [[1.0], [1.0], [math.pi / 180.0]]

    def __call__(self, times: Sequence[Fraction]) -> FloatArray:
        """See `outlines.envelope.Course`."""
        x, y, turn = self.rates(times, 0)
        try:
            faster = self.rates(times, 2)
        except UndefinedRate:
            faster = np.full((3, len(times)), np.nan)
        return np.stack([x, y, np.cos(turn), np.sin(turn), *self.rates(times, 1), *faster])


@dataclass(slots=True, eq=False)
class _Cutting:
    course: RelativeMotion
    parts: list[tuple[Fraction, Fraction]]
    outer: bool
    fault: str = ""
    outside: bool = False
    """Whether what is left is outside of the profile."""

    def profile(self, tools: Sequence[Contour], radius: float | None) -> Profile | None:
        runs: list[EnvelopeRun] = []
        swept: list[SweptOutline] = []
        for tool in tools:
            some, poses = envelope(tool, self.parts, self.course, max([0, *(run.branch for run in runs)]))
            runs += some
            swept.append(SweptOutline(tool, poses, radius))
        if not swept[0].poses.shape[1]:
            self.fault = "the film has no motion" if not self.parts else "the motion has no solution"
            return None
        if not runs:
            self.fault = "the tool rests in what it cuts"
            return None
        made = profile(runs, SweptOutlines(tuple(swept)), outer=self.outer)
        if made is None:
            self.fault = "the tool goes over all of it"
        else:
            self.outside = made.outer and made.outline.closed
        return made

    # --- what would do where it is undercut

    def radius(self, radius: float) -> float | None:
        """The largest of a roller that goes the same way and leaves a profile which does not cross itself: where it
        touches the profile it must reach no other place of the way of its centre.
        """
        times = self._times()
        (x, y, _), (vx, vy, _), (ax, ay, _) = (self.course.rates(times, order) for order in range(3))
        with np.errstate(all="ignore"):
            speed = np.hypot(vx, vy)
            bend = (vx * ay - vy * ax) / speed**3
            points, normals = np.stack([x, y], axis=-1), np.stack([-vy, vx], axis=-1) / speed[:, None]
        known = np.isfinite(points).all(axis=-1) & np.isfinite(normals).all(axis=-1) & np.isfinite(bend)
        points, normals, bend = points[known], normals[known], bend[known]
        inwards = math.copysign(1.0, float(np.nansum(x * vy - y * vx)))
        # a smaller one may leave the edge at the frame's origin where this one goes over that
        sides = (-inwards,) if self.outer else (inwards, -inwards)
        room = 0.0
        for side in sides:
            most = max(1.0 / radius, float(np.max(side * bend)))
            room = min(1.0 / most, _narrowest(points, side * normals)) * CUT_WOULD_DO
            if room < float(np.hypot(*points.T).min()):
                break
        step = float(np.median(np.hypot(*np.diff(points, axis=0).T)))
        return room if room > CROSSING * step else None

    def farther(self, tool: Thing, outline: Contour) -> float | None:
        """By how much a straight face must be farther away."""
        if tool.kind.word != "bar" or len(tool.anchors) != 2 or not outline.doubled:
            return None
        (px, py), (qx, qy) = (anchor.local for anchor in tool.anchors)
        along = math.atan2(qy - py, qx - px)
        (x, y, turn), (vx, vy, w), (ax, ay, b) = (self.course.rates(self._times(), order) for order in range(3))
        nx, ny = -np.sin(turn + along), np.cos(turn + along)
        away = x * nx + y * ny
        side = math.copysign(1.0, float(np.nanmedian(away)))
        # the distance of the face from the frame's origin by its direction: its value and its derivatives
        across = x * -ny + y * nx
        first = vx * nx + vy * ny + w * across
        second = ax * nx + ay * ny + 2.0 * w * (vx * -ny + vy * nx) + b * across - w * w * away
        with np.errstate(all="ignore"):
            slope = first / w
            bend = away + (second - slope * b) / (w * w)
        least = float(np.nanmin(side * bend))
        return -least if least < -CUT_CURVED * outline.size else None

    def _times(self) -> list[Fraction]:
        begin, end = self.parts[0][0], self.parts[-1][1]
        return [begin + (end - begin) * Fraction(2 * k + 1, 2 * INSTANTS) for k in range(INSTANTS)]


def _narrowest(points: FloatArray, normals: FloatArray) -> float:
    """The radius of the least circle that touches a way in one of these points (N, 2), on the side of its normal
    (N, 2), and goes through another one.
    """
    least = CUT_ALONG * float(np.ptp(points, axis=0).max())

    def rooms(some: IntArray, others: IntArray) -> FloatArray:
        dx, dy = (points[others, axis] - points[some, axis, None] for axis in (0, 1))
        ahead, square = dx * normals[some, 0, None] + dy * normals[some, 1, None], dx * dx + dy * dy
        return np.where((ahead > 0.0) & (square > least * least), square, np.inf) / np.where(
            ahead > 0.0, 2.0 * ahead, 1.0
        )

    coarse = np.arange(0, len(points), COARSE)
    found = rooms(coarse, coarse)
    one, other = np.unravel_index(int(np.argmin(found)), found.shape)
    fine = (np.arange(COARSE * (k - 1), COARSE * (k + 1) + 1) for k in (int(one), int(other)))
    some, others = (each[(each >= 0) & (each < len(points))] for each in fine)
    return min(float(found[one, other]), float(rooms(some, others).min()))
