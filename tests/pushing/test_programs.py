"""The least push, against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from movimentum.solver.pushing.quadratic_program import non_negative_least_squares, shortest_vector


@pytest.mark.parametrize("seed", range(12))
def test_the_shortest_vector_is_that_of_another_solver(seed: int) -> None:
    random = np.random.default_rng(seed)
    count, n = int(random.integers(1, 8)), int(random.integers(1, 6))
    rows = random.normal(size=(count, n))
    inside = random.normal(size=n)  # so that there is one
    least = rows @ inside - random.uniform(0.0, 1.0, count)
    found = shortest_vector(rows, least)
    assert found.y is not None
    assert (rows @ found.y - least).min() > -1e-7
    other = minimize(
        lambda y: float(y @ y),
        inside,
        jac=lambda y: 2.0 * y,
        constraints={"type": "ineq", "fun": lambda y: rows @ y - least, "jac": lambda y: rows},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 400},
    )
    assert float(found.y @ found.y) == pytest.approx(float(other.x @ other.x), abs=1e-6)


def test_what_contradicts_is_named() -> None:
    rows = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    found = shortest_vector(rows, np.array([1.0, 1.0, 0.5]))
    assert found.y is None
    assert found.active.tolist() == [0, 1]


def test_rows_that_say_the_same_are_borne() -> None:
    rows = np.array([[1.0, 0.0], [1.0, 0.0], [2.0, 0.0], [-1.0, 0.0]])
    found = shortest_vector(rows, np.array([1.0, 1.0, 2.0, -1.0]))
    assert found.y is not None
    assert found.y == pytest.approx([1.0, 0.0], abs=1e-8)


@pytest.mark.parametrize("seed", range(8))
def test_non_negative_least_squares(seed: int) -> None:
    from scipy.optimize import nnls

    random = np.random.default_rng(seed)
    matrix, target = random.normal(size=(6, 5)), random.normal(size=6)
    assert non_negative_least_squares(matrix, target) == pytest.approx(nnls(matrix, target)[0], abs=1e-9)


@pytest.mark.parametrize("off", [0.0, 1e-9, 2e-8, 1e-7])
@pytest.mark.parametrize("opposing", [2, 3, 4])
@pytest.mark.parametrize("seed", range(4))
def test_rows_that_oppose_each_other_and_are_just_met_are_equations(seed: int, opposing: int, off: float) -> None:
    """Rows that add up to nothing leave one place in the directions that they see, but for what they are ``off``."""
    random = np.random.default_rng(100 * opposing + seed)
    n = 6
    rows = random.normal(size=(opposing - 1, n))
    rows = np.concatenate([rows, -random.uniform(0.5, 2.0, opposing - 1)[None] @ rows])
    others = random.normal(size=(3, n))
    place = 10.0 * random.normal(size=n)
    least = np.concatenate([rows @ place + off * random.choice([-1.0, 1.0], opposing), others @ place - 3.0])
    found = shortest_vector(np.concatenate([rows, others]), least)
    assert found.y is not None
    assert np.abs(rows @ found.y - rows @ place).max() < 1e-6
    assert (others @ found.y - least[opposing:]).min() > -1e-6
    fixed = np.linalg.pinv(rows) @ (rows @ place)
    free = np.linalg.svd(rows)[2][opposing - 1 :].T  # the directions that they do not see
    other = minimize(
        lambda z: float(z @ z),
        free.T @ place,
        jac=lambda z: 2.0 * z,
        constraints={"type": "ineq", "fun": lambda z: others @ (fixed + free @ z) - least[opposing:]},
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 400},
    )
    assert float(found.y @ found.y) == pytest.approx(float(fixed @ fixed + other.x @ other.x), rel=1e-6)


@pytest.mark.parametrize("opposing", [2, 3, 4])
def test_rows_that_oppose_each_other_and_are_not_met_contradict(opposing: int) -> None:
    random = np.random.default_rng(opposing)
    rows = random.normal(size=(opposing - 1, 5))
    rows = np.concatenate([rows, -np.ones((1, opposing - 1)) @ rows, random.normal(size=(1, 5))])
    least = rows @ random.normal(size=5)
    least[0] += 1e-4
    found = shortest_vector(rows, least)
    assert found.y is None
    assert found.active.tolist() == list(range(opposing))
