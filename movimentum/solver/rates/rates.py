"""Velocities and accelerations of a motion: exact, from the derivatives of its equations, not from differences.

A block's equations F(x, y, t) = 0 in its unknowns x, given those of earlier blocks y, hold at all times, so their
derivatives do: J x' = -(F_y y' + F_t), and so on for higher ones. Block after block in the plan's order, unknowns
become Taylor series in time (`solver.arithmetic.taylor`): with x known up to order k - 1 and taken as zero in order k,
the residual's coefficient r_k is what is left, and J x_k = -r_k.

A block with freedom left moves as `solver.free.velocity` says: with the least velocity that its equations allow, and
toward its wishes. Where no wish pulls it, the acceleration follows from the derivative of that least-motion problem.

Where J is singular (a change point, two circles that coincide), rates are the limit of the motion, interpolated from
nearby instants. Where there is no such limit (a drive runs into a dead centre), or no solution, they are nan.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Hashable, Iterable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, symbols
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.records import dataclass, field, replace
from movimentum.scene.leaves import Bearing, Cord
from movimentum.scene.model import AnchorCoordinate, ThingAngle, ThingProperty, VariableComponent
from movimentum.solver.arithmetic.evaluation import ordered_nodes
from movimentum.solver.arithmetic.taylor import Series, Taylor, coefficient, plus, times
from movimentum.solver.basis.instants import Instants, at_times
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.rates import SeriesMoment
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.free.rates import derivative_depths, mark_undefined
from movimentum.solver.kinds.kernels import rates_along
from movimentum.solver.motion import FRAMES_AT_A_TIME, PathMotion
from movimentum.solver.path.piece import (
    ONE_SIDED,
    ONE_SIDED_OF_FIVE,
    POINTS,
    TWO_SIDED,
    TWO_SIDED_OF_FEWER,
    Piece,
    evaluate_piece,
)
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.tolerances import (
    LEAST_DIVISOR,
    LIMITS_AGREE,
    NEARLY_SINGULAR_FOR_RATES,
    ROUNDING_OF_POSES,
    SINGULAR_FOR_RATES,
    SLOW_RATE,
)

NEAREST, FARTHEST = 18, 6
"""Limits are taken from points 2^-18 to 2^-6 of the piece's length beside the instant."""


class UndefinedRate(Exception):
    """An acceleration of ``thing`` (its number, or None) is asked for, which a wish draws: none is defined there."""

    def __init__(self, thing: int | None) -> None:
        self.thing = thing
        super().__init__("free motion toward a wish has no acceleration")


def rates_at(motion: PathMotion, expressions: Sequence[Expr], order: int, instants: Sequence[Fraction]) -> FloatArray:
    """(n, F): the ``order``-th time derivative of each of n expressions of the scene at ``instants`` (ascending).

    Units: the expression's, per time unit to that power; world frame. nan where there is no solution, no value, or no
    finite rate. One-sided where it has a kink and where steps begin: as time goes on; at the end: as it came there.
    Raises `UndefinedRate` for an acceleration of what a wish draws.
    """
    return _rates(motion, expressions, (order,), instants)[0]


def rates_up_to(
    motion: PathMotion, expressions: Sequence[Expr], order: int, instants: Sequence[Fraction]
) -> FloatArray:
    """(order + 1, n, F): the values and all derivatives up to ``order``, in one go; otherwise as `rates_at`."""
    return _rates(motion, expressions, range(order + 1), instants)


def _rates(
    motion: PathMotion, expressions: Sequence[Expr], orders: Sequence[int], instants: Sequence[Fraction]
) -> FloatArray:
    timeline = motion.timeline
    if any(isinstance(payload, Cord | Bearing) for payload in symbols(*expressions)):
        from movimentum.timeline.cords import read_cords  # few scripts have any

        expressions = read_cords(timeline.scene, expressions)
    result = np.full((len(orders), len(expressions), len(instants)), np.nan)
    place = 0
    while place < len(instants):
        number = timeline.segment_at(instants[place])
        end = min(place + FRAMES_AT_A_TIME, len(instants))
        if number + 1 < len(timeline.segments):
            end = bisect_left(instants, timeline.segments[number + 1].start, place, end)
        ahead = True
        segment, earlier = timeline.segments[number], timeline.segments[max(number - 1, 0)]
        if number > 0 and segment.start == segment.end and segment.active == earlier.active:
            number, ahead = number - 1, False  # the end of it all: the motion that led there
        segment_motion = motion.segments[number]
        some = at_times(segment_motion.plan.clocks, segment_motion.segment.start, instants[place:end])
        result[:, :, place:end] = _in_segment(segment_motion, some, expressions, orders, ahead)
        place = end
    return result


def _in_segment(
    segment_motion: SegmentMotion,
    instants: Instants,
    expressions: Sequence[Expr],
    orders: Sequence[int],
    ahead: bool,
) -> FloatArray:
    result = np.full((len(orders), len(expressions), len(instants)), np.nan)
    for piece, chosen, part in segment_motion.by_piece(instants):
        if isinstance(piece, UnsolvedInterval):
            continue
        course = _PieceRates(piece, segment_motion.base.now, tuple(expressions), orders[-1], ahead)
        with np.errstate(all="ignore"):
            result[:, :, chosen] = course.all_rates(part) if len(orders) > 1 else course.rates(part)
    return result


