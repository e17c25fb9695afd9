"""Integrals, derivatives, angles, gears, wishes, inequalities: values against closed forms."""

import numpy as np
import pytest

from tests.solver.scenes import anchor, motion_of, poses_of, residuals

CRANK = "Crank : .bar O=[0,0] P=[50,0];"


def test_integrals_of_what_is_solved_for():
    poses = poses_of(f""".config(20); {CRANK}
    @0 Crank.O=[0,0]; Crank.angle=90*.t; a = .i(Crank.P.x); b = .i(.i(Crank.P.y));
    @4""")
    w, t = np.pi / 2, poses.times
    assert np.max(np.abs(poses.variables["a"] - 50 * np.sin(w * t) / w)) < 1e-11
    assert np.max(np.abs(poses.variables["b"] - (50 / w * t - 50 * np.sin(w * t) / w**2))) < 1e-11


def test_an_integral_goes_on_through_steps_about_something_else():
    text = """.config({fps}); Crank : .bar O=[0,0] P=[50,0];
    @0 Crank.O=[0,0]; Crank.angle=90*.t; a = .i(Crank.P.x);
    @0.7 q = 3;
    @1.31 q = 4;
    @2.5 q = 5*.t;
    @4"""
    for fps in (3, 20):
        poses = poses_of(text.replace("{fps}", str(fps)))
        w = np.pi / 2
        assert np.max(np.abs(poses.variables["a"] - 50 * np.sin(w * poses.times) / w)) < 1e-10


def test_derivatives_of_a_mechanism():
    poses = poses_of(f""".config(20); {CRANK} Rod : .bar A=[50,0] B=[200,0];
    @0 Crank.O=[0,0]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,0]; x>0; v=.d(x); a=.d(.d(x)); w=.d(Rod.angle);
    @4""")
    omega, t, r, rod = np.pi / 2, poses.times, 50.0, 150.0
    s, c = np.sin(omega * t), np.cos(omega * t)
    root = np.sqrt(rod**2 - r * r * s * s)
    v = -r * omega * s - r * r * omega * s * c / root
    # the second derivative by a five-point formula of the closed form for v
    h = 1e-3

    def speed(time):
        sine, cosine = np.sin(omega * time), np.cos(omega * time)
        return -r * omega * sine - r * r * omega * sine * cosine / np.sqrt(rod**2 - r * r * sine * sine)

    a = (speed(t - 2 * h) - 8 * speed(t - h) + 8 * speed(t + h) - speed(t + 2 * h)) / (12 * h)
    assert np.max(np.abs(poses.variables["v"] - v)) < 1e-10
    assert np.max(np.abs(poses.variables["a"] - a)) < 1e-7
    rate = -np.degrees(r * omega * c / root)
    assert np.max(np.abs(poses.variables["w"] - rate)) < 1e-9


def test_a_differential_equation():
    poses = poses_of(""".config(20); Dot : .disc(3) c=[0,0];
    @0 x = 10 - .i(x); Dot.c=[x,0];
    @2 y = 1;
    @4""")
    assert np.max(np.abs(poses.variables["x"] - 10 * np.exp(-poses.times))) < 1e-8


def test_a_pendulum_is_an_ellipse_integral_away():
    # theta'' = -k sin(theta): energy is conserved, and the period is 4 K(sin(theta0/2)) / sqrt(k)
    from scipy.special import ellipk

    k, amplitude = 25.0, 70.0
    poses = poses_of(f""".config(200); Rod : .bar P=[0,0] Q=[0,-50];
    @0 Rod.P=[0,0]; Rod.angle = a; a = {amplitude} + .i(w); w = .i(-{k}*180/.pi*.sin(a));
    @4""")
    a, w = poses.variables["a"], np.radians(poses.variables["w"])
    energy = 0.5 * w**2 - k * np.cos(np.radians(a))
    assert np.ptp(energy) < 1e-7 * k
    period = 4 * ellipk(np.sin(np.radians(amplitude / 2)) ** 2) / np.sqrt(k)
    crossings = (
        poses.times[:-1][(a[:-1] > 0) & (a[1:] <= 0)] + (a[:-1] / (a[:-1] - a[1:]))[(a[:-1] > 0) & (a[1:] <= 0)] / 200
    )
    assert np.diff(crossings) == pytest.approx(period, rel=1e-4)


def test_angles_count_full_turns_at_any_frame_rate():
    text = """.config(20); Crank : .bar O=[0,0] P=[50,0];
    @0 Crank.O=[0,0]; Crank.P = [50,0].r(1000*.t);
    @8"""
    for fps in (1, 20):
        assert poses_of(text, fps).angle[0][-1] == pytest.approx(8000, abs=1e-8)


def test_an_angle_between_vectors_is_meant_modulo_a_turn():
    poses = poses_of(""".config(20); Bar : .bar A=[0,0] B=[80,0];
    @0 Bar.A=[0,0]; .a([1,0], Bar.B-Bar.A) = 90*.t;
    @8""")
    assert np.max(np.abs(poses.angle[0] - 90 * poses.times)) < 1e-9


