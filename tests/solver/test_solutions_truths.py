"""All solutions of a block, and what it begins from: planted roots, Bézout's counts, foot points; notes on digits."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from movimentum.expressions import Expr, call, symbol, walk
from movimentum.planning.blocks.kinds import Newton
from movimentum.query import reader
from movimentum.scene.leaves import Bearing, ContactPlace
from movimentum.scene.model import AnchorCoordinate
from movimentum.solver.accuracy.notes import AttainedAccuracy, draft_note, inexact_note, singular_warning
from movimentum.solver.basis.partial_pose import PartialPose
from movimentum.solver.basis.pose_state import Snapshot, as_drawn
from movimentum.solver.block.problem import BlockProblem, scale_of
from movimentum.solver.round_counting import count_rounds, counts_rounds, visible_value
from movimentum.solver.solutions.carried import carried_values, complete_core
from movimentum.solver.solutions.homotopy import AllSolutions, TotalDegree, degrees_of, follow_paths
from movimentum.solver.solutions.touching_starts import ONE_IN, touching_starts
from tests.solver.blocks import TIME, less, newton_block, problem_at, times, total, unknowns
from tests.solver.scenes import motion_of, plan_of, scene_of, unknown

X, Y, Z = unknowns(3)


def all_at(rows, core, scale=1.0, inputs=None, sizes=None):
    block = newton_block(rows, core)
    every = AllSolutions(block, np.full(len(core), scale), sizes or dict.fromkeys(inputs or {}, 1.0))
    assert every.applicable
    return every, block, every.at(problem_at(block, 0.0, inputs, scale))


# --- homotopy


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("roots", [(1,), (1, -2), (0.5, 0.6, -3), (1, 2, 3, 4), (-1.5, 0.1, 0.3, 2, 2.5)])
def test_planted_roots_of_one_polynomial_are_all_found(roots, size):
    factors = [less(X, size * r) for r in roots]
    _, _, found = all_at([times(*factors)], (0,), size)
    assert found.complete
    assert found.paths == len(roots)
    assert sorted(float(x[0]) for x in found.real) == pytest.approx(
        [size * r for r in sorted(roots)], rel=1e-7, abs=1e-8 * size
    )


@pytest.mark.parametrize("seed", range(4))
def test_quadrics_with_planted_points_have_bezouts_count(seed):
    """Two conics through three planted points meet in four: complex ones come in pairs, so the fourth is real."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, size=(3, 2))
    monomials = [(X, X), (X, Y), (Y, Y), (X,), (Y,), ()]

    def values(p):
        x, y = p
        return [x * x, x * y, y * y, x, y, 1.0]

    null = np.linalg.svd(np.array([values(p) for p in points]))[2][3:]
    rows = [
        total(*(times(float(c), *m) for c, m in zip(row, monomials, strict=True)))
        for row in (null[0], null[1] + 0.3 * null[2])
    ]
    every, _, found = all_at(rows, (0, 1))
    assert every.degrees == [2, 2]
    assert (found.complete, found.paths) == (True, 4)
    for point in points:
        assert min(np.max(np.abs(x - point)) for x in found.real) < 1e-6
    assert len(found.real) in (3, 4)  # the fourth may be at infinity
    for x in found.real:
        assert np.abs(np.array([null[0], null[1] + 0.3 * null[2]]) @ values(x)).max() < 1e-7


def test_what_has_no_real_solution_or_is_at_infinity_is_left_out():
    _, _, found = all_at([total(times(X, X), 1.0)], (0,))
    assert (found.real, found.complete) == ([], True)
    _, _, found = all_at([less(times(X, Y), 1.0), less(X, 0.5)], (0, 1))  # the second path has y without bound
    assert found.complete
    assert [x.tolist() for x in found.real] == [pytest.approx([0.5, 2.0])]


@pytest.mark.parametrize("radius", [0.5, 1.2])
def test_circles_meet_twice_and_at_infinity(radius):
    """The common points of two circles: the law of cosines; the two circular points at infinity are no solutions."""
    one = less(total(times(X, X), times(Y, Y)), 1.0)
    other = less(total(times(less(X, 1.0), less(X, 1.0)), times(Y, Y)), radius**2)
    _, _, found = all_at([one, other], (0, 1))
    c = (1 + 1 - radius**2) / 2
    assert sorted(x.tolist() for x in found.real) == [pytest.approx([c, s * math.sqrt(1 - c * c)]) for s in (-1, 1)]


