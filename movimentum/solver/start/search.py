"""Where a path begins: which of several solutions (LANGUAGE: "Which solution").

Blocks are tried in order, each with all the solutions it has for what is known so far (depth first, the likeliest
first); inequalities and redundant equations turn candidates down as soon as all they need is known. Among the complete
candidates: what continues the motion so far; else the nearest to the wishes; else the nearest to the pose carried over;
else the least turned from how things were drawn. Everything is evaluated at two instants, the beginning and shortly
after, so that solutions that meet at the beginning (a mechanism drawn in its dead centre) can still be told apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable, Sequence
from fractions import Fraction
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np

from movimentum.arrays import first_of
from movimentum.planning.plan import Plan
from movimentum.planning.structure.graph import groups
from movimentum.records import dataclass, field, replace
from movimentum.solver.basis.instants import Instants, at_offsets
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.start.block_options import BlockOption, BlockOptions
from movimentum.solver.start.candidates import (
    Candidate,
    Part,
    Selection,
    decided_by,
    order_mirrored,
    same_pose,
    solving_order,
    visibly_distinct,
)
from movimentum.solver.start.early_checks import EarlyChecks, RejectedState, Rejection
from movimentum.solver.start.misplaced_contacts import misplaced_contacts
from movimentum.solver.start.placement import ConnectedParts, place_parts

if TYPE_CHECKING:
    from movimentum.solver.start.contradictions import Contradiction

ContradictionFinder = Callable[[Sequence[RejectedState]], "Contradiction | None"]

LEAVES = 256
LEAF_VALUES = 20_000
FEWEST_LEAVES = 8
"""As many complete candidates are compared as have `LEAF_VALUES` values in all, at least so many, at most `LEAVES`."""
EFFORT = 3_000
"""When so much has been tried (see `solver.start.block_options`), other candidates are no longer looked for."""
FIRST_EFFORT = 6_000
RESTARTS = 6
"""The same where none has been found yet; and how often the search begins anew then, in another order, every second
time with twice the effort.
"""
EFFORT_BEFORE_DOUBT = 1500
"""Effort without any candidate after which `select` first asks whether there can be one; as much again for every block
that Newton's method solves.
"""
KEPT_POSES = 24
KEPT_POSES_EACH = 4
"""Poses kept where something was turned down: in all, and by one equation or block."""


def select(
    plan: Plan,
    segment_start: Fraction,
    tau: float,
    ahead: float,
    carry: PoseState,
    totals: dict[int, float],
    doubt: ContradictionFinder | None = None,
) -> Selection:
    """Choose a solution at offset ``tau``, looking ``ahead`` to tell apart what meets there.

    ``totals``: integrals so far, by unknown number. ``doubt`` is asked whether what was turned down can be met at
    all: where nothing was found after some work, and where nothing was found at the end.
    """
    search = StartSearch(
        plan, at_offsets(plan.clocks, segment_start, np.array([tau, tau + ahead])), carry, ahead, totals
    )
    search.doubt = doubt
    with np.errstate(all="ignore"):
        found = search.run()
    if found.choices is not None:
        return found
    search.find_contradiction()
    return replace(
        found,
        rejected_states=tuple(search.rejected_states),
        contradiction=search.contradiction,
        tried=search.blocks.tried,
    )


def independent_parts(
    plan: Plan, branching: Container[int], rank: Sequence[int], judgements: EarlyChecks
) -> tuple[list[bool], list[list[int]]]:
    """Which blocks depend on a choice (of the blocks ``branching``), and the blocks in parts whose choices have nothing
    to do with each other. Tells ``judgements`` after which block each of them can be made.
    """
    owner = judgements.owner
    above: list[set[int]] = []
    links: list[tuple[int, int]] = []
    touched: list[bool] = []
    for block in plan.blocks:  # a block belongs to the parts of the branching blocks it depends on
        roots = {block.number} if block.number in branching else set[int]()
        for n in block.inputs:
            if n in owner and touched[owner[n]]:
                roots |= above[owner[n]]
        above.append({min(roots)} if roots else set())
        touched.append(bool(roots))
        ordered = sorted(roots | ({block.number} if roots else set()))
        links.extend((ordered[0], other) for other in ordered[1:])
    links.extend(judgements.schedule(touched, rank))
    return touched, groups(len(plan.blocks), links)


@dataclass(slots=True, eq=False)
class _SearchLevel:
    """Where the search stands in the options of one block: ``place`` is the next to take. ``blame`` are the levels on
    which it depends that others were turned down; ``solved``: some complete candidate takes an option of it.
    """

    options: list[BlockOption]
    place: int = 0
    blame: set[int] = field(default_factory=set[int])
    solved: bool = False


class StartSearch:
    """Looks for solutions of a plan at two instants, block by block; see `select`."""

    def __init__(
        self, plan: Plan, instants: Instants, carry: PoseState, ahead: float, totals: dict[int, float]
    ) -> None:
        self.plan = plan
        self.instants = instants
        self.carry = carry
        self.blocks = BlockOptions(plan, instants, carry, ahead, totals)
        self.state = self.blocks.state
        self.owner = {n: block.number for block in plan.blocks for n in block.unknowns}
        self.judgements = EarlyChecks(plan, self.state, instants.clocks, self.owner)
        self.shuffled: np.random.Generator | None = None
        self.rejected_states: list[RejectedState] = []
        self.doubt: ContradictionFinder | None = None
        self.refuted = 0
        self.asked = 0
        self.contradiction: Contradiction | None = None
        branching = {block.number for block in plan.blocks if block.branches}
        self.rank = solving_order(plan.blocks, self.owner, branching)
        self.parts: ConnectedParts | None = None
        self.touched, self.together = independent_parts(plan, branching, self.rank, self.judgements)

    @property
    def begin(self) -> Fraction:
        """The first of the two instants."""
        return self.plan.system.segment.start + Fraction(float(self.instants.tau[0]))

    def begin_at(self, instants: Instants) -> None:
        """Search at other instants, from the same pose, next."""
        before = self.blocks
        self.instants = instants
        self.blocks = BlockOptions(self.plan, instants, self.carry, before.ahead, before.totals)
        self.state = self.blocks.state
        self.judgements.state, self.judgements.clocks = self.state, instants.clocks

    # --- independent parts

    def run(self, only: Container[int] | None = None) -> Selection:
        """The choices for all blocks; for ``only`` some, which nothing connects with the others, whether there are any
        (`Selection.choices` are those then).
        """
        plan = self.plan
        touched, together = self.touched, self.together
        choices: dict[int, Choice] = {}
        parts: list[Part] = []
        common = [b.number for b in plan.blocks if not touched[b.number] and (only is None or b.number in only)]
        rejections: list[Rejection] = []
        for number in [-1, *common]:
            if number >= 0:
                found = self.blocks.candidates(plan.blocks[number], rejections)
                if not found:
                    self._remember(rejections[-1:])
                    return Selection(
                        None, (Part((number,), (), tuple(rejections), True, "only"),), rejections=tuple(rejections)
                    )
                self.blocks.set_option(plan.blocks[number], found[0])
                choices[number] = found[0].choice
            refused = self.judgements.rejection(number)
            if refused is not None:
                rejections.append(refused)
                self._remember([refused])
                return Selection(
                    None,
                    (Part((number,), (), tuple(rejections), True, "only"),),
                    frozenset(self.judgements.decisive),
                    tuple(rejections),
                )
        if self.parts is None:
            things = (
                None if only is None else {plan.system.unknowns[n].thing for n, b in self.owner.items() if b in only}
            )
            self.parts = ConnectedParts.of(plan, things)
        self.blocks.begin_from(place_parts(plan, self.parts, self.state, self.instants.clocks, self.carry))
        found_before: list[tuple[int, Choice]] = []
        for part_blocks in together:
            if not touched[part_blocks[0]] or (only is not None and part_blocks[0] not in only):
                continue
            for number, choice in found_before:
                self.blocks.set_choice(plan.blocks[number], choice)
            part = self._search_part(sorted(part_blocks, key=self.rank.__getitem__))
            parts.append(part)
            if not part.candidates:
                return Selection(None, tuple(parts), frozenset(self.judgements.decisive), part.rejections)
            best = part.candidates[0]
            choices.update(best.choices)
            found_before = [(number, best.choices[number]) for number in part.blocks]
        ordered_choices = [choices[b.number] for b in plan.blocks if b.number in choices]
        return Selection(ordered_choices, tuple(parts), frozenset(self.judgements.decisive))

    def _search_part(self, numbers: list[int]) -> Part:
        rejections: list[Rejection] = []
        closed = self._drawn_candidate(numbers, rejections)
        if closed is None and rejections and rejections[-1].amount == -math.inf:
            return Part(tuple(numbers), (), tuple(rejections), False, "only")  # no full rank where it is drawn
        rejections = []
        leaves, complete = self._searched(numbers, rejections, FIRST_EFFORT if closed is None else EFFORT)
        for again in range(RESTARTS):
            if leaves or complete or closed is not None or self.contradiction is not None:
                break
            # a wrong early choice may take for ever to be revised: begun anew in other orders, one of them finds what
            # the first does not (heavy tails: Gomes, Selman & Kautz 1998)
            self.shuffled = np.random.default_rng(again)
            leaves, complete = self._searched(numbers, rejections, FIRST_EFFORT * 2 ** (again // 2))
        self.shuffled = None
        if closed is not None:
            leaves.append(closed)
        leaves = visibly_distinct(self.plan, leaves)
        leaves = order_mirrored(self.plan, leaves)
        complete = complete and self.blocks.enumerated
        decided = decided_by(leaves)
        if decided == "drawn" and closed is not None and same_pose(self.plan, leaves[0], closed):
            decided = "closed"
        return Part(tuple(numbers), tuple(leaves), tuple(rejections), complete, decided)

    def _searched(self, numbers: list[int], rejections: list[Rejection], longest: int) -> tuple[list[Candidate], bool]:
        """Complete candidates for the blocks ``numbers``, and whether these are all; depth first, with an effort of at
        most ``longest`` until there is one.

        Where a block cannot be solved for what is before it, or a judgement turns it down, another choice is made where
        one of those is to blame: what lies in between has no part in it (conflict-directed backjumping, Prosser 1993).
        """
        plan = self.plan
        blocks = self.blocks
        leaves: list[Candidate] = []
        irreducible = sum(plan.blocks[n].iterative and not plan.blocks[n].free for n in numbers)
        patient = blocks.effort + EFFORT_BEFORE_DOUBT * (1 + irreducible)
        most = min(LEAVES, max(FEWEST_LEAVES, LEAF_VALUES // sum(len(plan.blocks[n].unknowns) for n in numbers)))
        level_of = {number: level for level, number in enumerate(numbers)}
        begun = blocks.effort
        stack = [_SearchLevel(self._options(numbers, 0, rejections))]
        taken: list[BlockOption] = []
        wished: list[float] = []
        while stack:
            level = stack[-1]
            depth = len(stack) - 1
            del taken[depth:], wished[depth:]
            number = numbers[depth]
            if level.place >= len(level.options):
                stack.pop()
                self._backtrack(stack, level, self._levels(plan.blocks[number].inputs, level_of))
                continue
            spent = blocks.effort - begun
            if len(leaves) >= most or spent >= (EFFORT + 2 * len(numbers) if leaves else longest + 2 * len(numbers)):
                return leaves, False
            if not leaves and blocks.effort > patient:
                if self.find_contradiction():
                    return leaves, False
                patient = blocks.effort + EFFORT_BEFORE_DOUBT * 4 ** min(self.asked, 8)
            option = level.options[level.place]
            level.place += 1
            blocks.effort += 1
            blocks.set_option(plan.blocks[number], option)
            refused = self.judgements.rejection(number)
            if refused is not None:
                if len(rejections) < LEAVES:
                    rejections.append(refused)
                level.blame |= self._levels(self.judgements.unknowns_of(refused), level_of) - {depth}
                self._remember([refused])
                continue
            taken.append(option)
            wished.append(self.judgements.wish_cost(number))
            if len(taken) == len(numbers):
                leaves.append(self._complete_candidate(numbers, taken, sum(wished)))
                for some in stack:
                    some.solved = True
                continue
            stack.append(_SearchLevel(self._options(numbers, len(taken), rejections)))
        return leaves, True

    def _backtrack(self, stack: list[_SearchLevel], failed: _SearchLevel, inputs: set[int]) -> None:
        """Go back from ``failed``, which was taken off the ``stack``: to the level before where it has been part of a
        solution, else to the last one that is to blame.
        """
        if failed.solved or not stack:
            return
        blame = failed.blame | inputs
        while stack and not stack[-1].solved and len(stack) - 1 not in blame:
            stack.pop()
        if stack:
            stack[-1].blame |= {level for level in blame if level < len(stack) - 1}

    def _levels(self, unknowns: Iterable[int], level_of: dict[int, int]) -> set[int]:
        """The levels of the blocks that find ``unknowns``."""
        found = {self.owner[n] for n in unknowns if n in self.owner}
        return {level_of[number] for number in found if number in level_of}

    def _drawn_candidate(self, numbers: list[int], rejections: list[Rejection]) -> Candidate | None:
        """The candidate that is the drawing as it stands (laid where it belongs), for blocks of new things only.

        None where the drawing does not satisfy the equations or the inequalities; the last of ``rejections`` then tells
        of a block that the drawing solves, but that has no full rank there and can move: its structure deceives.
        """
        taken: list[BlockOption] = []
        wished = 0.0
        for number in numbers:
            option = self.blocks.as_carried(self.plan.blocks[number], rejections)
            if option is None:
                return None
            self.blocks.set_option(self.plan.blocks[number], option)
            if self.judgements.rejection(number) is not None:
                return None
            taken.append(option)
            wished += self.judgements.wish_cost(number)
        return self._complete_candidate(numbers, taken, wished)

    def _options(self, numbers: list[int], place: int, rejections: list[Rejection]) -> list[BlockOption]:
        """The candidates of block ``numbers[place]``, the likeliest first: judged by the wishes too, as far as these
        depend on what has but one solution before the next block that has several.
        """
        blocks = self.plan.blocks
        options = self.blocks.candidates(blocks[numbers[place]], rejections)
        if not options:
            self._remember(rejections[-1:], numbers[place:])
        if self.shuffled is not None:
            return [options[i] for i in self.shuffled.permutation(len(options))]
        if len(options) < 2:
            return options
        following = (numbers[i] for i in range(place + 1, len(numbers)))
        follow_up = list(takewhile(lambda number: not blocks[number].branches, following))
        if not any(self.judgements.has_wishes(number) for number in (numbers[place], *follow_up)):
            return options
        judged: list[tuple[tuple[float, ...], BlockOption]] = []
        for option in options:
            self.blocks.set_option(blocks[numbers[place]], option)
            wished = self.judgements.wish_cost(numbers[place])
            for number in follow_up:
                found = self.blocks.candidates(blocks[number], [])
                if not found:
                    break
                self.blocks.set_option(blocks[number], found[0])
                wished += self.judgements.wish_cost(number)
            judged.append(((option.cost[0], wished if math.isfinite(wished) else math.inf, *option.cost[1:]), option))
        judged.sort(key=lambda item: item[0])
        return [option for _, option in judged]

    def find_contradiction(self) -> bool:
        """Whether what was turned down since the last time is shown to contradict."""
        if self.doubt is not None and self.contradiction is None and len(self.rejected_states) > self.refuted:
            self.refuted = len(self.rejected_states)
            self.asked += 1
            self.contradiction = self.doubt(self.rejected_states)
        return self.contradiction is not None

    def _remember(self, rejections: list[Rejection], unknown: Sequence[int] = ()) -> None:
        """Keep the pose at which something was turned down; blocks ``unknown`` are not found there."""
        for rejection in rejections:
            culprit = rejection.check, rejection.block
            same = sum((kept.rejection.check, kept.rejection.block) == culprit for kept in self.rejected_states)
            if rejection.selector is not None or same >= KEPT_POSES_EACH or len(self.rejected_states) >= KEPT_POSES:
                continue
            hidden = {n for number in unknown for n in self.plan.blocks[number].unknowns}
            values = tuple(None if v is None or n in hidden else first_of(v) for n, v in enumerate(self.state))
            self.rejected_states.append(RejectedState(rejection, values))

    def _complete_candidate(self, numbers: list[int], taken: list[BlockOption], wished: float) -> Candidate:
        unknowns = [n for number in numbers for n in self.plan.blocks[number].unknowns]
        both = {n: np.ravel(self.state[n]) for n in unknowns}
        breaks, carried, turned, moved = (sum(option.cost[i] for option in taken) for i in range(4))
        return Candidate(
            choices={number: option.choice for number, option in zip(numbers, taken, strict=True)},
            values={n: float(value[0]) for n, value in both.items()},
            later={n: float(value[-1]) for n, value in both.items()},
            cost=(round(breaks, 6), wished, carried, turned, moved),
            misplaced_contacts=misplaced_contacts(self.plan, self.state, self.carry.now, unknowns, self.begin),
        )