def test_gears_and_what_hangs_on_them():
    motion = motion_of(
        """.config(20);
    A : .bar O=[0,0] P=[40,0]; B : .bar O=[60,0] P=[80,0]; R : .bar O=[150,0] P=[150,60]; L : .bar A=[80,0] B=[150,60];
    @0 A.O=[0,0]; A.angle=100*.t; B.O=[60,0]; B.angle=-2*A.angle; R.O=[150,0]; L.A=B.P; L.B=R.P; z=R.angle*2; R.P.y>0;
       C.O=[10,10]; C.angle = R.angle/3;
    @8""".replace("L : .bar", "C : .bar O=[10,10] P=[20,10]; L : .bar")
    )
    poses = motion.poses(0, motion.timeline.frame_count)
    assert np.max(np.abs(poses.angle[1] + 200 * poses.times)) < 1e-9
    assert np.max(np.abs(poses.variables["z"] - 2 * poses.angle[2])) < 1e-9
    assert np.max(np.abs(poses.angle[3] - poses.angle[2] / 3)) < 1e-9
    assert max(residuals(motion, poses).values()) < 1e-12


def test_a_rack_turns_its_pinion():
    poses = poses_of(""".config(25); Pinion : .bar O=[0,0] P=[50,0];
    @0 Pinion.O=[10*.t,50]; Pinion.O.x = Pinion.angle*(-50*.pi/180);
    @4""")
    assert np.max(np.abs(poses.angle[0] + np.degrees(10 * poses.times / 50))) < 1e-9


@pytest.mark.parametrize(
    ("statement", "expected"), [("x > 0;", 200.0), ("x < 0;", -100.0), ("x ~ -90;", -100.0), ("x ~ 60;", 200.0)]
)
def test_inequalities_and_wishes_select(statement, expected):
    poses = poses_of(f""".config(20); {CRANK} Rod : .bar A=[50,0] B=[200,0];
    @0 Crank.O=[0,0]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,0]; {statement}
    @4""")
    assert poses.variables["x"][0] == pytest.approx(expected)
    assert poses.variables["x"][-1] == pytest.approx(expected)


def test_where_a_path_comes_to_violate_an_inequality_the_motion_goes_over():
    motion = motion_of(f""".config(20); {CRANK} Rod : .bar A=[0,50] B=[33,0];
    @0 Crank.O=[0,0]; Crank.angle=90 - 90*.t; Rod.A=Crank.P; Rod.B=[x,0]; x < 50;
    @3""")
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.solved.all()
    reach = np.hypot(33, 50)
    theta = np.radians(90 - 90 * poses.times)
    root = np.sqrt(reach**2 - (50 * np.sin(theta)) ** 2)
    plus, minus = 50 * np.cos(theta) + root, 50 * np.cos(theta) - root
    gone_over = poses.times > poses.times[np.argmax(plus > 50)] - 1e-9
    assert poses.variables["x"] == pytest.approx(np.where(gone_over, minus, plus), abs=1e-9)
    assert motion.segments[0].beginnings[0].reason == "step"
    assert "inequality" in [b.reason for b in motion.segments[0].beginnings]


def test_clocks_of_a_constraint_that_outlives_later_steps():
    poses = poses_of(""".config(10); Dot : .disc(2) c=[0,0]; Other : .disc(2) c=[0,0];
    @0 Dot.c = [0,0] + [100,0]*(.t/.iv);
    @1 Other.c = [5,5];
    @3 Other.c = [7,7];
    @4 Dot.c = [200, 0];
    @5""")
    x = poses.origin[0, :, 0]
    assert x[:41] == pytest.approx(np.append(25 * poses.times[:40], 200))


def test_a_ten_thousand_turn_crank_is_exact():
    poses = poses_of(""".config(1); Crank : .bar O=[0,0] P=[50,0]; Rod : .bar A=[50,0] B=[200,0];
    @0 Crank.O=[0,0]; Crank.angle=3600090*.t; Rod.A=Crank.P; Rod.B=[x,0]; x>0;
    @8""")
    assert poses.variables["x"][4::4] == pytest.approx(200.0, abs=1e-12)
    assert poses.variables["x"][1::2] == pytest.approx(np.sqrt(150**2 - 50**2), abs=1e-12)


def test_still_things_are_solved_once():
    motion = motion_of(f""".config(20); {CRANK} Rod : .bar A=[50,0] B=[200,0];
    Tri : .bar A=[0,0] B=[90,0]; Leg : .bar A=[0,0] B=[0,70];
    @0 Crank.O=[0,0]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,0]; x>0;
       Tri.A=[300,0]; Leg.A=[380,0]; Tri.B=Leg.B; Leg.B.y>0;
    @4""")
    still = [block for block in motion.segments[0].plan.blocks if not block.moving]
    names = {motion.segments[0].plan.system.unknowns[n].name for block in still for n in block.unknowns}
    assert {"Tri.x", "Tri.cos", "Leg.sin"} <= names
    poses = motion.poses(0, motion.timeline.frame_count)
    assert np.ptp(anchor(motion, poses, "Tri.B"), axis=0).max() == 0.0
