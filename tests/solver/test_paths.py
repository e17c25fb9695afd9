"""Paths through dead centres and change points, against closed forms; and what a path must not depend on."""

from fractions import Fraction

import numpy as np
import pytest

from movimentum.planning.blocks.kinds import method_of
from tests.solver.scenes import anchor, motion_of, poses_of, residuals, rigidity

PARALLELOGRAM = """.config(12);
Crank : .bar O=[0,0] P=[40,0];  Rocker : .bar O=[100,0] P=[140,0];  Coupler : .bar A=[40,0] B=[140,0];
@0 Crank.O=[0,0]; Crank.angle=10 + {speed}*.t; Rocker.O=[100,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P;
   .a(Coupler.B - Coupler.A, Rocker.P - Rocker.O) > 0;
@8 Crank.angle = 10 + 8*{speed} - {speed}*.t; .a(Coupler.B - Coupler.A, Rocker.P - Rocker.O) > _;
@16"""
PARALLELOGRAM = PARALLELOGRAM.replace(
    ".a(Coupler.B - Coupler.A, Rocker.P - Rocker.O) > 0;\n@8", "Coupler.angle ~ 0;\n@8"
).replace(" .a(Coupler.B - Coupler.A, Rocker.P - Rocker.O) > _;", "")


@pytest.mark.parametrize("fps", [1, 3, 8, 12, 25, Fraction(24000, 1001), 100])
@pytest.mark.parametrize("speed", [90, 87.31, -45])
def test_a_parallelogram_stays_one_through_its_change_points(fps, speed):
    poses = poses_of(PARALLELOGRAM.format(speed=speed), fps)
    assert poses.solved.all()
    # exactly on a change point the position is only determined to the root of the rounding error
    assert np.max(np.abs(poses.angle[1] - poses.angle[0])) < 1e-5
    assert np.max(np.abs(poses.angle[2])) < 1e-5


@pytest.mark.parametrize("fps", [4, 7, 36])
def test_a_cardan_slider_crank_goes_over_its_dead_centre(fps):
    # crank and rod of one length: x = 2 r cos(angle), through the centre of the crank
    text = """.config(36);
    Crank : .bar O=[0,0] P=[50,0]; Rod : .bar A=[50,0] B=[100,0];
    @0 Crank.O=[0,0]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,0]; x ~ 100;
    @8"""
    poses = poses_of(text, fps)
    assert np.max(np.abs(poses.variables["x"] - 100 * np.cos(np.pi / 2 * poses.times))) < 1e-6
    assert poses.angle[1][-1] == pytest.approx(-720, abs=1e-6)


@pytest.mark.parametrize("delta", [5e-4, -5e-4, 1e-6, -1e-6])
@pytest.mark.parametrize("fps", [5, 18, 72])
def test_four_bars_next_to_a_change_point_turn_sharply_and_do_not_cross(delta, fps):
    # a parallelogram whose coupler is a little too long or short
    # keeps the sign of the joint's angle, or cannot turn fully
    coupler = 100 * (1 + delta)
    text = f""".config(12);
    Crank : .bar O=[0,0] P=[40,0]; Rocker : .bar O=[100,0] P=[100,41]; Coupler : .bar A=[0,0] B=[{coupler},0];
    @0 Crank.O=[0,0]; Crank.angle=60+90*.t; Rocker.O=[100,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P; Coupler.angle ~ 0;
    @4"""
    motion = motion_of(text, fps)
    poses = motion.poses(0, motion.timeline.frame_count)
    # independent: the circle-circle intersection with the sign of the first frame kept
    theta = np.radians(60 + 90 * poses.times)
    p = 40 * np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    d = np.array([100.0, 0.0]) - p
    d2 = np.sum(d * d, axis=1)
    along = (coupler**2 - 41.0**2 + d2) / (2 * d2)
    height = np.sqrt(coupler**2 / d2 - along**2)
    side = -1.0 if anchor(motion, poses, "Coupler.B")[0, 1] < (p[0] + along[0] * d[0])[1] else 1.0
    perpendicular = np.stack([-d[:, 1], d[:, 0]], axis=-1)
    expected = p + along[:, None] * d + side * height[:, None] * perpendicular
    assert poses.solved.all()
    assert np.max(np.abs(anchor(motion, poses, "Coupler.B") - expected)) < 1e-7


