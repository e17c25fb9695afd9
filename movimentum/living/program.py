"""The JavaScript of a living figure: computes the motion, then all numbers of the picture."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

from movimentum.analysis.interactive.formula import to_sympy
from movimentum.equations.code import CodeWriter, following_javascript, following_python
from movimentum.equations.program import BranchSign, ContinuousTurn, NamedValue, NewtonLoop, StageProgram
from movimentum.expressions import Expr, named_origins, symbol, walk
from movimentum.living.scene import FilmExtreme, FilmTime, Placed, RateOf
from movimentum.records import dataclass, replace


@dataclass(frozen=True, slots=True, eq=False)
class LiveStage:
    """A step: its program has, after the ``drawn`` outputs of the picture, its margins, then what inequalities and
    equations that determine nothing keep it to, so many of each.
    """

    program: StageProgram
    drawn: int
    margins: int
    choices: int
    checks: int

    @property
    def signs(self) -> list[str]:
        """The branches that inequalities may choose."""
        return [one.name for one in self.program.statements if isinstance(one, BranchSign)]

    @property
    def follows(self) -> bool:
        """Whether an instant goes on from the one before."""
        return any(isinstance(one, ContinuousTurn | NewtonLoop) for one in self.program.statements)


def live_stage(stage: StageProgram, drawn: int) -> LiveStage:
    """A step with everything that it must keep to among its outputs; the first are ``drawn``, others must not be
    negative.
    """
    loops = [each for one in stage.statements if isinstance(one, NewtonLoop) for each in one.residuals]
    margins = [*stage.outputs[drawn:], *(fork.margin for fork in stage.forks)]
    checks = [*stage.checks, *loops]
    outputs = (*stage.outputs[:drawn], *margins, *stage.choices, *checks)
    # the page begins at the beginning, and remembers
    statements = tuple(
        replace(one, times=one.times[:1], values=one.values[:1])
        if isinstance(one, ContinuousTurn | NewtonLoop)
        else one
        for one in stage.statements
    )
    program = replace(stage, statements=statements, outputs=outputs)
    return LiveStage(program, drawn, len(margins), len(stage.choices), len(checks))


def opened(expressions: Sequence[Expr]) -> list[Expr]:
    """Expressions whose constants are what they were computed from, where that has a name. (By the nodes themselves:
    equal constants may come from others.)
    """
    known: dict[int, tuple[Expr, frozenset[Hashable]]] = {}
    made: dict[int, tuple[Expr, Expr]] = {}

    def unfolded(node: Expr) -> Expr:
        if id(node) not in made:
            found = node
            if node.args:
                found = Expr(node.op, tuple(map(unfolded, node.args)), node.payload)
            elif node.origin is not None and named_origins(node, known):
                found = unfolded(node.origin)
            made[id(node)] = node, found
        return made[id(node)][1]

    return list(map(unfolded, expressions))


def picture_stage(expressions: Sequence[Expr], constants: Mapping[Hashable, str]) -> StageProgram:
    """Numbers of a picture as a program: what is used twice has a name."""
    import sympy as library

    sympy: Any = library
    roots = opened(expressions)
    uses = Counter(arg for node in walk(*roots) for arg in node.args)
    made: dict[Expr, Any] = {}
    statements: list[NamedValue] = []

    def leaf(node: Expr) -> Any:
        match node.payload:
            case Expr():
                return made[node.payload]
            case Placed(number):
                name = f"v{number}_"
            case RateOf(number, order):
                name = f"r{number}_{order}_"
            case FilmExtreme(number, most):
                name = f"e{2 * number + most}_"
            case FilmTime():
                name = "t"
            case payload:
                name = constants[payload]
        return sympy.Symbol(name, real=True)

    for node in walk(*roots):
        if not node.args:
            made[node] = to_sympy(node, leaf)
            continue
        shallow = Expr(node.op, tuple(symbol(arg) for arg in node.args), node.payload)
        value = to_sympy(shallow, leaf)
        if (uses[node] > 1 or node.op not in ("add", "mul", "neg")) and not value.is_Atom:
            name = f"q{len(statements)}_"
            statements.append(NamedValue(name, value))
            value = sympy.Symbol(name, real=True)
        made[node] = value
    return StageProgram(0.0, 0.0, tuple(statements), tuple(made[root] for root in roots))


def javascript(
    stages: Sequence[LiveStage], picture: StageProgram, measures: StageProgram, constants: Sequence[str]
) -> str:
    """An object ``MOVIMENTUM_LIVE`` with ``stages`` (functions of time, constants and a memory), and ``picture`` and
    ``measures`` (of outputs, rates, extremes, constants, time).
    """
    body = following_javascript([stage.program for stage in stages], constants)
    functions = ",\n".join(
        f"{name}: {_function(one, constants)}" for name, one in (("picture", picture), ("measures", measures))
    )
    return f"const MOVIMENTUM_LIVE = (() => {{\n{body}return {{stages: STAGES,\n{functions}}};\n}})();\n"


_OWN = re.compile(r"([vre])(\d+(?:_\d)?)_")
"""Names of what is passed: outputs, rates, extremes."""


def _function(stage: StageProgram, constants: Sequence[str]) -> str:
    names = {
        str(one)
        for value in (*(s.value for s in stage.statements if isinstance(s, NamedValue)), *stage.outputs)
        for one in value.free_symbols
    }
    own = [found for name in sorted(names) if (found := _OWN.fullmatch(name))]
    taken = [f'{found[0]} = {found[1]}s_["{found[2]}"]' for found in own]
    taken += [f"{name} = constants_.{name}" for name in constants if name in names]
    head = f"const {', '.join(taken)};\n" if taken else ""
    lines = "\n".join(CodeWriter("javascript").stage(stage, "const found_"))
    return f"(vs_, rs_, es_, constants_, t) => {{\n{head}{lines}\nreturn found_;\n}}"


Values = Callable[[float, Mapping[str, float], dict[str, float]], list[float]]


def python(stage: LiveStage, constants: Sequence[str]) -> Values:
    """A step as a function here, by the same statements."""
    space: dict[str, Any] = {}
    exec(compile(following_python(stage.program, constants), "<living figure>", "exec"), space)
    return space["values"]
