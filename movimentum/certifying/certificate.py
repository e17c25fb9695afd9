"""The certificate of a film: how far its frames are from an exact solution, in which tubes, and where it breaks off."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.certifying.blocks import Encloser
from movimentum.certifying.bounds import Bound, bounds, sides_not_kept
from movimentum.certifying.forms import TimeForm, up
from movimentum.certifying.nearest import NOT_ENCLOSED
from movimentum.certifying.tubes import Stop, TubeEnd, Tunnel, tunnel
from movimentum.expressions import Expr, symbol
from movimentum.planning.blocks.kinds import Block, wishes_drawing
from movimentum.planning.lowering.system import lowered_expressions
from movimentum.records import dataclass, field
from movimentum.scene.model import AnchorCoordinate
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.source import Span
from movimentum.text import listed
from movimentum.text import number as shown_number
from movimentum.tolerances import FRAME_CERTIFIED, UNIT_ROUNDOFF

Place = tuple[int, int]
"""An anchor: the numbers of its thing and of itself."""


@dataclass(frozen=True, slots=True)
class Break:
    """Where the proof breaks off: from time ``begin`` to ``end``, and ``why``. ``span``: the statement, if it is one's.
    ``change``: two solutions meet there.
    """

    begin: float
    end: float
    why: str
    span: Span | None = None
    change: bool = False


@dataclass(frozen=True, slots=True)
class MotionJump:
    """A step at ``time`` at which the exact motion jumps by ``distance`` pixels; ``span``: where it is written."""

    time: float
    distance: float
    span: Span | None


@dataclass(frozen=True, slots=True)
class CertifiedInterval:
    """A part of the film in ``tubes`` intervals, one after the other."""

    begin: float
    end: float
    tubes: int


@dataclass(frozen=True, slots=True)
class Certificate:
    """The proved facts about a film.

    ``distance``: pixels that no anchor in a certified frame is off by; ``frames`` how many are certified, of ``whole``
    frames; ``worst`` the one that is farthest off. ``refused``: what cannot be certified at all. ``jumps``: where
    the exact motion jumps.
    """

    distance: float
    frames: int
    whole: int
    worst: int
    intervals: tuple[CertifiedInterval, ...]
    breaks: tuple[Break, ...]
    refused: tuple[Break, ...]
    jumps: tuple[MotionJump, ...]
    bounds: tuple[Bound, ...]

    @property
    def tubes(self) -> int:
        """How many intervals there are in all."""
        return sum(interval.tubes for interval in self.intervals)

    @property
    def complete(self) -> bool:
        """Whether the whole film is certified."""
        return not self.refused and not self.breaks and not self.jumps and self.frames == self.whole


PosesOf = Callable[[int, int], Poses]


def certificate(motion: PathMotion, poses: PosesOf | None = None) -> Certificate:
    """Certify a film: its frames' ``poses``, from one frame to before another (default: as the motion has them)."""
    refused = tuple(_refused(motion))
    count = motion.timeline.frame_count
    if refused:
        return Certificate(0.0, 0, count, 0, (), (), refused, (), ())
    return _Film(motion, poses or motion.poses).certified()


