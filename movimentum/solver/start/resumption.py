"""Where an ended path has a solution again: on its own branch, tried at later times."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from movimentum.arrays import FloatArray, finite_throughout, first_of
from movimentum.planning.blocks.kinds import Block, Newton
from movimentum.records import dataclass, field, replace
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.curve_ends import is_past_end
from movimentum.solver.block.problem import scale_of, sizes_at, track_scale
from movimentum.solver.continuation.tracks import Choice, Gap, NodeTrack, OdeTrack, StillTrack
from movimentum.solver.kinds.context import FAR_AWAY
from movimentum.solver.kinds.kernels import KERNELS, evaluate
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import (
    BARELY_REGULAR,
    BRANCH_IDENTIFIED_AFTER,
    BRANCH_IDENTIFIED_BEFORE,
    CLEAR_OF_FOLD,
    FIRST_RESUMPTION,
    INEQUALITY_MET,
    RATE_DIFFERENCE_AT_FOLD,
)

if TYPE_CHECKING:
    from movimentum.solver.block.problem import BlockProblem

WIDE_STEP = 0.3
"""Of the unknowns' scale: a step that moves something by more may lead to another branch."""
POLE_OFFSETS = np.geomspace(1e5, 1.0, 11)
"""Of the time in which something is as good as at infinity: how far from it branches may be told apart."""
TIMES_BETWEEN_NODES = 3
"""Times tried between two nodes."""
TIMES_AT_A_TIME = 256
"""Times that are looked at together."""
MOST_TIMES = 10_000
"""So many times after a path's end are tried as they come; of more, another so many evenly. (What rounding makes of a
motion far beyond all scales can have 400,000 nodes.)
"""


