"""What is found by a few operations on arrays is what is found piece by piece."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.penrose import transformable
from movimentum.arrays import finite_throughout
from movimentum.expressions import ZERO
from movimentum.interop.linkages import linkage_script
from movimentum.planning.blocks.kinds import Free, Winding
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.solver.block.change_points import find_events
from movimentum.solver.path.piece import Piece
from movimentum.solver.solver import solve
from tests.broad import broad
from tests.engine.families import dyads, four_bars
from tests.understand import timeline_of


@pytest.mark.parametrize("text", [four_bars(5), dyads(6)], ids=["four-bars", "dyads"])
@pytest.mark.parametrize("count", [1, 2, 11])
def test_angles_together_are_those_found_one_by_one(text: str, count: int) -> None:
    motion = solve(timeline_of(text))
    piece = motion.segments[0].pieces[0]
    assert isinstance(piece, Piece)
    instants = piece.instants(np.linspace(piece.begin, piece.end, count))
    (together, bad), (alone, lost) = piece.solve(instants), piece.evaluate(instants)
    angles = [n for block in piece.plan.blocks if isinstance(block, Winding) for n in block.unknowns]
    assert len(angles) > 4
    assert not bad.any()
    assert not lost.any()
    for n in angles:
        assert np.broadcast_to(together[n], count) == pytest.approx(np.broadcast_to(alone[n], count), abs=1e-9)


@broad("pinned", [False, True], first=1)
@pytest.mark.parametrize("order", [1, 2])
@broad("shape", [(2, 4), (3,), ()], first=1)
def test_eliminated_unknowns_are_what_their_formulas_say(order: int, shape: tuple[int, ...], pinned: bool) -> None:
    """To the last bit, for numbers and arrays: they are the unknowns of rods, in those of their joints."""
    text = linkage_script(transformable(order), "tiling")
    first = next(line.split(" :")[0] for line in text.splitlines() if " : .bar" in line)
    plan = solve(timeline_of(text + (f"\n{first}.V0.x = 30*.t; @1\n" if pinned else ""))).segments[0].plan
    (block,) = [block for block in plan.blocks if isinstance(block, Free) and block.linear is not None]
    assert block.linear is not None
    assert block.explicit is not None
    chance = np.random.default_rng(order)
    state = {n: chance.normal(size=shape) for n in (*block.core, *block.inputs)}
    clocks = [np.asarray(chance.normal(size=shape)) for _ in plan.clocks]
    found = block.explicit(state, clocks)
    known = compiled([root for _, root in block.given], Clocks(plan.clocks))(state, clocks)
    assert block.targets == tuple(n for n, _ in block.given)
    assert len(found) == len(known) > 40
    for one, other in zip(found, known, strict=True):
        assert np.array_equal(np.broadcast_to(one, shape), np.broadcast_to(other, shape))
    assert pinned == any(root != ZERO for root in block.linear.rests)


@pytest.mark.parametrize("least", [0.02, 0.3, 5.0])
def test_what_is_far_from_zero_is_not_looked_at_between_nodes(least: float) -> None:
    tau = np.linspace(0.0, 1.0, 30)
    asked: list[int] = []

    def margin(times: np.ndarray) -> np.ndarray:
        asked.append(len(times))
        return least * (1.5 + 0.5 * np.sin(50.0 * times))

    events = find_events(margin, tau, np.clip(margin(tau), least, 2.0 * least))
    assert (events.flips, events.gaps) == ((), ())
    assert len(asked) == 1


@pytest.mark.parametrize("shape", [(1,), (7,), (3, 5)])
@pytest.mark.parametrize("size", [1e-300, 1.0, 1e200])
def test_finite_throughout_tells_any_number_that_is_not(shape: tuple[int, ...], size: float) -> None:
    """Also where squares overflow."""
    values = np.full(shape, size)
    with np.errstate(all="ignore"):
        assert all(map(finite_throughout, (values, values.T, np.float64(size), size)))
        for wrong in (math.nan, math.inf, -math.inf):
            assert not finite_throughout(wrong)
            for place in np.ndindex(shape):
                spoilt = values.copy()
                spoilt[place] = wrong
                assert not finite_throughout(spoilt)
