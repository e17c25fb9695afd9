"""Free motion: least velocities, their rates, and least starting poses, against closed forms."""

from __future__ import annotations

import cmath
import math
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from movimentum.expressions import call
from movimentum.planning.blocks.base import WishRows
from movimentum.planning.blocks.kinds import Velocity
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.records import replace
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.block.problem import BlockProblem, scale_of
from movimentum.solver.free import velocity as free_velocity
from movimentum.solver.free.initial_pose import Turn, _Coordinate, least_pose, turns_of
from movimentum.solver.free.rates import derivative_depths
from movimentum.solver.free.velocity import (
    FOLLOWING_RATE,
    FreeMotionLaw,
    FreeVelocity,
    NearInstants,
    _weights,
    workspace_size,
)
from tests.solver.blocks import TIME, free_block, less, problem_at, times, total, unknowns
from tests.solver.scenes import motion_of, plan_of, scene_of

BOTH = pytest.mark.parametrize("large", [False, True], ids=["dense", "sparse"])
PLAN = plan_of(".config(10, 300, 200); Bar : .bar A = [0, 0] B = A + [100, 40]; @0 Bar.A = [0, 0]; Bar.angle = 0; @1")


def with_wish(block, *errors, speed: float = math.inf):
    """The same block with a wish for these errors to be 0."""
    clocks = Clocks([Fraction(0)])
    entries, slopes = slopes_of(errors, block.core)
    wishes = WishRows(
        compiled(errors, clocks), len(errors), compiled(slopes, clocks), (*errors, *slopes), tuple(entries),
        ((0, len(errors), speed),), (0,),
    )  # fmt: skip
    return replace(block, wishes=wishes)


# --- derivatives by time from values


@pytest.mark.parametrize("count", [5, 7])
@pytest.mark.parametrize("at", [-3.0, 0.0, 2.5])
def test_weights_give_the_derivative_of_any_polynomial(count, at):
    offsets = 0.01 * (np.arange(count) + at)
    for degree in range(count):
        slope = 1.0 if degree == 1 else 0.0  # of u^k at 0
        assert _weights(offsets) @ offsets**degree == pytest.approx(slope, abs=1e-9)
    two = _weights(np.stack([offsets, 2.0 * offsets]))
    assert two[0] == pytest.approx(2.0 * two[1], rel=1e-9)


def velocity_of(rows, core, metric, nodes=None, plan=PLAN, wish=None) -> FreeVelocity:
    block = free_block(rows, core, metric)
    if wish is not None:
        block = with_wish(block, wish)
    return FreeVelocity(
        block, plan, lambda tau: problem_at(block, tau), np.linspace(0.0, 4.0, 101) if nodes is None else nodes
    )


@pytest.mark.parametrize("tau", [0.0, 1.3, 4.0])
@pytest.mark.parametrize("weights", [(1.0, 1.0), (1.0, 9.0)])
def test_the_velocity_of_two_weights_on_a_line(tau, weights):
    """x + y = sin t: the rates are shared as the inverse weights are."""
    x, y = unknowns(2)
    row = less(total(x, y), call("sind", times(180.0 / math.pi, TIME)))
    free = velocity_of([row], (0, 1), np.diag(weights))
    here = np.array([math.sin(tau) - 0.3, 0.3])
    shares = np.array([1.0 / w for w in weights])
    exact = math.cos(tau) * shares / shares.sum()
    np.testing.assert_allclose(free.velocity(tau, here), exact, atol=1e-10)
    np.testing.assert_allclose(free.velocity(tau, here, free.tangent(tau, here)), exact, atol=1e-10)
    found, good, _ = free.restored(tau, here + 0.01)
    assert good
    off = 0.02 * shares / shares.sum()
    np.testing.assert_allclose(found, here + 0.01 - off, atol=1e-12)


@pytest.mark.parametrize("off", [-0.011, -0.003, 0.003, 0.011])
def test_a_difference_does_not_reach_over_a_kink(off):
    """x + y = |t - 2|: beside the kink each side has its own slope, and at the kink both are had."""
    x, y = unknowns(2)
    free = velocity_of([less(total(x, y), call("abs", less(TIME, 2.0)))], (0, 1), np.eye(2))
    for after in (False, True):
        v = free.velocity(2.0 + off, np.zeros(2), after=after)
        np.testing.assert_allclose(v, [np.sign(off) / 2] * 2, atol=1e-9)
    np.testing.assert_allclose(free.velocity(2.0, np.zeros(2), after=True), [0.5, 0.5], atol=1e-9)
    for tau, sides in (([0.5, 2.0 + off, 3.0], [1, -np.sign(off), -1]), ([2.0, 3.0], [-1, -1]), ([1.0, 2.0], [1, 1])):
        near = NearInstants(free, np.array(tau))
        changes = near.changes(np.zeros((len(tau), 2)), lambda problem, core: problem.residual(core))
        np.testing.assert_allclose(changes[:, 0], sides, atol=1e-9)  # of x + y - |t - 2|
        assert near.problem.clocks[0].tolist() == tau


