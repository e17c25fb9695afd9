"""`equations`: a motion as equations and as code."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING

from movimentum.errors import MovimentumError, script_error
from movimentum.expressions import Expr, symbol
from movimentum.records import dataclass, replace
from movimentum.text import rational
from movimentum.tolerances import APART_IN_NAME_ONLY
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, rebuilding, solved, understand

if TYPE_CHECKING:
    from movimentum.equations.program import MotionProgram
    from movimentum.solver.motion import PathMotion
    from movimentum.source import SourceText

NO_FORM = "equations/no-form"


@dataclass(frozen=True, slots=True)
class KeptConstant:
    """The payload of a symbol for a constant that keeps its name."""

    name: str


def program_of(source: SourceText, choices: Choices, of: Sequence[str]) -> MotionProgram:
    """The program that gives the expressions ``of`` (none: all anchors, turns and variables) at any time.

    Raises `ScriptError` for an expression that makes no sense, and (``equations/no-form``) for a motion that has no
    program; `NoSolutionError` where there is none at some time.
    """
    from movimentum.equations.program import MotionProgram, NoProgram, StageMaker, StageProgram, identifier

    constants, choices = _kept(source, choices)
    motion = solved(arranged(understand(source, choices), choices), choices).motion.path
    outputs = _asked(source, choices, of) if of else _all(motion)
    payloads: dict[Hashable, str] = {KeptConstant(name): f"{identifier(name)}" for name in constants}
    stages: list[StageProgram] = []
    segments = motion.segments
    try:
        for k, segment in enumerate(segments):
            end = segments[k + 1].segment.start if k + 1 < len(segments) else motion.timeline.end
            if k and segment.segment.start == end and segment.segment.active == segments[k - 1].segment.active:
                continue
            stages.append(StageMaker(segment, float(end), [each for _, each in outputs], payloads).made())
    except NoProgram as error:
        raise script_error(
            NO_FORM, str(error), "name something that has a formula: `--of Crank.B.x`", "`movimentum solve` gives poses"
        ) from error
    values = tuple((identifier(name), value) for name, value in constants.items())
    return MotionProgram(values, tuple(name for name, _ in outputs), tuple(stages))


def _kept(source: SourceText, choices: Choices) -> tuple[dict[str, float], Choices]:
    """The constants that are plain numbers, and choices under which each is told apart from all other numbers: its
    value differs in the last digits.
    """
    scene = understand(source, choices)
    set_already = {name for name, _ in choices.settings}
    found: dict[str, float] = {}
    for constant in scene.constants:
        text = scene.source.text[constant.expression.start : constant.expression.end]
        value = rational(text.strip())
        if not value or len(constant.value) != 1 or constant.name in set_already:
            continue
        near = float(value) * (1.0 + APART_IN_NAME_ONLY * (1.0 + math.sqrt(2.0 + len(found)) % 1.0))
        named = Expr("const", (), near, symbol(KeptConstant(constant.name)))
        more = replace(choices, settings=(*choices.settings, (constant.name, named)))
        try:
            arranged(understand(source, more), more)
        except MovimentumError:
            continue  # a number of copies, say
        found[constant.name], choices = float(value), more
    return found, choices


def _all(motion: PathMotion) -> list[tuple[str, Expr]]:
    """What `solve` writes, by the names of its columns."""
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
            raise script_error("query/expression", f"`{text}` is no expression", "for instance `--of Crank.B.x`")
        parts = understood(statement.left, 0, rebuilding(source, choices))
        names = (text,) if len(parts) == 1 else (f"{text}.x", f"{text}.y")
        found += zip(names, parts, strict=False)
    return found