@dataclass(slots=True, eq=False)
class _PieceRates:
    """The rates of ``expressions`` on one piece; ``base`` is where things are that its plan does not know."""

    piece: Piece
    base: Snapshot
    expressions: tuple[Expr, ...]
    order: int
    ahead: bool
    needed: tuple[int, ...] = field(init=False)
    nodes: list[Expr] = field(init=False)
    depth: int = field(init=False)
    depths: dict[int, int] = field(init=False)

    def __post_init__(self) -> None:
        self.nodes = ordered_nodes(self.expressions)
        plan = self.piece.plan
        asked = [n for p in symbols(*self.expressions) for n in self._numbers(p)]
        self.needed = plan.rate_blocks(asked)
        self.depth = self.order + sum(node.op == "derivative" for node in self.nodes)
        self.depths = derivative_depths(
            plan, self.needed, {plan.owner[n]: self.depth for n in asked if n in plan.owner}
        )

    # --- what is needed

    def _numbers(self, payload: Hashable) -> list[int]:
        """The unknowns that a symbol of the scene depends on."""
        number_of = self.piece.plan.system.number_of
        wanted: Iterable[Hashable] = (payload,)
        if isinstance(payload, AnchorCoordinate):
            wanted = (kind(payload.thing) for kind in (PoseX, PoseY, PoseCos, PoseSin, ThingAngle))
        return [number_of[item] for item in wanted if item in number_of]

    # --- rates at instants

    def all_rates(self, instants: Instants) -> FloatArray:
        """(order + 1, n, F): the rates of all orders; where the equations alone tell less, of each by itself."""
        series, condition, _ = self._series(instants)
        values = np.array([self._coefficients(series, condition, order) for order in range(self.order + 1)])
        doubtful = np.nonzero(condition < NEARLY_SINGULAR_FOR_RATES)[0]
        if len(doubtful):
            some = Instants(instants.tau[doubtful], tuple(clock[doubtful] for clock in instants.clocks))
            for order in range(self.order + 1):
                values[order, :, doubtful] = replace(self, order=order).rates(some).T
        return values

    def rates(self, instants: Instants) -> FloatArray:
        """(n, F); a limit where the equations alone tell less."""
        values, condition, _ = self._direct(instants)
        doubtful = np.nonzero(condition < NEARLY_SINGULAR_FOR_RATES)[0]
        if len(doubtful) == 0 or self.piece.end <= self.piece.begin:
            return values
        at_best = ROUNDING_OF_POSES / np.maximum(condition[doubtful], LEAST_DIVISOR) ** self.order
        off = np.where(condition[doubtful] > SINGULAR_FOR_RATES, at_best, np.inf)
        values[:, doubtful[~np.isfinite(off)]] = np.nan
        tau = instants.tau[doubtful]
        waiting = np.arange(len(doubtful))
        for halvings in range(FARTHEST, NEAREST + 1):
            limit, apart = self._limit(tau[waiting], (self.piece.end - self.piece.begin) * 0.5**halvings)
            better = (apart < off[waiting]) & (apart <= LIMITS_AGREE)
            off[waiting[better]] = apart[better]
            values[:, doubtful[waiting[better]]] = limit[:, better]
            if halvings == FARTHEST:  # what is singular all along has no regular points beside it
                waiting = waiting[np.isfinite(apart) | np.isfinite(off[waiting])]
            if len(waiting) == 0:
                break
        return values

    def _limit(self, tau: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
        """The rates (n, F) at ``tau`` as seen from both sides (or the one that the piece has), and (F,) how far they
        may be off, relative to those near by; inf where there is no limit to be seen.
        """
        offsets = np.arange(1, POINTS + 1) * step

        pace = np.zeros(len(tau))

        def side(sign: float) -> FloatArray:
            nonlocal pace
            points = tau[:, None] + sign * offsets
            inside = (points >= self.piece.begin) & (points <= self.piece.end)
            moments = self.piece.instants(np.clip(points, self.piece.begin, self.piece.end).reshape(-1))
            values, condition, near = self._direct(moments)
            good = inside & (condition > SINGULAR_FOR_RATES).reshape(points.shape)
            pace = np.fmax(pace, np.max(np.where(good, near.reshape(points.shape), 0.0), axis=1))
            return np.where(good, values.reshape(len(values), *points.shape), np.nan)

        before, after = side(-1.0), side(1.0)
        has_before = np.asarray(np.isfinite(before).all(axis=(0, 2)), dtype=np.bool_)
        both = has_before & np.asarray(np.isfinite(after).all(axis=(0, 2)), dtype=np.bool_)
        one = np.where(has_before[:, None], before, after)
        limit = np.where(both, (before + after) @ TWO_SIDED, one @ ONE_SIDED)
        fewer = np.where(both, (before + after) @ TWO_SIDED_OF_FEWER, one @ ONE_SIDED_OF_FIVE)
        near = np.nanmax(np.abs(np.concatenate([before, after], axis=2)), axis=2, initial=LEAST_DIVISOR)
        near = np.maximum(near, SLOW_RATE * pace)
        sides = np.where(both, np.abs((before - after) @ ONE_SIDED), 0.0) / near
        apart = np.where(sides <= LIMITS_AGREE, np.abs(limit - fewer) / near, np.inf)
        return limit, np.max(np.where(np.isfinite(apart), apart, np.inf), axis=0, initial=0.0)

    def _direct(self, instants: Instants) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The rates (n, F) by the equations, (F,) the worst reciprocal condition number on the way, and (F,) the
        fastest rate of an unknown.
        """
        series, condition, values = self._series(instants)
        result = self._coefficients(series, condition, self.order)
        pace, size = np.zeros(len(instants)), math.factorial(self.order)
        for n in (n for number in self.needed for n in self.piece.plan.blocks[number].unknowns):
            pace = np.fmax(pace, size * np.abs(coefficient(values[n] or (), self.order)))
        return result, condition, pace

    def _coefficients(self, series: Sequence[Series], condition: FloatArray, order: int) -> FloatArray:
        """(n, F): the rates that series tell; nan where there are none."""
        size = math.factorial(order)
        result = np.array([np.broadcast_to(size * coefficient(item, order), len(condition)) for item in series])
        result[:, np.isnan(condition)] = np.nan
        return np.where(np.isfinite(result), result, np.nan).reshape(len(series), len(condition))

    def _series(self, instants: Instants) -> tuple[list[Series], FloatArray, list[Series | None]]:
        """The expressions by time, (F,) the worst reciprocal condition number on the way, and the unknowns by time."""
        state, bad = evaluate_piece(self.piece, instants)
        values: list[Series | None] = [None if value is None else (value,) for value in state]
        moment = SeriesMoment(self.piece.plan, instants, values, self.ahead)
        condition = np.where(bad, np.nan, 1.0)
        for number in self.needed:
            block, track, depth = self.piece.plan.blocks[number], self.piece.tracks[number], self.depths[number]
            if block.moving and depth > block.highest_rate:
                things = (self.piece.plan.system.unknowns[n].thing for n in block.unknowns)
                raise UndefinedRate(next((t for t in things if t is not None), None))
            if isinstance(track, NodeTrack) and math.isinf(track.tolerance):  # accuracy was given up on the way
                mark_undefined(block, moment, depth)
                continue
            found = rates_along(self.piece, block, track, moment, depth)
            if found is not None:
                condition = np.minimum(condition, found)
        taylor = Taylor(self.depth, ahead=self.ahead)
        series = taylor.values(self.nodes, self.expressions, lambda node: self._leaf(node, moment, taylor))
        return series, condition, values

    def _leaf(self, node: Expr, moment: SeriesMoment, taylor: Taylor) -> Series:
        """A clock, or a symbol of the scene."""
        if node.op == "clock":
            return moment.clock(node)
        number_of = self.piece.plan.system.number_of
        match node.payload:
            case AnchorCoordinate(thing, anchor, axis):
                return self._anchor(thing, anchor, axis, moment, taylor)
            case ThingAngle(thing):
                return moment.of(number_of.get(node.payload)) or (np.float64(self.base.things[thing].angle),)
            case ThingProperty(thing, name):
                still = self.piece.plan.system.scene.things[thing].undriven(name)
                return moment.of(number_of.get(node.payload)) or (np.float64(still),)
            case VariableComponent():
                return moment.of(number_of.get(node.payload)) or (np.float64(np.nan), np.float64(np.nan))
            case _:
                raise NotImplementedError(node.payload)

    def _anchor(self, thing: int, anchor: int, axis: int, moment: SeriesMoment, taylor: Taylor) -> Series:
        """A world coordinate of an anchor, as `basis.body_pose.solved_pose` has it."""
        system = self.piece.plan.system
        get, frame, before = system.number_of.get, system.frame(thing), self.base.things[thing]
        c, s = moment.of(get(PoseCos(thing))), moment.of(get(PoseSin(thing)))
        angle = moment.of(get(ThingAngle(thing)))
        if c is not None and s is not None:
            ax, ay = frame.axis if frame.turned else (1.0, 0.0)
            c, s = plus(times(ax, c), times(ay, s)), plus(times(ax, s), times(-ay, c))
        elif angle is not None:
            s, c = (taylor.call(op, None, [angle]) for op in ("sind", "cosd"))
        else:
            c, s = (np.float64(before.c),), (np.float64(before.s),)
        rx, ry = frame.origin
        place = moment.of(get(PoseX(thing) if axis == 0 else PoseY(thing)))
        if place is not None:
            place = plus(place, (np.float64(system.shift[axis]),))
        else:
            still = before.x + (before.c * rx - before.s * ry), before.y + (before.s * rx + before.c * ry)
            place = (np.float64(still[axis]),)
        x, y = system.scene.things[thing].anchors[anchor].local
        dx, dy = x - rx, y - ry
        turned = plus(times(dx, c), times(-dy, s)) if axis == 0 else plus(times(dx, s), times(dy, c))
        return plus(place, turned)