def test_a_family_is_led_from_generic_inputs():
    """x² = p, y² + x = q, asked again for other inputs."""
    p, q = symbol(7), symbol(8)
    rows = [less(times(X, X), p), less(total(times(Y, Y), X), q)]
    every, block, _ = all_at(rows, (0, 1), inputs={7: 1.0, 8: 3.0})
    for values in ((1.0, 3.0), (4.0, 3.0), (0.25, 9.0), (4.0, 1.0), (-1.0, 2.0)):
        found = every.at(problem_at(block, 0.0, dict(zip((7, 8), values, strict=True))))
        exact = []
        if values[0] >= 0:
            for x in (math.sqrt(values[0]), -math.sqrt(values[0])):
                exact += [(x, s * math.sqrt(values[1] - x)) for s in (1, -1) if values[1] > x]
        assert found.complete
        assert found.paths == 4
        assert sorted(tuple(x) for x in found.real) == [pytest.approx(e, abs=1e-8) for e in sorted(exact)]
    assert every.asked == 6


def test_only_polynomials_of_low_degree_are_solved_so():
    assert degrees_of(newton_block([times(X, X, Y), less(Y, times(X, 3.0))], (0, 1))) == [3, 1]
    assert degrees_of(newton_block([times(Y, X), less(times(1e-30, X, X, X), X)], (0, 1))) == [2, 1]
    assert degrees_of(newton_block([call("sind", X)], (0,))) is None
    assert degrees_of(newton_block([symbol(9)], (0,))) is None
    many = newton_block([less(times(*[X] * 23), 1.0), less(times(*[Y] * 23), 1.0)], (0, 1))
    assert not AllSolutions(many, np.ones(2), {}).applicable
    assert not AllSolutions(newton_block([less(X, 1.0)], (0,)), np.ones(1), {}, coupled=True).applicable
    assert not AllSolutions(newton_block([less(X, 1.0)], (0, 1)), np.ones(2), {}).applicable


@pytest.mark.parametrize("degrees", [(1,), (2, 3), (3, 1, 2)])
def test_the_start_system_and_its_deformation(degrees):
    """Its solutions are all d-th roots; H is (1 - t) g G + t F, with the derivatives that differences show."""
    rng = np.random.default_rng(1)
    n = len(degrees)
    matrix = rng.normal(size=(n, n))

    def rows(x):
        return x @ matrix.T - 2.0, np.repeat(matrix[None], len(x), axis=0).astype(complex)

    problem = TotalDegree(rows, degrees, np.random.default_rng(2))
    starts = problem.starts()
    assert len(starts) == math.prod(degrees)
    assert len({tuple(np.round(s, 9)) for s in starts}) == len(starts)
    np.testing.assert_allclose(
        starts ** np.array(degrees), np.repeat(problem.constants[None], len(starts), axis=0), atol=1e-12
    )
    paths = np.arange(len(starts))
    value, _, _ = problem.at(starts, np.zeros(len(starts)), paths)
    assert np.abs(value).max() < 1e-12
    x, t = starts * 1.1 + 0.2, np.full(len(starts), 0.3)
    value, jacobian, by_t = problem.at(x, t, paths)
    h = 1e-6
    np.testing.assert_allclose(
        (problem.at(x, t + h, paths)[0] - problem.at(x, t - h, paths)[0]) / (2 * h), by_t, atol=1e-8
    )
    for j in range(n):
        step = np.zeros(n)
        step[j] = h
        slope = (problem.at(x + step, t, paths)[0] - problem.at(x - step, t, paths)[0]) / (2 * h)
        np.testing.assert_allclose(slope, jacobian[:, :, j], atol=1e-7)
    np.testing.assert_allclose(problem.at(x, np.ones(len(t)), paths)[0], rows(x)[0], atol=1e-12)


class Drawn:
    """A path problem x = f(t) with known solutions."""

    def __init__(self, f, rate):
        self.f, self.rate = f, rate

    def starts(self):
        return self.f(np.zeros(3))[:, None] * np.array([[1.0], [2.0], [3.0]])

    def at(self, x, t, paths):
        factor = (paths + 1.0)[:, None]
        return x - factor * self.f(t)[:, None], np.ones((len(x), 1, 1), dtype=complex), -factor * self.rate(t)[:, None]


