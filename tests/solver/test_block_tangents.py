"""Least motions and steps of free blocks, dense and sparse, against the linear systems that define them."""

from __future__ import annotations

import numpy as np
import pytest

from movimentum.solver.block.linearization import DenseTangent, Tangent, chord_newton, is_mobile, tangent_at
from movimentum.solver.block.problem import Damping
from movimentum.solver.block.sparse import QuadraticProgram, factorize, saddle_point
from movimentum.solver.free.velocity import project_onto_equations
from tests.solver.blocks import TIME, free_block, less, newton_block, problem_at, times, total, unknowns

ROUGH = 2e-5
"""Of a large block: how far rows that are relaxed by 1e-10 let a step be from the least one."""
BOTH = pytest.mark.parametrize("large", [False, True], ids=["dense", "sparse"])


def some_metric(rng: np.random.Generator, count: int) -> np.ndarray:
    """Any positive definite matrix."""
    root = rng.normal(size=(count, count))
    return root @ root.T + 0.5 * np.eye(count)


def linear_rows(matrix: np.ndarray, right: np.ndarray):
    """matrix . x - right."""
    some = unknowns(matrix.shape[1])
    return [
        less(total(*(times(float(a), u) for a, u in zip(row, some, strict=True))), float(b))
        for row, b in zip(matrix, right, strict=True)
    ]


def stationary(metric: np.ndarray, rows: np.ndarray, want: np.ndarray, pull: np.ndarray) -> np.ndarray:
    """The v with rows . v = want that makes v' M v / 2 + v' pull least, by its multipliers."""
    n, m = len(metric), len(rows)
    whole = np.block([[metric, rows.T], [rows, np.zeros((m, m))]])
    return np.linalg.lstsq(whole, np.concatenate([-pull, want]), rcond=None)[0][:n]


def tangent_of(seed: int, large: bool, size: float = 1.0) -> tuple[Tangent, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 8))
    m = int(rng.integers(1, n - 1))
    metric, rows = some_metric(rng, n), size * rng.normal(size=(m, n))
    block = free_block(linear_rows(rows, np.zeros(m)), range(n), metric, large=large)
    return tangent_at(problem_at(block), np.zeros(n)), metric, rows


@BOTH
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_the_least_velocity_is_stationary(seed, size, large):
    tangent, metric, rows = tangent_of(seed, large, size)
    rng = np.random.default_rng(seed + 100)
    want, pull = size * rng.normal(size=len(rows)), rng.normal(size=len(metric))
    scale = 1.0 / np.sqrt(np.diag(metric))
    np.testing.assert_allclose(tangent.scale, scale, rtol=1e-14)
    np.testing.assert_allclose(
        tangent.lengths,
        np.linalg.norm(rows @ np.linalg.inv(np.linalg.cholesky(metric)).T, axis=1)
        if not large
        else np.linalg.norm(rows * scale, axis=1),
        rtol=1e-12,
    )
    exact = stationary(metric, rows / size, want / size, pull)
    np.testing.assert_allclose(tangent.least_velocity(want, pull), exact, rtol=0.0, atol=ROUGH if large else 1e-10)
    exact = stationary(metric, rows / size, want / size, 0.0 * pull)
    np.testing.assert_allclose(tangent.least_velocity(want), exact, rtol=0.0, atol=ROUGH if large else 1e-10)
    np.testing.assert_allclose(tangent.corrected(want), -exact, rtol=0.0, atol=ROUGH if large else 1e-10)
    np.testing.assert_allclose(rows @ tangent.least_velocity(want, pull), want, rtol=1e-9, atol=1e-11 * size)


@BOTH
def test_a_repeated_row_changes_nothing(large):
    rng = np.random.default_rng(3)
    metric, rows = some_metric(rng, 5), rng.normal(size=(2, 5))
    twice = np.concatenate([rows, 7.0 * rows[:1]])
    want, pull = rng.normal(size=2), rng.normal(size=5)
    block = free_block(linear_rows(twice, np.zeros(3)), range(5), metric, large=large)
    found = tangent_at(problem_at(block), np.zeros(5)).least_velocity(np.append(want, 7.0 * want[0]), pull)
    np.testing.assert_allclose(found, stationary(metric, rows, want, pull), rtol=0.0, atol=ROUGH)


@BOTH
@pytest.mark.parametrize("seed", range(4))
def test_toward_adds_the_least_motion_that_brings_the_errors(seed, large):
    """Undamped: of all motions that the rows allow the one of least size that changes the errors as wanted."""
    tangent, metric, rows = tangent_of(seed + 20, large)
    rng = np.random.default_rng(seed)
    v = tangent.least_velocity(rng.normal(size=len(rows)))
    slopes, want = rng.normal(size=(1, len(v))), rng.normal(size=1)
    found = tangent.toward(v, slopes, want, Damping(weak=1e-9))
    added = stationary(
        metric, np.concatenate([rows, slopes]), np.append(np.zeros(len(rows)), want - slopes @ v), 0.0 * v
    )
    np.testing.assert_allclose(found - v, added, rtol=0.0, atol=ROUGH if large else 1e-9)
    assert np.isnan(tangent.toward(v, slopes, np.full(1, np.nan), Damping())).all()