SIX_BAR = """.config(24);
// a triad: a platform on three legs, one of them the crank
Crank : .bar O=[0,0] P=[15.28,0];
Leg1 : .bar A=[15.28,0] B=[67.77,55.51];  Leg2 : .bar A=[95.08,1.44] B=[21.88,92.14];
Leg3 : .bar A=[-34.86,-65.84] B=[-4.04,42.42];
Body : .bar X=[67.77,55.51] Y=[21.88,92.14] Z=[-4.04,42.42];
@0 Crank.O=[0,0]; Crank.angle=90*.t; Leg1.A=Crank.P; Leg2.A=[95.08,1.44]; Leg3.A=[-34.86,-65.84];
   Leg1.B=Body.X; Leg2.B=Body.Y; Leg3.B=Body.Z;
   Body.X ~ [67.77,55.51]; Body.Y ~ [21.88,92.14];
@4"""


def test_a_triad_closes_and_satisfies_its_constraints():
    motion = motion_of(SIX_BAR)
    poses = motion.poses(0, motion.timeline.frame_count)
    kernels = {method_of(block) for block in motion.segments[0].plan.blocks}
    assert "newton" in kernels
    assert max(residuals(motion, poses).values()) < 1e-12
    assert rigidity(motion, poses) < 1e-13
    assert np.max(np.abs(poses.origin[:, 0] - poses.origin[:, -1])) < 1e-9


@pytest.mark.parametrize("text", [PARALLELOGRAM.format(speed=90), SIX_BAR])
def test_shared_frames_do_not_depend_on_fps_or_on_what_is_asked_for(text):
    coarse, fine = motion_of(text, 6), motion_of(text, 24)
    a = coarse.poses(0, coarse.timeline.frame_count)
    b = fine.poses(0, fine.timeline.frame_count)
    assert np.max(np.abs(a.origin - b.origin[:, ::4])) < 1e-11
    assert np.max(np.abs(a.angle - b.angle[:, ::4])) < 1e-9
    part = fine.poses(7, 31)
    assert np.max(np.abs(part.origin - b.origin[:, 7:31])) < 1e-11
    at = fine.poses_at([fine.timeline.frame_time(k) for k in (3, 50)])
    assert np.max(np.abs(at.origin - b.origin[:, [3, 50]])) < 1e-11


@pytest.mark.slow
def test_statement_order_does_not_matter():
    lines = SIX_BAR.split("@0")[1].replace("@4", "").strip()
    statements = [s.strip() for s in lines.split(";") if s.strip()]
    head = SIX_BAR.split("@0")[0]
    reference = poses_of(SIX_BAR)
    generator = np.random.default_rng(5)
    for _ in range(3):
        shuffled = [statements[i] for i in generator.permutation(len(statements))]
        poses = poses_of(f"{head}@0 {'; '.join(shuffled)};\n@4")
        assert np.max(np.abs(poses.origin - reference.origin)) < 1e-10


def test_forward_and_back_ends_where_it_began():
    text = SIX_BAR.replace("Crank.angle=90*.t", "Crank.angle=720*(.t/.iv)*(1 - .t/.iv)")
    poses = poses_of(text)
    assert np.max(np.abs(poses.origin[:, 0] - poses.origin[:, -1])) < 1e-9
    assert np.max(np.abs(poses.angle[:, 0] - poses.angle[:, -1])) < 1e-8


@pytest.mark.parametrize("turn", [0.0, 33.0])
@pytest.mark.parametrize("factor", [1e-6, 1.0, 1e6])
def test_a_moved_turned_scaled_scene_moves_alike(turn, factor):
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    offset = np.array([3.0, -2.0]) * factor

    def put(x, y):
        return f"[{float(factor * (c * x - s * y) + offset[0])!r},{float(factor * (s * x + c * y) + offset[1])!r}]"

    def scene(point, angle):
        return f""".config(24);
        Crank : .bar O={point(0, 0)} P={point(35, 0)};
        Coupler : .bar A={point(35, 0)} B={point(90, 40)} C={point(60, 60)};
        Rocker : .bar O={point(90, 0)} P={point(90, 40)};
        @0 Crank.O={point(0, 0)}; Crank.angle=90*.t; Rocker.O={point(90, 0)}; Coupler.A=Crank.P; Coupler.B=Rocker.P;
           Coupler.angle ~ 0;
        @4"""

    plain = motion_of(scene(lambda x, y: f"[{x},{y}]", 0))
    moved = motion_of(scene(put, turn))
    a = plain.poses(0, plain.timeline.frame_count)
    b = moved.poses(0, moved.timeline.frame_count)
    p, q = anchor(plain, a, "Coupler.C"), anchor(moved, b, "Coupler.C")
    expected = factor * np.stack([c * p[:, 0] - s * p[:, 1], s * p[:, 0] + c * p[:, 1]], axis=-1) + offset
    assert np.max(np.abs(q - expected)) < 1e-10 * 100 * factor
    assert np.max(np.abs(a.angle - b.angle)) < 1e-8
