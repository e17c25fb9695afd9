"""Variants solved one by one, each as its own script: those that cannot be solved together, and the final check."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, symbol
from movimentum.fitting.aims import READABLE, Evaluation, SideFormulas
from movimentum.fitting.evaluation import SideReader, SolvedPart, times_of
from movimentum.fitting.slopes import AnchorSlopes, Dual, SegmentSlopes, differences
from movimentum.planning.plan import Plan
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.planning.structure.rates import RateError
from movimentum.query import reader
from movimentum.records import dataclass, field
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.block.closed_form import State
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import evaluate_piece
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.timeline.model import Segment, Timeline
from movimentum.tolerances import SLOPE_STEP, SLOPES_AGREE
from movimentum.variants.outcomes import VariantOutcome
from movimentum.variants.single import Variants, structure_key
from movimentum.variants.tracing import OriginUnfolding, with_values
from movimentum.workflow.frames import PoseChunks

REMEMBERED = 512
"""Variants whose motions are known still."""


@dataclass(frozen=True, slots=True, eq=False)
class SingleMotion:
    """One variant: its ``motion`` (None where it makes no sense) and the ``sides`` (S,) of its aims, nan where it does
    not move.
    """

    motion: PathMotion | None
    outcome: VariantOutcome
    time: float
    sides: FloatArray


@dataclass(eq=False)
class SingleEvaluator:
    """Evaluates variants by themselves; slopes are central differences within ``intervals`` (C, 2)."""

    variants: Variants
    formulas: SideFormulas
    intervals: FloatArray
    _known: dict[bytes, SingleMotion] = field(default_factory=dict[bytes, SingleMotion])
    _agrees: bool = False
    _reader: SideReader | None = field(init=False)

    def __post_init__(self) -> None:
        self._reader = _reader_of(self.formulas)

    def motion(self, constants: FloatArray) -> SingleMotion:
        """The variant with these constants (C,)."""
        none = np.full(len(self.formulas.layout.aim), np.nan)
        values = dict(zip(self.formulas.names, constants.tolist(), strict=True))
        found = self.variants.solved(values)
        outcome, time, motion = found.outcome, found.time, found.motion
        if motion is None or not outcome.moves:
            return SingleMotion(motion, outcome, time, none)
        timeline = motion.timeline
        if structure_key(timeline) != structure_key(self.formulas.lowered.timeline):
            return SingleMotion(motion, outcome, time, none)
        return SingleMotion(motion, outcome, time, self._sides(motion, timeline, constants))

    def _sides(self, motion: PathMotion, timeline: Timeline, constants: FloatArray) -> FloatArray:
        formulas = self.formulas
        payloads = [symbol(payload) for payload in formulas.payloads]
        read = reader(timeline.scene, payloads)
        frames = [read(poses) for poses in PoseChunks(motion, range(timeline.frame_count), skip=False)]
        duals = [Dual(np.concatenate(column)[None, :]) for column in zip(*frames, strict=True)]
        return formulas.sides(constants[None], duals, self._moments(motion, timeline, constants), slopes=False)[0][0]

    def _moments(self, motion: PathMotion, timeline: Timeline, constants: FloatArray) -> dict[int, Dual]:
        formulas = self.formulas
        found: dict[int, Dual] = {}
        times = times_of(formulas, constants)
        values = dict(zip(formulas.names, constants.tolist(), strict=True))
        for number, time in times.items():
            moment = min(max(Fraction(time), timeline.start), timeline.end)
            inner: Expr = formulas.lowered.reductions[number].inner
            (value,) = reader(timeline.scene, with_values([inner], values))(motion.poses_at([moment]))
            found[number] = Dual(np.asarray(value)[None, :])
        return found

    def _moved(self, constants: FloatArray) -> SingleMotion:
        """`motion`, which is not solved again if it was lately."""
        key = constants.tobytes()
        if key not in self._known:
            if len(self._known) >= REMEMBERED:
                self._known.clear()
            self._known[key] = self.motion(constants)
        return self._known[key]

    def sides(self, constants: FloatArray) -> FloatArray:
        """(S,) the sides of the variant with these constants (C,)."""
        return self._moved(constants).sides

    def all_sides(self, constants: FloatArray) -> FloatArray:
        """(V, S) the sides of variants with these constants (V, C)."""
        return np.array([self.sides(row) for row in constants])

    def __call__(self, constants: FloatArray, *, slopes: bool = True) -> Evaluation:
        """(V, C) constants -> their `Evaluation`."""
        sides = self.all_sides(constants)
        moves = np.asarray(np.isfinite(sides).all(axis=1), dtype=np.bool_)
        if not slopes:
            return Evaluation(sides, None, moves, moves, moves.astype(np.float64))
        changes = np.full((*sides.shape, constants.shape[1]), np.nan)
        for v in np.nonzero(moves)[0]:
            changes[v] = self.slopes(constants[v])
        return Evaluation(sides, np.nan_to_num(changes), moves, moves, moves.astype(np.float64))

    def slopes(self, constants: FloatArray) -> FloatArray:
        """(S, C) how the sides of a variant that moves change with its constants (C,): by its equations where these say
        it, else by differences. At the first variant both are found, and what disagrees is not believed.
        """
        if self._reader is None:
            return self.differences(constants)
        exact = self._by_equations(constants, self._reader)
        if exact is None or not np.isfinite(exact).all():
            return self.differences(constants)
        if not self._agrees:
            other = self.differences(constants)
            scale = 1.0 + np.max(np.abs(other), initial=0.0)
            self._agrees = bool(np.quantile(np.abs(exact - other) / scale, 0.95) < SLOPES_AGREE)
            if not self._agrees:
                self._reader = None
                return other
        return exact

    def _by_equations(self, constants: FloatArray, reader: SideReader) -> FloatArray | None:
        """The slopes by the implicit function theorem; None where the variant's plans have other unknowns."""
        motion = self._moved(constants).motion
        if motion is None:
            return None
        varied = [constants[None, k : k + 1] for k in range(len(constants))]
        with np.errstate(all="ignore"):
            try:
                found = reader.sides(constants[None], _parts(motion, reader.segments, varied), slopes=True)[1]
            except LookupError:
                return None
        return None if found is None else found[0]

    def differences(self, constants: FloatArray) -> FloatArray:
        """(S, C) the same as differences, see `fitting.slopes.differences`."""
        return differences(self.all_sides, constants[None], self.intervals, SLOPE_STEP)[1][0]


