"""A step of a scene as a tower: the planned blocks in order, each solved in exact terms.

Where a block by itself is not a chain of quotients and roots, the drives are dropped: all equations are taken together,
and the unknowns on which most others depend become the parameters. Each pose of the film is a pose of that mechanism,
too.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.expressions import Expr
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, symbol_numbers
from movimentum.proving import balls
from movimentum.proving.angles import CLOCK, common_bases
from movimentum.proving.balls import Ball, NoBall
from movimentum.proving.film import state_at
from movimentum.proving.groups import RowGroup
from movimentum.proving.lowering import Lowering, Opaque
from movimentum.proving.points import Drives, TowerPoint
from movimentum.proving.rings import Polynomial, Work, make_ring
from movimentum.proving.tower import FreeParameter, Full, NotAlgebraic, Quotient, Root, Tower, Unit
from movimentum.records import dataclass, field
from movimentum.scene.leaves import ContactPlace
from movimentum.scene.model import ThingAngle, VariableComponent
from movimentum.solver.segment_motion import SegmentMotion

Numbers = tuple[dict[float, list[Expr]], dict[float, list[Expr]]]
"""Constants by their floats: of a mechanism's equations, and of all statements (see `numbers`)."""
MOST_LOWERING = 3_000_000
"""Products of terms that making a tower may take."""
SPARE = 10
"""Variables of a tower's ring that are left for claims."""