@dataclass(slots=True, eq=False)
class _Film:
    motion: PathMotion
    poses: PosesOf
    tunnels: list[tuple[SegmentMotion, Tunnel]] = field(default_factory=list[tuple[SegmentMotion, Tunnel]])
    breaks: list[Break] = field(default_factory=list[Break])
    jumps: list[MotionJump] = field(default_factory=list[MotionJump])
    distance: float = 0.0
    worst: int = 0
    frames: int = 0
    _left: dict[Place, tuple[FloatArray, FloatArray]] = field(
        default_factory=dict[Place, tuple[FloatArray, FloatArray]]
    )

    def certified(self) -> Certificate:
        timeline, motion = self.motion.timeline, self.motion
        intervals: list[CertifiedInterval] = []
        begun: dict[Hashable, TimeForm] = {}
        for number, segment_motion in enumerate(motion.segments):
            start = segment_motion.segment.start
            low, high = motion.span(number, 0, timeline.frame_count) or (0, 0)
            times = [timeline.frame_time(frame) for frame in range(low, high)]
            tau = np.array([float(time - start) for time in times])
            of_piece = segment_motion.piece_numbers(tau)
            for index, piece in enumerate(segment_motion.pieces):
                if isinstance(piece, UnsolvedInterval):
                    end = min(piece.end, float(segment_motion.segment.end - start))
                    self.breaks.append(Break(*self._times(start, piece.begin, end), "there is no solution"))
                    self._left = {}
                    continue
                mine = np.nonzero(of_piece == index)[0]
                found = tunnel(Encloser(piece, begun), tau[mine])
                self.tunnels.append((segment_motion, found))
                tubes = 0 if found.tubes is None else len(found.tubes.begin)
                intervals.append(CertifiedInterval(*self._times(start, piece.begin, piece.end), tubes))
                self.breaks += [self._break(start, found, one) for one in found.endings]
                self.breaks += self._sides(segment_motion, found)
                self._measure(found, segment_motion, low + mine, tau[mine])
                begun = _integrals(found, begun)
        return Certificate(
            self.distance,
            self.frames,
            timeline.frame_count,
            self.worst,
            tuple(intervals),
            tuple(self.breaks),
            (),
            tuple(self.jumps),
            tuple(bounds(motion, self.tunnels)),
        )

    def _times(self, start: Fraction, begin: float, end: float) -> tuple[float, float]:
        return float(start) + begin, float(start) + end

    # --- how far the frames are off

    def _measure(self, found: Tunnel, segment_motion: SegmentMotion, frames: IntArray, tau: FloatArray) -> None:
        """Compare the frames with the exact solution, and the beginning with where the piece before ended."""
        places = _places(segment_motion)
        spots = {place: _spot(found, axes) for place, axes in places.items()}
        self._continue(found, segment_motion, spots)
        if not len(frames):
            return
        at = np.searchsorted(found.at.begin, tau)
        off, unknown = np.where(found.linked[at], 0.0, np.inf), np.zeros(len(at))
        poses = self.poses(int(frames[0]), int(frames[-1]) + 1)
        scene = self.motion.timeline.scene
        for (thing, anchor), (exact, radius) in spots.items():
            shown = poses.world(thing, scene.things[thing].anchors[anchor].local)
            apart = np.abs(shown - exact[at]) + radius[at] + 8.0 * UNIT_ROUNDOFF * np.abs(shown)
            off = np.maximum(off, np.hypot(apart[:, 0], apart[:, 1]) * (1.0 + 8.0 * UNIT_ROUNDOFF))
            unknown = np.maximum(unknown, np.max(radius[at], axis=1))
        off[np.isnan(off)] = np.inf
        certified = off <= FRAME_CERTIFIED * self.motion.size
        self.frames += int(np.sum(certified))
        self._wrong(frames, np.where(np.isfinite(off) & ~certified, off, 0.0), unknown)
        measured = np.where(certified, off, -1.0)
        if measured.max() >= self.distance:
            self.distance, self.worst = float(measured.max()), int(frames[int(np.argmax(measured))])

    def _wrong(self, frames: IntArray, off: FloatArray, unknown: FloatArray) -> None:
        """Tell the frame that is farthest off the exact solution, where that is known sharply enough."""
        limit = FRAME_CERTIFIED * self.motion.size
        for which, words in (
            (unknown <= limit, "frame {} is up to {} px from the exact solution, more than any other"),
            (unknown > limit, "for frame {}, only a distance of {} px from the exact solution is proved"),
        ):
            some = np.where(which, off, 0.0)
            if some.any():
                worst = int(np.argmax(some))
                time = float(self.motion.timeline.frame_time(int(frames[worst])))
                self.breaks.append(
                    Break(time, time, words.format(int(frames[worst]), shown_number(float(some[worst]), 3)))
                )

    def _continue(
        self, found: Tunnel, segment_motion: SegmentMotion, spots: dict[Place, tuple[FloatArray, FloatArray]]
    ) -> None:
        """Compare where the piece begins with where the last one ended, and remember where it ends."""
        if self._left and found.linked[0]:
            time = float(segment_motion.segment.start) + float(found.at.begin[0])
            least = most = 0.0
            for place in spots.keys() & self._left.keys():
                exact, radius = spots[place]
                old, off = self._left[place]
                apart, unsure = np.abs(exact[0] - old), radius[0] + off
                least = max(least, float(np.hypot(*np.maximum(apart - unsure, 0.0))))
                most = max(most, float(np.hypot(*(apart + unsure))))
            limit = FRAME_CERTIFIED * self.motion.size
            if least > limit:
                steps = self.motion.timeline.scene.steps
                span = next((step.span for step in steps if float(step.time) == time), None)
                self.jumps.append(MotionJump(time, least, span))
            elif not most <= limit:
                self.breaks.append(Break(time, time, "it is not proved that the motion continues from where it was"))
        last = {place: (exact[-1], radius[-1]) for place, (exact, radius) in spots.items()} if found.linked[-1] else {}
        self._left = {**self._left, **last}

    # --- why it breaks off

    def _sides(self, segment_motion: SegmentMotion, found: Tunnel) -> Iterator[Break]:
        if found.endings:
            return
        by_number = {constraint.number: constraint for constraint in self.motion.timeline.scene.constraints()}
        for number, tau in sides_not_kept(self.motion, segment_motion, found):
            time = float(segment_motion.segment.start) + tau
            span = by_number[number].span if number in by_number else None
            yield Break(
                time,
                time,
                "it is not proved that this statement's inequality (a side, or a length that is not 0) holds",
                span,
            )

    def _break(self, start: Fraction, found: Tunnel, ending: TubeEnd) -> Break:
        plan = found.encloser.plan
        begin, end = self._times(start, ending.begin, ending.end)
        if ending.block < 0:
            return Break(begin, end, "the enclosures there and beside it are not proved to be one motion")
        block = plan.blocks[ending.block]
        names = _names(found.encloser, block)
        span = _span(found.encloser, block)
        if ending.stop is Stop.JUMPS:
            return Break(begin, end, f"what is stated for {names} jumps", span)
        if ending.stop is Stop.MANY:
            return Break(begin, end, f"{names}: it would take too many tubes", span)
        if block.branches:
            why = f"a change point: two solutions for {names} meet, or come too close to be told apart"
            return Break(begin, end, why, span, change=True)
        return Break(begin, end, f"what is stated for {names} has no proved value there", span)


