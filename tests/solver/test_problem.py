"""A block's rows as functions of its core: nothing is written to, and the Jacobian is the derivative."""

from contextlib import chdir
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from movimentum.solver.block.newton import newton, newton_step
from movimentum.solver.block.problem import BlockProblem, track_scale
from tests.broad import broad
from tests.solver.scenes import motion_of

SCRIPTS = Path(__file__).parents[2] / "scripts"
WITH_NEWTON = ["penrose-five", "peaucellier-linkage", "stephenson", "walschaerts"]


@cache
def problems(name):
    """(problem, core values, state before it) of every block that Newton's method solves, at three instants."""
    with chdir(SCRIPTS):
        motion = motion_of((SCRIPTS / f"{name}.mov").read_text(encoding="utf-8"))
    found = []
    for segment_motion in motion.segments:
        piece = segment_motion.pieces[0]
        instants = piece.instants(np.array([0.1, 0.4, 0.7]) * piece.end)
        state, _ = piece.evaluate(instants)
        for block in filter(None, (block.simultaneous for block in segment_motion.plan.blocks)):
            x = np.stack([np.broadcast_to(state[n], 3) for n in block.core], axis=1)
            scale = track_scale(segment_motion.plan, block)
            found.append((BlockProblem.of(block, state, instants.clocks, scale), x, state))
    return found


@broad("name", WITH_NEWTON, fast=("stephenson",))
def test_the_jacobian_is_the_derivative_and_nothing_is_written_to(name):
    count = 0
    for problem, x, state in problems(name):
        count += 1
        before = [None if value is None else np.array(value) for value in state]
        aside = x + 1e-3 * problem.scale * np.random.default_rng(3).normal(size=x.shape)
        jacobian = problem.jacobian(aside) * problem.scale
        for j in range(x.shape[1]):
            step = np.zeros(x.shape[1])
            step[j] = 1e-5 * problem.scale[j]
            slope = (problem.residual(aside + step) - problem.residual(aside - step)) / 2e-5
            assert slope == pytest.approx(jacobian[:, :, j], abs=1e-7 * max(1.0, float(np.abs(jacobian).max())))
        problem.wishes(aside)
        problem.completed(aside)
        for value, old in zip(state, before, strict=True):
            assert (value is None) == (old is None)
            assert value is None or np.array_equal(value, old)
        assert problem.residual(x) == pytest.approx(0.0, abs=1e-6 * float(problem.scale.max()) ** 2)
    assert count > 0


@broad("name", WITH_NEWTON, first=1)
def test_some_instants_of_a_problem_are_as_in_the_whole(name):
    for problem, x, _ in problems(name):
        whole = problem.residual(x + problem.scale)
        for place in range(3):
            one = problem.at(np.array([place]), 3)
            assert np.array_equal(one.residual(x[place : place + 1] + problem.scale), whole[place : place + 1])
        first = problem.first(4)
        assert np.array_equal(
            first.residual(np.repeat(x[:1] + problem.scale, 4, axis=0)), np.repeat(whole[:1], 4, axis=0)
        )


@broad("limit", [None, 0.5], first=1)
@broad("name", ["stephenson", "walschaerts", "locomotive"], first=1)
def test_no_start_depends_on_the_others(name, limit):
    """Those that have arrived are left out, and nothing that is left feels it."""
    count = 0
    for problem, x, _ in problems(name):
        one = problem.first()
        starts = x[0] + 0.3 * problem.scale * np.random.default_rng(4).normal(size=(12, x.shape[1]))
        starts[::2] = x[0] + 1e-3 * (starts[::2] - x[0])
        together = newton(one.first(12), starts, iterations=40, limit=limit)
        for k in range(12):
            alone = newton(one, starts[[k]], iterations=40, limit=limit)
            assert np.array_equal(alone.x[0], together.x[k], equal_nan=True)
            assert alone.converged[0] == together.converged[k]
        count += bool(together.converged.any())
    assert count > 0


@pytest.mark.parametrize(("rows", "unknowns"), [(5, 4), (12, 9), (43, 39), (9, 2)])
def test_steps_from_afar_are_those_of_least_squares(rows, unknowns):
    generator = np.random.default_rng(rows)
    jacobian = generator.normal(size=(20, rows, unknowns))
    jacobian[15:, :, -1] = jacobian[15:, :, 0]  # not of full rank: the least of all least-squares steps
    residual, scale = generator.normal(size=(20, rows)), 10.0 ** generator.uniform(-2, 2, unknowns)
    exact = newton_step(jacobian, residual, scale, square=False)
    cheap = newton_step(jacobian, residual, scale, square=False, afar=True)
    assert np.array_equal(cheap[15:], exact[15:])
    assert cheap / scale == pytest.approx(exact / scale, rel=1e-7, abs=1e-9)
    lengths = np.linalg.norm(jacobian * scale, axis=2)
    for k in range(20):
        best = -np.linalg.lstsq(jacobian[k] * scale / lengths[k][:, None], residual[k] / lengths[k], rcond=1e-9)[0]
        assert cheap[k] / scale == pytest.approx(best, rel=1e-7, abs=1e-9)
