"""Finds the first time at which a segment without a solution at its beginning has one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction

import numpy as np

from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.planning.structure.graph import groups
from movimentum.records import replace
from movimentum.solver.basis.effort import EffortExceeded, is_limited, limit_effort
from movimentum.solver.basis.instants import Instants, at_offsets
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.continuation.runaways import INFINITY_DISTANCE
from movimentum.solver.path.follow import instant_piece
from movimentum.solver.start.candidates import (
    Selection,
)
from movimentum.solver.start.resumption import ResumedBranch
from movimentum.solver.start.search import StartSearch

TIMES_TRIED, TIMES_TRIED_WITH_NEWTON = 64, 16
"""Times of a segment at which a first solution is looked for, where there is none to begin with."""
LARGEST_BLOCK = 16
"""Unknowns of a block that is solved by Newton's method; for larger ones every look costs too much."""
DELAYED_START_EFFORT = 6_000
"""Linearizations that looking for a first solution may take, some seconds; then none is found."""


def first_start(
    plan: Plan,
    start: Fraction,
    length: float,
    refused: Selection,
    chosen: Callable[[float], Selection],
    still_refused: Callable[[float], bool],
) -> tuple[float, float, Selection] | None:
    """The first time of a segment at which there is a solution, where there is none to begin with, the time at or just
    after it from which a path can be followed, and what is ``chosen`` there. Nothing has to be chosen where something
    is ``still_refused`` (see `search.StillRefused`).

    None where none is found, not with as much work as `DELAYED_START_EFFORT`, or nothing that moves is in the way.
    """
    try:
        with limit_effort(DELAYED_START_EFFORT // 4 if is_limited() else DELAYED_START_EFFORT):  # a trial is worth less
            return _first_start(plan, start, length, refused, chosen, still_refused)
    except EffortExceeded:
        return None


def _first_start(
    plan: Plan,
    start: Fraction,
    length: float,
    refused: Selection,
    chosen: Callable[[float], Selection],
    still_refused: Callable[[float], bool],
) -> tuple[float, float, Selection] | None:
    blocks = [plan.blocks[r.block] for r in refused.rejections if r.block is not None]
    if length <= 0.0 or not any(block.moving for block in blocks):
        return None
    newton_blocks = [block for block in blocks if block.iterative]
    if any(len(block.core) > LARGEST_BLOCK for block in newton_blocks):
        return None
    bad = 0.0
    for good in map(
        float, np.linspace(0.0, length, (TIMES_TRIED_WITH_NEWTON if newton_blocks else TIMES_TRIED) + 1)[1:]
    ):
        selection = None if still_refused(good) else chosen(good)
        if selection is None or selection.choices is None:
            bad = good
            continue
        piece = instant_piece(plan, start, good, selection.choices)
        branch = ResumedBranch.of(piece, good)
        if any(rejection.pole for rejection in refused.rejections):
            branch.within = INFINITY_DISTANCE * plan.size
        begin, choices = branch.earliest(bad, good, selection.choices)
        there = selection if newton_blocks else chosen(begin)
        if there.choices is not None and not newton_blocks:
            return begin, begin, there
        clear, choices = branch.clear_of_fold(begin, length, choices)
        return begin, clear, replace(selection, choices=choices)
    return None


class StillRejected:
    """Whether a plan has no solution at other offsets either, for the same reason: only what has to do with what was
    ``refused`` is searched, not the rest of the scene.
    """

    def __init__(
        self,
        plan: Plan,
        segment_start: Fraction,
        ahead: float,
        carry: PoseState,
        totals: dict[int, float],
        refused: Selection,
    ) -> None:
        self._start = segment_start
        self._ahead = ahead
        self._search = StartSearch(plan, self._instants(plan, 0.0), carry, ahead, totals)
        about = {number for part in refused.parts[-1:] for number in part.blocks if number >= 0}
        self._only = _connected(plan, about)

    def __call__(self, tau: float) -> bool:
        """Whether there is none at offset ``tau``; False does not say that there is one."""
        search = self._search
        search.begin_at(self._instants(search.plan, tau))
        with np.errstate(all="ignore"):
            return search.run(self._only).choices is None

    def _instants(self, plan: Plan, tau: float) -> Instants:
        return at_offsets(plan.clocks, self._start, np.array([tau, tau + self._ahead]))


def _connected(plan: Plan, numbers: Iterable[int]) -> frozenset[int]:
    """The blocks that equations, inequalities and wishes connect with the blocks ``numbers``, however far."""
    system = plan.system
    read = [e.unknowns for e in system.equations]
    read += [symbol_numbers(selector.value) for selector in system.selectors]
    read += [symbol_numbers(*wish.errors) for wish in system.wishes]
    read += [block.unknowns for block in plan.blocks]
    links = [(min(some), n) for some in read for n in some if n != min(some)]
    owner = {n: block.number for block in plan.blocks for n in block.unknowns}
    wanted = {n for number in numbers for n in plan.blocks[number].unknowns}
    together = (group for group in groups(len(system.unknowns), links) if not wanted.isdisjoint(group))
    return frozenset(owner[n] for group in together for n in group if n in owner)
