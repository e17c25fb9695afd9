"""Values that count whole rounds where they are only read: places on closed outlines, and turns of cords.

If a segment follows such a value, that is the value. Otherwise the visible part is computed, and whole rounds are
counted along the nodes of the path, so that the result does not depend on the choice of frames.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from movimentum.arrays import FloatArray, unwound_from, wound
from movimentum.expressions import Expr, call
from movimentum.outlines.contour import numeric
from movimentum.outlines.nearest import Nearest
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import Bearing, ContactPlace
from movimentum.solver.basis.instants import Instants
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import evaluate_piece
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval

MOST_NODES = 100_000
"""Nodes of one segment at which rounds are counted; they are as close as directions need that are followed."""

VisibleReader: TypeAlias = Callable[[Poses], FloatArray]
"""From poses to what can be seen in them (F,), within a round."""


def counts_rounds(node: Expr) -> bool:
    """Whether a node of an expression goes on for more than a round."""
    return isinstance(node.payload, Bearing) or (isinstance(node.payload, Nearest) and node.payload.counts_rounds)


def visible_value(node: Expr) -> Expr:
    """What can be seen of it at one moment."""
    payload = node.payload
    if isinstance(payload, Bearing):
        return call("atan2d", payload.sine, payload.cosine)
    assert isinstance(payload, Nearest)
    return Expr(node.op, node.args, replace(payload, counts_rounds=False, drawn=None))


@dataclass(frozen=True, slots=True, eq=False)
class Rounds:
    """A value along a motion, with the rounds that it has gone: ``at`` times (N,), ``value`` (N,)."""

    node: Expr
    visible: VisibleReader
    at: FloatArray
    value: FloatArray

    def values(self, motion: PathMotion, poses: Poses) -> FloatArray:
        """(F,) in poses of the motion."""
        result = np.full(len(poses.times), np.nan)
        numbers = np.array([motion.timeline.segment_at(Fraction(time)) for time in poses.times.tolist()], dtype=np.intp)
        distinct: list[int] = np.unique(numbers).tolist()
        for number in distinct:
            some = np.nonzero(numbers == number)[0]
            start = motion.segments[min(number, len(motion.segments) - 1)].segment.start
            held = _followed_value(motion, number, self.node, poses.times[some] - float(start))
            if held is not None:
                result[some] = held
        rest = np.nonzero(np.isnan(result))[0]
        if len(rest):
            seen_there = self.visible(poses.select(rest))
            guess = np.interp(poses.times[rest], self.at, self.value) if len(self.at) else seen_there
            result[rest] = wound(seen_there, guess, _period(self.node))
        return result


def count_rounds(motion: PathMotion, node: Expr, read: VisibleReader) -> Rounds:
    """The rounds of a node that `counts_rounds`, of which ``read`` tells what can be `visible_value`."""
    begins = _drawn_value(node)
    if begins is None:  # elsewhere it is the place that is seen
        return Rounds(node, read, np.zeros(0), np.zeros(0))
    period = _period(node)
    at: list[FloatArray] = []
    found: list[FloatArray] = []
    before = begins
    for number, segment_motion in enumerate(motion.segments):
        tau = _nodes(segment_motion)
        if not len(tau):
            continue
        values = _followed_value(motion, number, node, tau)
        if values is None:
            poses = motion.poses_at([segment_motion.segment.start + Fraction(each) for each in tau.tolist()])
            values = read(poses)
            good = poses.solved & np.isfinite(values)
            tau, values = tau[good], values[good]
            if not len(tau):
                continue
            first, steps = unwound_from(values, before, period)
            values = first + np.concatenate([[0.0], np.cumsum(steps)])
        before = float(values[-1])
        at.append(float(segment_motion.segment.start) + tau)
        found.append(values)
    if not at:
        return Rounds(node, read, np.zeros(0), np.zeros(0))
    return Rounds(node, read, np.concatenate(at), np.concatenate(found))


def _drawn_value(node: Expr) -> float | None:
    """How it is drawn, where rounds are counted from there."""
    payload = node.payload
    if isinstance(payload, Nearest) and not payload.both[payload.which].closed:
        return None
    assert isinstance(payload, Bearing | Nearest)
    return payload.drawn


def _period(node: Expr) -> float:
    payload = node.payload
    if isinstance(payload, Bearing):
        return 360.0
    assert isinstance(payload, Nearest)
    return payload.both[payload.which].period


def _nodes(segment_motion: SegmentMotion) -> FloatArray:
    """Times since the segment began at which rounds are counted."""
    some = [piece.nodes for piece in segment_motion.pieces if not isinstance(piece, UnsolvedInterval)]
    if not some:
        return np.zeros(0)
    nodes = np.unique(np.concatenate(some))
    return (
        nodes if len(nodes) <= MOST_NODES else nodes[np.linspace(0, len(nodes) - 1, MOST_NODES).round().astype(np.intp)]
    )


def _followed_value(motion: PathMotion, number: int, node: Expr, tau: FloatArray) -> FloatArray | None:
    """(F,) the value as a segment follows it, at times since it began; nan where it has no solution; None where it does
    not follow it.
    """
    if number >= len(motion.segments):
        return None
    segment_motion = motion.segments[number]
    number_of, payload = segment_motion.plan.system.number_of, node.payload
    if isinstance(payload, Nearest):
        there = ContactPlace(payload.uncounted, node.args)
        unknown = number_of.get(there)
        along = number_of.get(replace(there, along=True)) if unknown is None else None
        unknown = along if unknown is None else unknown
    else:
        unknown, along = number_of.get(payload), None
    if unknown is None:
        return None
    result = np.full(len(tau), np.nan)
    for piece, some, _ in segment_motion.by_piece(Instants(tau, ())):
        if isinstance(piece, UnsolvedInterval):
            continue
        state, bad = evaluate_piece(piece, piece.instants(tau[some]))
        value = np.broadcast_to(np.asarray(state[unknown], dtype=np.float64), len(some))
        result[some] = np.where(bad, np.nan, value)
    if not isinstance(payload, Nearest):
        return result
    outline = payload.outline
    if along is None:
        return numeric([outline.arc_length])(result)[0] / outline.length if payload.share else result
    return result / outline.length if payload.share else numeric([outline.place_along])(result / outline.length)[0]
