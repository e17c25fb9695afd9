"""The smallest set of demands that contradict: without any one of them the others can be met.

A deletion filter (Chinneck, *Feasibility and Infeasibility in Optimization*, ch. 6), over the few members that pull on
each other at a best fit. That one is needed is shown by a pose that meets all others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.solver.start.demands import Demands, Member, scattered
from movimentum.solver.start.fitting import Fitting, StartFit
from movimentum.tolerances import FIT_ROW_MET, PULLS_IN_FIT

FIRST, LATEST = 3, 3
"""Poses that a trial begins with: of those given, and of those that earlier trials found."""
MORE = 8
"""Random poses that a trial begins with where no other start meets all demands."""


def pulling(fitting: Fitting, fit: StartFit) -> frozenset[Member]:
    """What pulls on something else where the best of a fit ended."""
    found = np.nonzero(fitting.stress(fit) > PULLS_IN_FIT)[0]
    return frozenset(fitting.demands.rows[i].member for i in found)


class MemberTrials:
    """Tries which members can be met together, from ``poses`` (n,) and from what it finds."""

    def __init__(self, demands: Demands, poses: Sequence[FloatArray]) -> None:
        self.demands = demands
        self.given = list(poses[:FIRST])
        self.found: list[FloatArray] = []
        self.random = scattered(demands, MORE + 1)[1:]

    def meeting(self, members: Iterable[Member]) -> tuple[FloatArray | None, frozenset[Member]]:
        """A pose (n,) that meets ``members``; or None, and those that pull on each other."""
        some = frozenset(members)
        fitting = Fitting(self.demands, self.demands.rows_of(some))
        if not fitting.consistent:
            return None, some
        nearest: StartFit | None = None
        for starts in (np.array([*self.given, *self.found[-LATEST:]]), self.random):
            fit = fitting.fit(starts)
            if np.min(fit.error) <= FIT_ROW_MET:
                pose = fit.u[int(np.argmax(fit.error <= FIT_ROW_MET))]
                self.found.append(pose)
                return pose, some
            nearest = nearest or fit
        assert nearest is not None
        return None, pulling(fitting, nearest)


def irreducible(trials: MemberTrials, members: frozenset[Member]) -> tuple[frozenset[Member], dict[Member, FloatArray]]:
    """The smallest set within ``members``, which contradict, and for each of it a pose (n,) that meets all others."""
    left = set(members)
    needed: dict[Member, FloatArray] = {}
    for member in sorted(members, key=lambda m: (m[0], -m[1])):
        if member not in left:
            continue
        pose, others = trials.meeting(left - {member})
        if pose is not None:
            needed[member] = pose
            continue
        left.discard(member)
        if needed.keys() <= others < left and trials.meeting(others)[0] is None:
            left &= others
    return frozenset(left), needed