@pytest.mark.parametrize("side", [0.0, 0.5, 1.0])
def test_instants_near_stay_on_the_path_where_they_can(side):
    free = velocity_of([], (0,), np.eye(1))
    for tau in (0.0, 0.01, 2.0, 3.99, 4.0):
        found = free.near(tau, 0.01, side)
        assert len(found) == 7
        np.testing.assert_allclose(np.diff(found), 0.01)
        assert found[0] >= 0.0
        assert found[-1] <= 4.0 + 1e-12
        if 0.06 <= tau <= 3.94:
            assert found[0] == pytest.approx(tau - side * 0.06)
    short = velocity_of([], (0,), np.eye(1), np.array([1.0, 1.001]))
    assert short.near(1.0, 0.01, side)[0] == pytest.approx(1.0 - side * 0.06)
    assert free.spacing == pytest.approx(0.04)


def test_a_wish_is_followed_to_one_over_e_in_an_eighth_of_a_unit():
    """x + y = 0 and the wish x = 3 t: the error falls as exp(-8 t) while its target moves."""
    x, y = unknowns(2)
    free = velocity_of([total(x, y)], (0, 1), np.eye(2), wish=less(x, times(3.0, TIME)))
    for tau, here in ((0.5, 1.5), (1.0, 2.9), (2.0, 6.4)):
        v = free.velocity(tau, np.array([here, -here]))
        exact = 3.0 - FOLLOWING_RATE * (here - 3.0 * tau)
        np.testing.assert_allclose(v, [exact, -exact], atol=1e-8)


def test_a_wish_is_followed_no_faster_than_its_speed():
    x, y = unknowns(2)
    for speed, most in (
        (2.0, 2.0),
        (math.inf, free_velocity.FARTHEST_WISH * FOLLOWING_RATE * workspace_size(PLAN.system.scene)),
    ):
        law = FreeMotionLaw(with_wish(free_block([], (0, 1), np.eye(2)), x, y, speed=speed), PLAN)
        far = np.array([3e9, -4e9])
        found = law.wish_rates(far, np.zeros(2))
        np.testing.assert_allclose(found, [-0.6 * most, 0.8 * most], rtol=1e-9)
        assert law.wish_rates(np.array([0.0, 0.1]), np.array([0.5, 0.0])) == pytest.approx(
            [-0.5, -0.1 * FOLLOWING_RATE]
        )
    assert (law.damping.near, law.damping.far) == (
        FOLLOWING_RATE * PLAN.size,
        FOLLOWING_RATE * workspace_size(PLAN.system.scene),
    )


@pytest.mark.parametrize(
    ("config", "anchors", "exact"),
    [("10", "A = [0, 0] B = A + [30, 400]", 400.0), ("10, 700, 300", "A = [0, 0] B = A + [30, 400]", 700.0),
     ("10", "A = [5, 5] B = A + [0, 0]", 100.0), ("10", "A = [-9, 5] B = A + [0, 0.5]", 0.5)],
)  # fmt: skip
def test_a_field_is_as_wide_as_the_drawing_or_the_canvas(config, anchors, exact):
    assert workspace_size(scene_of(f".config({config}); Bar : .bar {anchors}; @0 Bar.A = [0, 0]; @1")) == exact


# --- derivatives of a free motion

DRAGGED = """.config(20, 300, 200); Rod : .bar A = [0, 0] B = A + [0, 50];
@0 Rod.A = [{v}*.t, 0]; b = .d(Rod.B); c = .d(.d(Rod.B.x)); @1
"""


@pytest.mark.parametrize("v", [-80])
def test_a_dragged_rod_follows_the_tractrix(v):
    """tan(theta / 2) = exp(-v t / L) from upright: its velocity is along the rod, and all rates are known."""
    motion = motion_of(DRAGGED.format(v=v))
    times_ = [Fraction(k, 4) for k in range(1, 4)]
    poses = motion.poses_at(times_)
    for k, t in enumerate(map(float, times_)):
        turn = (
            math.pi - 2.0 * math.atan(math.exp(-abs(v) * t / 50.0))
            if v > 0
            else 2.0 * math.atan(math.exp(-abs(v) * t / 50.0))
        )
        s, c = math.sin(turn), math.cos(turn)
        np.testing.assert_allclose(poses.world(0, (0.0, 50.0))[k], [v * t + 50 * c, 50 * s], atol=1e-6)
        np.testing.assert_allclose(poses.variables["b"][k], [v * c * c, v * c * s], atol=1e-6)
        rate = -v / 50.0 * -s  # d(theta)/dt, that turns the rod into the way it comes from
        np.testing.assert_allclose(poses.variables["c"][k], -2.0 * v * c * s * rate, atol=1e-4)