@dataclass(slots=True, eq=False)
class Chain:
    """The tower of what ``wanted`` expressions (lowered, in the system's unknowns) depend on, at offset ``tau`` of a
    segment's motion. ``film``: floats of the variables that are unknowns, ``lengths`` those that are lengths of
    unknowns; ``point``: the pose of the film there.
    ``given``: constants that are left open, by payload. ``loose``: long functions of time are free parameters.
    """

    motion: SegmentMotion
    tau: float
    pooled: bool
    loose: bool
    accelerated: bool | None
    given: Mapping[Hashable, Fraction]
    size: int = 40
    bases: dict[Hashable, Fraction] = field(default_factory=dict[Hashable, Fraction])
    film: dict[int, float] = field(default_factory=dict[int, float])
    of_place: dict[int, int] = field(default_factory=dict[int, int])
    scales: dict[int, float] = field(default_factory=dict[int, float])
    lengths: dict[int, Root] = field(default_factory=dict[int, Root])
    let_go: list[Unit | FreeParameter] = field(default_factory=list["Unit | FreeParameter"])
    known: dict[int, Quotient] = field(default_factory=dict[int, Quotient])
    state: Sequence[float | None] = ()
    choice: int = 0
    blocks: frozenset[int] = frozenset()
    constants: dict[Hashable, Any] = field(default_factory=dict[Hashable, Any])
    numbers: Numbers | None = None
    one_number: dict[float, Expr] = field(default_factory=dict[float, Expr])
    poses: dict[tuple[int, float], TowerPoint] = field(default_factory=dict[tuple[int, float], TowerPoint])

    tower: Tower = field(init=False)
    lowering: Lowering = field(init=False)
    point: TowerPoint = field(init=False)

    def build(self, wanted: Iterable[Expr]) -> None:
        """Make the tower; `NotAlgebraic` where there is none, `NoBall` where the pose is a special one."""
        self.tower = Tower(make_ring(self.size, Work(MOST_LOWERING), accelerated=self.accelerated), given=self.given)
        unknowns = self.motion.plan.system.unknowns
        places = frozenset(n for n, one in enumerate(unknowns) if isinstance(one.payload, ContactPlace))
        self.lowering = Lowering(self.tower, self._unknown, self.known, self.bases, places=places, loose=self.loose)
        time = self.motion.segment.start + Fraction(self.tau)
        self.point = TowerPoint(self.tower, Drives(time, self.film, self.state, self.given, constants=self.constants))
        blocks = self.needed(wanted)
        self.blocks = frozenset(block.number for block in blocks)
        if self.pooled:
            self._pool(blocks)
        else:
            for block in blocks:
                self._take(block)
        for each in wanted:
            _touch(self, each)
        if not self.roomy:
            raise Full
        self.tower.arrange()
        self.point = self.pose(self.motion, self.tau)

    def pose(self, motion: SegmentMotion, tau: float, *, compared: bool = True) -> TowerPoint:
        """The pose of the film at an offset, of this motion or of one with the same equations; `NoBall` for a special
        one. Not ``compared`` with the film: it only says on which sides of things others are.
        """
        found = self.poses.get((id(motion), tau)) if compared else None
        if found is None:
            state = state_at(motion, tau)
            time = motion.segment.start + Fraction(tau)
            film: dict[int, float] = {}
            drives = Drives(time, film, state, self.given, constants=self.constants)
            for place, n in self.of_place.items():
                value = state[n]
                if value is None or not np.isfinite(value):
                    raise NoBall
                film[place] = value * self.scales[place]
            before = TowerPoint(self.tower, drives)
            for step in self.let_go:
                before.take(step)
                film.update((place, balls.as_float(before.values[place])) for place in step.places)
            for place, root in self.lengths.items():
                film[place] = balls.as_float(self._length(root, film, drives))
            found = TowerPoint(self.tower, drives, settled=True)
        if not compared:
            found.extend()
            return found
        found.settle()
        self.poses[id(motion), tau] = found
        return found

    def _length(self, root: Root, film: Mapping[int, float], drives: Drives) -> Ball:
        """A length that is an unknown, as the film has it."""
        before = TowerPoint(self.tower, drives)

        def value(place: int) -> Ball:
            if place not in film and place not in before.values:
                before.take(next(step for step in self.tower.steps if place in step.places))
            return balls.ball(Fraction(film[place])) if place in film else before.values[place]

        found = balls.root(balls.evaluated(self.tower.sparse(root.square), value, {}))
        sign = 1 if root.over is None else balls.evaluated(self.tower.sparse(root.over), value, {})[0]
        return found if sign > 0 else (-found[0], found[1])

    @property
    def loosened(self) -> bool:
        """Whether a function of time was made a free parameter."""
        return self.lowering.loosened

    @property
    def opaque(self) -> str:
        """What was made a free parameter although the mechanism finds it, in words; "" if nothing was."""
        return " and ".join(self.lowering.opaque)

    @property
    def roomy(self) -> bool:
        """Whether there is room for what claims may add: directions, lengths."""
        return self.size - self.tower.used >= SPARE

    def covers(self, wanted: Sequence[Expr]) -> bool:
        """Whether other expressions can be written in this chain; what they need is added."""
        try:
            if not self.blocks >= {block.number for block in self.needed(wanted)}:
                return False
            for each in wanted:
                _touch(self, each)
        except (NotAlgebraic, Full):
            return False
        return self.roomy and common_bases(self.lowering.requests) == self.bases

    # --- what is needed

    def needed(self, wanted: Iterable[Expr]) -> list[Block]:
        """The blocks that expressions depend on, in their order."""
        plan = self.motion.plan
        return [plan.blocks[number] for number in plan.rate_blocks(symbol_numbers(*wanted))]

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
        scale, length = None, 1.0
        if isinstance(payload, PoseCos | PoseSin):
            frame = system.frame(payload.thing)
            if frame.ahead is not None:
                scale = self.lowering.value(frame.distance)
                length = float(frame.distance.value or 1.0)
        place = tower.new()
        self.film[place], self.of_place[place], self.scales[place] = value * length, n, length
        variable = tower.whole(tower.ring.variable(place))
        return variable if scale is None else tower.div(variable, scale)

    def names(self, places: Iterable[int]) -> str:
        """The owners of variables, for messages."""
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
        heading = self.motion.plan.heading(block)
        if heading is not None:
            self._winding(block, heading)
        elif block.assigned:
            for n, expr in block.given:
                self._assign(n, expr)
        elif _is_algebraic(block):
            self._solve(block)  # free ones, too: some are only redundant
        else:
            raise NotAlgebraic("it comes from an integral")

    def _winding(self, block: Block, seen: Expr) -> None:
        (n,) = block.unknowns
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
            angle = isinstance(self.motion.plan.system.unknowns[n].payload, ThingAngle)
            form = lowering.phase(expr) if angle else lowering.angle(expr)
        except NotAlgebraic as error:
            reason = error
        known = {*lowering.forms, *self.known}
        if form is not None and all(not isinstance(source, int) or source in known for source in form):
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
        rows = [self._row(system.equations[e].residual) for e in block.equations]
        rows += self._lengths_of(opened)
        self._group(rows, opened, freely=False).solve()

    def _lengths_of(self, opened: set[int]) -> list[Polynomial]:
        """Lengths that are made of ``opened`` unknowns become such unknowns, too; the rows that say what their squares
        are.
        """
        tower, rows = self.tower, list[Polynomial]()
        self.point.extend()
        for step in list(tower.roots):
            if step.witness is None and not step.constant and tower.ring.occurring(step.square) & opened:
                root = tower.ring.variable(step.place)
                rows.append(root * root - step.square)
                self.film[step.place] = balls.as_float(self.point.value(step.place))
                self.lengths[step.place] = step
                opened.add(step.place)
                tower.forget(step)
        if rows:
            self.point = TowerPoint(tower, self.point.drives)
        return rows

    def _row(self, residual: Expr) -> Polynomial:
        value = self.lowering.value(residual)
        if self.tower.ring.constant(value.bottom) is None:
            self.tower.assumed.append(value.bottom)
        return value.top

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
            lambda: bool(self.lowering.opaque),
        )

    def _rank(self, place: int) -> int:
        """Places first, then the directions of the last things: so both coordinates of one thing go together."""
        n = self.of_place.get(place)
        if n is None:
            return 1
        unknown = self.motion.plan.system.unknowns[n]
        return -1_000_000 - n if isinstance(unknown.payload, PoseX | PoseY) else -(unknown.thing or -1)

    def _present(self, p: Polynomial) -> bool:
        return p != self.tower.ring.zero and self.point.present(p)

    # --- everything together

    def _pool(self, blocks: Sequence[Block]) -> None:
        """All rows of ``blocks`` at once; drives become unknowns."""
        system, tower = self.motion.plan.system, self.tower
        rows: list[Polynomial] = []
        for block in blocks:
            if block.counts_turns or block.assigned:
                if not self._drives(block):
                    self._take(block)
            elif not _is_algebraic(block):
                raise NotAlgebraic("it comes from an integral")
            else:
                for e in block.equations:
                    equation = system.equations[e]
                    if equation.form is not Form.PLAIN:
                        raise NotAlgebraic("it comes from an integral")
                    rows.append(self._row(equation.residual))
        opened = set(self.of_place)
        ring = tower.ring
        for step in list(tower.steps):
            if not isinstance(step, Unit | FreeParameter) or not _of_time(step.source):
                continue
            if isinstance(step, Unit):
                c, s = (ring.variable(place) for place in step.places)
                rows.append(c * c + s * s - ring.one)
                del tower.squares[step.sine]  # either may be found by the other
            self.point.extend()
            opened.update(step.places)
            self.film.update((place, balls.as_float(self.point.values[place])) for place in step.places)
            self.let_go.append(step)
            tower.steps.remove(step)
        opened = opened | set(self.of_place)
        rows += self._lengths_of(opened)
        self.point = TowerPoint(tower, self.point.drives)
        self._group(rows, opened, freely=True).solve()

    def _drives(self, block: Block) -> bool:
        """Whether a block only says what a named number is worth: any other value is as good."""
        return (
            block.assigned
            and not block.inputs
            and all(isinstance(self.motion.plan.system.unknowns[n].payload, VariableComponent) for n in block.unknowns)
        )


def _is_algebraic(block: Block) -> bool:
    """Whether equations at one instant determine a block, or leave freedom in it."""
    return block.closed_form or (block.iterative and not block.integrals)


def _of_time(source: Hashable) -> bool:
    """Whether what gives a parameter changes with the time: a constant has no other value."""
    return source == CLOCK or isinstance(source, int | Opaque) or (isinstance(source, Expr) and source.timed)


def _touch(chain: Chain, expression: Expr) -> None:
    """Lower what can be, for the angles that are asked for."""
    try:
        chain.lowering.angle(expression) if expression.op == "atan2d" else chain.lowering.value(expression)
    except NotAlgebraic:
        return
