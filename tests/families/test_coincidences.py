"""Kites, rhombuses and scissor lifts through the instants at which circles are one, against closed forms."""

import numpy as np
import pytest

from tests.families.coincidences import cases
from tests.families.judging import broken_promises, errors_of, solved_as_written
from tests.solver.scenes import anchor

OFF = 3e-8
"""Of the scene's size: where a rhombus is folded flat half of all digits are lost."""


@pytest.mark.slow
@pytest.mark.parametrize(("count", "seed"), [(4, 1), pytest.param(14, 2, marks=pytest.mark.slow)])
def test_the_limit_comes_from_both_sides(count, seed):
    wrong = []
    for number, case in enumerate(cases(count, seed)):
        examination, motion, poses = solved_as_written(case.text, (8, 25, 72)[number % 3])
        off = max(
            float(np.max(np.hypot(*(anchor(motion, poses, name) - truth).T)))
            for name, truth in case.places(poses.times).items()
        )
        broken = broken_promises(motion, poses, OFF * motion.size)
        if examination.fault or broken or not poses.solved.all() or off > OFF * motion.size:
            wrong.append((case.name, off, broken, [error.message for error in errors_of(examination)], case.text))
    print(f"{count} mechanisms with circles that become one, {len(wrong)} wrong")
    assert not wrong
