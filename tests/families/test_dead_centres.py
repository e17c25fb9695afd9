"""Mechanisms drawn at singular poses: each is driven both ways, with its statements in several orders.

Which of them can leave the pose was found by a solver of its own (Newton's method from many starts, for the places of
the joints): the distance of a solution from the pose goes to zero with the time since then, or it does not.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

import movimentum as mv
from movimentum.syntax.tree import Statement
from tests.broad import broad
from tests.families.dead_centres import KINDS, linkage
from tests.families.test_orders import reordered

EIGHT_BARS = """.config(20);
B4 : .bar P=[110,-120] Q=[-10,30];       B7 : .bar R=[10,30] S=[50,20] Q=[-10,30] T=[-50,20];
B6 : .bar U=[0,60] V=[-110,-120] P=[110,-120];    B3 : .bar W=[30,10] S=[50,20];
B1 : .bar O=[0,-80] U=[0,60];    B5 : .bar X=[-30,10] T=[-50,20];    B2 : .bar V=[-110,-120] R=[10,30];
@0 B3.W = [30,10];  B3.S = B7.S;  B5.X = [-30,10];  B1.angle = DRIVE*.t;  B6.V = B2.V;  B6.P = B4.P;  B1.U = B6.U;
   B1.O = [0,-80];  B5.T = B7.T;  B4.Q = B7.Q;  B2.R = B7.R;
@0.5
"""
SYMMETRIC = """.config(20);
K : .bar O=[0,-11] D=[0,86];    L : .bar D=[0,86] C=[0,-8];    P : .bar A=[-58,62] B=[58,62] C=[0,-8];
M : .bar E=[-86,0] A=[-58,62];    N : .bar F=[86,0] B=[58,62];
@0 K.O = [0,-11];  L.D = K.D;  P.C = L.C;  M.E = [-86,0];  M.A = P.A;  N.F = [86,0];  N.B = P.B;
   K.angle = DRIVE*.t;
@0.5
"""


@pytest.mark.slow
@broad("drive", [10, -10], first=1)
@pytest.mark.parametrize("order", [1, *(pytest.param(order, marks=pytest.mark.slow) for order in (0, 2))])
def test_that_can_be_left_is_left(drive, order):
    text = SYMMETRIC.replace("DRIVE", str(drive))
    script = mv.loads(reordered(text, order, Statement) if order else text)
    motion = script.solve()
    assert motion.solved.all()
    assert motion["P.C"][0] == pytest.approx([0.0, -8.0], abs=1e-9)
    # of the two paths that cross, the one that turns things least, in every order
    other = mv.loads(text).solve()
    assert motion["P.C"] == pytest.approx(other["P.C"], abs=1e-8)


@pytest.mark.slow
@broad("drive", [10, -10], first=1)
@pytest.mark.parametrize("order", [1, *(pytest.param(order, marks=pytest.mark.slow) for order in (0, 2))])
def test_that_is_a_dead_end_is_told_as_one_and_is_a_frame(drive, order):
    text = EIGHT_BARS.replace("DRIVE", str(drive))
    script = mv.loads(reordered(text, order, Statement) if order else text)
    motion = script.solve(on_failure="skip")
    assert motion.solved.tolist()[0]
    assert len(motion) == 1 or not motion.solved[1:].any()
    assert motion["B7.S"][0] == pytest.approx([50.0, 20.0], abs=1e-9)
    assert "bind at t = 0: there is no solution from then on" in script.diagnostics[0].message


def _right(kind: str, seed: int, orders: tuple[int, ...]) -> None:
    """Drawn pose is the first frame; then the film goes on if a path leaves it, on the same one in every order."""
    drawn = linkage(kind, seed)
    for sign in (1, -1):
        paths, lasting, before = drawn.paths(sign), drawn.lasting(sign), None
        for order in orders:
            script = mv.loads(drawn.text(10.0 * sign, order))
            motion = script.solve(on_failure="skip")
            assert motion.solved[0]
            for body, joints in drawn.bodies.items():
                for joint in joints:
                    place = motion[f"{body}.{joint}"][0]
                    assert place == pytest.approx(drawn.places[joint], abs=CLOSED.get(kind, 1e-9) * drawn.size)
            if lasting or not paths:
                assert (len(motion) > 1 and bool(motion.solved[1])) == (paths > 0)
            else:  # another joint binds a little later
                assert "at t = 0: there" not in script.diagnostics[0].message
            if not paths:
                assert not motion.solved[1:].any()
                told = re.search(
                    r"at t = ([-0-9.e]+): there is no solution from then on", script.diagnostics[0].message
                )
                # equations that hold to the second order hold to rounding (1e-16) for 1e-5 rad of the drive, or so
                assert told is not None
                assert 0.0 <= float(told[1]) <= 1e-4
            now = np.array([motion[f"{body}.{joints[-1]}"] for body, joints in drawn.bodies.items()])
            if before is not None:
                assert now == pytest.approx(before, abs=1e-6 * drawn.size, nan_ok=True)
            before = now


CLOSED = {"four-bar": 1e-7, "slider-crank": 1e-7, "toggle": 1e-7, "six-bar": 1e-7}
"""Dyads are solved in closed form, by a square root: rounding of 1e-16 is 1e-8 where it is zero."""


@broad("kind", ["slider-crank", "mirrored", "butterfly"], first=1)
def test_a_linkage_that_is_drawn_at_a_singular_pose_goes_on_where_a_path_does(kind):
    _right(kind, 0, (1,))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", KINDS)
def test_so_do_all_linkages_in_every_order(kind, seed):
    _right(kind, seed, (0, 1, 2))
