"""Series through a step: integrals, derivatives, and where a value falls, against closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from movimentum.arrays import FloatArray
from movimentum.solver.pushing.dense_steps import (
    DEGREE,
    DERIVATIVES,
    FINE,
    INTEGRALS,
    SHARES,
    basis,
    downward_roots,
    fine_values,
    has_converged,
    kink_in,
    series,
)
from movimentum.solver.pushing.strides import AndersonMixing

CLOSED = 1e-9


def zeros(function: Callable[[FloatArray], FloatArray], *, exactly: bool = True) -> list[float]:
    """Where `downward_roots` finds that a function of arrays falls below zero."""
    if exactly:
        found = downward_roots(function, function(FINE), CLOSED)
    else:
        coefficients = series(function(SHARES)[:, None])
        assert has_converged(coefficients, 1e-6).all()
        found = downward_roots(lambda w: basis(w) @ coefficients[:, 0], fine_values(coefficients)[:, 0], CLOSED)
    return [fall.share for fall in found]


@pytest.mark.parametrize("power", range(DEGREE))
def test_powers_are_integrated_and_derived_exactly(power: int) -> None:
    values = SHARES**power
    assert np.abs(INTEGRALS @ values - SHARES ** (power + 1) / (power + 1)).max() < 1e-14
    derivative = power * SHARES ** max(power - 1, 0)
    assert np.abs(DERIVATIVES @ values - derivative).max() < 1e-11


@pytest.mark.parametrize("exactly", [True, False])
def test_a_value_falls_where_it_is_zero(exactly: bool) -> None:
    assert zeros(lambda w: np.cos(2.0 * w), exactly=exactly) == pytest.approx([math.pi / 4.0], abs=1e-10)
    assert zeros(lambda w: np.cos(2.0 * w) + 2.0, exactly=exactly) == []
    # there and back: it falls once, and rises once
    assert zeros(lambda w: np.sin(3.0 * w + 0.1) - 0.5, exactly=exactly) == pytest.approx(
        [(math.pi - math.pi / 6.0 - 0.1) / 3.0], abs=1e-10
    )


@pytest.mark.parametrize("middle", [0.0151, 0.27, 0.5, 0.8333, 0.9971])
@pytest.mark.parametrize("depth", [1e-4, 1e-8])
def test_a_dip_between_two_looks_is_seen(middle: float, depth: float) -> None:
    (found,) = zeros(lambda w: (w - middle) ** 2 - depth)
    assert found == pytest.approx(max(middle - math.sqrt(depth), 0.0), abs=1e-7)


@pytest.mark.parametrize("middle", [0.0031, 0.27, 0.9971])
def test_a_dip_that_ends_above_is_none(middle: float) -> None:
    assert zeros(lambda w: (w - middle) ** 2 + 1e-8) == []


def test_a_corner_that_is_passed_closely_is_seen() -> None:
    """The distance of two points that pass each other, as it is at its least."""
    (found,) = zeros(lambda w: np.hypot(w - 0.4321, 1e-3) - 1.001e-3)
    assert found == pytest.approx(0.4321 - math.sqrt(1.001**2 - 1.0) * 1e-3, abs=1e-9)


def test_what_hardly_touches_and_goes_is_nothing() -> None:
    assert zeros(lambda w: w * w) == []
    found, *_ = zeros(lambda w: -(w**2))  # from zero on: at the beginning
    assert found == pytest.approx(0.0, abs=1e-4)


# --- kinks


@pytest.mark.parametrize("interval", range(DEGREE))
@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_a_kink_is_between_two_instants(interval: int, share: float, size: float) -> None:
    at = float(SHARES[interval] + share * (SHARES[interval + 1] - SHARES[interval]))
    values = size * (0.02 * np.exp(-SHARES) + np.maximum(SHARES - at, 0.0))
    found = kink_in(np.stack([values, np.ones_like(values)], axis=1))
    assert found == (SHARES[interval], SHARES[interval + 1])


@pytest.mark.parametrize("interval", range(DEGREE))
@pytest.mark.parametrize("bent", [np.exp, np.sinh])
def test_a_slight_kink_is_not_looked_for_elsewhere(interval: int, bent: Callable[[FloatArray], FloatArray]) -> None:
    at = 0.5 * float(SHARES[interval] + SHARES[interval + 1])
    for size in (1e-3, 1e-2, 0.1, 1.0, 10.0):
        found = kink_in((bent(3.0 * SHARES) + size * np.maximum(SHARES - at, 0.0))[:, None])
        assert found is None or found == (SHARES[interval], SHARES[interval + 1])


@pytest.mark.parametrize("rate", [0.1, 1.0, 3.0, 6.0])
def test_what_is_smooth_has_no_kink(rate: float) -> None:
    for values in (np.exp(rate * SHARES), np.exp(-rate * SHARES), np.sin(rate * SHARES), SHARES**3):
        assert kink_in(values[:, None]) is None


# --- what is tried next


@pytest.mark.parametrize("rate", [0.5, 2.0, 5.0, 8.0])
def test_a_decay_is_found_in_few_rounds(rate: float) -> None:
    def next_one(x: FloatArray) -> FloatArray:
        return 1.0 - rate * (INTEGRALS @ x)

    truth = np.linalg.solve(np.eye(DEGREE + 1) + rate * INTEGRALS, np.ones((DEGREE + 1, 1)))
    mixed, x, plain = AndersonMixing(np.ones(1)), np.ones((DEGREE + 1, 1)), np.ones((DEGREE + 1, 1))
    for _ in range(11):
        x, plain = mixed.next(x, next_one(x)), next_one(plain)
    off, plainly = np.abs(x - truth).max(), np.abs(plain - truth).max()
    assert off < 1e-4
    assert off < 0.2 * plainly
