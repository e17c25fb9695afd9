"""When variants bind: the last instant, to the last digit."""

from __future__ import annotations

import numpy as np

from movimentum.variants.together.binds import _last


def test_the_last_offset_is_found_to_the_last_digit():
    ends = np.array([np.pi, 1e-9, 0.75, 99.0 / 7.0])
    found = _last(lambda tau: tau <= ends[:, None], np.zeros(4), np.array([4.0, 1.0, 1.0, 20.0]))
    np.testing.assert_array_equal(found, ends)


def test_of_several_ends_the_first_one_counts():
    found = _last(lambda tau: np.abs(tau - 0.5) > 0.1, np.zeros(1), np.array([0.55]))
    assert found[0] < 0.4
    assert np.nextafter(found[0], 1.0) >= 0.4 - 1e-15