@dataclass(slots=True, eq=False)
class ResumedBranch:
    """The branch that ``piece`` is on at offset ``tau``, at any other time of the segment.

    ``before``: the state before a ``pole``, which the motion goes on from, with these ``signs`` of blocks. What an
    assigned or linear block computes counts as infinite if it is not ``within``.
    """

    piece: Piece
    tau: float
    _cores: dict[int, FloatArray]
    before: State | None = None
    pole: float | None = None
    signs: dict[int, float] = field(default_factory=dict[int, float])
    within: float = math.inf
    _led: dict[tuple[int, float], FloatArray] = field(default_factory=dict[tuple[int, float], FloatArray])
    _clear: float = CLEAR_OF_FOLD
    _good: float = 0.0
    _begins: bool = False

    @staticmethod
    def of(piece: Piece, tau: float) -> ResumedBranch:
        """The branch at ``tau``, where the piece has a solution. (Two meet at the end of a path: a little before.)"""
        tau = max(piece.begin, tau - BRANCH_IDENTIFIED_BEFORE * (tau - piece.begin))
        followed = [b for b, track in zip(piece.plan.blocks, piece.tracks, strict=True) if isinstance(track, NodeTrack)]
        if not followed:  # signs and formulas tell it
            return ResumedBranch(piece, tau, {})
        with np.errstate(all="ignore"):
            state, _ = piece.evaluate(piece.instants(np.array([tau])))
        return ResumedBranch(piece, tau, {b.number: np.array([first_of(state[n]) for n in b.core]) for b in followed})

    def beyond(self, pole: Gap, length: float) -> list[Choice] | None:
        """What a path begins with at the end of ``pole``: what points at something that comes back from the other side
        swings on evenly. None where there is no solution.
        """
        block = self.piece.plan.blocks[pole.block]
        asides = POLE_OFFSETS * (
            pole.end - pole.begin
        )  # far enough for rounding, near enough to see where it comes from
        instants = self.piece.instants(np.maximum(self.piece.begin, pole.begin - asides))
        with np.errstate(all="ignore"):
            states, _ = self.piece.evaluate(instants)
        scale = scale_of(self.piece.plan, block.unknowns)
        far = np.zeros(asides.shape, dtype=np.bool_)
        for n, unit in zip(block.unknowns, scale, strict=True):
            far |= np.abs(states[n]) > FAR_AWAY * unit
        place = int(np.argmax(far))
        state: State = [None if v is None else np.broadcast_to(v, asides.shape)[place : place + 1] for v in states]
        after = min(length, pole.end + float(asides[place]))
        later = replace(self, before=state, pole=pole.pole, signs={})
        choices = later.at(after)
        if choices is not None:
            later.signs.update((n, choice.sign) for n, choice in enumerate(choices))
        return later.at(pole.end)

    def at(self, tau: float) -> list[Choice] | None:
        """What a path on this branch begins with at ``tau``; None where it has no solution there that satisfies all
        inequalities.
        """
        piece, plan = self.piece, self.piece.plan
        instants = piece.instants(np.array([tau]))
        state: State = [None] * len(plan.system.unknowns)
        choices: list[Choice] = []
        with np.errstate(all="ignore"):
            for block in plan.blocks:
                choice = self._solved(block, state, instants)
                if choice is None or is_past_end(plan, block, state):
                    return None
                choices.append(choice)
            for selector in plan.selectors:
                value = first_of(selector(state, instants.clocks)[0])
                if not value >= -INEQUALITY_MET * plan.size:
                    return None
        return choices

    def _solved(self, block: Block, state: State, instants: Instants) -> Choice | None:
        """Set ``state`` for one block."""
        piece, track = self.piece, self.piece.tracks[block.number]
        if isinstance(track, OdeTrack):  # an integral of what is solved for ends with the path
            return None
        if isinstance(track, StillTrack):
            evaluate(piece, block, track, state, instants)
            return Choice(values=track.values)
        tau = float(instants.tau[0])
        if isinstance(track, NodeTrack) and tau <= track.until:  # followed all the way: another block's path ended
            failed = evaluate(piece, block, track, state, instants)
            if failed is not None and failed.any():
                return None
            return Choice(values=tuple(first_of(state[n]) for n in block.core))
        choice = KERNELS[type(block)].resume(self, block, track, state, instants)
        if choice is None:
            return None
        closed_form.fill_explicit(block, state, instants.clocks)
        if not block.iterative and not all(finite_throughout(state[n]) for n in block.unknowns):
            return None
        if block.single_valued and max(abs(first_of(state[n])) for n in block.unknowns) > self.within:
            return None
        return choice

    def starts(self, block: Newton, track: NodeTrack, tau: float) -> list[FloatArray]:
        """Core values (n,) near those at ``tau``; what comes back from a pole is as far away as before, on the other
        side or on the same one.
        """
        if self.pole is None:
            return [self._led.get((block.number, tau), self._cores[block.number])]
        before = track.guess(np.array([min(2.0 * self.pole - tau, track.until)]))[:, 0]
        far = np.abs(before) > FAR_AWAY * track_scale(self.piece.plan, block)
        return [np.where(far, -before, before), before]

    def regular(self, problem: BlockProblem, x: FloatArray) -> bool:
        """Whether a pose is clear of the fold at which a path ends: just past it, equations are met within rounding."""
        from movimentum.solver.block.problem import scaled

        block = problem.block
        rows = scaled(problem.jacobian(x), sizes_at(x[0], problem.scale))[0][0]
        singular = np.linalg.svd(rows, compute_uv=False)
        return block.free or bool(len(singular) == len(block.core) and singular[-1] > self._clear * singular[0])

    def first(self, times: FloatArray, bad: float) -> tuple[float, list[Choice]] | None:
        """The first of ``times`` (ascending, all after ``bad``) at which the branch has a solution, brought back to the
        time at which it begins to have one; None where there is none.
        """
        lost, end = False, bad
        nearest: float | None = None
        for time, hopeful in self._times_to_try(times):
            choices = self.at(time) if hopeful else None
            if choices is None:
                bad, lost = time, True
            elif lost:
                self._set_reference(choices)
                found = self.earliest(bad, time, choices)
                if self._begins or not self._cores:
                    return found
                found = self.earliest(end, *found)  # Newton's method from the last pose did not find it before
                return found if self._begins else None  # it was there when the path ended: another branch
            elif nearest is None and time - bad > BRANCH_IDENTIFIED_BEFORE * (float(times[-1]) - bad):
                nearest = time
        if lost or nearest is None:
            return None
        choices = self.at(nearest)  # there is no time without a solution: only the path could not be followed
        return None if choices is None else (nearest, choices)

    def earliest(self, bad: float, good: float, choices: list[Choice]) -> tuple[float, list[Choice]]:
        """Between ``bad``, without a solution, and ``good``: the earliest time with one, by bisection; by smaller steps
        where the branch moves far, because Newton's method finds others from afar.
        """
        self._begins = False
        step = 0.5 * (good - bad)
        for _ in range(300):
            middle = good - step
            if not bad < middle < good:
                break
            here = self.at(middle)
            if here is None:
                bad = middle
                self._begins = True
            elif self._off_branch(here):
                step *= 0.5
                continue
            else:
                good, choices = middle, here
                self._set_reference(choices)
            step = min(2.0 * step, 0.5 * (good - bad))
        self._good = good
        return self._at_fold(good), choices

    def _off_branch(self, choices: Sequence[Choice]) -> bool:
        """Whether ``choices`` are far from where is looked from."""
        blocks = self.piece.plan.blocks
        return any(
            np.max(np.abs(np.array(choices[n].values) - core) / track_scale(self.piece.plan, blocks[n])) > WIDE_STEP
            for n, core in self._cores.items()
        )

    def _set_reference(self, choices: Sequence[Choice]) -> None:
        """Look from now on from where ``choices`` are."""
        for number in self._cores:
            self._cores[number] = np.array(choices[number].values)

    def _times_to_try(self, times: FloatArray) -> Iterator[tuple[float, bool]]:
        """Each of ``times``, and whether the branch may have a solution there: some are looked at together."""
        from movimentum.solver.start.input_continuation import follow_inputs

        for first in range(0, len(times), TIMES_AT_A_TIME):
            some = times[first : first + TIMES_AT_A_TIME]
            hopeful = np.ones(len(some), dtype=np.bool_)
            for number, core in self._cores.items():
                block, track = self.piece.plan.blocks[number], self.piece.tracks[number]
                rows = block.simultaneous
                if not (isinstance(track, NodeTrack) and rows is not None and track.until < some[-1]):
                    continue
                if (found := follow_inputs(self.piece, rows, track, core, some)) is not None:
                    hopeful &= found[1] | (some <= track.until)
                    self._led.update(((number, time), x) for time, x in zip(some.tolist(), found[0], strict=True))
            yield from zip(some.tolist(), hopeful.tolist(), strict=True)

    def _at_fold(self, tau: float) -> float:
        """The time of the fold that the branch begins with, where ``tau`` is as near as Newton's method tells."""
        from movimentum.solver.block.block_at_instant import BlockAtInstant
        from movimentum.solver.continuation.singular_poses import fold_near
        from movimentum.solver.kinds.newton import probe_of

        piece = self.piece
        found: float | None = None
        for number, core in self._cores.items():
            block, track = piece.plan.blocks[number], piece.tracks[number]
            rows = block.simultaneous
            if isinstance(track, NodeTrack) and rows is not None and tau > track.until:
                length = float(piece.nodes[-1] - piece.nodes[0]) or 1.0
                local = BlockAtInstant(
                    rows, probe_of(piece, rows), RATE_DIFFERENCE_AT_FOLD * length, tau - length, tau + length
                )
                fold = fold_near(local, tau, core, track_scale(piece.plan, block), length)
                found = found if fold is None else max(found or fold, fold)
        return tau if found is None else found

    def clear_of_fold(self, begin: float, length: float, choices: list[Choice]) -> tuple[float, list[Choice]]:
        """A beginning at or just after ``begin`` from which Newton's method can follow a path: where two branches meet
        it cannot.
        """
        if not self._cores:
            return begin, choices
        after = BRANCH_IDENTIFIED_AFTER * length
        self._clear = BARELY_REGULAR
        while after < BRANCH_IDENTIFIED_BEFORE * length:
            later = self.at(begin + after)
            if later is not None:
                return begin + after, later
            after *= 4.0
        return self._good, choices


def times_after(begin: float, nodes: FloatArray, end: float) -> FloatArray:
    """Times at which to look again for a solution that was lost at ``begin``: first near by, then all over ``nodes``
    and between them.
    """
    later = nodes[nodes > begin]
    if len(later) == 0 or end <= begin:
        return np.zeros(0)
    first = float(later[0]) - begin
    count = max(1, int(np.ceil(np.log2(max(first / (FIRST_RESUMPTION * (end - begin)), 2.0)))))
    near = begin + first * 0.5 ** np.arange(count, 0, -1.0)
    widths = np.diff(np.append(begin, later))[1:]
    between = [later[:-1] + widths * k / (TIMES_BETWEEN_NODES + 1.0) for k in range(1, TIMES_BETWEEN_NODES + 1)]
    times = np.unique(np.concatenate([near, later, *between, [end]]))
    if len(times) <= 2 * MOST_TIMES:
        return times
    rest = times[MOST_TIMES:]
    every = -(-len(rest) // MOST_TIMES)
    return np.append(times[:MOST_TIMES], rest[(len(rest) - 1) % every :: every])  # the end is one of them
