"""Free blocks across variants: the lifted block, the nodes of each variant's path, and the motion along it."""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.planning.blocks.kinds import Block, Free
from movimentum.planning.lowering.unknowns import PoseCos, PosePart, PoseSin
from movimentum.planning.plan import Plan
from movimentum.planning.structure.metric import VariantMetrics
from movimentum.records import replace
from movimentum.solver.basis.instants import without
from movimentum.solver.continuation.grid import (
    LARGEST_PHASE,
    LARGEST_TURN,
    first_nodes,
    intervals_to_split,
    splitting_times,
)
from movimentum.solver.free.velocity import MOST_NODES
from movimentum.solver.kinds.variant_free_law import VariantFreeMotion, VariantLaw
from movimentum.solver.kinds.variant_free_motion import VariantTracks, integrate_variants, set_free
from movimentum.solver.kinds.variants import VariantLift, VariantRun
from movimentum.tolerances import LEAST_DIVISOR

ROUNDS = 24
"""Times that a grid's intervals are split for one block."""


def things_of(plan: Plan, block: Free) -> list[int]:
    """The things whose anchors' speeds are to be least."""
    poses = (plan.system.unknowns[n].payload for n in block.core)
    return sorted({payload.thing for payload in poses if isinstance(payload, PosePart)})


def lifted_free(block: Free, lift: VariantLift) -> dict[str, Any]:
    """The fields that only a free block has; `NotImplementedError` for large ones, and for those with as many equations
    as unknowns.
    """
    if block.sparse is not None or block.linear is not None or block.rows >= len(block.core):
        raise NotImplementedError("large free motions, or redundant equations")
    system = lift.plan.system
    drawn = [part for thing in system.scene.things for anchor in thing.anchors for part in anchor.coordinates]
    own = [
        part
        for thing in things_of(lift.plan, block)
        for anchor in system.scene.things[thing].anchors
        for part in system.frame(thing).stated(anchor.coordinates, anchor.local)
    ]
    fields: dict[str, Any] = {"places": lift.code([lift.formula(part) for part in (*drawn, *own)])}
    if block.wishes is not None:
        made = tuple(map(lift.formula, block.wishes.expressions))
        errors, slopes = made[: block.wishes.count], made[block.wishes.count :]
        fields["wishes"] = replace(block.wishes, errors=lift.code(errors), slopes=lift.code(slopes), expressions=made)
    return fields


def workspace_and_metric(run: VariantRun, block: Free) -> tuple[FloatArray, VariantMetrics]:
    """(V,) how far apart a scene's things may be (see `workspace_size`), and the block's metric."""
    plan, count = run.plan, len(run.size)
    scene = plan.system.scene
    assert block.places is not None
    values = [np.broadcast_to(value, (count, 1))[:, 0] for value in block.places(run.state, [])]
    drawn = 2 * sum(len(thing.anchors) for thing in scene.things)
    table = np.stack(values[:drawn], axis=1).reshape(count, -1, 2)
    far = np.max(np.ptp(table, axis=1), axis=1)
    far = np.maximum(far, max(map(float, scene.config.size or (0.0,))))
    local: dict[tuple[int, int], tuple[FloatArray, FloatArray]] = {}
    place = drawn
    for thing in things_of(plan, block):
        for anchor in range(len(scene.things[thing].anchors)):
            local[thing, anchor] = values[place], values[place + 1]
            place += 2
    metric = VariantMetrics.of(plan.system, block.core, lambda thing, anchor: local[thing, anchor], count)
    return np.where(far > 0.0, far, 100.0), metric


def solve_free_variants(run: VariantRun, block: Free, choice: Any) -> None:
    """Set the core of a free block along its track, or along the motion that begins with the core ``choice`` (V, n)."""
    if not block.moving:
        for j, n in enumerate(block.core):
            run.state[n] = choice[:, j : j + 1]
        return
    if not isinstance(choice, VariantTracks):
        assert run.nodes is not None
        nodes, counts = run.nodes
        if nodes[0, -1] <= nodes[0, 0]:
            for j, n in enumerate(block.core):
                run.state[n] = choice[:, j : j + 1]
            return
        far, metric = workspace_and_metric(run, block)
        spacing = (nodes[:, -1] - nodes[:, 0]) / np.maximum(counts - 1, 1)
        motion = VariantFreeMotion(
            run,
            block,
            metric,
            VariantLaw(block, far, run.size),
            float(nodes[0, 0]),
            float(nodes[0, -1]),
            np.maximum(spacing, LEAST_DIVISOR),
        )
        choice = integrate_variants(motion, choice, run.scale(block), nodes, counts)
        choice.good[counts > MOST_NODES] = False
        run.rough |= ~choice.good
        run.tracks[block.number] = choice
    set_free(run, block, choice)


class VariantNodes:
    """`Grid` for V variants: the nodes ``tau`` (V, K), of which ``counts`` (V,) count; the last one is repeated."""

    def __init__(self, run: VariantRun) -> None:
        tau = first_nodes(float(run.instants.tau[0]), float(run.instants.tau[-1]))
        self.run = run
        self.tau = np.repeat(tau[None], len(run.size), axis=0)
        self.counts = np.full(len(run.size), len(tau), dtype=np.int64)

    def resolve_phases(self, block: Block) -> None:
        """See `Grid.resolve_phases`."""
        if block.phases is not None:
            self._refine(block, LARGEST_PHASE, turning=False)

    def resolve_turning(self, block: Block) -> None:
        """Nodes close enough together that the block turns little between them."""
        if block.moving:
            self._refine(block, LARGEST_TURN, turning=True)

    def _refine(self, block: Block, limit: float, *, turning: bool) -> None:
        assert self.run.upstream_solver is not None
        system = self.run.plan.system
        who: IntArray = np.arange(len(self.tau), dtype=np.int64)
        for _ in range(ROUNDS):
            tau = self.tau[who]
            there = self.run.upstream_solver(block.number, tau, who, itself=turning)
            values: list[Any] = []
            if not turning:
                values = [] if block.phases is None else list(block.phases(there.state, there.instants.clocks))
            else:
                directed = (n for n in block.unknowns if isinstance(system.unknowns[n].payload, PoseCos | PoseSin))
                values = [there.state[n] for n in directed]
            change = np.zeros((len(who), tau.shape[1] - 1))
            for value in values:
                if np.ndim(value) and np.shape(value)[-1] > 1:
                    step = np.abs(np.diff(np.broadcast_to(value, tau.shape), axis=1))
                    change = np.maximum(change, np.where(np.isfinite(step), step, 0.0))
            split = np.stack([intervals_to_split(own, some, limit) for own, some in zip(tau, change, strict=True)])
            some = np.nonzero(split.any(axis=1))[0]
            if not len(some) or tau.shape[1] > MOST_NODES:
                return
            self._insert(who[some], [splitting_times(tau[v], change[v], limit, split[v]) for v in some])
            who = who[some]

    def _insert(self, who: IntArray, more: list[FloatArray]) -> None:
        rows = [row[:count] for row, count in zip(self.tau, self.counts.tolist(), strict=True)]
        for v, times in zip(who.tolist(), more, strict=True):
            rows[v] = np.sort(np.concatenate([rows[v], without(times, rows[v])]), kind="stable")
        self.counts = np.array([len(row) for row in rows], dtype=np.int64)
        width = int(self.counts.max())
        self.tau = np.stack([np.pad(row, (0, width - len(row)), mode="edge") for row in rows])