def test_derivatives_are_asked_of_all_that_a_block_depends_on():
    def block(number, **fields):
        return SimpleNamespace(number=number, rates_of=None, **fields)

    velocity = Velocity(
        number=3, unknowns=(), equations=(), core=(), inputs=frozenset(), moving=True, law=1, upstream=(0, 1), order=2
    )
    blocks = [block(0), block(1), block(2), velocity, block(4)]
    before = {0: set(), 1: {0, 1}, 2: {0, 2}, 4: {3, 4}}
    plan = SimpleNamespace(blocks=blocks, rate_blocks_before=lambda each: before[each.number])
    assert derivative_depths(plan, range(5), {4: 1}) == {0: 3, 1: 3, 2: 0, 3: 1, 4: 1}
    assert derivative_depths(plan, range(3), {2: 2}) == {0: 2, 1: 0, 2: 2}


# --- least poses

NOTHING = np.zeros(0, dtype=np.intp)


def found_at(block, start, turns=(), held=(), origin=None, pull=None, wished=NOTHING, longest=0.3, scale=1.0):
    n = len(block.core)
    return least_pose(
        problem_at(block, scale=scale), np.asarray(start, dtype=np.float64), turns, held,
        np.zeros(n) if origin is None else np.asarray(origin, dtype=np.float64),
        np.zeros(n) if pull is None else pull, wished, longest,
    )  # fmt: skip


@BOTH
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e5])
def test_the_pose_that_moves_least_is_the_foot_on_a_sphere(size, large):
    x, y, z = unknowns(3)
    row = less(total(times(x, x), times(y, y), times(z, z)), 9.0 * size * size)
    block = free_block([row], range(3), np.eye(3), large=large)
    origin = size * (1.4 if large else 2.0) * np.array([1.0, 2.0, 2.0])
    found = found_at(block, size * np.array([3.0, 0.1, 0.1]), origin=origin, scale=size)
    assert found is not None
    assert found.settled
    np.testing.assert_allclose(found.x, size * np.array([1.0, 2.0, 2.0]), rtol=1e-6 if large else 1e-9)


@BOTH
def test_least_poses_on_a_plane_are_those_of_the_multipliers(large):
    rng = np.random.default_rng(4)
    root, rows, right = rng.normal(size=(4, 4)), rng.normal(size=(2, 4)), rng.normal(size=2)
    metric, origin, pull = root @ root.T + np.eye(4), rng.normal(size=4), rng.normal(size=4)
    some = unknowns(4)
    block = free_block([less(total(*(times(float(a), u) for a, u in zip(row, some, strict=True))), float(b))
                        for row, b in zip(rows, right, strict=True)], range(4), metric, large=large)  # fmt: skip
    whole = np.block([[metric, rows.T], [rows, np.zeros((2, 2))]])
    exact = np.linalg.solve(whole, np.concatenate([metric @ origin - pull, right]))[:4]
    begin = rng.normal(size=4)
    for scale in (1.0, np.array([1.0, 30.0, 0.1, 3.0])):  # the unknowns' sizes limit steps, and change nothing else
        found = found_at(block, begin, origin=origin, pull=pull, scale=scale)
        assert found is not None
        np.testing.assert_allclose(found.x, exact, atol=1e-6 if large else 1e-9)


def turn_in(place: int, frame: BodyFrame | None = None, before: complex = 1.0) -> Turn:
    cosine, sine = (_Coordinate(np.array([place + k]), np.ones(1), 0.0) for k in (0, 1))
    return Turn(cosine, sine, frame or BodyFrame(), (complex(before).real, complex(before).imag))


@pytest.mark.parametrize("degrees", [0.0, 100.0, -170.0])
@pytest.mark.parametrize("axis", [0.0, 35.0])
@pytest.mark.parametrize("before", [0.0, -60.0])
def test_a_turn_is_measured_from_the_pose_before(degrees, axis, before):
    way, start = (cmath.exp(1j * math.radians(d)) for d in (axis, before))
    turn = turn_in(0, BodyFrame(axis=(way.real, way.imag)), start)
    direction = cmath.exp(1j * math.radians(degrees + axis + before))
    x = np.array([direction.real, direction.imag])
    assert turn.angle(x) == pytest.approx(math.radians(degrees), abs=1e-12)
    assert math.remainder(turn.heading(x) - math.radians(degrees + axis + before), 2 * math.pi) == pytest.approx(
        0.0, abs=1e-12
    )
    places, slopes = turn.slope(x)
    for place, slope in zip(places, slopes, strict=True):
        step = np.zeros(2)
        step[place] = 1e-6
        assert slope == pytest.approx((turn.heading(x + step) - turn.heading(x - step)) / 2e-6, abs=1e-8)
    mapped = replace(turn, cosine=_Coordinate(np.array([1]), np.array([2.0]), 0.25))
    assert mapped.cosine.at(np.array([9.0, 3.0])) == 6.25


