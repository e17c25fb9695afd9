"""A step of a scene as a tower: the planned blocks in their order, each solved in exact terms.

Where a block is no chain of quotients and roots by itself, the drives are let go: all equations are taken together, and
the unknowns that most others follow from become the parameters. Each pose of the film is a pose of that mechanism, too.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from fractions import Fraction

import numpy as np

from movimentum.expressions import Expr
from movimentum.planning.blocks.kinds import Assign, Block, Free, Linear, Newton, Quadratic, Winding
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.system import lowered_expressions
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, symbol_numbers
from movimentum.proving.balls import NoBall
from movimentum.proving.groups import RowGroup
from movimentum.proving.lowering import CLOCK, Lowering, common_bases
from movimentum.proving.points import Drives, TowerPoint
from movimentum.proving.rings import Polynomial, Work, make_ring
from movimentum.proving.tower import FreeParameter, Full, NotAlgebraic, Quotient, Tower, Unit
from movimentum.records import dataclass, field
from movimentum.scene.model import AnchorCoordinate, ThingAngle, VariableComponent
from movimentum.solver.segment_motion import SegmentMotion, Unsolved

MOST_LOWERING = 3_000_000
"""Products of terms that making a tower may take."""


@dataclass(slots=True, eq=False)
class Chain:
    """The tower of what ``wanted`` expressions (lowered, in the system's unknowns) depend on, at offset ``tau`` of a
    segment's motion. ``film``: floats of the variables that are unknowns; ``point``: the pose of the film there.
    ``given``: constants that are left open, by payload.
    """

    motion: SegmentMotion
    tau: float
    pooled: bool
    accelerated: bool | None
    given: Mapping[Hashable, Fraction]
    size: int = 40
    bases: dict[Hashable, Fraction] = field(default_factory=dict[Hashable, Fraction])
    film: dict[int, float] = field(default_factory=dict[int, float])
    of_place: dict[int, int] = field(default_factory=dict[int, int])
    known: dict[int, Quotient] = field(default_factory=dict[int, Quotient])
    state: Sequence[float | None] = ()
    choice: int = 0

    tower: Tower = field(init=False)
    lowering: Lowering = field(init=False)
    point: TowerPoint = field(init=False)

    def build(self, wanted: Iterable[Expr]) -> None:
        """Make the tower; `NotAlgebraic` where there is none, `NoBall` where the pose is a special one."""
        self.tower = Tower(make_ring(self.size, Work(MOST_LOWERING), accelerated=self.accelerated))
        self.lowering = Lowering(self.tower, self._unknown, self.known, self.bases)
        time = self.motion.segment.start + Fraction(self.tau)
        self.point = TowerPoint(self.tower, Drives(time, self.film, self._turn, self.given))
        blocks = self._needed(wanted)
        if self.pooled:
            self._pool(blocks)
            return
        for block in blocks:
            self._take(block)

    # --- what is needed

    def _needed(self, wanted: Iterable[Expr]) -> list[Block]:
        plan = self.motion.plan
        found: set[int] = set()
        stack = list(symbol_numbers(*wanted))
        while stack:
            n = stack.pop()
            owner = plan.owner.get(n)
            if owner is None:
                raise NotAlgebraic(f"`{plan.system.unknowns[n].name}` is not solved for")
            if owner not in found:
                found.add(owner)
                block = plan.blocks[owner]
                used = symbol_numbers(*(plan.system.equations[e].residual for e in block.equations))
                stack.extend(used | block.inputs | set(block.unknowns))
        return [plan.blocks[number] for number in sorted(found)]

    # --- unknowns

    def _unknown(self, n: int) -> Quotient:
        found = self.known.get(n)
        if found is None:
            if self.motion.plan.owner.get(n) is None:
                raise NotAlgebraic(f"`{self.motion.plan.system.unknowns[n].name}` is not solved for")
            found = self.known[n] = self._opened(n)
        return found

    def _opened(self, n: int) -> Quotient:
        """An unknown as a new variable; a direction is scaled by the length of its body's axis, whose square is
        rational where the length is not.
        """
        tower, system = self.tower, self.motion.plan.system
        payload = system.unknowns[n].payload
        value = self.state[n]
        if value is None or not np.isfinite(value):
            raise NotAlgebraic(f"`{system.unknowns[n].name}` has no value in the film")
        scale = None
        if isinstance(payload, PoseCos | PoseSin):
            frame = system.frame(payload.thing)
            if frame.ahead is not None:
                scale = self.lowering.value(frame.distance)
                value *= float(frame.distance.value or 1.0)
        place = tower.new()
        self.film[place], self.of_place[place] = value, n
        variable = tower.whole(tower.ring.variable(place))
        return variable if scale is None else tower.div(variable, scale)

    def _turn(self, source: Hashable) -> float | None:
        """An angle of the film, in degrees."""
        return self.state[source] if isinstance(source, int) else None

    def names(self, places: Iterable[int]) -> str:
        """What variables belong to, for messages."""
        system = self.motion.plan.system
        numbers = [self.of_place[place] for place in places if place in self.of_place]
        names: list[str] = []
        for n in numbers:
            thing = system.unknowns[n].thing
            name = system.unknowns[n].name if thing is None else system.scene.things[thing].name
            if f"`{name}`" not in names:
                names.append(f"`{name}`")
        shown = names[:4] + (["others"] if len(names) > 4 else [])
        return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown) or "something"

    # --- blocks

    def _take(self, block: Block) -> None:
        match block:
            case Winding():
                self._winding(block)
            case Assign():
                for n, expr in block.given:
                    self._assign(n, expr)
            case Linear() | Quadratic() | Newton():
                self._solve(block)  # free ones, too: some are only redundant
            case _:
                raise NotAlgebraic("it comes from an integral")

    def _winding(self, block: Block) -> None:
        (n,) = block.unknowns
        residual = self.motion.plan.system.equations[block.equations[0]].residual
        seen = residual.args[1].args[0]  # angle - atan2d(sine, cosine)
        self.lowering.forms[n] = {n: Fraction(1)}
        if isinstance(self.motion.plan.system.unknowns[n].payload, ThingAngle):
            sine, cosine = seen.args
            self.lowering.vectors[n] = lambda: (self.lowering.value(cosine), self.lowering.value(sine))
        else:
            self.lowering.vectors[n] = lambda: self.lowering.vector(self.lowering.angle(seen))

    def _assign(self, n: int, expr: Expr) -> None:
        """A given unknown: a quotient, and where its expression is a sum of angles that, too."""
        lowering = self.lowering
        form = reason = None
        try:
            form = lowering.angle(expr)
        except NotAlgebraic as error:
            reason = error
        if form is not None and all(not isinstance(source, int) or source in lowering.forms for source in form):
            lowering.forms[n] = form
        if not isinstance(self.motion.plan.system.unknowns[n].payload, ThingAngle):
            try:
                self.known[n] = lowering.value(expr)
            except NotAlgebraic:
                if n not in lowering.forms:
                    raise
        elif n not in lowering.forms:
            raise reason or NotAlgebraic("an angle that is no sum of angles")

    def _solve(self, block: Block) -> None:
        """A block's core by its rows, its targets by what gives them."""
        system = self.motion.plan.system
        opened: set[int] = set()
        for n in block.core:
            before = self.tower.used
            self._unknown(n)
            opened.update(place for place in range(before, self.tower.used) if place in self.of_place)
        for n, expr in block.given:
            self.known[n] = self.lowering.value(expr)
        rows = [self.lowering.value(system.equations[e].residual).top for e in block.equations]
        self._group(rows, opened, freely=False).solve()

    def _group(self, rows: list[Polynomial], opened: set[int], *, freely: bool) -> RowGroup:
        zero = self.tower.ring.zero
        return RowGroup(
            self.tower,
            [row for row in rows if row != zero],
            opened,
            self._present,
            self.names,
            freely,
            self._rank,
            self.choice,
        )

    def _rank(self, place: int) -> int:
        """Places first, then the directions of the last things: so both coordinates of one thing go together."""
        n = self.of_place.get(place)
        if n is None:
            return 1
        unknown = self.motion.plan.system.unknowns[n]
        return -1_000_000 - n if isinstance(unknown.payload, PoseX | PoseY) else -(unknown.thing or -1)

    def _present(self, p: Polynomial) -> bool:
        return p != self.tower.ring.zero and self.point.clearly(p)

    # --- everything together

    def _pool(self, blocks: Sequence[Block]) -> None:
        """All rows of ``blocks`` at once; drives become unknowns."""
        system, tower = self.motion.plan.system, self.tower
        rows: list[Polynomial] = []
        for block in blocks:
            if isinstance(block, Winding):
                self._winding(block)
            elif isinstance(block, Assign):
                if not self._drives(block):
                    self._take(block)
            elif not isinstance(block, Linear | Quadratic | Newton | Free):
                raise NotAlgebraic("it comes from an integral")
            else:
                for e in block.equations:
                    equation = system.equations[e]
                    if equation.form is not Form.PLAIN:
                        raise NotAlgebraic("it comes from an integral")
                    rows.append(self.lowering.value(equation.residual).top)
        opened = set(self.of_place)
        ring = tower.ring
        for step in list(tower.steps):
            if isinstance(step, Unit) and not (isinstance(step.source, Expr) and not step.source.timed):
                c, s = ring.variable(step.place), ring.variable(step.sine)
                self.point.extend()
                for place in (step.place, step.sine):
                    self.film[place] = self.point.values[place][0] / (1 << 640)
                    opened.add(place)
                rows.append(c * c + s * s - ring.one)
                tower.steps.remove(step)
            elif isinstance(step, FreeParameter) and (step.source == CLOCK or isinstance(step.source, Expr)):
                self.point.extend()
                self.film[step.place] = self.point.values[step.place][0] / (1 << 640)
                opened.add(step.place)
                tower.steps.remove(step)
        opened = opened | set(self.of_place)
        self.point = TowerPoint(tower, self.point.drives)
        self._group(rows, opened, freely=True).solve()

    def _drives(self, block: Assign) -> bool:
        """Whether a block only says what a named number is worth: any other value is as good."""
        return not block.inputs and all(
            isinstance(self.motion.plan.system.unknowns[n].payload, VariableComponent) for n in block.unknowns
        )


def chain_of(
    motion: SegmentMotion,
    wanted: Sequence[Expr],
    tau: float,
    *,
    accelerated: bool | None,
    given: Mapping[Hashable, Fraction],
    choice: int = 0,
) -> Chain:
    """The chain that ``wanted`` expressions depend on, by blocks or, where these are no chain, of all together (with
    one or another ``choice`` of parameters).
    """
    reason: Exception | None = None
    state = state_at(motion, tau)
    for pooled in (False, True):
        bases: dict[Hashable, Fraction] = {}
        size = 40
        for _ in range(6):
            chain = Chain(motion, tau, pooled, accelerated, given, size, bases, state=state, choice=choice)
            try:
                chain.build(wanted)
                for each in wanted:
                    _touch(chain, each)
            except Full:
                size *= 2
                continue
            except (NotAlgebraic, NoBall) as error:
                if reason is None or isinstance(reason, NoBall):
                    reason = error
                break
            wider = common_bases(chain.lowering.requests)
            if wider == bases:
                chain.point.extend()
                return chain
            bases = wider
    raise reason or NotAlgebraic("there are too many equations")


def _touch(chain: Chain, expression: Expr) -> None:
    """Lower what can be, for the angles that are asked for."""
    try:
        chain.lowering.angle(expression) if expression.op == "atan2d" else chain.lowering.value(expression)
    except NotAlgebraic:
        return


def state_at(motion: SegmentMotion, tau: float) -> list[float | None]:
    """The unknowns' values at an offset; `NotAlgebraic` where there is no solution."""
    piece = next((p for p in reversed(motion.pieces) if p.begin <= tau), motion.pieces[0])
    if isinstance(piece, Unsolved):
        raise NotAlgebraic("there is no solution at this time")
    state, bad = piece.solve(piece.instants(np.array([tau])))
    if bad[0]:
        raise NotAlgebraic("there is no solution at this time")
    return [None if value is None else float(np.ravel(value)[0]) for value in state]


def lowered(motion: SegmentMotion, expressions: Sequence[Expr]) -> list[Expr]:
    """Expressions of the scene in the unknowns of a segment's system; things that no constraint mentions are where they
    are drawn.
    """
    from movimentum.expressions import substitute

    system = motion.plan.system

    def leaf(node: Expr) -> Expr | None:
        payload = node.payload
        if node.op != "symbol" or not isinstance(payload, AnchorCoordinate | ThingAngle):
            return None
        if {PoseX(payload.thing), PoseY(payload.thing)} & system.number_of.keys():
            return None
        thing = system.scene.things[payload.thing]
        pose = motion.base.now.things[payload.thing]
        if (pose.x, pose.y, pose.c, pose.s) != (0.0, 0.0, 1.0, 0.0):
            raise NotAlgebraic(f"where `{thing.name}` is was left by an earlier step")
        if isinstance(payload, ThingAngle):
            from movimentum.expressions import ZERO

            return ZERO
        return thing.anchors[payload.anchor].coordinates[payload.axis]

    try:
        return lowered_expressions(system, [substitute(each, leaf) for each in expressions])
    except (ValueError, TypeError) as error:
        raise NotAlgebraic(f"nothing is solved for `{error}` in this step") from error
