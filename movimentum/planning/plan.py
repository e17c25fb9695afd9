"""The product of the plan stage."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

from movimentum.expressions import Expr
from movimentum.planning.blocks.fused_runs import Schedule, schedule
from movimentum.planning.blocks.kinds import Block, BlockBase, Free
from movimentum.planning.blocks.velocities import BlockRows, rate_blocks_before, rate_blocks_of, rows_of
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import BodyUnknowns, PoseCos, PoseSin, PoseX, PoseY
from movimentum.records import dataclass, field
from movimentum.scene.model import ThingAngle


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """How to solve one segment: blocks in order, and what to check and choose by.

    ``checks`` are the equations that determine nothing (redundant where they hold); ``check_values`` gives for each its
    residual and the size of its terms. ``selectors`` has one function for each of `System.selectors`, ``wishes`` one
    for each error of `System.wishes` (``wish_of``: which wish). ``measured`` are expressions of what hangs from free
    motion without a say in it, see `blocks.wishes`. ``clocks`` are the starts of the clocks that all compiled functions
    read as ``k``. ``bodies`` are the unknowns of all things that constraints mention. ``size`` is the scene's size in
    pixels.
    """

    system: System
    blocks: tuple[Block, ...]
    checks: tuple[int, ...]
    clocks: tuple[Fraction, ...]
    check_values: tuple[Compiled, ...]
    selectors: tuple[Compiled, ...]
    wishes: tuple[Compiled, ...]
    wish_of: tuple[int, ...]
    measured: Mapping[Expr, Expr]
    bodies: tuple[BodyUnknowns, ...]
    size: float
    _schedule: list[Schedule] = field(default_factory=list[Schedule], init=False)
    _owner: dict[int, int] = field(default_factory=dict[int, int], init=False)
    _stated: dict[int, BlockRows] = field(default_factory=dict[int, BlockRows], init=False)

    @property
    def owner(self) -> Mapping[int, int]:
        """The number of the block that finds each unknown (collected when it is first asked for)."""
        if not self._owner:
            self._owner.update((n, block.number) for block in self.blocks for n in block.unknowns)
        return self._owner

    @property
    def directions(self) -> list[tuple[int, int]]:
        """The unknowns of the cosine and the sine of each thing that has both."""
        return [(body.c, body.s) for body in self.bodies if body.c is not None and body.s is not None]

    @property
    def free_rows(self) -> tuple[Free, ...]:
        """The equations that leave freedom, block by block."""
        return tuple(rows for block in self.blocks if (rows := block.free_rows) is not None)

    def heading(self, block: Block) -> Expr | None:
        """The direction, in degrees, whose full turns a block counts; None where it is no continuous angle."""
        if not block.counts_turns:
            return None
        return self.system.equations[block.equations[0]].residual.args[1].args[0]  # angle - atan2d(sine, cosine)

    def rate_blocks(self, unknowns: Iterable[int]) -> tuple[int, ...]:
        """The numbers of the blocks that the rates of ``unknowns`` depend on, in order."""
        return rate_blocks_of(self.system, self.blocks, self.owner, unknowns)

    def rate_blocks_before(self, block: Block) -> set[int]:
        """The numbers of the blocks whose rates those of ``block`` depend on at once, and its own."""
        return rate_blocks_before(self.system, self.owner, block)

    def stated_rows(self, block: BlockBase) -> BlockRows:
        """The equations of a block as they were stated (made when they are first asked for)."""
        found = self._stated.get(block.number)
        if found is None:
            found = self._stated[block.number] = rows_of(self.system, block)
        return found

    def unknowns_read_by(self, block: Block) -> set[int]:
        """The unknowns that say how a block stands: those it finds, those it is given, and what else tells the pose of
        the things that it has a part of.
        """
        found = {*block.inputs, *block.unknowns}
        things = {t for n in block.unknowns if (t := self.system.unknowns[n].thing) is not None}
        parts = (PoseX, PoseY, PoseCos, PoseSin, ThingAngle)
        numbers = (self.system.number_of.get(part(t)) for t in things for part in parts)
        return found | {n for n in numbers if n is not None}

    @property
    def schedule(self) -> Schedule:
        """The order in which to solve all moving blocks at once (made when it is first asked for)."""
        if not self._schedule:
            self._schedule.append(schedule(self.blocks, Clocks(self.clocks)))
        return self._schedule[0]
