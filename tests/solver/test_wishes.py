"""Wishes draw free motion: where a path begins, and along it, as far as the equations let them."""

import numpy as np
import pytest

from tests.broad import broad
from tests.solver.scenes import anchor, motion_of, residuals


def poses_and(text, fps=None):
    motion = motion_of(text, fps)
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    return motion, poses


def test_a_free_bar_points_at_its_wish():
    motion, poses = poses_and(""".config(20); Bar : .bar O=[0,0] P=[100,0];
    @0 Bar.O=[0,0]; Bar.P ~ [130, 100+20*.t];
    @2""")
    target = np.stack([np.full(41, 130.0), 100 + 20 * poses.times], axis=-1)
    nearest = 100 * target / np.hypot(*target.T)[:, None]  # the point of the circle nearest to the wish
    off = np.hypot(*(anchor(motion, poses, "Bar.P") - nearest).T)
    assert off[0] < 1e-6
    assert off.max() < 1.5  # it is followed, with a lag that its own speed makes


def test_a_wish_that_can_be_met_is_met_all_along():
    motion, poses = poses_and(""".config(20); A : .bar a=[0,0] b=[50,0]; B : .bar a=[50,0] b=[100,0];
    @0 A.a=[0,0]; B.a=A.b; B.b ~ [60+10*.t, 30];
    @3""")
    expected = np.stack([60 + 10 * poses.times, np.full(61, 30.0)], axis=-1)
    assert np.max(np.abs(anchor(motion, poses, "B.b") - expected)) < 1e-3
    assert max(residuals(motion, poses).values()) < 1e-12


@broad("fps", [4, 20], first=1)
def test_a_wish_stated_later_draws_and_never_makes_a_jump(fps):
    motion, poses = poses_and(
        """.config(20); Dot : .disc(3) c=[0,0];
        @0 Dot.c.y = 5;
        @1 Dot.c ~ [100,50];
        @3""",
        fps,
    )
    x = anchor(motion, poses, "Dot.c")[:, 0]
    after = poses.times >= 1
    assert np.max(np.abs(x[~after])) == 0
    # it is nearer by the same share in every moment, whatever the frame rate
    assert x[after] == pytest.approx(100 * (1 - np.exp(-8 * (poses.times[after] - 1))), abs=0.02)


def test_what_is_not_free_heeds_no_wish():
    _, poses = poses_and(""".config(20); Bar : .bar O=[0,0] P=[100,0];
    @0 Bar.O=[0,0]; Bar.angle=30*.t; Bar.P ~ [0,-100];
    @2""")
    assert np.max(np.abs(poses.angle[0] - 30 * poses.times)) < 1e-9
