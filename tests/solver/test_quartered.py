"""Two wheels coupled on both sides, a quarter of a turn apart, are one block, and angles in it keep turning."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum as mv

WHEELS = """
.config(25);
W[k = 0..1] : .disc(40)  C = [80 + 120*k, 80]   N = C + [26, 0]   F = C + [0, 26];
S[k = 0..1] : .bar  C = [80 + 120*k, 80]  B = C + [40, 0];
Near : .bar  A = [106, 80]  B = A + [120, 0];
Far  : .bar  A = [80, 106]  B = A + [120, 0];
@0  .for k = 0..1 { W[k].C = [80 + 120*k, 80];   S[k].C = W[k].C;   S[k].angle = W[k].angle; }
    W[1].angle = -180*.t;
    Near.A = W[0].N;   Near.B = W[1].N;   Far.A = W[0].F;   Far.B = W[1].F;
@4
"""


@pytest.mark.slow
def test_angles_in_one_block_pass_half_a_turn() -> None:
    motion = mv.loads(WHEELS).solve()
    for name in ("W[0]", "S[0]", "S[1]"):
        np.testing.assert_allclose(motion[f"{name}.angle"], -180 * motion.times, atol=1e-7)
    np.testing.assert_allclose(motion["Near.angle"], 0, atol=1e-9)
