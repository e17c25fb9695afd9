"""The tiers `high` and `exact`: every frame's poses solved again in an arithmetic of more digits.

The path decides which solution (as in `standard`); here it is only improved, block by block in the plan's order, so
that each block starts from inputs that are already right. World positions are computed in the arithmetic too and
rounded once.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic
from movimentum.expressions import ZERO, Expr
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.calculus import closed_form
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import PosePart, Rate
from movimentum.records import dataclass, field
from movimentum.scene.model import ThingAngle, ThingProperty, VariableComponent
from movimentum.settings import Accuracy
from movimentum.solver.accuracy.notes import AttainedAccuracy
from movimentum.solver.accuracy.polish import PolishRows, RefinedPoses, RowContext, make_rows, polish
from movimentum.solver.arithmetic.double_double import WideArithmetic
from movimentum.solver.arithmetic.evaluation import Arithmetic, Evaluator, Number, ordered_nodes
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.solver.basis.body_pose import BodyPose, solved_pose
from movimentum.solver.basis.instants import at_times
from movimentum.solver.block.formulas import UnknownFormulas
from movimentum.solver.block.problem import scale_of
from movimentum.solver.continuation.tracks import StillTrack
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece, evaluate_piece
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import UnsolvedInterval
from movimentum.timeline.model import Timeline

DEFAULT_DIGITS = 50
INTEGRAL_REASON = "an integral"


@dataclass(slots=True, eq=False)
class RefinedMotion:
    """A motion whose poses are computed again in ``arithmetic``; asked for poses as `PathMotion` is."""

    base: PathMotion
    arithmetic: Arithmetic
    attained: AttainedAccuracy = field(default_factory=AttainedAccuracy)
    _evaluator: Evaluator = field(init=False)
    _rows: dict[tuple[int, int], PolishRows] = field(default_factory=dict[tuple[int, int], PolishRows])
    _still: dict[tuple[int, int], tuple[list[Number], list[FloatArray]]] = field(
        default_factory=dict[tuple[int, int], "tuple[list[Number], list[FloatArray]]"]
    )
    _moments: list[_RefinedMoment] = field(default_factory=list["_RefinedMoment"])
    _totals: dict[tuple[int, int], tuple[Fraction, Number]] = field(
        default_factory=dict[tuple[int, int], "tuple[Fraction, Number]"]
    )
    _formulas: dict[int, UnknownFormulas] = field(default_factory=dict[int, UnknownFormulas])

    def __post_init__(self) -> None:
        self._evaluator = Evaluator(self.arithmetic)

    @property
    def timeline(self) -> Timeline:
        """The timeline that was solved."""
        return self.base.timeline

    @property
    def size(self) -> float:
        """The scene's size in pixels."""
        return self.base.size

    @property
    def path(self) -> PathMotion:
        """The motion of which this has more digits."""
        return self.base

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """What the frames computed so far fall short of."""
        return self.attained.notes(self.arithmetic.shown)

    def poses(self, first: int, stop: int, *, angles: bool = True) -> RefinedPoses:
        """The poses of frames ``first`` … ``stop - 1``."""
        times = [self.timeline.frame_time(frame) for frame in range(first, stop)]
        return self._refined(self.base.poses(first, stop), times)

    def poses_at(self, times: Sequence[Fraction]) -> RefinedPoses:
        """The poses at any times (ascending), clipped to the timeline."""
        timeline = self.timeline
        return self._refined(
            self.base.poses_at(times), [min(max(time, timeline.start), timeline.end) for time in times]
        )

    # from float64 poses to better ones

    def _refined(self, poses: Poses, times: list[Fraction]) -> RefinedPoses:
        floats = self.arithmetic.floats
        things = [
            BodyPose(
                floats(poses.origin[t, :, 0]),
                floats(poses.origin[t, :, 1]),
                floats(poses.direction[t, :, 0]),
                floats(poses.direction[t, :, 1]),
                floats(poses.angle[t]),
            )
            for t in range(len(poses.origin))
        ]
        scalars: dict[tuple[str, int | None], Number] = {}
        for name, values in poses.variables.items():
            for axis in (0, 1) if values.ndim == 2 else (None,):
                scalars[name, axis] = floats(values if axis is None else values[:, axis])
        for number, segment_motion in enumerate(self.base.segments):
            inside = np.array([self.timeline.segment_at(time) == number for time in times])
            tau = np.array([float(time - segment_motion.segment.start) for time in times])
            of_piece = segment_motion.piece_numbers(tau)
            for index, piece in enumerate(segment_motion.pieces):
                places = np.nonzero(inside & (of_piece == index) & poses.solved)[0]
                if isinstance(piece, UnsolvedInterval) or len(places) == 0:
                    continue
                moment = self.moment_of(number, piece, [times[place] for place in places])
                self._put(poses, things, scalars, places, moment)
        return RefinedPoses(
            **{name: getattr(poses, name) for name in Poses.__dataclass_fields__},
            evaluator=self._evaluator,
            pose=tuple(things),
            scalars=scalars,
            instants=self.arithmetic.rationals(times),
            size=self.base.size,
            things=self.timeline.scene.things,
        )

    def _put(
        self,
        poses: Poses,
        things: list[BodyPose],
        scalars: dict[tuple[str, int | None], Number],
        places: NDArray[np.intp],
        moment: _RefinedMoment,
    ) -> None:
        count, rounded = len(places), self.arithmetic.rounded
        for t, pose in enumerate(moment.things):
            for name in ("x", "y", "c", "s", "angle"):
                getattr(things[t], name)[places] = _spread(getattr(pose, name), count)
            poses.origin[t, places, 0], poses.origin[t, places, 1] = rounded(pose.x), rounded(pose.y)
            poses.direction[t, places, 0], poses.direction[t, places, 1] = rounded(pose.c), rounded(pose.s)
            poses.angle[t, places] = rounded(pose.angle)
        for (thing, name), values in poses.properties.items():
            value = moment.others.get(ThingProperty(thing, name))
            if value is not None:
                values[places] = rounded(value)
        for (name, axis), wide in scalars.items():
            value = moment.others.get(VariableComponent(name, axis))
            if value is not None:
                wide[places] = _spread(value, count)
                target = poses.variables[name] if axis is None else poses.variables[name][:, axis]
                target[places] = rounded(value)

    # one segment at some instants

    def moment_of(self, number: int, piece: Piece, times: list[Fraction]) -> _RefinedMoment:
        """Every thing's pose and every other unknown at ``times``, which lie in ``piece`` of segment ``number``."""
        state = self.state(number, piece, times)[0]
        before = self._before(number)
        system, evaluator = piece.plan.system, self._evaluator
        dx, dy = (evaluator.decimal(v) for v in system.shift)

        def sine_and_cosine(angle: Number) -> tuple[Number, Number]:
            sine, cosine = (self.arithmetic.call(op, None, [angle]) for op in ("sind", "cosd"))
            return sine, cosine

        things = list(before.things)
        for body in piece.plan.bodies:
            t, frame = body.thing, system.frame(body.thing)
            rx, ry, ax, ay = map(evaluator.constant, (*frame.stated_origin, *frame.stated_axis))
            things[t] = solved_pose(
                system, body, (rx, ry, ax, ay), state.__getitem__, things[t], sine_and_cosine, (dx, dy)
            )
        others = dict(before.others)
        for unknown in piece.plan.system.unknowns:
            if isinstance(unknown.payload, PosePart | ThingAngle | Rate) or state[unknown.number] is None:
                continue
            others[unknown.payload] = state[unknown.number]
        return _RefinedMoment(things, others)

    def _before(self, number: int) -> _RefinedMoment:
        """The moment at which segment ``number`` begins: what its plan does not know stays as there."""
        decimal = self._evaluator.decimal
        if not self._moments:
            zero, one = decimal(0.0), decimal(1.0)
            self._moments.append(
                _RefinedMoment([BodyPose(zero, zero, one, zero, zero) for _ in self.timeline.scene.things], {})
            )
        while len(self._moments) <= number:
            index = len(self._moments) - 1
            segment_motion, following = self.base.segments[index], self.base.segments[index + 1]
            last = segment_motion.pieces[-1]
            if isinstance(last, UnsolvedInterval) or segment_motion.failures:
                now = following.base.now
                floats = self.arithmetic.floats
                poses = [BodyPose(*(floats(np.array([v])) for v in (p.x, p.y, p.c, p.s, p.angle))) for p in now.things]
                self._moments.append(_RefinedMoment(poses, {k: floats(np.array([v])) for k, v in now.others.items()}))
            else:
                self._moments.append(self.moment_of(index, last, [segment_motion.segment.end]))
        return self._moments[number]

    def state(self, number: int, piece: Piece, times: list[Fraction]) -> tuple[list[Number], FloatArray]:
        """All unknowns by number (None where nothing needs it) at ``times``, and (F,) the digits that are right."""
        plan, segment_motion = piece.plan, self.base.segments[number]
        instants = at_times(plan.clocks, segment_motion.segment.start, times)
        with np.errstate(all="ignore"):
            floats, _ = evaluate_piece(piece, instants)
        clocks: dict[Fraction, Number] = {}

        def clock(node: Expr) -> Number:
            if node.start not in clocks:
                clocks[node.start] = self.arithmetic.rationals([time - node.start for time in times])
            return clocks[node.start]

        wide: list[Number] = [None] * len(floats)
        context = RowContext(self._evaluator, wide, list(floats), clock, instants.clocks)
        digits = np.full(len(times), np.inf)
        for block, track in zip(plan.blocks, piece.tracks, strict=True):
            key = (id(piece), block.number)
            if isinstance(track, StillTrack) and key in self._still:
                for n, w, f in zip(block.unknowns, *self._still[key], strict=True):
                    wide[n], context.floats[n] = w, f
                continue
            count = 1 if isinstance(track, StillTrack) else len(times)
            digits = np.minimum(digits, self._block(number, piece, block, context, times, count))
            if isinstance(track, StillTrack):
                self._still[key] = [wide[n] for n in block.unknowns], [context.floats[n] for n in block.unknowns]
        worst = int(np.argmin(digits))
        if digits[worst] < min(self.attained.digits, self.arithmetic.digits):
            self.attained.digits, self.attained.time = float(digits[worst]), times[worst]
        return wide, digits

    def _block(
        self, number: int, piece: Piece, block: Block, context: RowContext, times: list[Fraction], count: int
    ) -> FloatArray:
        """Solve one block; returns the digits that are right (not counting what is rough)."""
        plan, arithmetic = piece.plan, self.arithmetic
        everywhere = np.full(1, np.inf)
        start = np.stack([np.broadcast_to(context.floats[n], count) for n in block.unknowns], axis=1)
        heading = plan.heading(block)
        if heading is not None:
            (n,) = block.unknowns
            self._wind(heading, context, n, start[:, 0])
            return everywhere
        if block.continued:
            self._accumulate(number, piece, block, context, times, start[:, 0])
            return everywhere
        if block.free and len(block.unknowns) > len(block.equations):
            things = {t: None for n in block.unknowns if (t := plan.system.unknowns[n].thing) is not None}
            self.attained.inexact.update(
                {f"the free motion of `{plan.system.scene.things[t].name}`": None for t in things}
            )
        states = block.integrals
        for n in states:
            context.wide[n] = arithmetic.floats(start[:, block.unknowns.index(n)])
            self.attained.inexact[INTEGRAL_REASON] = None
        chosen = [j for j, n in enumerate(block.unknowns) if n not in states]
        unknowns = [block.unknowns[j] for j in chosen]
        rows = self._rows.get((id(plan), block.number))
        if rows is None:
            equations = [plan.system.equations[e] for e in block.equations]
            residuals = [e.simultaneous_residual for e in equations if e.form in (Form.PLAIN, Form.WINDING)]
            rows = self._rows[id(plan), block.number] = make_rows(plan, residuals, unknowns)
        if not rows.residuals:
            for j, n in zip(chosen, unknowns, strict=True):
                context.wide[n] = arithmetic.floats(start[:, j])
            return everywhere
        return polish(plan, rows, context, start[:, chosen], scale_of(plan, unknowns))

    def _wind(self, heading: Expr, context: RowContext, unknown: int, guess: FloatArray) -> None:
        """angle - atan2d(sine, cosine) = 0, up to full turns, which ``guess`` knows."""
        sine, cosine = heading.args
        values = self._evaluator.values(ordered_nodes([sine, cosine]), [sine, cosine], context.leaf)
        angle = self.arithmetic.call("atan2d", None, values)
        turns = np.rint((guess - self.arithmetic.rounded(angle)) / 360.0)
        context.wide[unknown] = angle + self.arithmetic.floats(360.0 * turns)
        context.floats[unknown] = self.arithmetic.rounded(context.wide[unknown])

    def _formulas_of(self, number: int, piece: Piece) -> UnknownFormulas:
        """What is known of segment ``number`` as formulas of time."""
        if number not in self._formulas:
            unknowns = piece.plan.system.unknowns

            def begun(n: int) -> Expr:
                value = self._before(number).others.get(unknowns[n].payload)
                return ZERO if value is None else self._evaluator.given(value)

            start = self.base.segments[number].segment.start
            self._formulas[number] = UnknownFormulas(piece.plan, start, begun)
        return self._formulas[number]

    def _accumulate(
        self, number: int, piece: Piece, block: Block, context: RowContext, times: list[Fraction], standard: FloatArray
    ) -> None:
        """An integral: in closed form where its integrand is a formula of time that has one, by quadrature where it is
        a formula of time and digits are asked for; else as `standard` has it.
        """
        equation = piece.plan.system.equations[block.equations[0]]
        (unknown,) = block.unknowns
        assert equation.integrand is not None
        payload = piece.plan.system.unknowns[unknown].payload
        integrand = self._formulas_of(number, piece).of_time(equation.integrand)
        start = self.base.segments[number].segment.start
        total = self._before(number).others.get(payload)
        if total is None:
            total = self._evaluator.rational(Fraction(0))
        closed = None if integrand is None else closed_form(integrand, start)
        if closed is not None:
            value = total + self._evaluator.values(ordered_nodes([closed]), [closed], context.leaf)[0]
        elif integrand is not None and isinstance(self.arithmetic, DigitsArithmetic):
            value = total + self._quadrature((number, unknown), integrand, start, times, self.arithmetic)
        else:
            value = self.arithmetic.floats(standard)
            self.attained.inexact[INTEGRAL_REASON] = None
        context.wide[unknown] = _spread(value, len(times))
        context.floats[unknown] = self.arithmetic.rounded(context.wide[unknown])

    def _quadrature(
        self,
        key: tuple[int, int],
        integrand: Expr,
        start: Fraction,
        times: list[Fraction],
        arithmetic: DigitsArithmetic,
    ) -> Number:
        """The integral of a formula of time from ``start`` to each of ``times``, frame by frame."""
        nodes = ordered_nodes([integrand])
        mpf = arithmetic.context.mpf

        def value(time: object) -> object:
            """The integrand, ``time`` after ``start``."""

            def leaf(node: Expr) -> Number:
                offset = start - node.start
                return arithmetic.array([time + mpf(offset.numerator) / offset.denominator])

            return self._evaluator.values(nodes, [integrand], leaf)[0][0]

        values: list[object] = []
        for time in times:
            at, total = self._totals.get(key, (start, mpf(0)))
            if at > time:
                at, total = start, mpf(0)
            if time > at:
                parts = math.ceil((time - at) * self.timeline.fps)
                grid = [at - start + (time - at) * k / parts for k in range(parts + 1)]
                points = [mpf(point.numerator) / point.denominator for point in grid]
                more, error = arithmetic.context.quad(value, points, error=True)
                if not error <= mpf(10) ** (-arithmetic.shown) * max(1, abs(more)):
                    self.attained.inexact[INTEGRAL_REASON] = None
                total = total + more
            self._totals[key] = time, total
            values.append(total)
        return arithmetic.array(values)


@dataclass(frozen=True, slots=True, eq=False)
class _RefinedMoment:
    """Every thing's pose, and the other unknowns by payload, over some instants (or one)."""

    things: list[BodyPose]
    others: dict[Hashable, Number]


def _spread(value: Number, count: int) -> Number:
    return value if len(value) == count else value[np.zeros(count, dtype=np.int64)]


def refine(motion: PathMotion, accuracy: Accuracy, digits: int | None = None) -> RefinedMotion:
    """``motion`` with its poses in the tier HIGH or EXACT (to ``digits``, default `DEFAULT_DIGITS`)."""
    high = accuracy is Accuracy.HIGH
    arithmetic: Arithmetic = WideArithmetic() if high else DigitsArithmetic(digits or DEFAULT_DIGITS)
    return RefinedMotion(motion, arithmetic)
