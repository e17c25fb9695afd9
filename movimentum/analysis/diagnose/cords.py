"""Reports wheels that a cord would have to push, and drums that unwind more than was wound on."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import Expr, add, call, const, sub, substitute, symbol, symbols
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.scene.leaves import Bearing, Cord, cords_of
from movimentum.scene.model import Constraint, Relation, Scene
from movimentum.scene.names import symbol_name
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece, evaluate_piece
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.text import number, time_text
from movimentum.timeline.cords import CordParts, Wrap
from movimentum.tolerances import UNWRAPPED_AT, UNWRAPPED_DEG

Angles = Callable[[FloatArray], FloatArray]
"""From offsets in a segment to degrees."""


def slack_cords(motion: PathMotion) -> Iterator[Diagnostic]:
    """A warning for each wheel that a cord would leave, with when that is first so."""
    scene = motion.timeline.scene
    equations = (item for item in scene.constraints() if item.relation is Relation.EQUAL)
    stated = {item.number: (item, found) for item in equations if (found := cords_of(item))}
    reported: set[tuple[Cord, int]] = set()
    for segment_motion in motion.segments if stated else ():
        here = dict.fromkeys(item.number for item in segment_motion.segment.active)
        for item, found in (stated[each] for each in here if each in stated):
            for cord in found:
                for wrap in CordParts(scene, cord).wraps:
                    if (cord, wrap.stop) in reported:
                        continue
                    when = _first_negative_wrap(segment_motion, wrap)
                    if when is not None:
                        reported.add((cord, wrap.stop))
                        yield _slack_diagnostic(motion, item, cord, wrap, segment_motion.segment.start + Fraction(when))


def drawn_lengths(scene: Scene, items: Sequence[Constraint]) -> Iterator[str]:
    """Of each cord among ``items`` how long it is as everything is drawn, and how long it is to be; or that it has no
    tangents.
    """

    def turned(node: Expr) -> Expr | None:
        bearing = node.payload
        if not isinstance(bearing, Bearing):
            return None
        first = const(bearing.drawn - 180.0)
        return add(first, call("mod", sub(call("atan2d", bearing.sine, bearing.cosine), first), const(360.0)))

    numbers = {item.number for item in items}
    for item in scene.constraints():
        for cord in cords_of(item) if item.number in numbers else ():
            parts = CordParts(scene, cord)
            length = parts.drawn(substitute(parts.length, turned))
            stated = next((side.value for side in (*item.right, *item.left) if side.value is not None), None)
            if length > 0.0:
                asked = "" if stated is None else f", and {number(stated)} is stated"
                yield f"as everything is drawn, `{symbol_name(scene, cord)}` is {number(length)} px long{asked}"
            else:
                inside = "a wheel of it reaches beyond the next point or wheel"
                yield f"as everything is drawn, there is no tangent for `{symbol_name(scene, cord)}`: {inside}"


def _first_negative_wrap(segment_motion: SegmentMotion, wrap: Wrap) -> float | None:
    """The first offset in a segment at which a wrap is less than none."""
    for piece in segment_motion.pieces:
        if isinstance(piece, UnsolvedInterval):
            continue
        tau = np.unique(np.concatenate([[piece.begin, piece.end], piece.nodes]))
        tau = tau[(tau >= piece.begin) & (tau <= piece.end)]
        angle = _angle_of(piece, wrap)
        if angle is None:
            return None
        below = angle(tau) < -UNWRAPPED_DEG
        if not below.any():
            continue
        place = int(np.argmax(below))
        low, high = float(tau[max(place - 1, 0)]), float(tau[place])
        while place and high - low > UNWRAPPED_AT * max(1.0, abs(high)):
            some = np.linspace(low, high, 17)
            first = int(np.argmax(angle(some) < 0.0))
            if not first > 0 or (some[first - 1], some[first]) == (low, high):
                break
            low, high = float(some[first - 1]), float(some[first])
        return low
    return None


def _angle_of(piece: Piece, wrap: Wrap) -> Angles | None:
    """A wrap as it is followed in a piece; None if it is constant."""
    numbers = [piece.plan.system.number_of.get(payload) for payload in symbols(wrap.angle)]
    if not numbers or None in numbers:
        return None
    clocks = Clocks()
    function = compiled([substitute(wrap.angle, partial(numbered_symbol, piece.plan.system.number_of))], clocks)

    def angle(tau: FloatArray) -> FloatArray:
        instants = piece.instants(tau)
        state, _ = evaluate_piece(piece, instants)
        (found,) = function(state, instants.clocks)
        return np.broadcast_to(found, len(tau))

    return angle


def numbered_symbol(number_of: Mapping[Hashable, int], node: Expr) -> Expr | None:
    """A symbol by the number of its unknown; None for what is none."""
    return symbol(number_of[node.payload]) if node.op == "symbol" else None


def _slack_diagnostic(motion: PathMotion, item: Constraint, cord: Cord, wrap: Wrap, time: Fraction) -> Diagnostic:
    scene = motion.timeline.scene
    wheel, when = scene.things[wrap.wheel.thing], time_text(float(time))
    written = symbol_name(scene, cord)
    if wrap.drum:
        turns = f"begin with turns on it: state 720 degrees more for `{wheel.name}.angle`, and "
        turns += f"{number(4.0 * math.pi * wrap.radius, 6)} more for the length"
        return Diagnostic(
            code="cord/unwound",
            severity=Severity.WARNING,
            message=f"from t = {when} more of the cord is off `{wheel.name}` than was wound on it",
            span=item.span,
            notes=(f"nothing is wound on `{wheel.name}` as it is drawn, at the angle 0",),
            helps=(turns,),
        )
    rest = symbol_name(scene, Cord(cord.stops[: wrap.stop] + cord.stops[wrap.stop + 1 :]))
    return Diagnostic(
        code="cord/slack",
        severity=Severity.WARNING,
        message=f"from t = {when} the cord does not touch `{wheel.name}`, unless something pulls it there",
        span=item.span,
        notes=(f"it goes on about `{wheel.name}` the other way, which a taut cord cannot do",),
        helps=(f"leave `{wheel.name}` out from then on: `@{when} {written} = _; {rest} = …;`",),
    )
