"""The path's own grid of times, and the state at its nodes of all blocks that have been followed so far."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.solver.basis.instants import Instants, without
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.tracks import Circles, Gap, Path

LARGEST_TURN = 0.45
"""Change of a direction's cosine or sine between two nodes."""
FINEST = 2.0**-18
"""Of a path's length: nodes are no closer."""

INITIAL_INTERVALS = 24
LARGEST_PHASE = 15.0
"""Degrees that any driving angle may turn between two nodes."""
MAXIMAL_NODES = 400_000
HOPELESS_FACTOR = 1000
"""Where so many times `MAXIMAL_NODES` would be needed, as many as there may be show no more than a few do."""


def first_nodes(begin: float, end: float) -> FloatArray:
    """The nodes of a path before anything is known of it, at odd places, so that a periodic motion is not sampled in
    step.
    """
    tau = np.linspace(begin, end, INITIAL_INTERVALS + 1)
    tau[1:-1] += 0.2 * np.sin(2.399963 * np.arange(1, INITIAL_INTERVALS)) * (end - begin) / INITIAL_INTERVALS
    return tau


def intervals_to_split(tau: FloatArray, change: FloatArray, limit: float) -> BoolArray:
    """Which intervals of ``tau`` are split, because something changes in them by more than ``limit``."""
    return (np.abs(change) > limit) & (np.diff(tau) > FINEST * (tau[-1] - tau[0]))


def splitting_times(tau: FloatArray, change: FloatArray, limit: float, split: BoolArray) -> FloatArray:
    """The times that split the intervals ``split`` of ``tau``, so that no ``change`` is larger than ``limit``."""
    steps = np.diff(tau)[split]
    parts = np.clip(np.ceil(np.abs(change[split]) / limit), 2, 64).astype(np.int64)
    of = np.repeat(np.arange(len(parts)), parts - 1)
    inside = np.arange(1, len(of) + 1) - np.repeat(np.cumsum(parts - 1) - (parts - 1), parts - 1)
    return tau[:-1][split][of] + steps[of] * inside / parts[of]


class Grid:
    """Nodes, and the state at them of what the block depends on that is followed; ``circles``: those of dyads, by block
    number.

    Of other blocks the state lacks the nodes that were inserted since they were followed: a thousand parts that have
    nothing to do with each other would otherwise all be solved again at the nodes of each.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.tau = first_nodes(path.begin, path.end)
        self.state: State = [None] * len(path.plan.system.unknowns)
        self.instants: Instants = path.instants(self.tau)
        self.circles: dict[int, Circles] = {}
        self._inserted: list[FloatArray] = []
        self._known: list[int] = []  # for each block that has a state, at the nodes of how many insertions
        self._block: Block | None = None

    def begin(self, block: Block) -> None:
        """The state is what ``block`` needs, which is followed next."""
        self._block = block
        owner, now = self.path.plan.owner, len(self._inserted)
        if any(self._known[owner[n]] < now for n in block.inputs if n in owner):
            self._complete()

    def has_state(self, block: Block) -> None:
        """The state of ``block`` has been set at all nodes."""
        del self._known[block.number :]
        self._known.append(len(self._inserted))

    def insert(self, more: FloatArray) -> None:
        """Add the times ``more`` to the nodes, with the state at them of what is followed."""
        more = without(more, self.tau)
        if len(more) == 0:
            return
        self._inserted.append(more)
        self.tau = np.sort(np.concatenate([self.tau, more]))
        self.instants = self.path.instants(self.tau)
        self._complete()

    def _complete(self) -> None:
        """Solve what the block depends on, and the block where it has a track, at the nodes that they lack."""
        path, block = self.path, self._block
        assert block is not None
        needed = list(path.finders(block.inputs)) if block.inputs else []
        needed += [block.number] if block.number < len(path.tracks) else []
        lacking: dict[int, list[Block]] = {}
        for number in needed:
            if self._known[number] < len(self._inserted):
                lacking.setdefault(self._known[number], []).append(path.plan.blocks[number])
                self._known[number] = len(self._inserted)
        for known, blocks in lacking.items():
            more = np.sort(np.concatenate(self._inserted[known:]))
            unknowns = [n for each in blocks for n in each.unknowns]
            alone = not any(each.inputs for each in blocks)
            only = [each.number for each in blocks] if alone else path.finders(unknowns)
            state, _ = path.evaluate(path.instants(more), only)
            old = np.ones(len(self.tau), dtype=np.bool_)
            old[np.searchsorted(self.tau, more)] = False
            for n in unknowns:
                if np.ndim(self.state[n]) > 0 or np.ndim(state[n]) > 0:
                    joined = np.empty(len(self.tau))
                    joined[old], joined[~old] = self.state[n], state[n]
                    self.state[n] = joined

    def refine(self, change: FloatArray, limit: float) -> bool:
        """Split every interval over which something changes by more than ``limit``; True if any was split."""
        split = intervals_to_split(self.tau, change, limit)
        if not split.any():
            return False
        if len(self.tau) >= MAXIMAL_NODES or np.sum(np.abs(change[split])) > HOPELESS_FACTOR * MAXIMAL_NODES * limit:
            self.path.resolved = False
            return False
        more = splitting_times(self.tau, change, limit, split)
        self.insert(more[: MAXIMAL_NODES - len(self.tau)])
        return True

    def resolve_phases(self, block: Block, until: float) -> None:
        """Nodes close enough together that no driving angle turns far between them ``until`` what it depends on has no
        solution, so that nothing periodic is missed.
        """
        if block.phases is None:
            return
        for _ in range(24):
            with np.errstate(all="ignore"):
                phases = block.phases(self.state, self.instants.clocks)
            change = np.zeros(len(self.tau) - 1)
            for phase in phases:
                if np.ndim(phase) > 0:
                    step = np.abs(np.diff(phase))
                    change = np.maximum(change, np.where(np.isfinite(step), step, 0.0))
            if not self.refine(np.where(self.tau[:-1] < until, change, 0.0), LARGEST_PHASE):
                return

    def turning(self, plan: Plan, block: Block, until: float) -> FloatArray:
        """The largest change of any of the block's directions between neighbouring nodes before ``until``."""
        state = self.state
        moving = [state[n] for n in direction_unknowns(plan, block) if np.ndim(state[n]) > 0]
        if not moving:
            return np.zeros(len(self.tau) - 1)
        with np.errstate(invalid="ignore"):  # where an input has run away
            steps = np.abs(np.diff(np.array(moving)))
        change = np.max(steps, axis=0, where=np.isfinite(steps), initial=0.0)
        return np.where(self.tau[:-1] < until, change, 0.0) if len(change) == len(self.tau) - 1 else change


def direction_unknowns(plan: Plan, block: Block) -> list[int]:
    """The block's unknowns that are parts of directions."""
    return [n for n in block.unknowns if isinstance(plan.system.unknowns[n].payload, PoseCos | PoseSin)]


def end_of_upstream(path: Path, block: Block, gaps: list[Gap]) -> float:
    """When the first of the blocks that ``block`` depends on comes to the end of its path."""
    if not gaps:
        return np.inf
    above = {*path.upstream(block.number)}
    return min((gap.begin for gap in gaps if gap.block in above), default=np.inf)