def test_paths_are_followed_to_their_known_ends():
    found, finite, lost = follow_paths(Drawn(lambda t: np.exp(3j * t), lambda t: 3j * np.exp(3j * t)))
    np.testing.assert_allclose(found[:, 0], np.exp(3j) * np.array([1, 2, 3]), rtol=1e-9)
    assert finite.all()
    assert not lost.any()
    with np.errstate(all="ignore"):
        _, finite, lost = follow_paths(Drawn(lambda t: 1.0 / (1.0 - t + 1e-9j), lambda t: (1.0 - t + 1e-9j) ** -2))
    assert not finite.any()
    assert not lost.any()


# --- what a block begins from

NUMBERS = """.config(10, 100, 100); Bar : .bar A = [0, 0] B = A + [100, 0];
@0 Bar.A = [x, y]; Bar.angle = 0; x + z = 1; x*z = y; z = .t; @1"""


def test_what_nothing_tells_is_completed_from_what_is_carried():
    plan = plan_of(NUMBERS)
    carry = as_drawn(plan.system.scene)
    one, two = unknown(plan, "x"), unknown(plan, "z")
    a, b = symbol(one), symbol(two)
    for rows, start, exact in (
        ([less(times(3.0, a), 6.0)], [0.0], [2.0]),
        ([less(a, 1.0), less(a, 4.0)], [0.0], [2.5]),  # as nearly as can be
        ([less(total(a, b), 5.0), less(less(a, b), 1.0)], [0.0, 0.0], [3.0, 2.0]),
    ):
        core = (one, two)[: len(start)]
        problem = problem_at(newton_block(rows, core), scale=100.0)
        known = [n for n in core if carry.now.value(plan.system, n) is not None]
        assert known == []
        found = complete_core(plan, problem, carry, np.array(start))
        if len(start) == len(core) and not problem.block.targets:
            assert found.tolist() == start  # nothing is known beside it: nothing to come near to
        told = Snapshot(carry.now.things, {plan.system.unknowns[two].payload: exact[1] if len(exact) > 1 else 7.0})
        known_carry = type(carry)(told)
        if len(core) == 2:
            begun = carried_values(plan, problem.block, known_carry)
            assert begun.tolist() == [0.0, exact[1]]
            np.testing.assert_allclose(complete_core(plan, problem, known_carry, begun), exact, atol=1e-9)


def test_a_factor_along_a_line_comes_from_the_drawing():
    """x + 3 z = 10 with z carried: x = 10 - 3 z; of squares several steps come near."""
    plan = plan_of(NUMBERS)
    one, two = unknown(plan, "x"), unknown(plan, "z")
    told = Snapshot(as_drawn(plan.system.scene).now.things, {plan.system.unknowns[two].payload: 2.0})
    carry = type(as_drawn(plan.system.scene))(told)
    a, b = symbol(one), symbol(two)
    for row, begin, exact, off in (
        (less(total(a, times(3.0, b)), 10.0), 0.0, 4.0, 1e-9),
        (less(times(a, a), times(8.0, b)), 3.0, 4.0, 0.05),
    ):
        problem = problem_at(newton_block([row, less(b, 2.0)], (one, two)), scale=1.0)
        found = complete_core(plan, problem, carry, np.array([begin, 2.0]))
        assert found[1] == 2.0
        assert found[0] == pytest.approx(exact, abs=off)


CONTACT = """.config(10); Round : .curve O = [0, 0] .param(u, [60*.cos(u), 30*.sin(u)]);
Pin : .bar A = [70, 5] B = A + [60, 0];
@0 Round.O = [0, 0]; Round.angle = 0; .on(Pin.A, Round) = 8; (Pin.A - [20, 10]).l = 49.5; Pin.A.x > 0; Pin.angle = 0; @1
"""


