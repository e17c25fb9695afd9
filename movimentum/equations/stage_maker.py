"""Makes a step's program from its plan: closed forms, Newton loops, and tables of signs, turns and starts.

It also splits one long expression into short named steps at an instant, as the debugger shows long formulas.
"""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np

from movimentum.analysis.interactive.formula import has_long_table, lowered_in, readable, to_sympy
from movimentum.arrays import FloatArray
from movimentum.equations.program import (
    RESERVED,
    BranchSign,
    ContinuousTurn,
    Fork,
    NamedValue,
    NewtonLoop,
    NoProgram,
    StageProgram,
    Statement,
    identifier,
)
from movimentum.expressions import Expr, const, substitute, symbol
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.unknowns import Accumulated, symbol_numbers, unknown_number
from movimentum.records import dataclass, field
from movimentum.scene.leaves import Bearing
from movimentum.solver.continuation.tracks import SignTrack, StillTrack
from movimentum.solver.kinds.context import LoopRows
from movimentum.solver.kinds.kernels import loop
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval

MOST_STARTS = 129
"""Rows of a table of starts."""


@dataclass(slots=True, eq=False)
class StageMaker:
    """Makes the stage of a segment's ``motion`` whose outputs are ``wanted`` (expressions of the scene). ``whole``:
    with all blocks, and what the motion must keep to.
    """

    motion: SegmentMotion
    end: float
    wanted: Sequence[Expr]
    open: Mapping[Hashable, str]
    whole: bool = False
    names: dict[int, str] = field(default_factory=dict[int, str])
    taken: set[str] = field(default_factory=lambda: set(RESERVED))
    statements: list[Statement] = field(default_factory=list[Statement])
    loops: list[Any] = field(default_factory=list[Any])
    forks: list[Fork] = field(default_factory=list[Fork])
    count: int = 0
    memo: dict[Expr, Any] = field(default_factory=dict[Expr, Any])

    def made(self) -> StageProgram:
        """The stage; `NoProgram` where there is none."""
        plan = self.motion.plan
        self.taken |= set(self.open.values())
        found = [lowered_in(self.motion, each) for each in self.wanted]
        roots: list[Expr] = []
        for one in found:
            if not isinstance(one, Expr):
                raise NoProgram(one.words)
            roots.append(one)
        blocks = plan.blocks if self.whole else [plan.blocks[k] for k in plan.rate_blocks(symbol_numbers(*roots))]
        for block in blocks:
            if block.integrals or (block.iterative and loop(block) is None):
                raise self._none(block)
            if has_long_table(*(plan.system.equations[e].residual for e in block.equations)):
                raise self._none(block, "follows a curve, or a long table")
        if has_long_table(*roots):
            raise NoProgram("a value reads a curve, or a long table, and has no formula")
        for block in blocks:
            self._take(block)
        system = plan.system
        outputs, choices, checks = (
            tuple(self.expression(root) for root in some)
            for some in (
                roots,
                [selector.value for selector in system.selectors] if self.whole else [],
                [system.equations[e].residual for e in plan.checks] if self.whole else [],
            )
        )
        start, statements = float(system.segment.start), tuple(self.statements)
        return StageProgram(start, self.end, statements, outputs, tuple(self.loops), tuple(self.forks), choices, checks)

    def name(self, unknown: int) -> str:
        """The identifier of an unknown."""
        found = self.names.get(unknown)
        if found is None:
            base = identifier(self.motion.plan.system.unknowns[unknown].name)
            found = self.names[unknown] = self.fresh(base)
        return found

    def fresh(self, base: str) -> str:
        """An identifier that is not taken."""
        name, k = base, 1
        while name.lower() in {one.lower() for one in self.taken}:
            k += 1
            name = f"{base}_{k}"
        self.taken.add(name)
        return name

    def expression(self, root: Expr) -> Any:
        """An expression of the plan in SymPy's terms, angles in degrees outside of sines."""
        import sympy as library

        sympy: Any = library

        def leaf(node: Expr) -> Any:
            match node.op:
                case "symbol":
                    if node.payload in self.open:
                        return sympy.Symbol(self.open[node.payload], real=True)
                    return sympy.Symbol(self.name(unknown_number(node.payload)), real=True)
                case "sign":
                    return sympy.Symbol(f"sign_{node.payload}", real=True)
                case _:
                    start = node.start
                    t = sympy.Symbol("t", real=True)
                    return t - sympy.Rational(start.numerator, start.denominator)

        return to_sympy(root, leaf, self.memo)

    # --- blocks

    def _take(self, block: Block) -> None:
        system = self.motion.plan.system
        heading, rows = self.motion.plan.heading(block), loop(block)
        if not block.assigned and not block.continued:
            self.loops += [self.expression(system.equations[e].residual) for e in block.equations]
        if heading is not None:
            self._turn(block, heading)
        elif block.assigned and isinstance(system.unknowns[block.unknowns[0]].payload, Bearing):
            self._bearing(block)
        elif block.assigned:
            self._formulas(block)
        elif block.discriminant is not None:
            times, signs = self._signs(block)
            self.statements.append(BranchSign(f"sign_{block.number}", times, signs))
            self._formulas(block)
            self._fork(block, block.discriminant)
        elif rows is not None:
            self._newton(block, rows)
        else:
            raise self._none(block)

    def _none(self, block: Block, what: str = "comes from an integral") -> NoProgram:
        system = self.motion.plan.system
        reasons = [system.equations[e].constraint for e in block.equations]
        if block.moves_least:
            what = "moves freely, or follows a wish"
            wishes = [wish.constraint for wish in system.wishes if wish.about & set(block.unknowns)]
            reasons = wishes or reasons
        named = [system.unknowns[n] for n in block.unknowns]
        named = [one for one in named if not isinstance(one.payload, Accumulated)]
        who = "the motion"
        if named:
            first = named[0]
            who = f"`{first.name if first.thing is None else system.scene.things[first.thing].name}`"
        return NoProgram(f"{who} {what}, and has no formula", [n for n in reasons if n is not None])

    def _formulas(self, block: Block) -> None:
        """Closed forms in named steps: what occurs twice has a name."""
        import sympy as library

        sympy: Any = library
        core = [pair for pair in block.formulas if pair[0] in block.core]
        names = [self.name(n) for n, _ in core]
        values = [self.expression(value) for _, value in core]

        def steps() -> Any:
            while True:
                self.count += 1
                yield sympy.Symbol(self.fresh(f"s{self.count}"), real=True)

        shared, short = sympy.cse(values, symbols=steps(), order="none")
        self.statements += [NamedValue(str(one), value) for one, value in shared]
        self.statements += [NamedValue(name, value) for name, value in zip(names, short, strict=True)]
        rest = [(n, value) for n, value in block.formulas if n not in block.core]
        self.statements += [NamedValue(self.name(n), self.expression(value)) for n, value in rest]

    def _fork(self, block: Block, margin: Expr) -> None:
        equations = self.motion.plan.system.equations
        given = dict(block.given)

        def put(node: Expr) -> Expr | None:
            return given.get(unknown_number(node.payload)) if node.op == "symbol" else None

        rows = [self.expression(substitute(equations[e].residual, put)) for e in block.equations]
        names = tuple(self.name(n) for n in block.core)
        self.forks.append(Fork(names, tuple(rows), self.expression(margin)))

    def _newton(self, block: Block, rows: LoopRows) -> None:
        residuals = tuple(map(self.expression, rows.residuals))
        slopes = tuple(tuple(map(self.expression, row)) for row in rows.slopes)
        names = tuple(self.name(n) for n in block.core)
        times, values = self._path(block.core)
        self.statements.append(NewtonLoop(names, residuals, slopes, times, values))
        self.statements += [NamedValue(self.name(n), self.expression(value)) for n, value in block.given]

    def _turn(self, block: Block, heading: Expr) -> None:
        (n,) = block.unknowns
        y, x = heading.args
        times, values = self._path((n,))
        self.statements.append(
            ContinuousTurn(
                self.name(n), self.expression(y), self.expression(x), times, tuple(value for (value,) in values)
            )
        )

    def _bearing(self, block: Block) -> None:
        """A direction that is continuous: its formula gives it up to whole turns, and rounding may choose them."""
        import sympy as library

        sympy: Any = library
        for n, value in block.given:
            angle = self.expression(value) * sympy.pi / 180
            times, values = self._path((n,))
            column = tuple(each for (each,) in values)
            self.statements.append(ContinuousTurn(self.name(n), sympy.sin(angle), sympy.cos(angle), times, column))

    # --- tables

    def _signs(self, block: Block) -> tuple[tuple[float, ...], tuple[float, ...]]:
        times: list[float] = []
        signs: list[float] = []
        for piece in self.motion.pieces:
            if isinstance(piece, UnsolvedInterval):
                continue
            track = piece.tracks[block.number]
            sign, switches = 1.0, ()
            if isinstance(track, SignTrack):
                sign, switches = track.first, tuple(track.switches.tolist())
            elif isinstance(track, StillTrack):
                sign = self._still_sign(block, piece)
            for time in (piece.begin, *switches):
                if signs and time <= times[-1] and signs[-1] == sign:
                    continue
                times.append(float(time))
                signs.append(sign)
                sign = -sign
        return tuple(times), tuple(signs)

    def _still_sign(self, block: Block, piece: Any) -> float:
        """The sign with which the formulas give what a still block is."""
        state, _ = piece.solve(piece.instants(np.array([piece.begin])))
        n, value = block.formulas[0]
        found: dict[float, float] = {}
        for sign in (1.0, -1.0):
            put = substitute(value, lambda node, sign=sign: const(sign) if node.op == "sign" else None)
            numbers = sorted(symbol_numbers(put))
            places = {number: k for k, number in enumerate(numbers)}
            put = substitute(
                put,
                lambda node, places=places: (
                    symbol(places[unknown_number(node.payload)]) if node.op == "symbol" else None
                ),
            )
            known = [np.ravel(state[number])[:1] for number in numbers]
            with np.errstate(all="ignore"):
                (result,) = compiled([put], Clocks())(known, [])
            found[sign] = abs(float(np.ravel(result)[0]) - float(np.ravel(state[n])[0]))
        return min(found, key=found.__getitem__)

    def _path(self, unknowns: Sequence[int]) -> tuple[tuple[float, ...], tuple[tuple[float, ...], ...]]:
        """Values of unknowns along the path."""
        times: list[float] = []
        rows: list[tuple[float, ...]] = []
        for piece in self.motion.pieces:
            if isinstance(piece, UnsolvedInterval):
                continue
            tau = self._nodes(piece.begin, piece.end, piece.nodes)
            state, _ = piece.solve(piece.instants(tau))
            columns = [np.broadcast_to(np.asarray(state[n], dtype=np.float64), len(tau)) for n in unknowns]
            times += tau.tolist()
            rows += [tuple(map(float, row)) for row in zip(*columns, strict=True)]
        still = all(row == rows[0] for row in rows)
        return (tuple(times[:1]), tuple(rows[:1])) if still else (tuple(times), tuple(rows))

    def _nodes(self, begin: float, end: float, nodes: FloatArray) -> FloatArray:
        inside = nodes[(nodes >= begin) & (nodes <= end)]
        if len(inside) > MOST_STARTS:
            inside = inside[np.linspace(0, len(inside) - 1, MOST_STARTS).round().astype(np.intp)]
        count = max(2, min(33, int(60 * (end - begin)) + 2)) if end > begin else 1
        return np.unique(np.concatenate([inside, np.linspace(begin, end, count)]))


