"""The least push, against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from movimentum.solver.pushing.programs import non_negative, shortest


@pytest.mark.parametrize("seed", range(12))
def test_the_shortest_vector_is_that_of_another_solver(seed: int) -> None:
    random = np.random.default_rng(seed)
    count, n = int(random.integers(1, 8)), int(random.integers(1, 6))
    rows = random.normal(size=(count, n))
    inside = random.normal(size=n)  # so that there is one
    least = rows @ inside - random.uniform(0.0, 1.0, count)
    found = shortest(rows, least)
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
    found = shortest(rows, np.array([1.0, 1.0, 0.5]))
    assert found.y is None
    assert found.holding.tolist() == [0, 1]


def test_rows_that_say_the_same_are_borne() -> None:
    rows = np.array([[1.0, 0.0], [1.0, 0.0], [2.0, 0.0], [-1.0, 0.0]])
    found = shortest(rows, np.array([1.0, 1.0, 2.0, -1.0]))
    assert found.y is not None
    assert found.y == pytest.approx([1.0, 0.0], abs=1e-8)


@pytest.mark.parametrize("seed", range(8))
def test_non_negative_least_squares(seed: int) -> None:
    from scipy.optimize import nnls

    random = np.random.default_rng(seed)
    matrix, target = random.normal(size=(6, 5)), random.normal(size=6)
    assert non_negative(matrix, target) == pytest.approx(nnls(matrix, target)[0], abs=1e-9)
