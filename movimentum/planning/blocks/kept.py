"""Blocks that were made before: most steps of a script, and most edits, change few of a plan's equations."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import count

from movimentum.expressions import walk
from movimentum.kept import Kept
from movimentum.planning.blocks.kinds import Block, Newton
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.unknowns import PoseCos, PosePart, PoseSin, PoseX, PoseY
from movimentum.planning.structure.decompose import Group


class KeptBlocks(Kept[Block]):
    """Blocks by everything that `blocks.build.make_block` reads, but for the numbers of their equations."""

    def __init__(self, generations: int) -> None:
        super().__init__(generations)
        self._identities = count(1)

    def block(self, key: Hashable, equations: tuple[int, ...], make: Callable[[], Block]) -> Block:
        """The block under ``key`` with these numbers of its ``equations``, made where it is not kept."""
        block = self.get(key)
        if block is None:
            block = replace(make(), identity=next(self._identities))
            self.keep(key, block)
        if block.equations == equations:
            return block
        if not isinstance(block, Newton):
            return replace(block, equations=equations)
        now = dict(zip(block.equations, equations, strict=True))
        return replace(block, equations=equations, row_equations=tuple(now[e] for e in block.row_equations))


def block_key(
    number: int, system: System, rows: Sequence[Equation], group: Group, clocks: Clocks, moving: Collection[int]
) -> Hashable:
    """Everything that making block ``number`` of ``group`` depends on but the scene's size, ``rows`` being its
    equations; None for a differential equation, which is not kept. Clocks that the rows read are numbered.
    """
    if any(row.form is Form.INTEGRAL for row in rows):
        return None
    reads = frozenset[int]().union(*(row.unknowns for row in rows))
    starts: dict[Fraction, int] = {}
    for node in walk(*(row.residual for row in rows), *(row.original for row in rows if row.original is not None)):
        if node.op == "integral":
            return None
        if node.op == "clock":
            starts[node.start] = clocks.number(node.start)
    bodies = _bodies(system, group) if group.free else ()
    reads |= {n for _, _, _, parts in bodies for n in parts if n is not None}
    return (
        number,
        group.unknowns,
        bodies,
        tuple(map(_row_key, rows)),
        tuple(starts.items()),
        frozenset(n for n in reads if n in moving),
        tuple(isinstance(system.unknowns[n].payload, PoseCos | PoseSin) for n in group.unknowns),
    )


def _bodies(system: System, group: Group) -> tuple[_Body, ...]:
    """What the metric of a free block depends on: for each of its things the number, the anchors, the frame, and the
    numbers of the pose's parts.
    """
    things = sorted({p.thing for n in group.unknowns if isinstance(p := system.unknowns[n].payload, PosePart)})
    return tuple(
        (
            t,
            tuple(anchor.local for anchor in system.scene.things[t].anchors),
            system.frame(t),
            tuple(system.number_of.get(part(t)) for part in (PoseX, PoseY, PoseCos, PoseSin)),
        )
        for t in things
    )


_Body = tuple[int, tuple[tuple[float, float], ...], BodyFrame, tuple[int | None, ...]]


def _row_key(row: Equation) -> Hashable:
    form = None if row.polynomial is None else tuple(row.polynomial.items())
    return row.residual, row.unknowns, row.targets, form, row.form, row.original
