"""Evaluates any expression of the language in a motion.

All users of expressions come here: `motion["…"]`, the numbers in pictures, claims, measures of sweeps, fits, the
debugger and the studio. An expression comes from the scene, or from a text typed about a script and read as the
script's own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.expressions import Expr, substitute, symbol, symbols, walk
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import Bearing, Cord
from movimentum.scene.model import AnchorCoordinate, Claim, Scene, ThingAngle, ThingProperty, VariableComponent
from movimentum.solver.motion import MotionOfAnyAccuracy, PathMotion
from movimentum.solver.poses import Poses
from movimentum.source import SourceText, Span
from movimentum.timeline.model import Timeline

if TYPE_CHECKING:  # the parser is imported where a text is read
    from movimentum.syntax.expression_tree import Expression
    from movimentum.syntax.tree import ClaimStatement, Statement

Reader = Callable[[Poses], list[FloatArray]]
"""From the poses of F moments to one (F,) array for each expression; nan if an expression has no value."""

NOT_A_READING = "claim/not-a-reading"
"""The code of what has to be solved for and cannot just be read off a motion (an integral, a derivative)."""


def reader(scene: Scene, expressions: Sequence[Expr], motion: PathMotion | None = None) -> Reader:
    """Evaluates ``expressions`` of the scene's anchors, angles, properties, variables and clocks (`scene.model`).

    ``motion``: where the poses are from, if that is known: whole rounds of places of contact and of cords are counted
    along it, derivatives are its exact rates, and ``.at`` looks at it at another time. NotImplementedError for one that
    has to be solved for (an integral; without a motion a derivative).
    """
    if any(isinstance(payload, Cord) for payload in symbols(*expressions)):
        from movimentum.timeline.cords import read_cords  # few scripts have any

        return reader(scene, read_cords(scene, expressions, rounds=motion is not None), motion)
    along: dict[Expr, Callable[[Poses], FloatArray]] = {}
    if motion is not None and _needs_motion(expressions):
        along = _along(motion, expressions)
    payloads = sorted((p for p in symbols(*expressions) if symbol(p) not in along), key=repr)
    place = {payload: n for n, payload in enumerate(payloads)}
    place_along = {node: n + len(payloads) for n, node in enumerate(along)}
    memo = {node: symbol(number) for node, number in place_along.items()}

    def numbered(node: Expr) -> Expr | None:
        return symbol(place[node.payload]) if node.op == "symbol" else None

    clocks = Clocks()
    function = compiled([substitute(e, numbered, memo) for e in expressions], clocks)
    starts: list[Fraction] = clocks.starts

    def read(poses: Poses) -> list[FloatArray]:
        count = len(poses.times)
        worlds: dict[tuple[int, int], FloatArray] = {}

        def value(payload: object) -> FloatArray:
            match payload:
                case AnchorCoordinate(thing, anchor, axis):
                    if (thing, anchor) not in worlds:
                        local = scene.things[thing].anchors[anchor].local
                        worlds[thing, anchor] = poses.world(thing, local)
                    return worlds[thing, anchor][:, axis]
                case ThingAngle(thing):
                    return poses.angle[thing]
                case ThingProperty(thing, name):
                    found = poses.properties.get((thing, name))
                    return np.full(count, scene.things[thing].undriven(name)) if found is None else found
                case VariableComponent(name, axis):
                    value = poses.variables[name] if axis is None else poses.variables[name][:, axis]
                    return np.where(poses.missing[name], np.nan, value) if name in poses.missing else value
                case _:
                    raise NotImplementedError(payload)

        known = [*map(value, payloads), *(each(poses) for each in along.values())]
        with np.errstate(all="ignore"):
            found = function(known, [poses.times - float(start) for start in starts])
        return [np.array(np.broadcast_to(v, count), dtype=np.float64) for v in found]

    return read


def _needs_motion(expressions: Sequence[Expr]) -> bool:
    """Whether there may be something that one pose does not tell, without the modules of what that is."""
    return any(
        node.op in ("nearest", "nearest-turned", "derivative", "reduction") or isinstance(node.payload, Bearing | Cord)
        for node in walk(*expressions)
    )


def _along(motion: PathMotion, expressions: Sequence[Expr]) -> dict[Expr, Callable[[Poses], FloatArray]]:
    """What one pose does not tell, and how to read it in poses of a motion."""
    from movimentum.solver.rates.rates import rates_at
    from movimentum.solver.round_counting import count_rounds, counts_rounds, visible_value  # few scripts have any

    scene = motion.timeline.scene

    def turning(node: Expr) -> Callable[[Poses], FloatArray]:
        at_once = reader(scene, [visible_value(node)])
        track = count_rounds(motion, node, lambda poses: at_once(poses)[0])
        return lambda poses: track.values(motion, poses)

    def at_another_time(node: Expr) -> Callable[[Poses], FloatArray]:
        inner, time = node.args
        there = motion.poses_at([Fraction(time.value or 0.0)])
        value = reader(scene, [inner], motion)(there)[0][0] if there.solved[0] else np.nan
        return lambda poses: np.full(len(poses.times), value)

    def moving(node: Expr) -> Callable[[Poses], FloatArray]:
        return lambda poses: rates_at(motion, [node], 0, [Fraction(time) for time in poses.times.tolist()])[0]

    found: dict[Expr, Callable[[Poses], FloatArray]] = {}
    for node in walk(*expressions):
        if node.op == "derivative":
            found[node] = moving(node)
        elif node.op == "reduction" and node.payload == "at":
            found[node] = at_another_time(node)
        elif counts_rounds(node):
            found[node] = turning(node)
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Query:
    """An expression that is asked for, called ``text``: of one component, or of two for a vector.

    ``values``: (F, n) in the poses of F moments; nan where it has no value. ``expressions``: its n components in
    symbols of the scene; none for what had to be solved for (see `solved_query`), which has no `rates`.
    """

    text: str
    expressions: tuple[Expr, ...]
    values: Callable[[Poses], FloatArray]

    @property
    def goes_round(self) -> bool:
        """Whether there may be something in it that goes on for more than a round."""
        return _needs_motion(self.expressions)

    def along(self, motion: MotionOfAnyAccuracy) -> Query:
        """The same, in poses of a motion only: whole rounds of contacts and cords are counted along it (`reader`)."""
        if not self.goes_round:
            return self
        return make_query(motion.timeline.scene, self.text, self.expressions, motion.path)

    def rates(self, motion: MotionOfAnyAccuracy, order: int, times: Sequence[Fraction]) -> FloatArray:
        """(F, n): its velocity (``order`` 1) or acceleration (2) at ``times`` (ascending), per time unit.

        Exact, from the derivatives of the equations; see `solver.rates` for one-sided rates and `UndefinedRate`.
        """
        from movimentum.solver.rates.rates import rates_at

        return rates_at(motion.path, self.expressions, order, times).T


def make_query(scene: Scene, text: str, expressions: tuple[Expr, ...], motion: PathMotion | None = None) -> Query:
    """The query for ``expressions`` of a scene; ``motion`` and NotImplementedError as in `reader`."""
    read = reader(scene, expressions, motion)
    return Query(text.strip(), expressions, lambda poses: np.stack(read(poses), axis=-1))


# --- what somebody types ----------------------------------------------------------------------------------

Rebuild = Callable[["tuple[int, Statement | ClaimStatement]"], Timeline]
"""The script read again with one more statement, (number of its step, statement), up to its timeline."""


def parsed_statement(whole: str, text: str) -> Statement | None:
    """The one statement in ``whole``, which is the typed ``text`` with what the parser asks for behind it; None where
    there is another number of them. Raises `ScriptError` with places in ``text``.
    """
    from movimentum.syntax.parser import parse
    from movimentum.syntax.tree import Statement

    try:
        items = parse(SourceText("<typed>", whole)).items
    except ScriptError as error:
        item, end = error.diagnostics[0], len(text.rstrip())
        if item.span is not None and item.span.start >= end:  # at what stands there for the parser's sake
            message = re.sub(r"found `[^`]*`$", "found its end", item.message)
            item = replace(item, message=message, span=Span(max(end - 1, 0), end), labels=(), helps=())
        raise ScriptError([item]) from error
    return items[0] if len(items) == 1 and isinstance(items[0], Statement) else None


def understood(expression: Expression, step: int, rebuild: Rebuild) -> tuple[Expr, ...]:
    """The components of an ``expression`` inside the script: put there as a claim, which has no influence on anything,
    and which holds from step number ``step`` to the end. None of them for a bare ``_``, which is any value;
    `ScriptError` where it makes no sense.
    """
    from movimentum.syntax.expression_tree import Comparison
    from movimentum.syntax.tree import ClaimStatement

    timeline = rebuild((step, ClaimStatement(expression, Comparison.EQUAL, expression, span=expression.span)))
    place = timeline.scene.steps[step].claims[-1]
    if not isinstance(place, Claim):
        return ()
    found = next(held.claim.left for held in timeline.claims if held.claim.number == place.number)
    for node in walk(*found):
        if node.op == "derivative":
            raise ScriptError([_refused(NOT_A_READING, "`.d(…)` has to be solved for", expression.span)])
        if node.op == "reduction":
            message = "`.at(…)` looks at another time: ask for the value there"
            raise ScriptError([_refused("kind/reduction", message, expression.span)])
    return found


def _refused(code: str, message: str, span: Span) -> Diagnostic:
    return Diagnostic(code, Severity.ERROR, message, span)


def solved_query(
    text: str,
    scene: Scene,
    expression: Expression,
    step: int,
    rebuild: Rebuild,
    solve: Callable[[Timeline], PathMotion],
) -> Query:
    """The query for an expression that is not a reading (a derivative, an integral): the script is solved again, with a
    variable that equals it. Without a clock or an integral it is so from the first step on, not only from ``step`` on.
    """
    from movimentum.syntax.expression_tree import Call, Clock, Comparison, Name, postorder
    from movimentum.syntax.tree import Statement

    nodes = list(postorder(expression))
    used = {node.name for node in nodes if isinstance(node, Name)}
    taken = {*scene.variables, *(item.name for item in (*scene.things, *scene.constants))}
    name = next(name for k in range(10**6) if (name := f"Shown{k}") not in taken)
    timed = any(
        isinstance(node, Clock) or (isinstance(node, Call) and node.function in ("i", "integral")) for node in nodes
    )
    variable = Name(name, span=expression.span)
    statement = Statement(variable, Comparison.EQUAL, expression, span=expression.span)
    motion = solve(rebuild((step if timed else 0, statement)))
    exact = {float(item.time): item.time for item in motion.timeline.scene.steps}

    def values(poses: Poses) -> FloatArray:
        found = motion.poses_at([exact.get(time, Fraction(time)) for time in poses.times.tolist()])
        column = found.variables[name].copy()
        lacking = [mask for some in (found, poses) for of, mask in some.missing.items() if of == name or of in used]
        column[np.logical_or.reduce([~found.solved, *lacking])] = np.nan
        return column if column.ndim == 2 else column[:, None]

    return Query(text.strip(), (), values)
