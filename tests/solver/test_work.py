"""How much is done for a motion, counted: what was saved once cannot come back unseen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from benchmarks.penrose import transformable
from movimentum.analysis import examine as examination
from movimentum.analysis.diagnose.verify import first_unsolved_frame
from movimentum.analysis.freedom import rank
from movimentum.analysis.freedom.degrees import block_ranks, generic_moment
from movimentum.analysis.freedom.rank import SparseRank
from movimentum.interop.linkages import linkage_script
from movimentum.planning.blocks.kinds import Free
from movimentum.planning.codegen.writing import structures_compiled
from movimentum.planning.structure.graph import maximum_matching
from movimentum.solver import segment_start
from movimentum.solver.block import change_points
from movimentum.solver.block.problem import null_space
from movimentum.solver.continuation import coincidences, steps, trace
from movimentum.solver.kinds import kernels
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.start.block_options import BlockOptions
from movimentum.solver.start.resumption import times_after
from movimentum.source import SourceText
from movimentum.tolerances import RANK_TOLERANCE
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, moved, understand
from tests.command import ROOT
from tests.families.coincidences import cases

FOUR_BAR = (ROOT / "scripts" / "four-bar.mov").read_text(encoding="utf-8")
WALSCHAERTS = ROOT / "scripts" / "walschaerts.mov"


def motion_of(text: str) -> PathMotion:
    return moved(arranged(understand(SourceText("test.mov", text)), Choices()))


def chain(count: int) -> str:
    """Four-bars, each driven by the rocker of the one before."""
    things = ["Crank : .bar O=[0,0] P=[20,0];"]
    step = ["Crank.O=[0,0]; Crank.angle=20*.sin(360*.t);"]
    last, at = "Crank.P", (20.0, 0.0)
    for i in range(count):
        ground, top = (at[0] + 40.0, at[1] - 50.0), (at[0] + 40.0, at[1])
        things.append(f"C{i} : .bar A=[{at[0]},{at[1]}] B=[{top[0]},{top[1]}];")
        things.append(f"R{i} : .bar B=[{top[0]},{top[1]}] D=[{ground[0]},{ground[1]}];")
        step.append(f"C{i}.A={last}; C{i}.B=R{i}.B; R{i}.D=[{ground[0]},{ground[1]}];")
        last, at = f"R{i}.B", top
    return "\n".join([".config(8);", *things, "@0", *step, "@1", ""])


def counted(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> Counter[str]:
    """Counts the calls of a function or method from here on."""
    calls: Counter[str] = Counter()
    original: Callable[..., Any] = getattr(owner, name)

    def count(*arguments: Any, **named: Any) -> Any:
        calls[name] += 1
        return original(*arguments, **named)

    monkeypatch.setattr(owner, name, count)
    return calls


def test_a_closed_drawing_is_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search for a beginning takes over what the look at the drawing has found."""
    begun = counted(monkeypatch, kernels, "begin")
    motion_of(chain(6))
    once = begun["begin"]
    original = BlockOptions.candidates

    def forgetful(self: BlockOptions, *arguments: Any) -> Any:
        self.__dict__["_known"].clear()
        return original(self, *arguments)

    monkeypatch.setattr(BlockOptions, "candidates", forgetful)
    motion_of(chain(6))
    assert begun["begin"] - once >= once + 4 * 6  # at least the four blocks of each loop