def test_starts_with_contacts_are_led_to_foot_points_of_an_ellipse():
    plan = plan_of(CONTACT)
    block = next(
        b
        for b in plan.blocks
        if isinstance(b, Newton) and any(isinstance(plan.system.unknowns[n].payload, ContactPlace) for n in b.core)
    )
    carry, scale = as_drawn(plan.system.scene), scale_of(plan, block.core)
    problem = BlockProblem(
        block,
        {n: np.array([carry.now.value(plan.system, n) or 0.0]) for n in block.inputs},
        [np.zeros(1)] * len(plan.clocks),
        scale,
    )
    first = carried_values(plan, block, carry)
    rng = np.random.default_rng(4)
    starts = first + 0.1 * scale * rng.normal(size=(3 * ONE_IN, len(first)))
    before = starts.copy()
    found = touching_starts(plan, problem, carry, starts)
    places = [j for j, n in enumerate(block.core) if isinstance(plan.system.unknowns[n].payload, ContactPlace)]
    led = np.zeros(len(starts), dtype=bool)
    led[1::ONE_IN] = True
    assert np.array_equal(found[~led], before[~led])
    angles = np.linspace(0.0, 2 * math.pi, 20001)
    ellipse = np.stack([60 * np.cos(angles), 30 * np.sin(angles)], axis=1)
    met = []
    for x in found[led]:
        values = problem.completed(x[None])
        state = [values.get(n) for n in range(len(plan.system.unknowns))]
        pin = PartialPose.of(plan, state.__getitem__, carry.now, Fraction(0)).moment.things[1].world(70.0, 5.0)
        for j in places:
            place = plan.system.unknowns[block.core[j]].payload
            px, py = (float(v[0]) for v in place.touch.outline.values(np.array([x[j]]))[:2])
            away = math.hypot(px - pin[0], py - pin[1])
            assert away == pytest.approx(np.min(np.hypot(*(ellipse - np.array(pin)).T)), abs=1e-4)
            met.append(abs(away - 8.0) < 1e-3 and abs(math.hypot(pin[0] - 20, pin[1] - 10) - 49.5) < 1e-3)
    assert all(met)  # the pin is where it has to be, and not only its place
    few = before[: ONE_IN - 1].copy()
    assert touching_starts(plan, problem, carry, few) is few


# --- rounds

WHEEL = """.config(20); Round : .curve O = [0, 0] .param(u, [30*.cos(u), 30*.sin(u)]);
Arm : .bar P = [0, 0] Q = P + [50, 0];
@0 Round.O = [0, 0]; Round.angle = 0; Arm.P = [0, 0]; Arm.angle = {speed}*.t; {more} @2
"""


@pytest.mark.parametrize("speed", [90, 400, -600])
@pytest.mark.parametrize("more", ["", ".on(Arm.Q, Round) = 20; k = .where(Arm.Q, Round);"], ids=["read", "followed"])
def test_rounds_are_counted_along_the_motion(speed, more):
    """An arm about a circle: the place goes as the angle does, a share of 1 for each round."""
    motion = motion_of(WHEEL.format(speed=speed, more=more))
    scene = motion.timeline.scene
    stated = scene_of(WHEEL.format(speed=speed, more="k = .where(Arm.Q, Round);")).constraints()
    sides = [side for constraint in stated for side in (*constraint.left, *constraint.right)]
    (place,) = {node for node in walk(*sides) if counts_rounds(node)}
    unit = place.payload.outline.period
    node = Expr(place.op, place.args, place.payload.uncounted.counting_rounds(2.0 * unit))
    once = reader(scene, [visible_value(node)])
    rounds = count_rounds(motion, node, lambda poses: once(poses)[0])
    poses = motion.poses(0, motion.timeline.frame_count)
    found = rounds.values(motion, poses)
    np.testing.assert_allclose(found - found[0], unit * speed / 360 * poses.times, atol=1e-9)
    assert found[0] == pytest.approx(0.0 if more else 2.0 * unit, abs=1e-9)  # from where it is drawn on
    apart = rounds.values(motion, motion.poses_at([Fraction(3, 10), Fraction(17, 10)]))
    assert apart[1] - apart[0] == pytest.approx(unit * speed / 360 * 1.4, abs=1e-9)
    unknown_start = Expr(place.op, place.args, place.payload.uncounted.counting_rounds())
    if not more:  # of what is drawn nowhere, only what is seen is known
        apart = count_rounds(motion, unknown_start, lambda poses: once(poses)[0]).values(motion, poses)
        np.testing.assert_allclose(apart, once(poses)[0])
    if more:
        np.testing.assert_allclose(poses.variables["k"] - poses.variables["k"][0], speed / 360 * poses.times, atol=1e-9)


