"""Blocks that were made before: most steps of a script, and most edits, change few of a plan's equations."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from fractions import Fraction

from movimentum.expressions import walk
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.structure.decompose import Group


class KeptBlocks:
    """Blocks by everything that `blocks.build.make_block` reads; what was last used too long ago is forgotten.

    Free blocks and differential equations are not kept: they read the things' anchors, too.
    """

    def __init__(self) -> None:
        self.made = 0
        self._kept: dict[Hashable, tuple[Block, int]] = {}
        self._age = 0

    def begin(self, kept: int) -> None:
        """Another timeline is planned: forget what the last ``kept`` had no use for."""
        self._age += 1
        old = [key for key, (_, used) in list(self._kept.items()) if used < self._age - kept]
        for key in old:
            self._kept.pop(key, None)

    def get(self, key: Hashable) -> Block | None:
        """The block kept under ``key``."""
        found = self._kept.get(key)
        if found is None:
            return None
        self._kept[key] = found[0], self._age
        return found[0]

    def keep(self, key: Hashable, block: Block) -> None:
        """Keep a block that had to be made."""
        self.made += 1
        self._kept[key] = block, self._age


def block_key(
    number: int, system: System, rows: Sequence[Equation], group: Group, clocks: Clocks, moving: Collection[int]
) -> Hashable:
    """Everything that making block ``number`` of ``group`` depends on but the scene's size, ``rows`` being its
    equations; None for a block that is not kept. Clocks that the rows read are numbered.
    """
    if group.free or any(row.form is Form.INTEGRAL for row in rows):
        return None
    reads = frozenset[int]().union(*(row.unknowns for row in rows))
    starts: dict[Fraction, int] = {}
    for node in walk(*(row.residual for row in rows), *(row.original for row in rows if row.original is not None)):
        if node.op == "integral":
            return None
        if node.op == "clock":
            starts[node.start] = clocks.number(node.start)
    return (
        number,
        group,
        tuple(map(_row_key, rows)),
        tuple(starts.items()),
        frozenset(n for n in reads if n in moving),
        tuple(isinstance(system.unknowns[n].payload, PoseCos | PoseSin) for n in group.unknowns),
    )


def _row_key(row: Equation) -> Hashable:
    form = None if row.polynomial is None else tuple(row.polynomial.items())
    return row.number, row.residual, row.unknowns, row.targets, form, row.constraint, row.thing, row.form, row.original
