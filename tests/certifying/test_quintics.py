"""Tables of quintics lie in their enclosures, and so do their derivatives."""

import numpy as np
import pytest

from movimentum.certifying.tabled import pieces_of, reach
from movimentum.expressions.tables import Ends, Table


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("ends", [Ends.HELD, Ends.PERIODIC])
def test_a_quintic_table_is_enclosed(seed, ends):
    random = np.random.default_rng(seed)
    x = np.concatenate([[0.0], np.sort(random.uniform(0.0, 10.0, 10)), [10.0]])
    y, slopes, bends = random.normal(size=(3, 12))
    if ends is Ends.PERIODIC:
        y[-1], slopes[-1] = y[0], slopes[0]
    table = Table(x, y, smooth=True, ends=ends, slopes=slopes, bends=bends)
    for _ in range(2):
        c, d = random.uniform(0.1, 9.9, 50), 10.0 ** random.uniform(-6.0, -0.5, 50)
        value, off, slope, slope_off, jump = reach(table, pieces_of(table), c, d)
        for share in np.linspace(-1.0, 1.0, 21):
            u = c + share * d
            missed = np.abs(table.at(u) - (value + slope * (u - c)))
            assert (missed <= (off + slope_off * np.abs(u - c) + jump) * (1.0 + 1e-9) + 1e-14).all()
        table = table.derived()
