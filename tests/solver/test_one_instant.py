"""Newton's method in plain floats finds what Newton's method over arrays finds, in no more steps."""

import numpy as np

from movimentum.solver.basis.effort import limit_effort
from movimentum.solver.block.newton import newton, newton_at_instant
from tests.broad import broad
from tests.solver.test_problem import problems

SQUARE = ["stephenson", "walschaerts", "peaucellier-linkage"]
AWAY = [1e-2, 1e-3, 1e-5, 0.0]


@broad("name", SQUARE, first=2)
def test_it_finds_the_same_pose(name):
    random = np.random.default_rng(11)
    seen = 0
    for problem, x, _ in problems(name):
        if not problem.block.is_square or problem.sparse is not None:
            continue
        for place in range(3):
            one = problem.at(np.array([place]), 3)
            for away in AWAY:
                start = x[place] + away * problem.scale * random.normal(size=x.shape[1])
                whole = newton(one, start[None])
                found = newton_at_instant(one, start, 12)
                assert found is not None
                pose, converged = found
                assert converged == bool(whole.converged[0])
                if converged:
                    assert np.max(np.abs(pose - whole.x[0]) / problem.scale) < 1e-12
                    seen += 1
    assert seen >= 12 or name == "peaucellier-linkage"


def test_it_takes_no_more_linearizations():
    for problem, x, _ in problems("walschaerts"):
        if not problem.block.is_square:
            continue
        one, start = problem.at(np.array([0]), 3), x[0] + 1e-3 * problem.scale
        with limit_effort(1000) as left:
            newton_at_instant(one, start, 12)
        with limit_effort(1000) as before:
            newton(one, start[None])
        assert left[0] >= before[0]


@broad("name", SQUARE, first=1)
def test_from_a_singular_pose_it_finds_nothing_wrong(name):
    """With all of the core at zero, directions have no length, and rows no gradient."""
    for problem, x, _ in problems(name):
        if not problem.block.is_square or problem.sparse is not None:
            continue
        one = problem.at(np.array([0]), 3)
        found = newton_at_instant(one, np.zeros(x.shape[1]), 30)
        if found is not None and found[1]:
            assert np.max(np.abs(one.residual(found[0][None]))) < 1e-6 * float(problem.scale.max()) ** 2


def test_what_cannot_be_divided_is_left_to_who_can_tell():
    for problem, x, _ in problems("walschaerts"):
        if problem.block.is_square:
            one = problem.at(np.array([0]), 3)
            nothing = np.full(x.shape[1], np.nan)
            assert newton_at_instant(one, nothing, 12) is None
