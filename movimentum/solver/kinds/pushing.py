"""Blocks with pushing inequalities."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Pushing
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.newton import newton
from movimentum.solver.block.problem import BlockProblem, track_scale
from movimentum.solver.block.rates import SeriesMoment
from movimentum.solver.continuation.grid import Grid, end_of_upstream
from movimentum.solver.continuation.tracks import Choice, Gap, NodeTrack, Path, Track
from movimentum.solver.kinds.context import BlockSolutions, Kernel, ResumeContext, StartContext
from movimentum.solver.kinds.newton import NewtonKernel, choice_from, probe_of
from movimentum.solver.kinds.variants import VariantLift
from movimentum.solver.pushing.contact_projection import project_onto_contacts
from movimentum.solver.pushing.contacts import RATE, Contacts, contacts_of
from movimentum.solver.pushing.phases import follow_phases
from movimentum.solver.pushing.push_law import PushedInstant, pushed_velocity, velocity_with_active
from movimentum.solver.pushing.pushed_path import PushedPath
from movimentum.solver.pushing.tracks import ContactPhase, PushTrack
from movimentum.tolerances import (
    LEAST_DIVISOR,
    NEWTON_SOLVED,
    PUSH_CLOSED,
    PUSH_OVERLAP,
    PUSH_SETTLED,
)

NEWTON_KERNEL = NewtonKernel()


class PushingKernel(Kernel[Pushing]):
    """See `Kernel`."""

    def begin(self, start: StartContext, block: Pushing) -> BlockSolutions:
        """The pose of a free block, moved as little as possible until it satisfies what pushes."""
        scale = track_scale(start.plan, block)
        starts = start.free_start(block, scale)
        problem = BlockProblem.of(block, start.state, start.instants.clocks, scale).first()
        found = [without_violations(block, problem, x, start.plan.size) for x in starts.solutions]
        choices = [choice_from(start, block, x) for x in found]
        return BlockSolutions(choices, [] if choices else [-np.inf], starts.complete, starts.effort)

    def set_choice(self, start: StartContext, block: Pushing, choice: Choice) -> None:
        """Set the core, at both instants."""
        NEWTON_KERNEL.set_choice(start, block, choice)

    def first_track(self, path: Path, block: Pushing, choice: Choice) -> NodeTrack:
        """The track where a path is one instant long."""
        return NEWTON_KERNEL.first_track(path, block, choice)

    def follow(self, path: Path, grid: Grid, block: Pushing, choice: Choice, gaps: list[Gap]) -> PushTrack:
        """The track of a block, phase by phase; where it has no solution is added to ``gaps``."""
        until = end_of_upstream(path, block, gaps)
        with np.errstate(all="ignore"):
            pushed_path = PushedPath(block, path.plan, probe_of(path, block), grid.tau, track_scale(path.plan, block))
            track = follow_phases(pushed_path, np.array(choice.values), grid.tau, until)
        if track.until < path.end and track.until < until:
            gaps.append(Gap(track.until, path.end, block.number))
        return track

    def resume(
        self, on: ResumeContext, block: Pushing, track: Track, state: State, instants: Instants
    ) -> Choice | None:
        """Set the core, by Newton's method from the branch's own poses."""
        return NEWTON_KERNEL.resume(on, block, track, state, instants)

    def rates(self, block: Pushing, moment: SeriesMoment, depth: int) -> FloatArray | None:
        """Those that it would have alone."""
        return NEWTON_KERNEL.rates(block, moment, depth)

    def rates_along(
        self, path: Path, block: Pushing, track: Track, moment: SeriesMoment, depth: int
    ) -> FloatArray | None:
        """Its velocity, given what pushes it."""
        if not isinstance(track, PushTrack) or not track.phases:
            return self.rates(block, moment, depth)
        extend_pushed(path, path.nodes, block, track, moment)
        return None

    def lifted(self, block: Pushing, lift: VariantLift) -> dict[str, Any]:
        """Variants are solved one by one: what happens when differs among them."""
        raise NotImplementedError("what pushes")

    def evaluate(self, path: Path, block: Pushing, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the core; returns where there is no solution."""
        assert isinstance(track, NodeTrack)
        if not isinstance(track, PushTrack) or not track.phases:
            return NEWTON_KERNEL.evaluate(path, block, track, state, instants)
        guess = track.guess(instants.tau).T
        problem = BlockProblem.of(block, state, instants.clocks, track_scale(path.plan, block))
        begins = np.array([phase.begin for phase in track.phases])
        of_phase = np.clip(np.searchsorted(begins, instants.tau, side="right") - 1, 0, len(begins) - 1)
        moving = track.moving[track.step(instants.tau)] if len(track.moving) else np.ones(guess.shape, dtype=np.bool_)
        alike, kind = np.unique(np.column_stack([of_phase, moving]), axis=0, return_inverse=True)
        x, good = guess.copy(), np.zeros(len(guess), dtype=np.bool_)
        contacts = contacts_of(block)
        for number, (of, moves) in enumerate(zip(alike[:, 0].tolist(), alike[:, 1:] > 0, strict=True)):
            phase = track.phases[int(of)]
            for among in (moves, np.ones_like(moves)):
                some = np.nonzero((kind.ravel() == number) & ~good)[0]
                if len(some):
                    own = problem.at(some, len(instants))
                    x[some], good[some] = _on_contacts(contacts, own, guess[some], phase, among)
        for j, n in enumerate(block.core):
            state[n] = x[:, j]
        return ~good | (instants.tau > track.until)