def named_steps(motion: SegmentMotion, tau: float, wanted: Sequence[tuple[str, Expr]]) -> list[tuple[str, Any]]:
    """Names with SymPy expressions of the time ``t`` since the step, on the branch that is followed ``tau`` after it;
    what is ``wanted`` comes last. `NoProgram` where a step is no formula.
    """
    import sympy as library

    sympy: Any = library
    stage = StageMaker(motion, 0.0, [each for _, each in wanted], {}).made()
    t, here = sympy.Symbol("t", real=True), {}
    since = sympy.Rational(motion.segment.start.numerator, motion.segment.start.denominator)
    found: list[tuple[str, Any]] = []
    for one in stage.statements:
        match one:
            case BranchSign():
                value = [v for time, v in zip(one.times, one.values, strict=True) if time <= tau] or [one.values[0]]
                here[sympy.Symbol(one.name, real=True)] = sympy.Integer(int(value[-1]))
            case NamedValue():
                found.append((one.name, one.value))
            case ContinuousTurn():
                found.append((one.name, sympy.atan2(one.y, one.x) * 180 / sympy.pi))
            case _:
                raise NoProgram(f"`{one.names[0]}` has no formula")
    found += [(name, value) for (name, _), value in zip(wanted, stage.outputs, strict=True)]
    return tidied(
        [(name, (value.subs(t, t + since) if since else value).xreplace(here)) for name, value in found], len(wanted)
    )


