"""The derivatives of a free motion, from the law that moves it, and those of all blocks that it depends on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, substitute, symbol
from movimentum.planning.blocks.kinds import Block, Free
from movimentum.planning.lowering.calculus import with_respect_to
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.solver.arithmetic.evaluation import ordered_nodes
from movimentum.solver.arithmetic.taylor import coefficient
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.linearization import DenseTangent, tangent_at
from movimentum.solver.block.problem import BlockProblem, scale_of
from movimentum.solver.block.rates import SeriesMoment
from movimentum.solver.free.velocity import FreeMotionLaw


@dataclass(slots=True, eq=False)
class FreeBlock:
    """A block with freedom left at F instants: v makes v' M v + 2 v' p least with J v = want, p being what its anchors
    have in common with the speeds w of other unknowns (`planning.structure.metric`).
    """

    block: Free
    moment: SeriesMoment
    nodes: list[Expr] = field(init=False)
    explicit: tuple[tuple[int, Expr], ...] = field(init=False)
    pull: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self.nodes = ordered_nodes(self.block.residuals)
        self.explicit = () if self.block.linear is None else self.block.linear.explicit

    def first(self) -> None:
        """Velocities."""
        block, moment = self.block, self.moment
        drift = moment.coefficients(self.nodes, block.residuals, 1)
        self.pull = self._pulled(1)
        errors, drifts = self._wishes()
        law = FreeMotionLaw(block, moment.plan)
        found = np.empty((len(block.core), len(moment.instants)))
        for f, (problem, x) in enumerate(self._instants()):

            def wish(
                f: int = f, problem: BlockProblem = problem, x: FloatArray = x
            ) -> tuple[FloatArray, FloatArray, FloatArray]:
                return errors[:, f], problem.wishes(x[None])[1][0], drifts[:, f]

            found[:, f] = law.velocity(tangent_at(problem, x), -drift[:, f], self.pull[:, f], wish)
        self._keep(found, 1)

    def second(self) -> None:
        """Accelerations: the derivative of M v + p + J' l = 0, J v = want, with l the multipliers of the rows."""
        block, moment = self.block, self.moment
        rest = 2.0 * moment.coefficients(self.nodes, block.residuals, 2)
        speeds, pull_rate = self._speeds(), 2.0 * self._pulled(2)
        place = {n: j for j, n in enumerate(block.core)}
        slopes = [
            (i, place[n], with_respect_to(residual, n))
            for i, residual in enumerate(block.residuals)
            for n in sorted(symbol_numbers(residual) & place.keys())
        ]
        roots = [slope for _, _, slope in slopes]
        changes = moment.coefficients(ordered_nodes(roots), roots, 1)
        found = np.empty_like(speeds)
        for f, (problem, x) in enumerate(self._instants()):
            tangent = DenseTangent(block, problem.jacobian(x[None])[0])
            bending = np.zeros((len(block.residuals), len(x)))
            for (i, j, _), change in zip(slopes, changes, strict=True):
                bending[i, j] += change[f]
            found[:, f] = tangent.accelerated(speeds[:, f], -rest[:, f], self.pull[:, f], pull_rate[:, f], bending)
        self._keep(0.5 * found, 2)

    def _keep(self, found: FloatArray, order: int) -> None:
        """Keep the core's coefficients (n, F) of ``order``, and those of what follows from the core."""
        for n, values in zip(self.block.core, found, strict=True):
            self.moment.extend(n, values)
        for n, values in zip([n for n, _ in self.explicit], self._explicit(order), strict=True):
            self.moment.extend(n, values)

    def _explicit(self, order: int) -> FloatArray:
        roots = [root for _, root in self.explicit]
        return self.moment.coefficients(ordered_nodes(roots), roots, order)

    def _speeds(self) -> FloatArray:
        count = len(self.moment.instants)
        return np.array([np.broadcast_to(coefficient(self.moment.values[n] or (), 1), count) for n in self.block.core])

    def _pulled(self, order: int) -> FloatArray:
        """(n, F) C w: the ``order``-th coefficients of what the metric couples, had the core none of that order."""
        metric = self.block.metric
        count = len(self.moment.instants)
        given = dict(zip([n for n, _ in self.explicit], self._explicit(order), strict=True))
        speeds = np.zeros((len(metric.coupled), count))
        for i, n in enumerate(metric.coupled):
            known = given.get(n)
            speeds[i] = coefficient(self.moment.values[n] or (), order) if known is None else known
        rows, columns, values = metric.coupling
        result = np.zeros((metric.size, count))
        np.add.at(result, rows, values[:, None] * speeds[columns])
        return result

    def _wishes(self) -> tuple[FloatArray, FloatArray]:
        """The wishes' errors (p, F), and how they change if the block stands still."""
        count = len(self.moment.instants)
        wishes = self.moment.plan.system.wishes
        drawn_by = () if self.block.wishes is None else self.block.wishes.numbers
        given = {symbol(n): root for n, root in self.explicit}
        roots = [substitute(error, lambda _: None, dict(given)) for w in drawn_by for error in wishes[w].errors]
        if not roots:
            return np.zeros((0, count)), np.zeros((0, count))
        nodes = ordered_nodes(roots)
        return self.moment.coefficients(nodes, roots, 0), self.moment.coefficients(nodes, roots, 1)

    def _instants(self) -> Iterator[tuple[BlockProblem, FloatArray]]:
        """The block's equations and its core (n,), instant by instant."""
        moment, count = self.moment, len(self.moment.instants)
        state: State = [None if value is None else coefficient(value, 0) for value in moment.values]
        scale = scale_of(moment.plan, self.block.core)
        problem = BlockProblem.of(self.block, state, moment.instants.clocks, scale)
        core = np.array([np.broadcast_to(state[n], count) for n in self.block.core])
        for f in range(count):
            yield problem.at(np.array([f]), count), core[:, f]


def derivative_depths(plan: Plan, numbers: Iterable[int], wanted: Mapping[int, int]) -> dict[int, int]:
    """How many derivatives are needed of each of the blocks ``numbers``, which have all that they depend on, where
    those of the blocks in ``wanted`` are. A velocity takes one more of what it is the velocity of.
    """
    result = dict.fromkeys(numbers, 0) | dict(wanted)
    for number in sorted(result, reverse=True):
        block, depth = plan.blocks[number], result[number]
        if block.rates_of is not None:
            law, order = block.rates_of
            before, depth = {law}, depth + order
        else:
            before = set(plan.rate_blocks_before(block))
        for other in before:
            result[other] = max(result[other], depth)
    return result


def mark_undefined(block: Block, moment: SeriesMoment, depth: int) -> None:
    """Nothing can be said about how the unknowns of ``block`` change."""
    for n in block.unknowns:
        rates = [np.full(len(moment.instants), np.nan)] * depth
        moment.values[n] = (coefficient(moment.values[n] or (), 0), *rates)
