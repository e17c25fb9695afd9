"""Least motion, against the curves that it is known to give."""

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from tests.solver.scenes import anchor, motion_of


def test_a_bar_dragged_by_its_end_traces_a_tractrix():
    # least motion of the free end: it moves along the bar only
    for fps in (2, 20):
        motion = motion_of(
            """.config(20); Rod : .bar A=[0,0] B=[0,100];
            @0 Rod.A=[50*.t,0];
            @6""",
            fps,
        )
        poses = motion.poses(0, motion.timeline.frame_count)
        u = 50 * poses.times / 100
        expected = np.stack([50 * poses.times - 100 * np.tanh(u), 100 / np.cosh(u)], axis=-1)
        assert np.max(np.abs(anchor(motion, poses, "Rod.B") - expected)) < 5e-8


def test_a_tractrix_turns_a_corner_that_no_frame_shows():
    # along a line at 100, and from t = 2 at 80 across it; the angle between bar and way halves as exp(-u t / L)
    motion = motion_of(
        """.config(20); Rod : .bar A=[0,0] B=[0,100];
        @0 Rod.A = [{ .t < 2.013 : 100*.t; 201.3 }, { .t < 2.013 : 0; 80*(.t - 2.013) }];
        @4""",
        20,
    )
    poses = motion.poses(0, motion.timeline.frame_count)
    before, after = np.minimum(poses.times, 2.013), np.maximum(poses.times - 2.013, 0.0)
    corner = 2.0 * np.arctan(np.exp(2.013))  # where the bar points when the way turns
    angle = np.where(
        poses.times < 2.013,
        2.0 * np.arctan(np.exp(before)),
        np.pi / 2 + 2.0 * np.arctan(np.tan(0.5 * corner - np.pi / 4) * np.exp(0.8 * after)),
    )
    expected = np.stack([100 * before + 100 * np.cos(angle), 80 * after + 100 * np.sin(angle)], axis=-1)
    assert np.max(np.abs(anchor(motion, poses, "Rod.B") - expected)) < 1e-7


def test_a_bar_that_only_turns_is_free_to_stay_where_it_is():
    # only its angle is driven: all anchors weighted alike, it turns about their middle
    motion = motion_of(""".config(20); Rod : .bar A=[0,0] B=[100,0];
    @0 Rod.angle=90*.t;
    @2""")
    poses = motion.poses(0, motion.timeline.frame_count)
    middle = 0.5 * (anchor(motion, poses, "Rod.A") + anchor(motion, poses, "Rod.B"))
    assert np.max(np.abs(middle - [50, 0])) < 1e-6


def test_at_the_beginning_things_are_turned_least_and_then_moved_least():
    motion = motion_of(""".config(20); Rod : .bar A=[0,0] B=[100,0]; Other : .bar C=[0,50] D=[100,50];
    @0 Rod.A=[30,10]; Other.D.x = 120;
    @1""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.angle == pytest.approx(0, abs=1e-9)
    assert anchor(motion, poses, "Rod.B") == pytest.approx(np.tile([130, 10], (21, 1)), abs=1e-9)
    assert anchor(motion, poses, "Other.C") == pytest.approx(np.tile([20, 50], (21, 1)), abs=1e-9)


def test_what_nothing_constrains_stays_as_drawn():
    motion = motion_of(""".config(20); Rod : .bar A=[3,4] B=[100,7]; Dot : .disc(2) c=[0,0];
    @0 Dot.c=[50*.t,0];
    @1""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert anchor(motion, poses, "Rod.A") == pytest.approx(np.tile([3, 4], (21, 1)))


def test_what_a_step_lets_go_stays_where_it_was():
    motion = motion_of(""".config(20); Dot : .disc(2) c=[0,0];
    @0 Dot.c=[50*.t,0];
    @1 Dot.c=_;
    @2""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert anchor(motion, poses, "Dot.c")[20:] == pytest.approx(np.tile([50, 0], (21, 1)))


@pytest.mark.slow
def test_a_chain_dragged_by_its_end_keeps_its_joints():
    links = " ".join(f"L{i} : .bar A=[{30 * i},0] B=[{30 * i + 30},0];" for i in range(5))
    joints = " ".join(f"L{i + 1}.A = L{i}.B;" for i in range(4))
    motion = motion_of(f""".config(10); {links}
    @0 L0.A = [0,0] + [0,60]*.t; {joints}
    @2""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    for i in range(4):
        assert np.max(np.abs(anchor(motion, poses, f"L{i}.B") - anchor(motion, poses, f"L{i + 1}.A"))) < 1e-9


@pytest.mark.slow
def test_accuracy_that_is_given_up_is_told():
    """What nothing determines, drawn by something that shakes a hundred times a second for ever faster."""
    motion = motion_of(
        ".config(10, 300, 300); Arm : .bar A=[100,100] B=[200,100]; Rod : .bar A=[200,100] B=[250,150];"
        "@0 Arm.A=[100,100]; Arm.angle = 40*.sin(9000000*.t^2); Rod.A=Arm.B; @1"
    )
    told = [d for d in examine(motion).diagnostics if d.code == "solve/inaccurate"]
    assert len(told) == 1
    assert "`Rod`" in told[0].message
    poses = motion.poses(0, motion.timeline.frame_count)  # it goes on all the same, each pose near the last
    assert poses.solved.all()
    assert anchor(motion, poses, "Rod.A") == pytest.approx(anchor(motion, poses, "Arm.B"), abs=1e-9)
