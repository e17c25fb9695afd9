"""Kernels across variants: what they compute on a common grid, against closed forms."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from movimentum.arrays import unwound_from
from movimentum.planning.blocks.kinds import Block
from movimentum.solver.continuation.ode import Collocation, RateFunctions
from movimentum.solver.kinds.integral import _GAUSS_X, _INTEGRALS_WITHIN, with_points
from movimentum.solver.kinds.kernels import _MAKERS, KERNELS
from movimentum.solver.start.early_checks import satisfied


def test_the_points_of_a_quadrature_lie_between_those_that_are_there():
    tau = np.array([0.0, 0.1, 0.1, 2.0])
    found = with_points(tau)
    np.testing.assert_array_equal(found[:: len(_GAUSS_X) + 1], tau)
    assert (np.diff(found) >= 0.0).all()


@pytest.mark.parametrize("power", range(8))
def test_polynomials_are_integrated_exactly_up_to_each_point(power):
    whole = (_GAUSS_X ** (power + 1) - (-1.0) ** (power + 1)) / (power + 1)
    np.testing.assert_allclose(_INTEGRALS_WITHIN @ _GAUSS_X**power, whole, rtol=0.0, atol=1e-14)


def test_angles_of_many_variants_go_on_through_whole_turns():
    turned = np.stack([np.linspace(350.0, 1200.0, 60), np.linspace(-10.0, -900.0, 60)])
    wrapped = (turned + 180.0) % 360.0 - 180.0
    first, steps = unwound_from(wrapped, np.array([[350.0], [0.0]]))
    np.testing.assert_allclose(first + np.cumsum(steps, axis=1), turned[:, 1:], atol=1e-9)


def test_systems_side_by_side_are_each_solved_as_alone():
    speeds = np.array([1.0, 3.0, 50.0])

    def equation(tau):
        def slopes(z, x):
            found = np.zeros((len(tau), 3, 2, 2))
            found[:, :, 0, 1], found[:, :, 1, 0] = 1.0, -(speeds**2)
            return found

        def rates(z, x):
            place, speed = z.reshape(len(tau), 3, 2).transpose(2, 0, 1)
            return x, np.stack([speed, -(speeds**2) * place], axis=2).reshape(len(tau), 6)

        return RateFunctions(rates, slopes, lambda z, x: np.zeros_like(z))

    tau = np.linspace(0.0, 2.0, 41)
    begun = np.stack([np.ones(3), np.zeros(3)], axis=1).reshape(-1)
    track = Collocation(equation, tau, np.zeros(0), systems=3).track(np.zeros(0), begun, 2.0)
    np.testing.assert_allclose(track.states.guess(tau)[::2], np.cos(speeds[:, None] * tau), rtol=0.0, atol=1e-10)


def test_every_kind_of_block_has_a_kernel():
    assert _MAKERS.keys() == set(get_args(Block))
    assert all(KERNELS[kind] is KERNELS[kind] for kind in get_args(Block))


@pytest.mark.parametrize("strict", [False, True])
def test_inequalities_are_judged_alike_for_one_variant_and_for_many(strict):
    """Clear of zero the first instant decides, at zero the second: a strict one has to leave it."""
    values = [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 50.0, -50.0, -150.0, np.nan]
    here, later = map(np.ravel, np.meshgrid(values, values))
    together = satisfied(here, later, np.ones(len(here)), strict=strict)
    known = [h > 1.0 or (abs(h) <= 1.0 and k >= (1e-3 if strict else -100.0)) for h, k in zip(here, later, strict=True)]
    assert together.tolist() == known
    alone = [bool(satisfied(h, k, 1.0, strict=strict)) for h, k in zip(here, later, strict=True)]
    assert alone == known
