"""Thousands of ends of one path (a drive of 1e7 degrees through a dyad's binds) are found all at once."""

import numpy as np
import pytest

from movimentum.solver.block.change_points import find_events


def test_many_ends_cost_a_few_calls_and_are_where_the_cosine_is_a_half():
    calls = []

    def margin(tau):
        calls.append(len(tau))
        return np.cos(2.0 * np.pi * tau) + 0.5

    tau = np.linspace(0.0, 5000.0, 120_001)
    gaps = np.array(find_events(margin, tau, margin(tau)).gaps)
    whole = np.arange(5000.0)
    assert gaps == pytest.approx(np.stack([whole + 1.0 / 3.0, whole + 2.0 / 3.0], axis=1), rel=0, abs=1e-11)
    assert len(calls) < 100