def test_a_rigid_block_goes_nowhere_toward_a_wish():
    rng = np.random.default_rng(8)
    rows = rng.normal(size=(3, 3))
    tangent = DenseTangent(free_block(linear_rows(rows, np.zeros(3)), range(3), np.eye(3)), rows)
    v = rng.normal(size=3)
    assert np.array_equal(tangent.toward(v, np.ones((1, 3)), np.ones(1), Damping()), v)


@pytest.mark.parametrize("seed", range(4))
def test_the_acceleration_is_the_derivative_of_the_least_velocity(seed):
    rng = np.random.default_rng(seed)
    n, m = 5, 2
    metric, block = some_metric(rng, n), None
    j0, j1, w0, w1, p0, p1 = (rng.normal(size=s) for s in [(m, n), (m, n), m, m, n, n])
    block = free_block(linear_rows(j0, w0), range(n), metric)

    def velocity(t: float) -> np.ndarray:
        return stationary(metric, j0 + t * j1, w0 + t * w1, p0 + t * p1)

    v = velocity(0.0)
    # J v = w: J v' = w' - J' v
    found = DenseTangent(block, j0).accelerated(v, w1 - j1 @ v, p0, p1, j1)
    h = 1e-3
    ahead = (8 * (velocity(h) - velocity(-h)) - (velocity(2 * h) - velocity(-2 * h))) / (12 * h)
    np.testing.assert_allclose(found, ahead, rtol=1e-8, atol=1e-8)


@BOTH
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("seed", range(4))
def test_back_onto_a_plane_is_the_foot_of_the_metric(seed, size, large):
    rng = np.random.default_rng(seed)
    metric, rows, right = some_metric(rng, 4), rng.normal(size=(2, 4)), size * rng.normal(size=2)
    problem = problem_at(free_block(linear_rows(rows, right), range(4), metric, large=large))
    x = size * rng.normal(size=4)
    inverse = np.linalg.inv(metric)
    foot = x + inverse @ rows.T @ np.linalg.solve(rows @ inverse @ rows.T, right - rows @ x)
    found, good = project_onto_equations(problem, x)
    assert good
    np.testing.assert_allclose(rows @ found, right, rtol=0.0, atol=1e-11 * size)
    np.testing.assert_allclose(found, foot, rtol=0.0, atol=(ROUGH if large else 1e-11) * size)
    _, error, _ = chord_newton(problem, x, 0)
    tangent = tangent_at(problem, x)
    left = np.max(np.abs((rows @ x - right) / tangent.lengths)) / np.max(np.abs(x / tangent.scale))
    assert error == pytest.approx(left, rel=1e-12)


@BOTH
@pytest.mark.parametrize("factor", [0.6, 0.95, 1.3, 1.9])
def test_back_onto_a_sphere_goes_along_the_radius(factor, large):
    x, y, z = unknowns(3)
    sphere = less(total(times(x, x), times(y, y), times(z, z)), 9.0)
    block = free_block([sphere], range(3), np.eye(3), large=large)
    foot = np.array([1.0, 2.0, 2.0])
    found, error, tangent = chord_newton(problem_at(block), factor * foot, 20)
    assert error <= 1e-14
    np.testing.assert_allclose(found, foot, rtol=1e-11)
    again, error, same = chord_newton(problem_at(block), 1.0001 * foot, 12, tangent=tangent)
    assert error <= 1e-12
    assert same is tangent  # steps shrink fast: no other is needed
    np.testing.assert_allclose(again, foot, rtol=1e-11)
    short, _, _ = chord_newton(problem_at(block), 1.2 * foot, 1, limit=0.25)
    assert np.max(np.abs(short - 1.2 * foot)) == pytest.approx(0.25, rel=1e-12)


def test_what_cannot_be_met_is_told_by_the_residual_that_is_left():
    x, y = unknowns(2)
    block = free_block([total(times(x, x), times(y, y), 1.0)], range(2), np.eye(2))
    found, good = project_onto_equations(problem_at(block), np.array([0.7, 0.4]))
    assert not good
    assert np.isfinite(found).all()


# --- can a pose move although its equations are as many as its unknowns?