def bars(count: int, *rows, large: bool = False):
    """Directions (c, s) of unit length for ``count`` bars, tied by ``rows``."""
    some = unknowns(2 * count)
    units = [
        less(total(times(some[2 * k], some[2 * k]), times(some[2 * k + 1], some[2 * k + 1])), 1.0) for k in range(count)
    ]
    return free_block([*units, *rows], range(2 * count), np.eye(2 * count), large=large)


@BOTH
@pytest.mark.parametrize("height", [0.6, -1.2])
def test_bars_share_a_turn_evenly(height, large):
    """sin a + sin b = h with a² + b² least: both are asin(h / 2)."""
    some = unknowns(4)
    block = bars(2, less(total(some[1], some[3]), height), large=large)
    found = found_at(block, [1.0, 0.0, 1.0, 0.0], [turn_in(0), turn_in(2)])
    assert found is not None
    angle = math.asin(height / 2)
    np.testing.assert_allclose(found.x, [math.cos(angle), math.sin(angle)] * 2, atol=2e-3)


@BOTH
@pytest.mark.parametrize("angle", [0.3, -0.5])
def test_a_direction_that_is_held_leaves_the_turn_to_the_others(angle, large):
    some = unknowns(4)
    block = bars(2, less(total(some[1], some[3]), 0.4), large=large)
    found = found_at(block, [1.0, 0.0, 1.0, 0.0], [turn_in(2)], [(turn_in(0), angle)])
    assert found is not None
    other = math.asin(0.4 - math.sin(angle))
    exact = [math.cos(angle), math.sin(angle), math.cos(other), math.sin(other)]
    np.testing.assert_allclose(found.x, exact, atol=1e-6)


@BOTH
def test_wishes_come_before_the_least_motion(large):
    """On the circle of radius 2: a wish for x is met, on the side of the start."""
    x, y = unknowns(2)
    row = less(total(times(x, x), times(y, y)), 4.0)
    for wish, exact in ((1.0, [1.0, -math.sqrt(3.0)]), (-1.5, [-1.5, -math.sqrt(1.75)])):
        block = with_wish(free_block([row], (0, 1), np.eye(2), large=large), less(x, wish))
        found = found_at(block, [1.8, -0.9], origin=[1.8, -0.9], wished=np.array([0]))
        assert found is not None
        np.testing.assert_allclose(found.x, exact, atol=2e-3 if large else 1e-7)


@BOTH
def test_where_nothing_satisfies_the_equations_nothing_settles(large):
    x, y = unknowns(2)
    block = free_block([total(times(x, x), times(y, y), 1.0)], (0, 1), np.eye(2), large=large)
    with np.errstate(all="ignore"):
        found = found_at(block, [0.7, 0.2], origin=[0.7, 0.2])
    assert found is None or not found.settled
    assert found_at(free_block([less(x, 1.0)], (0, 1), np.eye(2), large=large), [np.nan, 0.0]) is None


def test_the_turns_of_a_block_begin_from_the_pose_carried_over():
    plan = plan_of("""
    .config(10); A : .bar P = [0, 0] Q = P + [30, 40]; B : .bar P = [30, 40] Q = P + [0, 20];
    @0 A.P = [0, 0]; B.P = A.Q; @1
    """)
    things = plan.system.scene.things
    before = tuple(BodyPose(0.0, 0.0, math.cos(a), math.sin(a), math.degrees(a)) for a in (0.4, -1.1))
    carry = replace(as_drawn(plan.system.scene), now=replace(as_drawn(plan.system.scene).now, things=before))
    seen = set()
    for block in plan.blocks:
        if not block.free:
            continue
        problem = BlockProblem(block, {}, [np.zeros(1)], scale_of(plan, block.core))
        x = np.array([carry.now.value(plan.system, n) for n in block.core])
        for turn in turns_of(plan, problem, {0, 1}, carry):
            assert turn.angle(x) == pytest.approx(0.0, abs=1e-12)
            seen.add(turn.before)
        assert turns_of(plan, problem, set(), carry) == []
    assert seen == {(pose.c, pose.s) for pose in before}
    assert len(things) == 2