def _places(segment_motion: SegmentMotion) -> dict[Place, list[Expr]]:
    """The coordinates of the anchors that the plan places, in its unknowns."""
    system = segment_motion.plan.system
    found: dict[Place, list[Expr]] = {}
    for thing in system.mentioned():
        for anchor in range(len(system.scene.things[thing].anchors)):
            axes = [symbol(AnchorCoordinate(thing, anchor, axis)) for axis in (0, 1)]
            try:
                found[thing, anchor] = lowered_expressions(system, axes)
            except ValueError:  # it cannot be seen turning
                continue
    return found


def _spot(found: Tunnel, axes: list[Expr]) -> tuple[FloatArray, FloatArray]:
    """(N, 2) an anchor's exact place at the instants of a tunnel, and how far that may be off."""
    with np.errstate(all="ignore"):
        forms = found.encloser.values(axes, found.at)
    count = len(found.at.begin)
    exact, radius = (
        np.stack([np.broadcast_to(part, count) for part in parts], axis=-1)
        for parts in ([form.c for form in forms], [up(form.reach) for form in forms])
    )
    return exact, radius


def _integrals(found: Tunnel, begun: dict[Hashable, TimeForm]) -> dict[Hashable, TimeForm]:
    """The values of integrals at the end of a piece."""
    plan = found.encloser.plan
    now = dict(begun)
    for number in found.encloser.needed:
        block = plan.blocks[number]
        for n in block.integrals:
            form = found.at.forms[n]
            now[plan.system.unknowns[n].payload] = TimeForm(form.c[-1:], form.s[-1:], form.r[-1:])
    return now


# --- what cannot be certified


def _refused(motion: PathMotion) -> Iterator[Break]:
    """The leaves that poses depend on and that have no known enclosure, each once."""
    seen: set[str] = set()
    for segment_motion in motion.segments:
        start, end = float(segment_motion.segment.start), float(segment_motion.segment.end)
        for piece in segment_motion.pieces:
            if isinstance(piece, UnsolvedInterval):
                continue
            encloser = Encloser(piece)
            for number in encloser.needed:
                block = piece.plan.blocks[number]
                why = _no_certificate(encloser, block)
                if why is not None and why not in seen:
                    seen.add(why)
                    yield Break(start, end, why, _span(encloser, block))


def _no_certificate(encloser: Encloser, block: Block) -> str | None:
    names = _names(encloser, block)
    if block.integrals and not block.continued:
        return f"a differential equation moves {names}"
    if wishes_drawing(block):
        return f"a wish draws {names}: it is as near as can be, and solves no equation"
    if block.free and encloser.rows(block) is None:
        return f"it is not shown that equations determine {names}: it may move freely, without one exact motion"
    if block.rates_of is not None:
        return f"the velocity of a free motion is part of {names}"
    if block.integrals and encloser.closed(block) is None:
        return f"{names} is an integral without a closed form"
    rows = encloser.plan.stated_rows(block)
    if any(node.op in NOT_ENCLOSED for node in rows.nodes):
        return f"the nearest places of two outlines determine {names}, and are not enclosed"
    return None if block.moving or encloser.rows(block) is not None else f"{names} is free to be anywhere"


def _names(encloser: Encloser, block: Block) -> str:
    system = encloser.plan.system
    unknowns = [system.unknowns[n] for n in block.unknowns]
    things = {system.scene.things[n.thing].name: None for n in unknowns if n.thing is not None}
    return listed([f"`{name}`" for name in (things or {n.name: None for n in unknowns})], 4)


def _span(encloser: Encloser, block: Block) -> Span | None:
    """A statement of a block: the wish that draws it, or the last of its equations that is one's."""
    system = encloser.plan.system
    wishes = [system.wishes[k].constraint for k in wishes_drawing(block)]
    stated = [system.equations[e].constraint for e in block.equations]
    numbers = wishes or [number for number in stated if number is not None]
    if not numbers:
        return None
    by_number = {constraint.number: constraint for constraint in system.scene.constraints()}
    return by_number[numbers[-1]].span if numbers[-1] in by_number else None