def turned(rows, matrix: np.ndarray):
    """The same rows in other unknowns: x = matrix . y."""

    def f(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residual, jacobian = rows(matrix @ y)
        return residual, jacobian @ matrix

    return f


def curve_twice(x: np.ndarray):
    """A circle, stated twice: it moves along that."""
    r, j = x @ x - 1.0, 2.0 * x
    return np.array([r, 3.0 * r]), np.array([j, 3.0 * j])


def tangent_circles(x: np.ndarray):
    """Two circles that touch at (1, 0): no rank, and no motion."""
    away = x - np.array([3.0, 0.0])
    return np.array([x @ x - 1.0, away @ away - 4.0]), np.array([2.0 * x, 2.0 * away])


def regular(x: np.ndarray):
    """Two circles that cross at (1, 0)."""
    away = x - np.array([1.0, 1.0])
    return np.array([x @ x - 1.0, away @ away - 1.0]), np.array([2.0 * x, 2.0 * away])


def cusp(x: np.ndarray):
    """y = x^3 and y = 0 meet at the origin three times, and nowhere else."""
    return np.array([x[1] - x[0] ** 3, x[1]]), np.array([[-3.0 * x[0] ** 2, 1.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ("rows", "pose", "moves"),
    [(curve_twice, [1, 0], True), (curve_twice, [0.6, 0.8], True), (tangent_circles, [1, 0], False),
     (regular, [1, 0], False), (cusp, [0, 0], False)],
)  # fmt: skip
@pytest.mark.parametrize("angle", [0.0, 33.0, 140.0])
def test_a_pose_moves_only_where_its_rank_is_lost_beside_it_too(rows, pose, moves, angle):
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    matrix = np.array([[c, -s], [s, c]])
    start = matrix.T @ np.array(pose, dtype=np.float64)
    for factor in (1e-8, 1.0, 1e8):  # of the equations: rows are brought to unit length

        def scaled(y: np.ndarray, factor: float = factor):
            residual, jacobian = turned(rows, matrix)(y)
            return factor * residual, factor * jacobian

        assert is_mobile(scaled, start) is moves


def test_a_pose_with_what_is_not_finite_does_not_count_as_mobile():
    assert not is_mobile(lambda x: (np.array([np.nan]), np.array([[1.0]])), np.zeros(1))
    assert not is_mobile(lambda x: (np.array([np.inf]), np.array([[0.0]])), np.zeros(1))


# --- quadratic programs of large blocks


@pytest.mark.parametrize("seed", range(5))
def test_the_step_of_a_quadratic_program_is_stationary(seed):
    """1/2 f s'Ms + g's + 1/2 (v + a's)^2 is least where the rows and one more hold to first order."""
    rng = np.random.default_rng(seed)
    n = 6
    metric, rows, right = some_metric(rng, n), rng.normal(size=(2, n)), rng.normal(size=2)
    x = rng.normal(size=n)
    program = QuadraticProgram(problem_at(free_block(linear_rows(rows, right), range(n), metric, large=True)), x)
    more, gradient, side = rng.normal(size=3), rng.normal(size=n), rng.normal(size=2)
    places, aside = np.array([0, 2, 5]), np.array([1, 4])
    program.row(places, more, 0.7)
    block_metric = free_block([], range(n), metric).metric
    program.weigh(block_metric, 2.5, gradient)
    program.square(aside, side, -1.2)
    whole, all_rows = 2.5 * metric, np.zeros((3, n))
    all_rows[:2], all_rows[2, places] = rows, more
    square = np.zeros(n)
    square[aside] = side
    exact = stationary(
        whole + np.outer(square, square), all_rows, np.append(right - rows @ x, -0.7), gradient - 1.2 * square
    )
    np.testing.assert_allclose(program.step(), exact, rtol=0.0, atol=ROUGH)


def test_a_soft_row_gives_way_to_a_hard_one():
    x, _ = unknowns(2)
    block = free_block([less(x, 3.0)], range(2), np.eye(2), large=True)
    program = QuadraticProgram(problem_at(block), np.zeros(2))
    program.weigh(block.metric, 1.0, np.zeros(2))
    program.row(np.array([0]), np.ones(1), 5.0, soft=True)  # x = -5
    program.row(np.array([1]), np.ones(1), 5.0, soft=True)  # y = -5
    step = program.step()
    assert step[0] == pytest.approx(3.0, rel=1e-3)
    assert step[1] == pytest.approx(-5.0, rel=1e-3)


def test_what_is_singular_or_not_finite_has_no_step():
    from scipy.sparse import csc_matrix

    assert factorize(csc_matrix(np.zeros((2, 2)))) is None
    x, y = unknowns(2)
    block = free_block([less(times(x, y), 1.0)], range(2), np.eye(2), large=True)
    assert np.isnan(saddle_point(problem_at(block), np.array([np.nan, 1.0])).least_velocity(np.ones(1))).all()
    program = QuadraticProgram(problem_at(block), np.ones(2))
    program.weigh(block.metric, 1.0, np.array([np.nan, 0.0]))
    assert np.isnan(program.step()).all()


@pytest.mark.parametrize("t", [0.0, 0.5, 2.0])
def test_sparse_rows_whose_coefficients_change_with_time_are_the_dense_ones(t):
    x, y, z = unknowns(3)
    rows = [total(times(TIME, x, y), times(2.0, z)), less(times(z, z), times(TIME, TIME))]
    point = np.array([[0.3, -1.2, 0.7]])
    one, other = (
        problem_at(block, t)
        for block in (newton_block(rows, range(3)), free_block(rows, range(3), np.eye(3), large=True))
    )
    exact = [[t * 0.3 * -1.2 + 2.0 * 0.7, 0.49 - t * t]]
    slopes = [[[-1.2 * t, 0.3 * t, 2.0], [0.0, 0.0, 1.4]]]
    for problem in (one, other):
        np.testing.assert_allclose(problem.residual(point), exact, rtol=1e-14)
        np.testing.assert_allclose(problem.jacobian(point), slopes, rtol=1e-14)