def _on_contacts(
    contacts: Contacts, problem: BlockProblem, x: FloatArray, phase: ContactPhase, moving: BoolArray
) -> tuple[FloatArray, BoolArray]:
    """The core values (F, n) nearest to ``x`` that satisfy the equations and are held by the contacts of a phase; and
    whether they do. What is not ``moving`` stays.
    """
    if all(np.isnan(phase.values)):
        found = newton(problem, x, limit=0.1)
        return found.x, found.converged
    white, _ = contacts.block.metric.among(moving)
    best, error = project_onto_contacts(contacts, problem, x, phase.contacts, phase.values, white)
    return best, error <= NEWTON_SOLVED


def extend_pushed(path: Path, nodes: FloatArray, block: Pushing, track: NodeTrack, moment: SeriesMoment) -> None:
    """Give the unknowns of ``block``, which know their values, their velocities; at events those after it. Where the
    path is one instant long, what touches there pushes.
    """
    tau = moment.instants.tau
    core = np.stack([np.broadcast_to((moment.values[n] or (np.nan,))[0], len(tau)) for n in block.core], axis=1)
    pushed_path = PushedPath(block, path.plan, probe_of(path, block), nodes, track_scale(path.plan, block))
    phases = track.phases if isinstance(track, PushTrack) else ()
    begins = [phase.begin for phase in phases]
    found = np.zeros_like(core)
    for k, time in enumerate(np.clip(tau, nodes[0], nodes[-1]).tolist()):
        if not phases:
            touching, _ = pushed_path.contacts.touching(pushed_path.at(time), core[k : k + 1], pushed_path.closed)
            v = pushed_velocity(pushed_path.instant(time, core[k], touching)).v
            found[k] = np.nan if v is None else v
            continue
        phase = phases[max(bisect_right(begins, time) - 1, 0)]
        now = pushed_path.instant(time, core[k], phase.contacts, after=time in begins)
        found[k] = velocity_with_active(now, np.arange(len(phase.contacts), dtype=np.intp))
    for j, n in enumerate(block.core):
        moment.extend(n, found[:, j])


# --- the pose that a block begins with: moved as little as possible until it satisfies what pushes


STEPS = 60
LONGEST_STEP = 0.25
"""In units of the unknowns' scale: a step."""


def without_violations(block: Pushing, problem: BlockProblem, x: FloatArray, size: float) -> FloatArray:
    """The core values (n,) nearest to ``x``, which satisfy the equations, that satisfy the inequalities too. Where
    there are none, some that do not. Outlines that overlap more than by rounding stay where they are.

    Steps of sequential quadratic programming (Nocedal & Wright, ch. 18).
    """
    contacts = contacts_of(block)
    origin, metric = x, block.metric
    closed = PUSH_CLOSED * size
    for _ in range(STEPS):
        near, _ = contacts.touching(problem, x[None], PUSH_OVERLAP * size)
        some = list(dict.fromkeys([*contacts.plain, *(each for each in near if each.gap != RATE)]))
        if not some:
            break
        lines = contacts.lines(some, problem, x[None]).first()
        residual = problem.residual(x[None])[0]
        if float(np.min(lines.values)) >= -closed and np.array_equal(x, origin):
            break
        now = PushedInstant(
            metric,
            problem.jacobian(x[None])[0],
            -residual,
            metric.applied(x - origin),
            (),
            lines.slopes,
            -lines.values,
        )
        found = pushed_velocity(now)
        if found.v is None or not np.isfinite(found.v).all():
            break
        step = float(np.max(np.abs(found.v) / problem.scale, initial=0.0))
        x = x + found.v * min(1.0, LONGEST_STEP / max(step, LEAST_DIVISOR))
        if step <= PUSH_SETTLED:
            break
    return x
