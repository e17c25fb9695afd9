"""Where paths begin, what steps cut loose, and redundant equations."""

import numpy as np
import pytest

from tests.solver.scenes import anchor, motion_of, poses_of, residuals

FOUR_BAR = """.config(24);
Crank : .bar O=[0,0] P=[35,0]; Coupler : .bar A=[35,0] B=[90,60]; Rocker : .bar O=[90,0] P=[90,60];
@0 Crank.O=[0,0]; Crank.angle=90*.t; Rocker.O=[90,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P;"""


def test_as_drawn_is_the_solution_turned_least():
    poses = poses_of(FOUR_BAR + "@4")
    assert poses.angle[:, 0] == pytest.approx(0, abs=1e-9)


def test_a_step_about_something_else_changes_nothing():
    plain = poses_of(FOUR_BAR + "@4")
    other = poses_of(FOUR_BAR + "@1.37 q = 3; Coupler.angle ~ 180; @2.9 q = _; @4")
    assert np.max(np.abs(plain.origin - other.origin)) < 1e-9
    assert np.max(np.abs(plain.angle - other.angle)) < 1e-8


def test_what_a_step_cuts_loose_goes_to_the_nearest_pose():
    motion = motion_of(FOUR_BAR + "@1 Crank.angle = 90 + 45*.t; @2 Rocker.O=[95,0]; @4")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    step = np.max(np.abs(np.diff(anchor(motion, poses, "Rocker.P"), axis=0)))
    assert step < 12  # no change of assembly mode (that would be some 60)


def test_both_ends_of_a_rigid_bar_may_be_given():
    motion = motion_of(""".config(24); Bar : .bar A=[0,0] B=[50,0];
    @0 Bar.A=[10,10]; Bar.B=[10,10] + [50,0].r(90*.t);
    @4""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert np.max(np.abs(poses.angle[0] - 90 * poses.times)) < 1e-9
    assert len(motion.segments[0].plan.checks) == 1


def test_a_redundant_coupling_rod_is_no_obstacle():
    motion = motion_of(""".config(24);
    W1 : .bar C=[0,0] P=[20,0]; W2 : .bar C=[100,0] P=[120,0]; W3 : .bar C=[200,0] P=[220,0];
    R : .bar a=[20,0] b=[120,0] c=[220,0];
    @0 W1.C=[0,0]; W1.angle=30+90*.t; W2.C=[100,0]; W3.C=[200,0]; R.a=W1.P; R.b=W2.P; R.c=W3.P; R.angle ~ 0;
    @4""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    assert np.max(np.abs(poses.angle[2] - poses.angle[0])) < 1e-5  # the root of the rounding error, at the dead points
    assert max(residuals(motion, poses).values()) < 1e-11


def test_a_braced_parallelogram_with_a_rod_too_many():
    # three parallel rods of one length: the third is redundant by its geometry only, not by its structure
    motion = motion_of(""".config(24);
    Base : .bar a=[0,0] b=[60,0] c=[130,0];  Top : .bar a=[0,50] b=[60,50] c=[130,50];
    R1 : .bar p=[0,0] q=[0,50]; R2 : .bar p=[60,0] q=[60,50]; R3 : .bar p=[130,0] q=[130,50];
    @0 Base.a=[0,0]; Base.angle=0; R1.p=Base.a; R2.p=Base.b; R3.p=Base.c; R1.q=Top.a; R2.q=Top.b; R3.q=Top.c;
       R1.angle = -30*.t; Top.angle ~ 0;
    @2""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    assert np.max(np.abs(poses.angle[1])) < 1e-6
    assert np.max(np.abs(poses.angle[4] - poses.angle[2])) < 1e-6


def test_a_wish_never_makes_a_path_jump():
    poses = poses_of(FOUR_BAR + "@1 Coupler.B ~ [0,-100]; @4")
    plain = poses_of(FOUR_BAR + "@4")
    assert np.max(np.abs(plain.origin - poses.origin)) < 1e-9


@pytest.mark.parametrize("sign", ["<", ">"])
def test_an_inequality_among_four_solutions(sign):
    poses = poses_of(f""".config(10);
    A : .bar o=[0,0] p=[60,0]; B : .bar o=[80,0] p=[80,60]; C : .bar o=[0,0] p=[50,0]; D : .bar o=[110,10] p=[60,10];
    @0 A.o=[0,0]; B.o=[80,0]; A.p=B.p; C.o=A.p; D.o=[110,10]; C.p=D.p; C.p.x {sign} 75; A.p.y < 0;
    @1""")
    a, c = poses.world(0, (60.0, 0.0))[0], poses.world(2, (50.0, 0.0))[0]
    assert a[1] < 0
    assert (c[0] < 75) == (sign == "<")
    assert np.hypot(*(c - [110, 10])) == pytest.approx(50)