def _reader_of(formulas: SideFormulas) -> SideReader | None:
    """What reads slopes off single motions; None where they depend on more than the equations of each instant."""
    if not all(isinstance(payload, READABLE) for payload in formulas.payloads):
        return None
    timeline, names, unfolding = formulas.lowered.timeline, formulas.names, OriginUnfolding()
    if timeline.stored_values:  # they change with the constants
        return None
    size = scene_size(timeline.scene)
    segments: list[SegmentSlopes] = []
    earlier: Segment | None = None
    try:
        anchors = AnchorSlopes(timeline.scene, names, unfolding, formulas.payloads)
        for segment in timeline.segments:
            same = earlier is not None and earlier.active == segment.active
            structure = None if same else structure_of(timeline.scene, segment, {})
            plan = segments[-1].plan if structure is None else compile_structure(structure, size, None)
            segments.append(SegmentSlopes(plan, plan.clocks, names, unfolding, formulas.payloads))
            earlier = segment
    except RateError:
        return None
    if not all(segment.exact for segment in segments):
        return None
    return SideReader(formulas, anchors, segments)


def _parts(motion: PathMotion, slopes: Sequence[SegmentSlopes], varied: Sequence[FloatArray]) -> Iterator[SolvedPart]:
    """The segments of one variant. LookupError where an unknown is none of its own."""
    timeline = motion.timeline
    frames = [timeline.frame_time(k) for k in range(timeline.frame_count)]
    numbers = [timeline.segment_at(time) for time in frames]
    for number, (own, found) in enumerate(zip(slopes, motion.segments, strict=True)):
        segment = found.segment
        inside = [float(time - segment.start) for time, n in zip(frames, numbers, strict=True) if n == number]
        tau = np.array([*inside, float(segment.end - segment.start)])

        def state_at(
            tau: FloatArray, _: Sequence[FloatArray], own: SegmentSlopes = own, found: SegmentMotion = found
        ) -> State:
            return [*_state(found, own.plan, tau.reshape(-1)), *varied]

        last = number + 1 == len(slopes)
        yield SolvedPart(segment.start, segment.end, last, tau, state_at(tau, ()), state_at)


def _state(motion: SegmentMotion, plan: Plan, tau: FloatArray) -> list[FloatArray]:
    """The unknowns of ``plan`` (1, F) at offsets ``tau`` (F,) of a segment; LookupError where it has not got one."""
    table = np.full((len(plan.system.unknowns), len(tau)), np.nan)
    for piece, chosen, _ in motion.by_piece(Instants(tau, ())):
        if isinstance(piece, UnsolvedInterval):
            raise LookupError
        state = evaluate_piece(piece, piece.instants(tau[chosen]))[0]
        for unknown in plan.system.unknowns:
            value = state[piece.plan.system.number_of[unknown.payload]]
            table[unknown.number, chosen] = np.nan if value is None else value
    return [row[None, :] for row in table]
