"""`equations`: a motion as equations and as code."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.diagnostics import Diagnostic, Severity, real
from movimentum.errors import MovimentumError, ScriptError, script_error
from movimentum.expressions import Expr, named_origins, symbol, walk
from movimentum.records import replace
from movimentum.tolerances import APART_IN_NAME_ONLY, ZERO_IN_NAME_ONLY
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, plain_numbers, rebuilding, solved, understand

if TYPE_CHECKING:
    from movimentum.equations.program import MotionProgram, NoProgram, StageProgram
    from movimentum.scene.model import Scene
    from movimentum.solver.motion import PathMotion
    from movimentum.source import SourceText

NO_FORM = "equations/no-form"


def program_of(source: SourceText, choices: Choices, of: Sequence[str]) -> MotionProgram:
    """The program that gives the expressions ``of`` (none: all anchors, turns and variables) at any time.

    Raises `ScriptError` for an expression that makes no sense, and (``equations/no-form``) for a motion that has no
    program; `NoSolutionError` where there is none at some time.
    """
    from movimentum.equations.program import ConstantSymbol, MotionProgram, NoProgram, identifier

    constants, kept = _distinguished(source, choices)
    motion = _solved(source, kept)
    bare = bare_numbers(_moved(source, choices)) if constants else frozenset[float]()
    if not bare_numbers(motion) <= bare and constants:
        constants, kept = _whole_names(source, choices, constants, bare)
        motion = _moved(source, kept)
    choices = kept
    outputs = _asked(source, choices, of) if of else _all(motion)
    payloads: dict[Hashable, str] = {ConstantSymbol(name): f"{identifier(name)}" for name in constants}
    try:
        stages = stages_of(motion, [each for _, each in outputs], payloads)
    except NoProgram as error:
        helps = (
            Advised("name something that has a formula: `", Choose.OF.to("Crank.B.x"), "`"),
            "`movimentum solve` gives poses",
        )
        raise no_form(error, motion.timeline.scene, *helps) from error
    values = tuple((identifier(name), value) for name, value in constants.items())
    return MotionProgram(values, tuple(name for name, _ in outputs), stages)


def stages_of(
    motion: PathMotion, outputs: Sequence[Expr], payloads: Mapping[Hashable, str], *, whole: bool = False
) -> tuple[StageProgram, ...]:
    """The steps of a motion, as programs; `NoProgram` where one has none. ``whole``: see `StageMaker`."""
    from movimentum.equations.stage_maker import StageMaker

    stages: list[StageProgram] = []
    segments = motion.segments
    for k, segment in enumerate(segments):
        end = segments[k + 1].segment.start if k + 1 < len(segments) else motion.timeline.end
        if k and segment.segment.start == end and segment.segment.active == segments[k - 1].segment.active:
            continue
        stages.append(StageMaker(segment, float(end), outputs, payloads, whole).made())
    return tuple(stages)


def no_form(error: NoProgram, scene: Scene, *helps: str) -> ScriptError:
    """The error for a motion without a program, at the statement that is the reason."""
    spans = [constraint.span for constraint in scene.constraints() if constraint.number in error.constraints]
    found = Diagnostic(NO_FORM, Severity.ERROR, str(error), spans[0] if spans else None, helps=helps)
    return ScriptError([real(found, scene.source)])


def _distinguished(source: SourceText, choices: Choices) -> tuple[dict[str, float], Choices]:
    """The constants that are plain numbers, and choices under which each keeps its name (see `distinguishable`)."""
    scene = understand(source, choices)
    found: dict[str, float] = {}
    for constant, value in plain_numbers(scene, choices):
        more = distinguishable(choices, constant.name, value, len(found))
        try:
            arranged(understand(source, more), more)
        except MovimentumError:
            continue  # a number of copies, say
        found[constant.name], choices = value, more
    return found, choices


def _solved(source: SourceText, choices: Choices) -> PathMotion:
    return solved(arranged(understand(source, choices), choices), choices).motion.path


def _moved(source: SourceText, choices: Choices) -> PathMotion:
    """The motion, where somebody else has looked for what is wrong with it."""
    return moved(arranged(understand(source, choices), choices))


def bare_numbers(motion: PathMotion) -> frozenset[float]:
    """The constants of a motion's equations that were not computed from a named constant: where these are others than
    those of the script itself, a name got lost on the way (in a cord's radius, say).
    """
    found: set[float] = set()
    known: dict[int, tuple[Expr, frozenset[Hashable]]] = {}
    for segment in motion.segments:
        for equation in segment.plan.system.equations:
            for node in walk(equation.residual):
                if node.op == "const" and node.value is not None and not named_origins(node, known):
                    found.add(node.value)
    return frozenset(found)


def _whole_names(
    source: SourceText, choices: Choices, constants: Mapping[str, float], bare: frozenset[float]
) -> tuple[dict[str, float], Choices]:
    """Those of the constants whose names reach the equations, and choices under which only they keep them."""
    found: dict[str, float] = {}
    kept = choices
    for number, (name, value) in enumerate(constants.items()):
        if bare_numbers(_moved(source, distinguishable(choices, name, value, number))) <= bare:
            kept = distinguishable(kept, name, value, number)
            found[name] = value
    return found, kept


def distinguishable(choices: Choices, name: str, value: float, number: int) -> Choices:
    """Choices under which a constant, ``number`` of several, is told apart from all other numbers: its value differs
    in the last digits.
    """
    from movimentum.equations.program import ConstantSymbol

    share = APART_IN_NAME_ONLY * (1.0 + math.sqrt(2.0 + number) % 1.0)
    near = value * (1.0 + share) if value else ZERO_IN_NAME_ONLY * (number + 1)
    named = Expr("const", (), near, symbol(ConstantSymbol(name)))
    return replace(choices, settings=(*choices.settings, (name, named)))


def _all(motion: PathMotion) -> list[tuple[str, Expr]]:
    """The values that `solve` writes, by the names of their columns."""
    from movimentum.scene.model import AnchorCoordinate, ThingAngle, VariableComponent

    scene = motion.timeline.scene
    found: list[tuple[str, Expr]] = []
    for thing in scene.things:
        if not thing.is_body:
            continue
        for k, anchor in enumerate(thing.anchors):
            for axis in (0, 1):
                name = f"{thing.name}.{anchor.name}.{'xy'[axis]}"
                found.append((name, symbol(AnchorCoordinate(thing.number, k, axis))))
        found.append((f"{thing.name}.angle", symbol(ThingAngle(thing.number))))
    known = motion.segments[0].plan.system.number_of
    for name, variable in scene.variables.items():
        for axis in (0, 1) if variable.is_vector else (None,):
            payload = VariableComponent(name, axis)
            if all(payload in segment.plan.system.number_of for segment in motion.segments) and payload in known:
                found.append((name if axis is None else f"{name}.{'xy'[axis]}", symbol(payload)))
    return found


def _asked(source: SourceText, choices: Choices, of: Sequence[str]) -> list[tuple[str, Expr]]:
    """Expressions that somebody asks for, by component."""
    from movimentum.query import parsed_statement, understood

    found: list[tuple[str, Expr]] = []
    for text in of:
        statement = parsed_statement(f"{text} = 0;", text)
        if statement is None:
            raise script_error(
                "query/expression",
                f"`{text}` is no expression",
                Advised("for instance `", Choose.OF.to("Crank.B.x"), "`"),
            )
        parts = understood(statement.left, 0, rebuilding(source, choices))
        names = (text,) if len(parts) == 1 else (f"{text}.x", f"{text}.y")
        found += zip(names, parts, strict=False)
    return found
