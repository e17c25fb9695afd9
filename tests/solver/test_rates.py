"""Velocities and accelerations: against closed forms, and against differences of poses that are not theirs to see."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from movimentum.expressions import Expr, symbol
from movimentum.scene.model import AnchorCoordinate, Scene, ThingAngle, VariableComponent
from movimentum.settings import Accuracy
from movimentum.solver.accuracy.refinement import refine
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.solver.rates.rates import UndefinedRate, rates_at
from movimentum.solver.solver import solve
from movimentum.workflow.choices import Choices
from movimentum.workflow.read import read as read_script
from movimentum.workflow.stages import arranged, moved, understand
from tests.broad import broad
from tests.understand import timeline_of

ROOT = Path(__file__).parents[2]
GALLERY = sorted((ROOT / "scripts").glob("*.mov"))


def motion_of(text: str) -> PathMotion:
    return solve(timeline_of(text))


def coordinate(scene: Scene, name: str, axis: int) -> Expr:
    thing, anchor = name.split(".")
    (owner,) = [item for item in scene.things if item.name == thing]
    (place,) = [i for i, item in enumerate(owner.anchors) if item.name == anchor]
    return symbol(AnchorCoordinate(owner.number, place, axis))


def angle(scene: Scene, name: str) -> Expr:
    (owner,) = [item for item in scene.things if item.name == name]
    return symbol(ThingAngle(owner.number))


def variable(name: str, axis: int | None = None) -> Expr:
    return symbol(VariableComponent(name, axis))


def times_of(motion: PathMotion) -> list[Fraction]:
    return [motion.timeline.frame_time(frame) for frame in range(motion.timeline.frame_count)]


# --- closed forms


def test_a_slider_crank_has_the_rates_of_the_textbook():
    # x = r cos θ + sqrt(l² - r² sin² θ), θ = ω t (Norton, Design of Machinery, 4.5, 6.7, 7.3)
    motion = motion_of("""
        .config(25);
        Crank : .bar O = [0,0] P = [50,0];   Rod : .bar A = [0,0] B = [170,0];
        @0 Crank.O = [0,0]; Crank.angle = 90*.t; Rod.A = Crank.P; Rod.B = [x, 0]; x > 0;
        @4
    """)
    times = times_of(motion)
    t = np.array([float(time) for time in times])
    r, length, w = 50.0, 170.0, math.pi / 2.0
    sine, cosine = np.sin(w * t), np.cos(w * t)
    root = np.sqrt(length**2 - (r * sine) ** 2)
    velocity = -r * w * sine * (1.0 + r * cosine / root)
    bend = (cosine**2 - sine**2) / root + r**2 * sine**2 * cosine**2 / root**3
    acceleration = -r * w**2 * (cosine + r * bend)
    assert np.max(np.abs(rates_at(motion, [variable("x")], 1, times)[0] - velocity)) < 1e-11
    assert np.max(np.abs(rates_at(motion, [variable("x")], 2, times)[0] - acceleration)) < 1e-10
    # the rod's turning: l sin φ = -r sin θ
    turning = np.degrees(-r * w * cosine / root)
    assert np.max(np.abs(rates_at(motion, [angle(motion.timeline.scene, "Rod")], 1, times)[0] - turning)) < 1e-11


def test_a_four_bar_has_the_rates_of_the_textbook():
    # Freudenstein: with links a (crank, ω2), b (coupler), c (rocker), d (ground),
    # ω3 = a ω2 sin(θ4 - θ2) / (b sin(θ3 - θ4)), ω4 = a ω2 sin(θ2 - θ3) / (c sin(θ4 - θ3)) (Norton 6.18)
    motion = motion_of("""
        .config(25);
        Crank : .bar A = [0,0] B = [50,0];  Coupler : .bar B = [0,0] C = [150,0];  Rocker : .bar D = [0,0] C = [130,0];
        @0 Crank.A = [0,0]; Crank.angle = 180*.t; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [180,0];
           Rocker.C.y > 0;
        @2
    """)
    scene, times = motion.timeline.scene, times_of(motion)
    poses = motion.poses(0, motion.timeline.frame_count)
    two, three, four = (np.radians(poses.angle[item.number]) for item in scene.things)
    a, b, c, w = 50.0, 150.0, 130.0, math.pi
    w3 = a * w * np.sin(four - two) / (b * np.sin(three - four))
    w4 = a * w * np.sin(two - three) / (c * np.sin(four - three))
    found = np.radians(rates_at(motion, [angle(scene, "Coupler"), angle(scene, "Rocker")], 1, times))
    assert np.max(np.abs(found - [w3, w4])) < 1e-12
    # Norton 7.12, with crank acceleration 0
    A, B = c * np.sin(four), b * np.sin(three)
    C = a * w**2 * np.cos(two) + b * w3**2 * np.cos(three) - c * w4**2 * np.cos(four)
    D, E = c * np.cos(four), b * np.cos(three)
    F = -a * w**2 * np.sin(two) - b * w3**2 * np.sin(three) + c * w4**2 * np.sin(four)
    a3, a4 = (C * D - A * F) / (A * E - B * D), (C * E - B * F) / (A * E - B * D)
    found = np.radians(rates_at(motion, [angle(scene, "Coupler"), angle(scene, "Rocker")], 2, times))
    assert np.max(np.abs(found - [a3, a4])) < 1e-10


@pytest.mark.parametrize(
    ("stated", "rate", "second"),
    [
        ("x = 3*.t^4;", lambda t: 12 * t**3, lambda t: 36 * t**2),
        ("x = .exp(.t)*.sin(60*.t);", None, None),
        ("x = .sqrt(1 + .t);", lambda t: 0.5 / np.sqrt(1 + t), lambda t: -0.25 * (1 + t) ** -1.5),
        ("x = (1 + .t)^2.5;", lambda t: 2.5 * (1 + t) ** 1.5, lambda t: 3.75 * np.sqrt(1 + t)),
        ("x = 1/(2 + .t);", lambda t: -((2 + t) ** -2.0), lambda t: 2 * (2 + t) ** -3.0),
        ("x = .ln(1 + .t);", lambda t: 1 / (1 + t), lambda t: -1 / (1 + t) ** 2),
        ("x = .tan(30*.t);", None, None),
        ("x = .atan(.t) + .asin(.t/5) + .acos(.t/7);", None, None),
        ("x = .atan2(.t, 3 - .t);", None, None),
        ("x = .mod(.t^2, 10);", lambda t: 2 * t, lambda t: 2 + 0 * t),
        ("x = .max(.t, 2 - .t) + .abs(.t - 3);", lambda t: np.where(t < 1, -1, 1) - np.where(t < 3, 1, -1), None),
        ("x = .ease(.t/2);", lambda t: 3 * (t / 2) * (1 - t / 2), lambda t: 1.5 * (1 - t)),
        ("x = .i(v); v = .i(6*.t);", lambda t: 3 * t**2, lambda t: 6 * t),
        ("x = 10 - .i(x);", lambda t: -10 * np.exp(-t), lambda t: 10 * np.exp(-t)),
        ("x = 5 + .i(v); v = -.i(4*x);", lambda t: -10 * np.sin(2 * t), lambda t: -20 * np.cos(2 * t)),
        ("x = .d(y); y = .t^3;", lambda t: 6 * t, lambda t: 6 + 0 * t),
        ("x^3 + x = .t;", None, None),
    ],
)
def test_what_expressions_come_to(stated, rate, second):
    motion = motion_of(f".config(10); B : .bar P=[0,0] Q=[9,0]; @0 {stated} @2")
    times = [time for time in times_of(motion) if time not in (1, 2)]
    t = np.array([float(time) for time in times])
    for order, known in ((1, rate), (2, second)):
        found = rates_at(motion, [variable("x")], order, times)[0]
        if known is None:
            inner, h = times[1:], Fraction(1, 100)
            shifts = [time + k * h for time in inner for k in range(-4, 5)]
            values = motion.poses_at(shifts).variables["x"].reshape(-1, 9)
            expected = values @ STENCILS[order] / float(h) ** order
            assert np.max(np.abs(found[1:] - expected)) < 1e-7 * max(1.0, np.max(np.abs(expected)))
        else:
            assert np.max(np.abs(found - known(t))) < 1e-8  # a differential equation is integrated


# --- where equations say less


def test_change_points_and_folded_circles_have_the_limit_of_the_motion():
    # a parallelogram, whose bars lie on one line at 0, 180 and 360 degrees: the rocker turns as the crank does
    motion = motion_of("""
        .config(12);
        Crank : .bar A = [0,0] B = [0,50];  Coupler : .bar B = [0,0] C = [150,0];  Rocker : .bar D = [0,0] C = [0,50];
        @0 Crank.A = [0,0]; Crank.angle = 180*.t - 30; Coupler.B = Crank.B; Rocker.C = Coupler.C; Rocker.D = [150,0];
        @4
    """)
    scene, times = motion.timeline.scene, times_of(motion)
    wanted = [angle(scene, "Rocker"), angle(scene, "Coupler")]
    assert np.max(np.abs(rates_at(motion, wanted, 1, times) - [[180.0], [0.0]])) < 1e-6
    assert np.max(np.abs(rates_at(motion, wanted, 2, times))) < 1e-4


def test_a_dead_centre_that_is_driven_against_has_no_rate():
    # driven by the slider, the crank comes to its dead centre with ever greater speed, and cannot go on
    motion = motion_of("""
        .config(10);
        Crank : .bar O = [0,0] P = [30,40];  Rod : .bar A = [0,0] B = [120,0];
        @0 Crank.O = [0,0]; Rod.A = Crank.P; Rod.B = [x, 0]; x = 150 + 20*.t; Crank.P.y > 0;
        @2
    """)
    scene, times = motion.timeline.scene, times_of(motion)
    found = rates_at(motion, [angle(scene, "Crank")], 1, times)[0]
    reached = np.array([time <= 1 for time in times])
    assert np.isfinite(found[:9]).all()
    assert np.isnan(found[~reached]).all()
    assert np.isnan(found[10]) or abs(found[10]) > 1e6


def test_rates_are_those_of_the_step_that_begins_and_at_the_end_of_the_one_that_ends():
    motion = motion_of(".config(10); B : .bar P=[0,0] Q=[9,0]; @0 x = 5*.t; @1 x = 5 - .t^2; @2")
    found = rates_at(motion, [variable("x")], 1, [Fraction(0), Fraction(1), Fraction(2)])[0]
    assert np.max(np.abs(found - [5.0, 0.0, -2.0])) < 1e-12
    found = rates_at(motion, [variable("x")], 2, [Fraction(0), Fraction(1), Fraction(2)])[0]
    assert np.max(np.abs(found - [0.0, -2.0, -2.0])) < 1e-12


def test_nothing_has_a_rate_where_there_is_no_solution_or_no_value():
    motion = motion_of(".config(10); B : .bar P=[0,0] Q=[9,0]; @0 B.P = [0,0]; B.Q.x = 8 + .t; @1 y = .t; @2")
    scene, times = motion.timeline.scene, [Fraction(1, 2), Fraction(3, 2)]
    assert np.isnan(rates_at(motion, [variable("y")], 1, times)[0]).tolist() == [True, True]
    found = rates_at(motion, [coordinate(scene, "B.Q", 1)], 1, times)[0]
    assert np.isfinite(found[0])
    assert np.isnan(found[1])


# --- freedom


def test_least_motion_has_its_velocity_and_its_acceleration():
    # one end of a bar is led along a circle; the rest follows as little as it can, which bends its path
    motion = motion_of("""
        .config(20);
        Bar : .bar P = [100,0] Q = [260,30];  Tail : .bar A = [260,30] B = [260,150];
        @0 Bar.P = [100*.cos(40*.t), 100*.sin(40*.t)]; Tail.A = Bar.Q;
        @2
    """)
    scene = motion.timeline.scene
    wanted = [coordinate(scene, name, axis) for name in ("Bar.Q", "Tail.B") for axis in (0, 1)]
    wanted += [angle(scene, "Bar"), angle(scene, "Tail")]
    inner = [Fraction(k, 10) for k in range(2, 19)]
    h = Fraction(1, 50)
    shifts = [time + k * h for time in inner for k in range(-4, 5)]
    values = read(motion.poses_at(shifts), scene, wanted).reshape(len(wanted), -1, 9)
    for order, within in ((1, 1e-6), (2, 1e-4)):
        expected = values @ STENCILS[order] / float(h) ** order
        found = rates_at(motion, wanted, order, inner)
        assert np.max(np.abs(found - expected)) < within * np.max(np.abs(expected))


def test_a_wish_has_a_velocity_and_no_acceleration():
    motion = motion_of("""
        .config(10); Arm : .bar O = [0,0] P = [100,0];
        @0 Arm.O = [0,0]; Arm.P ~ [0, 100] .speed(30);
        @2
    """)
    scene = motion.timeline.scene
    found = rates_at(motion, [angle(scene, "Arm")], 1, [Fraction(1)])[0]
    values = motion.poses_at([1 + Fraction(k, 100) for k in range(-4, 5)]).angle[0]
    assert abs(found[0] - values @ STENCILS[1] * 100) < 1e-5 * abs(found[0])
    with pytest.raises(UndefinedRate):
        rates_at(motion, [angle(scene, "Arm")], 2, [Fraction(1)])


# --- every script


STENCILS = {
    1: np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]),
    2: np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560]),
}
"""Central differences of order 8, by order of the derivative."""


def read(poses: Poses, scene: Scene, wanted: list[Expr]) -> np.ndarray:
    rows = []
    for item in wanted:
        match item.payload:
            case AnchorCoordinate(thing, anchor, axis):
                rows.append(poses.world(thing, scene.things[thing].anchors[anchor].local)[:, axis])
            case ThingAngle(thing):
                rows.append(poses.angle[thing])
            case VariableComponent(name, axis):
                rows.append(poses.variables[name] if axis is None else poses.variables[name][:, axis])
    return np.array(rows)


FREE = {"peaucellier-linkage", "penrose-five", "penrose-twenty", "geneva", "geneva-play", "escapement", "ratchet"}
FREE |= {"combination-lock", "vending-latch", "walking-toy"}
"""Drawn by wishes or pushed: integrated, with some 8 digits; a pushed thing has no acceleration."""


@broad("count", [2, pytest.param(7, marks=pytest.mark.slow)], first=1)
@broad("path", [path for path in GALLERY if path.stem not in FREE], every=9, ids=lambda path: path.stem)
def test_every_script_of_the_gallery_against_differences_of_fifty_digits(path, count, monkeypatch):
    monkeypatch.chdir(ROOT)
    choices = Choices()
    motion = moved(arranged(understand(read_script(str(path)), choices), choices))
    timeline = motion.timeline
    scene = timeline.scene
    wanted: list[Expr] = []
    for thing in scene.things:
        if thing.is_body:
            numbers = range(len(thing.anchors))
            wanted += [symbol(AnchorCoordinate(thing.number, n, axis)) for n in numbers for axis in (0, 1)]
            wanted.append(symbol(ThingAngle(thing.number)))
    h = Fraction(1, 10**6)
    steps = [*(segment.start for segment in timeline.segments), timeline.end]
    length = timeline.end - timeline.start
    times = [timeline.start + length * k / count + length / 97 for k in range(count)]
    times = [time for time in times if all(abs(time - step) > 4 * h for step in steps)]
    exact = refine(motion, Accuracy.EXACT, 50).poses_at([time + k * h for time in times for k in range(-4, 5)])
    for order, within in ((1, 1e-9), (2, 1e-7)):
        found = rates_at(motion, wanted, order, times)
        expected = []
        for item in wanted:
            payload = item.payload
            if isinstance(payload, AnchorCoordinate):
                local = scene.things[payload.thing].anchors[payload.anchor].local
                wide = exact.coordinate(payload.thing, local, payload.axis)
            else:
                wide = exact.pose[payload.thing].angle
            weights = EXACT[order]
            rows = wide.reshape(len(times), 9) if len(wide) > 1 else np.broadcast_to(wide, (len(times), 9))
            expected.append(
                [
                    float(
                        sum(w.numerator * v / w.denominator for w, v in zip(weights, row, strict=True))
                        / (h.numerator**order)
                        * h.denominator**order
                    )
                    for row in rows
                ]
            )
        expected = np.array(expected)
        size = max(1.0, float(np.max(np.abs(expected))))
        assert np.max(np.abs(found - expected)) < within * size


EXACT = {order: [Fraction(float(w)).limit_denominator(1000) for w in row] for order, row in STENCILS.items()}
