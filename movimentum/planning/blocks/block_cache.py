"""Reuses blocks made before: most steps of a script, and most edits, change few of a plan's equations."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Sequence
from fractions import Fraction
from itertools import count

from movimentum.expressions import Expr, walk
from movimentum.memo import Memo
from movimentum.planning.blocks.kinds import Block, Free, Newton
from movimentum.planning.blocks.wishes import with_wishes
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.planning.lowering.equations import Equation, Form, System, Wish
from movimentum.planning.lowering.unknowns import PoseCos, PosePart, PoseSin, PoseX, PoseY, symbol_numbers
from movimentum.planning.structure.decompose import Group
from movimentum.records import replace

_IDENTITIES = count(1)


class BlockCache:
    """Blocks by everything that `blocks.build.make_block` reads, but for the numbers of their equations."""

    def __init__(self, memo: Memo) -> None:
        self._memo = memo

    def block(self, key: Hashable, equations: tuple[int, ...], make: Callable[[], Block]) -> Block:
        """The block under ``key`` with these numbers of its ``equations``, made where it is not kept."""
        block = self._memo.of("block", key, lambda: replace(make(), identity=next(_IDENTITIES)))
        if block.equations == equations:
            return block
        if not isinstance(block, Newton):
            return replace(block, equations=equations)
        now = dict(zip(block.equations, equations, strict=True))
        return replace(block, equations=equations, row_equations=tuple(now[e] for e in block.row_equations))

    def with_wishes(self, block: Block, wishes: Sequence[Wish], known: set[int], clocks: Clocks) -> Block:
        """`with_wishes`, kept by what the wishes that are about the block say."""
        about = [n for n, wish in enumerate(wishes) if not wish.about.isdisjoint(block.unknowns)]
        some = [wishes[n] for n in about]
        starts = _starts(clocks, *(error for wish in some for error in wish.errors))
        if not block.identity or not isinstance(block, Free) or not some or starts is None:
            return with_wishes(block, wishes, known, clocks)
        said = tuple((wish.errors, wish.speed, frozenset(symbol_numbers(*wish.errors) & known)) for wish in some)
        drawn = self.block(
            ("drawn", block.identity, said, starts), block.equations, lambda: with_wishes(block, some, known, clocks)
        )
        if not isinstance(drawn, Free) or drawn.wishes is None:
            return block
        return replace(drawn, wishes=replace(drawn.wishes, numbers=tuple(about[n] for n in drawn.wishes.numbers)))


def block_key(
    number: int, system: System, rows: Sequence[Equation], group: Group, clocks: Clocks, moving: Collection[int]
) -> Hashable:
    """Everything that making block ``number`` of ``group`` depends on but the scene's size, ``rows`` being its
    equations; None for a differential equation, which is not kept. Clocks that the rows read are numbered.
    """
    if any(row.form is Form.INTEGRAL for row in rows):
        return None
    reads = frozenset[int]().union(*(row.unknowns for row in rows))
    starts = _starts(
        clocks, *(row.residual for row in rows), *(row.original for row in rows if row.original is not None)
    )
    if starts is None:
        return None
    bodies = _bodies(system, group) if group.free else ()
    reads |= {n for _, _, _, parts in bodies for n in parts if n is not None}
    return (
        number,
        group.unknowns,
        group.pushed,
        bodies,
        tuple(map(_row_key, rows)),
        starts,
        frozenset(n for n in reads if n in moving),
        tuple(isinstance(system.unknowns[n].payload, PoseCos | PoseSin) for n in group.unknowns),
    )


def _starts(clocks: Clocks, *roots: Expr) -> tuple[tuple[Fraction, int], ...] | None:
    """The clocks that ``roots`` read, with their numbers; None where there is an integral among them."""
    starts: dict[Fraction, int] = {}
    for node in walk(*(root for root in roots if root.timed)):
        if node.op == "integral":
            return None
        if node.op == "clock":
            starts[node.start] = clocks.number(node.start)
    return tuple(starts.items())


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
    return row.residual, row.unknowns, row.targets, form, row.form, row.original, row.length