def shared_steps(name: str, value: Any) -> list[tuple[str, Any]]:
    """A formula in named steps: what occurs in it twice."""
    import sympy as library

    sympy: Any = library
    symbols = (sympy.Symbol(f"s{k}", real=True) for k in itertools.count(1))
    shared, (short,) = sympy.cse([value], symbols)
    return tidied([*((str(one), each) for one, each in shared), (name, short)], 1)


def tidied(steps: Sequence[tuple[str, Any]], wanted: int) -> list[tuple[str, Any]]:
    """The steps that the last ones, so many as are ``wanted``, need; what is a number, or a number of times the time,
    has no name, and no number is longer than a decimal.
    """
    import sympy as library

    sympy: Any = library
    put: dict[Any, Any] = {}
    found: list[tuple[str, Any]] = []
    for place, (name, value) in enumerate(steps):
        here = _decimal(value.xreplace(put), sympy)
        if place < len(steps) - wanted and (here.is_number or (here.is_Mul and all(a.is_Atom for a in here.args))):
            put |= {sympy.Symbol(name, real=True): here}
        else:
            found.append((name, here))
    needed = set[str]()
    tidy: list[tuple[str, Any]] = []
    for place, (name, value) in reversed(list(enumerate(found))):
        if place >= len(found) - wanted or name in needed:
            needed |= {str(one) for one in value.free_symbols}
            tidy.append((name, value))
    return tidy[::-1]


def _decimal(value: Any, sympy: Any) -> Any:
    """An expression whose constant parts are fractions or decimals."""
    parts = {
        one: one.evalf(15)
        for one in sympy.preorder_traversal(value)
        if one.is_number and not one.is_Atom and one.has(sympy.Pow, sympy.Function) and not one.is_Rational
    }
    return readable(value.xreplace(parts))
