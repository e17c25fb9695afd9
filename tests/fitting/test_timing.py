"""The best times of precision points, against all that there are; and least squares where matrices are singular."""

from __future__ import annotations

import numpy as np
import pytest

from movimentum.fitting.evaluation import BatchEvaluator
from movimentum.fitting.fit import FitProblem, make_job, make_problem
from movimentum.fitting.least_squares import steps_of
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from tests.broad import broad

ARM = """.let R = 40 .range(20, 60); {lets}
Arm : .bar O = [0, 0] P = [R, 0];
@0 Arm.O = [0, 0]; Arm.angle = 300*.t;
{goals}
@1"""


def made(points, requirements="", lets=""):
    lets = lets or "".join(f".let t{k} = 0.5 .range(0, 1); " for k in range(len(points)))
    goals = "".join(f" .goal Arm.P = [{float(x)!r}, {float(y)!r}] .at(t{k});\n" for k, (x, y) in enumerate(points))
    text = ARM.format(lets=lets, goals=goals + requirements)
    return make_problem(make_job(SourceText("arm.mov", text), Choices(), {}))


def retimed(problem: FitProblem, constants):
    assert isinstance(problem.search.evaluate, BatchEvaluator)
    return problem.search.evaluate.retimed(constants)


def cost(radius, points, times):
    """By a formula of our own."""
    turns = np.radians(300.0 * np.asarray(times))
    return sum(
        (radius * np.cos(a) - x) ** 2 + (radius * np.sin(a) - y) ** 2 for a, (x, y) in zip(turns, points, strict=True)
    )


@broad("seed", range(6), every=3)
@pytest.mark.parametrize("ordered", [False, True])
def test_times_are_the_best_ones(seed, ordered):
    generator = np.random.default_rng([seed, ordered])
    points = generator.uniform(-60.0, 60.0, (3, 2))
    order = " .require t0 < t1; .require t2 > t1;" if ordered else ""
    constants = np.column_stack([generator.uniform(20.0, 60.0, 4), generator.random((4, 3))])
    found = retimed(made(points, order), constants)
    assert np.array_equal(found[:, 0], constants[:, 0])
    tried = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 61)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    if ordered:
        tried = tried[(np.diff(tried, axis=1) >= 0.0).all(axis=1)]
    for radius, *times in found:
        if ordered:
            assert times == sorted(times)
        least = cost(radius, points, tried.T).min()
        assert cost(radius, points, times) <= least + 2e-3 * 60.0**2  # both know the arc at some instants only


def test_gaps_and_intervals_are_kept():
    points = [(0.0, 60.0), (60.0, 0.0)]
    lets = ".let t0 = 0.5 .range(0.1, 0.9); .let t1 = 0.5 .range(0.2, 0.6);"
    (found,) = retimed(made(points, " .require t1 - t0 >= 0.2;", lets), np.array([[30.0, 0.7, 0.3]]))
    assert 0.1 <= found[1] <= found[2] - 0.2 + 1e-12
    assert found[2] <= 0.6


@pytest.mark.parametrize(
    ("lets", "more"),
    [
        (".let t0 = 0.5 .range(0, 1);", " .goal Arm.P.x.at(0) = 9*t0;"),
        (".let t0 = 0.5 .range(0, 1); .let x = t0;", " .goal Arm.P.x.at(x/2) = 9;"),
        (".let t0 = 0.5 .range(0, 1);", " .goal Arm.P.x.at(t0) = .max(Arm.P.y);"),
    ],
)
def test_a_time_that_does_something_else_too_is_searched_like_any_constant(lets, more):
    problem = made([(0.0, 60.0)], more, lets)
    assert isinstance(problem.search.evaluate, BatchEvaluator)
    assert problem.search.evaluate.free_times.times == []
    assert problem.search.timing is None


def test_orders_that_go_round_in_a_circle_end_nowhere():
    problem = made([(0.0, 60.0)] * 3, " .require t0 < t1; .require t1 < t2; .require t2 < t0;")
    assert retimed(problem, np.array([[30.0, 0.1, 0.2, 0.3]])).shape == (1, 4)


def test_a_singular_matrix_has_the_shortest_step():
    """Two unknowns that nothing tells apart: their matrix is singular to the last bit, beside one that is not."""
    matrices = np.array([[[2.0, 2.0], [2.0, 2.0]], [[2.0, 0.0], [0.0, 4.0]]])
    found = steps_of(matrices, np.array([[4.0, 4.0], [4.0, 4.0]]))
    assert found == pytest.approx(np.array([[-1.0, -1.0], [-2.0, -1.0]]))
