"""What only measures does not make a block larger: it is found afterwards."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.penrose import transformable
from movimentum.interop.linkages import linkage_script
from movimentum.planning.blocks.kinds import Free
from movimentum.solver.motion import PathMotion
from movimentum.solver.solver import solve
from tests.understand import timeline_of

TILING = linkage_script(transformable(1), "tiling")
FIRST = next(line.split(" :")[0] for line in TILING.splitlines() if " : .bar" in line)
PULL = f"{FIRST}.V0.x ~ 400; @1\n"


@cache
def solved(*statements: str) -> PathMotion:
    """The tiling pulled, with further statements: a second or more each, so the motions are shared."""
    return solve(timeline_of(TILING.rstrip() + "\n" + "\n".join(statements) + "\n" + PULL))


def core(motion: PathMotion) -> list[int]:
    """How many unknowns each free block is solved for at once."""
    return [len(block.core) for block in motion.segments[0].plan.blocks if isinstance(block, Free)]


@pytest.mark.slow
@pytest.mark.parametrize(
    "measure",
    [
        f"turned = {FIRST}.angle;",
        f"far = ({FIRST}.V0 - [10,20]).l;",
        f"twice = 2*once; once = {FIRST}.V0.x + {FIRST}.V0.y;",
        f"turned = {FIRST}.angle + far; far = ({FIRST}.V0 - [10,20]).l;",
    ],
)
def test_a_measure_leaves_a_large_block_as_it_is(measure: str) -> None:
    plain, measured = solved(), solved(measure)
    # a thing whose angle is mentioned has another frame, which may cost an elimination
    assert [len(sizes) for sizes in (core(plain), core(measured))] == [1, 1]
    assert core(plain)[0] <= core(measured)[0] <= core(plain)[0] + 2
    a, b = (motion.poses(0, motion.timeline.frame_count) for motion in (plain, measured))
    assert np.allclose(a.origin, b.origin, atol=0.1)  # a wish is reached within that at once, and exactly later
    assert b.solved.all()


@pytest.mark.slow
def test_a_measure_is_right_and_can_be_wished_for() -> None:
    motion = solved(f"turned = {FIRST}.angle;")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert np.array_equal(poses.variables["turned"], poses.angle[0])
    text = TILING.rstrip() + f"\nturned = {FIRST}.angle; turned ~ 9; @2\n"
    motion = solve(timeline_of(text))
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.variables["turned"][-1] == pytest.approx(9.0, abs=1e-4)
    assert poses.angle[0, -1] == pytest.approx(9.0, abs=1e-4)
