"""Whatever can be typed is solved, or told what is wrong with it: no exception, and no frame that claims too much."""

import collections

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from movimentum.errors import MovimentumError
from movimentum.planning.structure.rates import RateError
from tests.properties.scenes import Anything
from tests.solver.scenes import motion_of, residuals


def outcome(seed):
    """What becomes of one random script; a frame that counts as solved must satisfy what the script says."""
    text = Anything(seed).script()
    try:
        motion = motion_of(text)
    except MovimentumError as error:
        return error.diagnostics[0].code
    except RateError:
        return "cyclic"
    examination = examine(motion)
    poses = motion.poses(0, motion.timeline.frame_count)
    if examination.fault == 0:
        assert poses.solved.all(), text
        try:
            off = max(residuals(motion, poses).values(), default=0.0)
        except NotImplementedError:  # an operation that the check does not know
            return "unchecked"
        # what runs far away is known to the rounding of its own size only
        far = max([np.max(np.abs(poses.origin)), *(np.max(np.abs(v)) for v in poses.variables.values())]) / motion.size
        assert off < 1e-6 + 1e-14 * far, text
    return f"fault {examination.fault}"


def survey(seeds):
    found = collections.Counter(outcome(seed) for seed in seeds)
    print(dict(found))
    assert found["fault 0"] > len(seeds) // 6


@pytest.mark.slow
def test_random_scripts():
    survey(range(36))


@pytest.mark.slow
@pytest.mark.parametrize("block", range(2))
def test_many_random_scripts(block):
    survey(range(1000 * block + 1000, 1000 * block + 1150))