def test_a_final_instant_goes_on_from_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last `@time` states nothing new: the branch is known, and nothing is searched for."""
    searched = counted(monkeypatch, segment_start, "select")
    motion = motion_of(chain(6))
    assert len(motion.segments) == 2
    assert searched["select"] == 1


def test_following_a_chain_looks_for_nothing_upstream(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = counted(monkeypatch, Piece, "finders")
    motion_of(chain(12))
    assert not asked


def test_what_is_before_a_block_is_evaluated_once_an_instant(monkeypatch: pytest.MonkeyPatch) -> None:
    attempts = counted(monkeypatch, steps, "try_step")
    single = counted(monkeypatch, trace, "try_step")
    evaluated = counted(monkeypatch, Piece, "before")
    timeline = arranged(understand(SourceText(str(WALSCHAERTS), WALSCHAERTS.read_text(encoding="utf-8"))), Choices())
    motion = moved(timeline)
    pieces = [
        piece for segment_motion in motion.segments for piece in segment_motion.pieces if isinstance(piece, Piece)
    ]
    nodes = sum(len(piece.nodes) for piece in pieces)
    assert nodes > 200
    assert single["try_step"] == 0
    assert (
        40 < attempts["try_step"] < nodes / 2
    )  # strides over many nodes; a step to each of them took 1.5 times as many
    assert evaluated["before"] < attempts["try_step"]  # those at the nodes are looked up together


def test_verifying_frames_compiles_nothing() -> None:
    motion = motion_of(FOUR_BAR)
    before = structures_compiled()
    assert first_unsolved_frame(motion) is None
    assert structures_compiled() == before


def test_one_schedule_serves_with_and_without_turns() -> None:
    motion = motion_of(FOUR_BAR)
    piece = motion.segments[0].pieces[0]
    assert isinstance(piece, Piece)
    instants = piece.instants(np.linspace(0.0, 1.0, 5))
    whole, _ = piece.solve(instants)
    before = structures_compiled()
    part, _ = piece.solve(instants, windings=False)
    assert structures_compiled() == before
    left_out = [n for n, value in enumerate(part) if value is None and whole[n] is not None]
    assert [motion.segments[0].plan.system.unknowns[n].name for n in left_out]
    for n, value in enumerate(part):
        assert n in left_out or np.array_equal(value, whole[n])


def test_reports_of_steps_are_made_for_who_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = counted(monkeypatch, examination, "parts_of")
    solution = examined(arranged(understand(SourceText("test.mov", FOUR_BAR)), Choices()), Choices())
    assert not parts
    assert len(solution.steps) == len(list(solution.steps)) == parts["parts_of"]


def test_large_blocks_need_no_dense_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = motion_of(linkage_script(transformable(1), "tiling"))
    decomposed = counted(monkeypatch, rank, "null_space")
    (found,) = block_ranks(motion.segments[0])
    assert (found.freedom, len(found.motions), found.rows - found.rank) == (4, 4, 1)
    assert not decomposed


def test_sparse_rank_is_the_rank() -> None:
    motion = motion_of(linkage_script(transformable(1), "tiling"))
    segment_motion = motion.segments[0]
    moment = generic_moment(segment_motion)
    assert moment is not None
    piece, tau = moment
    instants = piece.instants(np.array([tau]))
    state, _ = piece.evaluate(instants)
    (block,) = (block for block in segment_motion.plan.blocks if isinstance(block, Free))
    scale = np.full(len(block.core), segment_motion.plan.size)
    rows, found, free = rank.rank_at(block, rank.at_one(state), instants.clocks, rank.values_of(block, state), scale)
    expected, null, _ = null_space(rows, RANK_TOLERANCE)
    assert found == expected < len(block.core)
    assert np.abs(rows @ free).max() < 1e-12
    assert free == pytest.approx(null @ (null.T @ free), abs=1e-11)
    left = np.linalg.svd(rows)[0][:, expected:]
    assert block.sparse is not None
    assert rank.stress_of(block, rows, found) == pytest.approx(np.linalg.norm(left, axis=1), abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_closed_regions_leave_a_matching_as_it_is(seed: int) -> None:
    """Searching only where a free column may be found gives what searching everywhere gives."""
    chance = np.random.default_rng(seed)
    rows = [sorted(chance.choice(14, size=chance.integers(1, 4), replace=False).tolist()) for _ in range(18)]
    of_row, of_column = maximum_matching(rows, 14)
    matched = {i for i, column in enumerate(of_row) if column >= 0}
    assert all(of_column[of_row[i]] == i and of_row[i] in rows[i] for i in matched)
    first: list[int] = []  # the lexicographically first set: each row that can still be had with those before it
    for i in range(len(rows)):
        if _size([rows[k] for k in (*first, i)]) == len(first) + 1:
            first.append(i)
    assert sorted(matched) == first


def _size(rows: list[list[int]]) -> int:
    """The size of a maximum matching, by augmenting paths one row after the other (Kuhn)."""
    owner: dict[int, int] = {}

    def place(i: int, seen: set[int]) -> bool:
        for column in rows[i]:
            if column not in seen:
                seen.add(column)
                if column not in owner or place(owner[column], seen):
                    owner[column] = i
                    return True
        return False

    return sum(place(i, set()) for i in range(len(rows)))


def test_more_free_motions_than_are_looked_for_first() -> None:
    rows = np.zeros((3, 60))
    rows[[0, 1, 2], [5, 17, 40]] = 1.0
    found = SparseRank(rows, 1e-5)
    assert found.rank == 3
    assert found.free.shape == (60, 57)
    assert np.abs(rows @ found.free).max() < 1e-9


@pytest.mark.slow
def test_circles_that_are_one_all_the_time_are_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a scissor lift, each stage of which may be folded onto itself: what rounding makes of that is no motion."""
    nearest = counted(monkeypatch, coincidences, "_nearest")
    ends: list[int] = []
    sectioned = change_points._crossings

    def crossings(margin: Any, good: Any, bad: Any) -> Any:
        ends.append(len(good))
        return sectioned(margin, good, bad)

    monkeypatch.setattr(change_points, "_crossings", crossings)
    scissor = next(case for case in cases(14, 2) if case.name == "scissor 3")
    timeline = arranged(understand(SourceText("test.mov", scissor.text)), Choices())
    examined(timeline, Choices())
    assert nearest["_nearest"] < 200  # it was 7,000 in half a minute, with three more to go
    assert sum(ends) < 200


def test_times_after_an_end_are_as_many_as_can_be_tried() -> None:
    few = times_after(1.0, np.linspace(0.0, 10.0, 101), 10.0)
    assert np.isin(np.linspace(0.0, 10.0, 101)[11:], few).all()
    many = times_after(1.0, np.linspace(0.0, 10.0, 400_001), 10.0)
    assert len(many) <= 20_001
    assert many[0] < 1.0 + 1e-9
    assert 9.99 < many[-1] <= 10.0
    assert np.max(np.diff(many)) < 0.01
