"""A drive in steps that hold, run, ease and reverse comes to the same as one expression."""

from __future__ import annotations

import numpy as np
import pytest

from movimentum.solver.poses import Poses
from movimentum.solver.solver import solve
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, understand
from tests.broad import broad
from tests.families.drives import WAYS, split_and_whole

SIZE = 100.0


def poses_of(text: str) -> Poses:
    timeline = arranged(understand(SourceText("scene.mov", text)), Choices())
    return solve(timeline).poses(0, timeline.frame_count)


def check_twins(seed: int) -> None:
    steps, whole, how = split_and_whole(seed)
    one, other = poses_of(steps), poses_of(whole)
    assert len(one.frames) == len(other.frames)
    # where a drive goes past a reach, a new step begins again, and one expression does not
    good = [len(poses.frames) if poses.solved.all() else int(np.argmin(poses.solved)) for poses in (one, other)]
    assert good[0] == good[1], (seed, how, good)
    assert good[0] > 0
    off = np.abs(one.origin[:, : good[0]] - other.origin[:, : good[0]]).max()
    turned = np.abs(one.direction[:, : good[0]] - other.direction[:, : good[0]]).max()
    assert max(off / SIZE, turned) <= 1e-9, (seed, how, off, turned)


@broad("seed", range(3 * len(WAYS)), every=4)
def test_steps_and_one_expression_agree(seed):
    check_twins(seed)


@pytest.mark.slow
@pytest.mark.parametrize("way", range(len(WAYS)))
def test_many_drives_agree(way):
    for seed in range(1000 + way, 1000 + 24 * len(WAYS), len(WAYS)):
        check_twins(seed)
