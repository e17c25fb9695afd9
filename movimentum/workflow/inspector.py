"""Questions about a script at one instant: answers as data, which each front end words for itself.

Questions about an expression over the whole film are here too: when it has a value, when a condition holds, extremes.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.analysis.interactive.crossings import Crossing, Curve, ExtremeValue, Way, crossings, extreme
from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import NoSolutionError, script_error
from movimentum.query import Query, parsed_statement
from movimentum.records import dataclass, replace
from movimentum.solver.rates.rates import UndefinedRate
from movimentum.syntax.expression_tree import Comparison
from movimentum.tolerances import DIFFERENCED_RATE, VALUE_TOUCHED
from movimentum.workflow.engine import Revision

if TYPE_CHECKING:
    from movimentum.analysis.freedom.motions import FreeMotion
    from movimentum.analysis.interactive.all_solutions import Alternatives
    from movimentum.expressions import Expr
    from movimentum.scene.model import Thing
    from movimentum.solver.basis.pose_state import Snapshot
    from movimentum.solver.path.piece import Piece
    from movimentum.solver.poses import Poses
    from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval


LEAST_S = 0.5
"""The least time that finding a formula gets."""


@dataclass(frozen=True, slots=True)
class Cause:
    """A link in the chain of what determines a value: a statement in ``line``, or (``rigid``) a thing that is rigid."""

    line: int
    text: str
    rigid: bool


@dataclass(frozen=True, slots=True)
class Causes:
    """The statements that determine a value: ``chain`` in the order in which the solver uses it. ``free``: blocks of
    equations on the way that leave freedom, each with the names of its unknowns. ``drawn``: things that stay as drawn.
    """

    chain: tuple[Cause, ...]
    free: tuple[tuple[int, tuple[str, ...]], ...]
    drawn: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class PoseKnown:
    """Whether the poses at an instant are ``solved``. If not, they are those of the last instant with a solution,
    ``last`` (None: things are as drawn), and ``reason`` says why in a line.
    """

    solved: bool
    last: Fraction | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Contradicting:
    """Statements that cannot hold together: each with its line, its text and its ``off``, how far its sides are apart
    where the others hold (None where that is not known).
    """

    statements: tuple[tuple[int, str, float | None], ...]


@dataclass(frozen=True)
class Inspector:
    """A text at one instant, inside its film. Asking for what cannot be had raises `MovimentumError` with the
    reasons.
    """

    work: Revision
    time: Fraction

    @property
    def segment_motion(self) -> SegmentMotion:
        """The part of the motion that contains the instant."""
        return self.work.motion.segments[self.work.timeline.segment_at(self.time)]

    @property
    def step(self) -> int:
        """The number of the step that the instant belongs to."""
        return self.work.timeline.segments[self.work.timeline.segment_at(self.time)].step

    @property
    def piece(self) -> tuple[Piece, float]:
        """The part of the path that contains the instant, and how long after the segment's start the instant is;
        `NoSolutionError` where there is no solution.
        """
        from movimentum.solver.segment_motion import UnsolvedInterval

        piece, tau = self.part
        if isinstance(piece, UnsolvedInterval):
            message = "there is no solution at this moment"
            raise NoSolutionError([Diagnostic("solve/unreachable", Severity.ERROR, message)])
        return piece, tau

    @property
    def part(self) -> tuple[Piece | UnsolvedInterval, float]:
        """The same, also where there is no solution."""
        segment_motion = self.segment_motion
        tau = float(self.time - segment_motion.segment.start)
        return segment_motion.pieces[int(segment_motion.piece_numbers(np.array(tau)))], tau

    def poses(self) -> Poses:
        """The poses at the instant (F = 1)."""
        return self.work.motion.poses_at([self.time])

    @property
    def standing(self) -> PoseKnown:
        """The kind of the poses at the instant."""
        from movimentum.solver.segment_motion import UnsolvedInterval

        part, _ = self.part
        if not isinstance(part, UnsolvedInterval) and bool(self.poses().solved[0]):
            return PoseKnown(solved=True)
        errors = (item.message for item in self.work.diagnostics if item.severity is Severity.ERROR)
        last: Fraction | None = None
        for segment_motion in self.work.motion.segments:
            start = segment_motion.segment.start
            for piece in segment_motion.pieces:
                if start + Fraction(piece.begin) <= self.time and not isinstance(piece, UnsolvedInterval):
                    last = min(start + Fraction(piece.end), segment_motion.segment.end)
        return PoseKnown(solved=False, last=last, reason=next(errors, ""))

    def contradicting(self) -> Contradicting | None:
        """The contradiction at the instant, as in the message about it; None if no set is known."""
        from movimentum.analysis.diagnose.conflict import conflict_of

        begun = [t for t in self.segment_motion.failures if t.selection is not None]
        found = next((t.selection.contradiction for t in begun if t.selection is not None), None)
        if found is None:
            return None
        conflict = conflict_of(found)
        source = self.work.scene.source
        items = {item.number: item for item in self.work.scene.constraints()}
        rows = [(items[number].span, conflict.errors.get(number)) for number in conflict.constraints]
        return Contradicting(
            tuple((source.position(span.start).line, source.statement(span), off) for span, off in rows)
        )

    def query(self, text: str) -> Query:
        """An expression as it is understood in the step of the instant; see `Revision.query`."""
        return self.work.query(text, self.step)

    def thing(self, name: str) -> Thing | None:
        """The thing that is called so."""
        return next((thing for thing in self.work.scene.things if thing.name == name), None)

    def expressions(self, text: str) -> tuple[Expr, ...]:
        """The components of an expression; `ScriptError` (`query.NOT_A_READING`) for one that has to be solved for."""
        return self.work.expressions(text, self.step)

    # --- answers

    def causes(self, name: str) -> Causes:
        """The statements that determine a thing, an anchor, or any expression."""
        from movimentum.analysis.interactive.determination import determination

        scene, plan = self.work.scene, self.segment_motion.plan
        thing = self.thing(name)
        asked = [name] if thing is None else [f"{name}.{anchor.name}" for anchor in thing.anchors]
        found = determination(plan, [each for text in asked for each in self.expressions(text)])
        numbers = {item.number: item for item in scene.constraints()}
        chain: list[Cause] = []
        for reason in found.reasons:
            if reason.constraint is None:
                assert reason.thing is not None
                span, text = scene.things[reason.thing].span, scene.things[reason.thing].name
            else:
                span = numbers[reason.constraint].span
                text = scene.source.statement(span)
            chain.append(Cause(scene.source.position(span.start).line, text, reason.constraint is None))
        names = [unknown.name for unknown in plan.system.unknowns]
        free = tuple((block, tuple(names[n] for n in plan.blocks[block].unknowns)) for block in found.free)
        return Causes(tuple(chain), free, tuple(scene.things[number].name for number in found.drawn))

    def formulas(self, text: str, seconds: float) -> list[tuple[str, Any]]:
        """Each component of an expression by its name, as a SymPy expression of the time since the step's beginning
        (angles in radians), or the `Obstacle` in its way; found within about so many ``seconds``.
        """
        import sympy  # before the time runs: an import that is given up half way is broken for good

        from movimentum.analysis.interactive.formula import short_formula

        del sympy
        begun = time.monotonic()
        expressions = self.expressions(text)
        _ = self.piece  # what has no pose has no formula

        patience = max(LEAST_S, seconds - (time.monotonic() - begun)) / len(expressions)
        names = (text,) if len(expressions) == 1 else (f"{text}.x", f"{text}.y")
        tau = float(self.time - self.segment_motion.segment.start)
        found = partial(short_formula, self.segment_motion, tau)
        return [(name, found(each, patience)) for name, each in zip(names, expressions, strict=True)]

    def named_steps(self, text: str, seconds: float) -> list[tuple[str, Any]]:
        """An expression in short named steps, the last of them its components: of what has a formula that is too long
        to read. None where it has no formula, or there is no time to find it.
        """
        from movimentum.analysis.interactive.deadline import within
        from movimentum.equations.program import NoProgram
        from movimentum.equations.stage_maker import named_steps

        expressions = self.expressions(text)
        names = (text,) if len(expressions) == 1 else (f"{text}.x", f"{text}.y")
        tau = float(self.time - self.segment_motion.segment.start)
        found: list[tuple[str, Any]] = []

        def work() -> None:
            found.extend(named_steps(self.segment_motion, tau, list(zip(names, expressions, strict=True))))

        with suppress(NoProgram):
            within(seconds, work)
        return found

    def freedom(self) -> list[tuple[FreeMotion, str | None]]:
        """The free motions, each with a statement that would stop it, if one was found."""
        from movimentum.analysis.diagnose.trials import Trials, first_that_works
        from movimentum.analysis.freedom.motions import free_motions_at

        motions = free_motions_at(self.work.motion, self.time)
        if not motions:
            return []
        trials, index = Trials(self.work.motion), self.work.timeline.segment_at(self.time)
        return [(motion, first_that_works(trials, index, motion.holds, len(motions))) for motion in motions]

    def solutions(self) -> list[Alternatives]:
        """The parts of the scene that have several solutions, with all of them, and those that inequalities reject;
        where there is no pose, because they reject all.
        """
        from movimentum.analysis.interactive.all_solutions import alternatives
        from movimentum.solver.segment_motion import UnsolvedInterval

        part, tau = self.part
        piece = None if isinstance(part, UnsolvedInterval) else part
        found = alternatives(self.segment_motion, piece, tau)
        if piece is None and not any(each.rejected for each in found):
            _ = self.piece  # says that there is none
        return [each for each in found if len(each.solutions) + len(each.rejected) > (piece is not None)]

    def statement(self, constraint: int) -> tuple[int, str]:
        """The line and the text of a constraint."""
        source = self.work.scene.source
        span = next(item.span for item in self.work.scene.constraints() if item.number == constraint)
        return source.position(span.start).line, source.statement(span)

    def poses_of(self, snapshots: Sequence[Snapshot]) -> Poses:
        """The scene in each of ``snapshots``, as the poses of so many frames."""
        from movimentum.analysis.shown_numbers import with_shown_numbers

        count = len(snapshots)
        poses = self.poses().select(np.zeros(count, dtype=np.int64))
        places = np.array([[(p.x, p.y, p.c, p.s, p.angle) for p in each.things] for each in snapshots])
        places = places.reshape(count, -1, 5).swapaxes(0, 1)  # (things, snapshots, 5)
        made = replace(
            poses,
            frames=np.arange(count, dtype=np.int64),
            origin=places[:, :, :2].copy(),
            direction=places[:, :, 2:4].copy(),
            angle=places[:, :, 4].copy(),
            solved=np.ones(count, dtype=np.bool_),
        )
        return with_shown_numbers(self.work.motion, made, [self.time] * count)


_ABOVE = {Comparison.ABOVE, Comparison.AT_LEAST}


@dataclass(frozen=True, slots=True)
class Times:
    """When a condition holds: at ``crossings`` of an equality, or in the intervals ``holding`` of an inequality (the
    first and the last time of each).
    """

    crossings: tuple[Crossing, ...] = ()
    holding: tuple[tuple[Fraction, Fraction], ...] = ()

    @property
    def begins(self) -> tuple[Fraction, ...]:
        """The times at which it comes to hold."""
        return tuple(item.time for item in self.crossings) + tuple(first for first, _ in self.holding)

    @property
    def ends(self) -> tuple[Fraction, ...]:
        """The times at which it holds last."""
        return tuple(item.until for item in self.crossings) + tuple(last for _, last in self.holding)


def when(inspector: Inspector, condition: str) -> Times:
    """When a condition such as ``Rod.B.x = 300`` or ``Rod.B.x < 300`` holds. `ScriptError` (``query/expression``) for
    what is none.
    """
    whole = f"{condition.strip().removesuffix(';')};"
    statement = parsed_statement(whole, condition)
    if statement is None:
        raise script_error("query/expression", f"`{condition.strip()}` is not a condition such as `Rod.B.x = 300`")
    left, right = (whole[side.span.start : side.span.end] for side in (statement.left, statement.right))
    difference = inspector.query(f"({left}) - ({right})")
    sides = [inspector.query(side).expressions for side in (left, right)]
    turns = any(len(side) == 1 and side[0].op == "atan2d" for side in sides)
    curves = _curves(inspector, difference, turns=turns)
    if statement.comparison is Comparison.EQUAL:
        return Times(crossings=tuple(_common(curves)))
    if len(curves) != 1 or statement.comparison is Comparison.WISH:
        raise script_error("query/expression", f"`{condition.strip()}` is not a condition such as `Rod.B.x < 300`")
    return Times(holding=tuple(_holding(curves[0], above=statement.comparison in _ABOVE)))


def extremes(inspector: Inspector, expression: str, *, largest: bool) -> list[ExtremeValue | None]:
    """The largest or the smallest value of each component of an expression."""
    return [extreme(curve, largest=largest) for curve in _curves(inspector, inspector.query(expression), turns=False)]


def _curves(inspector: Inspector, query: Query, *, turns: bool) -> list[Curve]:
    """The components of a query as curves."""
    motion = inspector.work.motion
    count = len(query.expressions) or query.values(inspector.poses()).shape[1]

    def values(k: int, times: Sequence[Fraction]) -> FloatArray:
        poses = motion.poses_at(times)
        found = np.array(query.values(poses)[:, k], dtype=np.float64)
        found[~poses.solved] = np.nan
        return found

    def rates(k: int, times: Sequence[Fraction]) -> FloatArray:
        if query.expressions:
            try:
                return query.rates(motion, 1, times)[:, k]
            except UndefinedRate:  # of a free motion, which has no equations for it
                pass
        step = Fraction(DIFFERENCED_RATE) * (motion.timeline.end - motion.timeline.start)
        before, after = (values(k, [time + aside for time in times]) for aside in (-step, step))
        return (after - before) / float(2 * step)

    def of(k: int) -> Curve:
        return Curve(motion, lambda times: values(k, times), lambda times: rates(k, times), turns)

    return [of(k) for k in range(count)]


def _common(curves: Sequence[Curve]) -> list[Crossing]:
    """The crossings of one curve, or those times at which all of several are zero."""
    if len(curves) == 1:
        return crossings(curves[0])
    every = [crossings(curve) for curve in curves]
    still = [len(found) == 1 and found[0].way is Way.STAYS for found in every]
    leading = every[still.index(False)] if False in still else every[0]
    near = 100.0 * VALUE_TOUCHED * curves[0].motion.size
    met = [item for item in leading if all(abs(float(curve.values([item.time])[0])) <= near for curve in curves)]
    return [item if item.way is Way.STAYS else replace(item, way=Way.MEETS) for item in met]


def _holding(curve: Curve, *, above: bool) -> list[tuple[Fraction, Fraction]]:
    """The intervals in which a curve is on one side of zero."""
    timeline = curve.motion.timeline
    found = crossings(curve)
    bounds = sorted({timeline.start, timeline.end, *(t for item in found for t in (item.time, item.until))})
    gaps = {float(s.segment.start) for s in curve.motion.segments}
    bounds = sorted({*bounds, *(Fraction(start) for start in gaps if timeline.start <= start <= timeline.end)})
    result: list[tuple[Fraction, Fraction]] = []
    if len(bounds) == 1:
        value = float(curve.values(bounds)[0])
        return [(bounds[0], bounds[0])] if (value > 0.0) is above and value != 0.0 else []
    for first, last in pairwise(bounds):
        value = float(curve.values([(first + last) / 2])[0])
        if np.isfinite(value) and (value > 0.0 if above else value < 0.0):
            if result and result[-1][1] == first:
                result[-1] = (result[-1][0], last)
            else:
                result.append((first, last))
    return result