@pytest.mark.parametrize("speed", [0.4, -1.3])
def test_shares_of_an_outline_with_corners_are_counted(speed):
    """Round a square, a quarter of its length for each side."""
    text = f""".config(20); Box : .polygon O = [0, 0] A = [40, 0] B = [40, 40] C = [0, 40];
    Pin : .bar P = [0, 0] Q = P + [5, 0];
    @0 Box.O = [0, 0]; Box.angle = 0; .on(Pin.P, Box) = 0; .where(Pin.P, Box) = {speed}*.t; Pin.angle = 0; @2"""
    motion = motion_of(text)
    (node,) = {
        n for c in scene_of(text).constraints() for side in (*c.left, *c.right) for n in walk(side) if counts_rounds(n)
    }
    once = reader(motion.timeline.scene, [visible_value(node)])
    poses = motion.poses(0, motion.timeline.frame_count)
    node = Expr(node.op, node.args, node.payload.shared().counting_rounds(0.0).shared())
    found = count_rounds(motion, node, lambda some: once(some)[0]).values(motion, poses)
    np.testing.assert_allclose(found, speed * poses.times, atol=1e-9)


def test_only_what_goes_round_is_counted():
    scene = plan_of(WHEEL.format(speed=90, more="")).system.scene
    plain = symbol(AnchorCoordinate(0, 0, 0))
    assert not counts_rounds(plain)
    bearing = symbol(Bearing("here", 0.0, plain, TIME))
    assert counts_rounds(bearing)
    assert visible_value(bearing) == call("atan2d", plain, TIME)
    assert len(scene.things) == 2


def test_a_bearing_is_unwound_from_how_it_is_drawn():
    """The direction of (cos 500 t, sin 500 t), as drawn at 720 degrees: it goes on from there."""
    motion = motion_of(WHEEL.format(speed=500, more=""))
    scene = motion.timeline.scene
    arm = next(t.number for t in scene.things if t.name == "Arm")
    for drawn in (0.0, 720.0, -360.0):
        node = symbol(Bearing("arm", drawn, symbol(AnchorCoordinate(arm, 1, 1)), symbol(AnchorCoordinate(arm, 1, 0))))
        once = reader(scene, [visible_value(node)])
        rounds = count_rounds(motion, node, lambda poses, once=once: once(poses)[0])
        poses = motion.poses(0, motion.timeline.frame_count)
        np.testing.assert_allclose(rounds.values(motion, poses), drawn + 500 * poses.times, atol=1e-9)


# --- notes


@pytest.mark.parametrize(("digits", "said"), [(12.9, "12 of 15"), (0.4, "0 of 15"), (-3.0, "0 of 15")])
def test_a_warning_names_the_digits_that_are_certain(digits, said):
    warning = singular_warning(digits, 15, Fraction(5, 2))
    assert said in warning.message
    assert "t = 2.5" in warning.message
    assert warning.code == "solve/ill-conditioned"


def test_what_falls_short_of_what_was_asked_is_noted():
    assert AttainedAccuracy().notes(None) == ()
    assert AttainedAccuracy(14.0, None).notes(None) == ()
    assert [note.code for note in AttainedAccuracy(14.9, Fraction(1)).notes(None)] == ["solve/ill-conditioned"]
    assert AttainedAccuracy(15.0, Fraction(1)).notes(None) == ()
    assert [note.code for note in AttainedAccuracy(15.0, Fraction(1)).notes(30)] == ["solve/ill-conditioned"]
    assert "15 of 30" in AttainedAccuracy(15.0, Fraction(1)).notes(30)[0].message
    both = AttainedAccuracy(1.0, Fraction(1), {"x": None, "y": None}).notes(None)
    assert [note.code for note in both] == ["solve/ill-conditioned", "solve/rough"]
    assert both[1].message == inexact_note(["x", "y"]).message
    assert all(name in both[1].message for name in ("x", "y"))
    assert "0.25 pixels" in draft_note(0.25).message


def test_products_of_signs_are_all_told_apart():
    """x² = 1, y² = 4, z² = 9: eight solutions, each once."""
    rows = [less(times(u, u), float(k * k)) for u, k in ((X, 1), (Y, 2), (Z, 3))]
    _, _, found = all_at(rows, (0, 1, 2))
    assert sorted(tuple(np.round(x, 9)) for x in found.real) == sorted(product((-1.0, 1.0), (-2.0, 2.0), (-3.0, 3.0)))
