"""Grids, gaps, poles and ways along the inputs, of motions that are known."""

from __future__ import annotations

import math
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from movimentum.expressions import call, clock, symbol
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.continuation.grid import (
    FINEST,
    LARGEST_PHASE,
    LARGEST_TURN,
    Grid,
    end_of_upstream,
    first_nodes,
    intervals_to_split,
    splitting_times,
)
from movimentum.solver.continuation.runaways import INFINITY_DISTANCE, _brackets, _steady, _zeros, pole_ahead
from movimentum.solver.continuation.tracks import Gap, NodeTrack
from movimentum.solver.path.follow import follow_path, instant_piece
from movimentum.solver.start.input_continuation import _are_collinear, _InputPath, _nearest, _without_time
from movimentum.solver.start.search import select
from movimentum.tolerances import LOOK_AHEAD
from tests.solver.blocks import TIME, less, newton_block, problem_at, times, total, unknowns
from tests.solver.scenes import motion_of, plan_of, unknown

X, Y = unknowns(2)


# --- grids


@pytest.mark.parametrize(("begin", "end"), [(0.0, 1.0), (3.0, 3.001), (-5.0, 1e6)])
def test_first_nodes_are_at_odd_places(begin, end):
    tau = first_nodes(begin, end)
    assert (tau[0], tau[-1]) == (begin, end)
    steps = np.diff(tau) * 24 / (end - begin)
    assert ((steps > 0.5) & (steps < 1.5)).all()
    assert len(np.unique(np.round(steps[1:-1], 6))) > 20
    assert min((steps > 1.0).sum(), (steps < 1.0).sum()) >= 8  # to and fro


@settings(max_examples=40)
@given(st.lists(st.floats(0, 40), min_size=1, max_size=12), st.floats(0.1, 3.0))
def test_an_interval_is_split_as_often_as_its_change_needs(changes, limit):
    tau = np.concatenate([[0.0], np.cumsum(np.linspace(1.0, 2.0, len(changes)))])
    change = np.array(changes) * np.where(np.arange(len(changes)) % 2, -1.0, 1.0)
    split = intervals_to_split(tau, change, limit)
    assert split.tolist() == [abs(c) > limit for c in changes]
    more = splitting_times(tau, change, limit, split)
    for low, high, size, yes in zip(tau[:-1], tau[1:], changes, split, strict=True):
        inside = more[(more > low) & (more < high)]
        parts = len(inside) + 1
        assert parts == (min(max(math.ceil(size / limit), 2), 64) if yes else 1)
        np.testing.assert_allclose(np.diff([low, *inside, high]), (high - low) / parts)
    assert len(more) == sum(1 for m in more if m not in tau)
    tiny = np.array([0.0, FINEST / 2, 1.0])
    assert intervals_to_split(tiny, np.array([9.0, 9.0]), 1.0).tolist() == [False, True]


def followed(statements: str, end: float = 2.0, config: str = "10, 100, 100"):
    """A path of a script's only step from its start."""
    plan = plan_of(f".config({config}); Bar : .bar A = [0, 0] B = A + [100, 0];\n@0 {statements} @{end}")
    found = select(plan, Fraction(0), 0.0, LOOK_AHEAD, as_drawn(plan.system.scene), {})
    assert found.choices is not None
    piece, gaps = follow_path(plan, Fraction(0), 0.0, end, found.choices)
    return plan, piece, gaps


@pytest.mark.parametrize("speed", [100, 2000, -700])
def test_between_two_nodes_nothing_turns_far(speed):
    plan, piece, gaps = followed(f"Bar.A = [50*.cos({speed}*.t), 0]; Bar.B = [x, 80*.sin({speed}*.t)]; x > -400;")
    assert not gaps
    assert piece.resolved
    assert abs(speed) * np.diff(piece.nodes).max() <= LARGEST_PHASE * (1 + 1e-9)
    state, _ = piece.evaluate(piece.instants(piece.nodes))
    for each in plan.system.unknowns:
        if isinstance(each.payload, PoseCos | PoseSin):
            values = np.broadcast_to(state[each.number], len(piece.nodes))
            assert np.abs(np.diff(values)).max() <= LARGEST_TURN
    assert (piece.nodes[0], piece.nodes[-1]) == (0.0, 2.0)


def test_nodes_that_are_inserted_have_their_state():
    plan, piece, _ = followed("x*x = .t + 1; x > 0; y*y = x + 3; y > 0; z*z = y; z > 0; Bar.A = [z, y]; Bar.angle = 0;")
    grid = Grid(piece)
    for block in plan.blocks:
        grid.begin(block)
        state, _ = piece.evaluate(grid.instants)
        for n in block.unknowns:
            grid.state[n] = state[n]
        grid.has_state(block)
        grid.insert(np.array([0.123, 1.5, 0.7, 0.0]))
        grid.insert(np.array([0.124 + 0.01 * block.number]))
        assert all(np.size(grid.state[n]) in (1, len(grid.tau)) for n in block.unknowns)
    for name, exact in (("x", lambda t: np.sqrt(t + 1)), ("y", lambda t: np.sqrt(np.sqrt(t + 1) + 3))):
        n = unknown(plan, name)
        grid.begin(next(block for block in plan.blocks if n in block.inputs))
        np.testing.assert_allclose(grid.state[n], exact(grid.tau), rtol=1e-12)
    assert {0.123, 0.7, 1.5} <= set(grid.tau.tolist())
    assert (np.diff(grid.tau) > 0).all()


def test_a_block_ends_with_what_it_depends_on():
    path = SimpleNamespace(upstream=lambda number: (0, 2))
    gaps = [Gap(3.0, 4.0, 2), Gap(1.0, 2.0, 1), Gap(2.5, 9.0, 0)]
    assert end_of_upstream(path, SimpleNamespace(number=3), gaps) == 2.5
    assert end_of_upstream(path, SimpleNamespace(number=3), gaps[1:2]) == math.inf
    assert end_of_upstream(path, SimpleNamespace(number=3), []) == math.inf


# --- gaps and poles


@pytest.mark.parametrize(
    ("formula", "begin", "end"),
    [(".sqrt(1 - .t)", 1.0, 2.0), (".sqrt((.t - 0.5)*(.t - 1.25))", 0.5, 1.25),
     (".asin(.t)", 1.0, 2.0), (".ln(1.5 - .t)", 1.5, 2.0)],
)  # fmt: skip
def test_a_value_has_a_gap_where_its_formula_has_none(formula, begin, end):
    plan, _, gaps = followed(f"x = {formula}; Bar.A = [x, 0]; Bar.angle = 0;")
    gap = next(gap for gap in gaps if gap.block == plan.owner[unknown(plan, "x")])
    assert (gap.begin, gap.end) == pytest.approx((begin, end), abs=1e-9)
    assert gap.pole is None


@pytest.mark.parametrize("formula", [".sin(90*(.t - 1))/(.t - 1)", "(.t*.t - 1)/(.t - 1)", ".abs(.t - 1)/(.t + 1)"])
def test_a_removable_zero_of_a_divisor_is_no_gap(formula):
    _, _, gaps = followed(f"x = {formula}; Bar.A = [x, 0]; Bar.angle = 0;")
    assert gaps == []


@pytest.mark.parametrize("pole", [0.7, 1.0, 1.9])
@pytest.mark.parametrize("formula", ["1/(.t - {p})", "5/((.t - {p})*(.t - {p}))", ".tan(90*(.t - {p}) + 90)"])
def test_poles_of_formulas_are_found(pole, formula):
    plan, _, gaps = followed(f"x = {formula.format(p=pole)}; Bar.A = [x, 0]; Bar.angle = 0;")
    gap = next(gap for gap in gaps if gap.block == plan.owner[unknown(plan, "x")])
    assert gap.pole == pytest.approx(pole, abs=1e-9)
    assert gap.begin < pole < gap.end
    assert gap.end - gap.begin < 1e-3


@pytest.mark.parametrize("slope", [1.0, 1e-3])
def test_two_lines_that_become_parallel_meet_at_infinity(slope):
    """x + y = 1 and x + (2 - t) y = 1 + slope: y = slope / (1 - t)."""
    plan, _, gaps = followed(f"x + y = 1; x + (2 - .t)*y = 1 + {slope}; Bar.A = [x, y]; Bar.angle = 0;")
    gap = min(gaps, key=lambda gap: gap.begin)
    assert gap.pole == pytest.approx(1.0, abs=1e-9)
    reach = slope / (INFINITY_DISTANCE * plan.size)
    assert gap.end - gap.begin == pytest.approx(2 * reach, rel=0.5) or gap.end - gap.begin < 1e-9


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("pole", [0.8, 1.6])
def test_integrals_stop_at_poles_only(power, pole):
    """The integral of |t - p|^(-1/2) is finite, of (t - p)^-1 or -2 it is not."""
    term = f"(.t - {pole})"
    plan, _, gaps = followed(f"x = .i(1/({'*'.join([term] * power)})); Bar.A = [x, 0]; Bar.angle = 0;")
    assert min(gap.begin for gap in gaps) == pytest.approx(pole, abs=1e-6)
    plan, piece, gaps = followed(f"x = .i(1/.sqrt(.abs({term}))); Bar.A = [x, 0]; Bar.angle = 0;")
    assert not gaps
    state, _ = piece.evaluate(piece.instants(np.array([2.0])))
    exact = 2 * math.sqrt(pole) + 2 * math.sqrt(2 - pole)
    assert float(np.ravel(state[unknown(plan, "x")])[0]) == pytest.approx(exact, abs=1e-5)


@settings(max_examples=30)
@given(st.lists(st.floats(0.05, 1.95), min_size=1, max_size=3, unique=True), st.booleans())
def test_zeros_of_divisors_are_found_between_nodes(places, squares):
    places = sorted(places)
    assume(np.diff(places).min(initial=1.0) >= 0.2)
    tau = np.linspace(0.0, 2.0, 33) + 0.003 * np.sin(np.arange(33.0))
    tau[0], tau[-1] = 0.0, 2.0

    def value(t: np.ndarray) -> np.ndarray:
        return np.prod([np.asarray(t) - p for p in places], axis=0) ** (2 if squares else 1)

    found = sorted(place for place, _ in _zeros(lambda t: np.abs(value(t)), tau, value(tau)))
    assert found == pytest.approx(places, abs=1e-9)
    assert not list(_zeros(lambda t: np.abs(value(t)) + 1e-3, tau, np.abs(value(tau)) + 1e-3))


def test_brackets_are_about_changes_of_sign_and_minima():
    row = np.array([1.0, -1.0, -5.0, -0.1, -4.0, np.nan, 3.0, 2.9, 3.0])
    low, high = _brackets(row)
    assert sorted(zip(low.tolist(), high.tolist(), strict=True)) == [(0, 1), (2, 4)]
    assert _steady(np.array([1.0, 2.0, 4.0]))
    assert _steady(np.array([3.0, 2.0, -4.0]))
    assert not _steady(np.array([1.0, 1.0, 2.0]))
    assert not _steady(np.array([1.0, 3.0, 2.0]))


@pytest.mark.parametrize("pole", [1.0, 1.37])
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_the_pole_that_a_path_runs_to_is_told_from_its_last_nodes(pole, power):
    """x = (p - t)^-k: x / x' = (p - t) / k goes to zero evenly."""
    tau = pole - 10.0 ** -np.linspace(0.5, 9.0, 40)
    values = np.stack([(pole - tau) ** -power, np.ones(40)], axis=1)
    rates = np.stack([power * (pole - tau) ** (-power - 1.0), np.zeros(40)], axis=1)
    path = SimpleNamespace(end=2.0)
    block = newton_block([X, Y], (0, 1))
    gap = pole_ahead(path, block, NodeTrack(tau, values, rates, float(tau[-1])), np.ones(2))
    assert gap is not None
    assert gap.pole == pytest.approx(pole, abs=1e-7)
    assert gap.begin < pole < gap.end <= 2.0
    assert pole_ahead(path, block, NodeTrack(tau[:10], values[:10], rates[:10], float(tau[9])), np.ones(2)) is None
    assert (
        pole_ahead(SimpleNamespace(end=pole - 1e-3), block, NodeTrack(tau, values, rates, float(tau[-1])), np.ones(2))
        is None
    )


TRACK = """.config(10, 200, 100); Way : .curve A = [0, 0] .through([0, 0], [100, 0]) .open;
Pin : .bar A = [10, 0] B = A + [5, 0];
@0 Way.A = [0, 0]; Way.angle = 0; .on(Pin.A, Way) = 0; Pin.A.x = 40 + 50*.t; Pin.angle = 0; @2
"""


def test_a_point_leaves_an_open_curve_at_its_end():
    motion = motion_of(TRACK)
    (trouble,) = motion.segments[0].failures
    assert trouble.begin == pytest.approx(1.2, abs=1e-6)


def test_an_instant_is_a_piece_of_no_length():
    plan, _, _ = followed("x = .t*.t; Bar.A = [x, 0]; Bar.angle = 0;")
    found = select(plan, Fraction(0), 1.5, LOOK_AHEAD, as_drawn(plan.system.scene), {})
    one = instant_piece(plan, Fraction(0), 1.5, found.choices)
    assert (one.begin, one.end, one.nodes.tolist()) == (1.5, 1.5, [1.5])
    state, bad = one.evaluate(one.instants(np.array([1.5])))
    assert not bad.any()
    assert float(np.ravel(state[unknown(plan, "x")])[0]) == 2.25
    same, gaps = follow_path(plan, Fraction(0), 1.5, 1.5, found.choices)
    assert (same.begin, same.end, gaps) == (1.5, 1.5, [])


# --- led along the inputs

P = symbol(7)


def way_of(rows, core, begin, end, size: float = 1.0) -> _InputPath:
    block = newton_block(rows, core)
    assert isinstance(block, Newton)
    first, last = (np.atleast_2d(np.asarray(numbers, dtype=np.float64)) for numbers in (begin, end))
    return _InputPath(block, first, last, np.full(len(core), size))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_each_way_keeps_to_its_branch(size):
    """x² = p from 1 to 9 leads ±1 to ±3, from 1 to 0.01 to ±0.1; through zero there is none."""
    row = less(times(X, X), times(size * size, P))
    way = way_of([row], (0,), [1.0] * 6, [9.0, 9.0, 0.01, 0.01, -1.0, -4.0], size)
    found, arrived = way.followed(size * np.array([[1.0], [-1.0]] * 3))
    assert arrived.tolist() == [True] * 4 + [False] * 2
    np.testing.assert_allclose(found[:4, 0], size * np.array([3.0, -3.0, 0.1, -0.1]), rtol=1e-9)
    velocity, sign = way.rates(np.arange(2), np.array([0.5, 0.5]), size * np.sqrt([[5.0], [5.0]]) * [[1.0], [-1.0]])
    np.testing.assert_allclose(velocity[:, 0], size * np.array([4.0, -4.0]) / math.sqrt(5.0), rtol=1e-6)
    assert sign.tolist() == [1.0, -1.0]
    _, sign = way.rates(np.array([4]), np.array([0.5]), np.zeros((1, 1)))
    assert sign.tolist() == [0.0]


@pytest.mark.parametrize(("size", "other"), [(50.0, "+ y - .sqrt(.t + 1); y*y = .t + 1; y > 0")])
def test_a_path_that_ended_goes_on_in_its_own_branch(size, other):
    """x³ - 3 x = p has its upper root for p >= -2: after p was below, x is that root again, not the lower one."""
    w = f"(x/{size})"
    motion = motion_of(f""".config(10, 100, 100); Bar : .bar A = [0, 0] B = A + [100, 0];
    @0 {w}*{w}*{w} - 3*{w} = 3 - 6*.sin(90*.t) {other}; Bar.A = [x, 0]; Bar.angle = 0; @2""")
    (trouble,) = motion.segments[0].failures
    ends = [math.degrees(math.asin(5 / 6)) / 90, 2 - math.degrees(math.asin(5 / 6)) / 90]
    assert (trouble.begin, trouble.until) == pytest.approx(ends, abs=1e-6)
    times_ = [Fraction(k, 10) for k in (0, 3, 9, 16, 20)]
    poses = motion.poses_at(times_)
    assert poses.solved.tolist() == [True, True, False, True, True]
    for k in (0, 1, 3, 4):
        p = 3 - 6 * math.sin(math.pi / 2 * float(times_[k]))
        root = max(r.real for r in np.roots([1, 0, -3, -p]) if abs(r.imag) < 1e-9)
        assert poses.variables["x"][k] == pytest.approx(size * root, rel=1e-9)


def test_a_way_round_a_fold_is_not_jumped():
    """x³ - 3 x = p: on the upper branch from p = 0 no farther down than to -2."""
    way = way_of([less(less(times(X, X, X), times(3.0, X)), P)], (0,), [0.0] * 3, [-1.9, -2.001, 50.0])
    start = np.full((3, 1), math.sqrt(3.0))
    found, arrived = way.followed(start)
    assert arrived.tolist() == [True, False, True]
    for x, p in ((found[0, 0], -1.9), (found[2, 0], 50.0)):
        assert x**3 - 3 * x == pytest.approx(p, abs=1e-8)
        assert x > 1.0


def test_the_nearest_sound_pose_is_taken():
    drives = np.array([[0.1, 0.9, np.nan, 0.0, 0.5, 1.0]])  # three ends, three poses
    sound, poor = np.eye(2), np.array([[1.0, 1.0], [1.0, 1.0 + 1e-6]])
    jacobians = np.stack([sound, sound, sound])
    assert _nearest(drives, 3, jacobians, np.ones(2))[:2].tolist() == [0, 2]
    jacobians[0] = poor
    assert _nearest(drives, 3, jacobians, np.ones(2))[:2].tolist() == [1, 2]
    two = np.array([[0.0, 0.0, 10.0], [0.0, 1.0, 0.2]])  # each number in units of its range
    assert _nearest(two, 1, jacobians[1:], np.ones(2)).tolist() == [1]
    assert _nearest(two[:, [0, 2, 1]], 1, jacobians[1:], np.ones(2)).tolist() == [0]


@pytest.mark.parametrize(
    ("drives", "straight"),
    [([[0, 1, 2, 5]], True), ([[0, 1, 2], [0, 2, 4]], True), ([[0, 1, 2], [0, 2, 4.1]], False),
     ([[0, 1, 0], [0, 0, 1]], False),
     ([[0, 1, np.nan, 2], [0, 2, 7, 4]], True), ([[1e6, 1e6 + 1e-9, 1e6], [5, 5, 5]], True)],
)  # fmt: skip
def test_whether_drives_keep_to_a_line(drives, straight):
    assert _are_collinear(np.array(drives, dtype=np.float64)) is straight


def test_what_depends_on_time_alone_gets_a_name():
    atoms: dict = {}
    sine = call("sind", times(90.0, TIME))
    row = total(times(X, sine), times(TIME, TIME), times(Y, call("sind", X)), times(3.0, clock(Fraction(1))))
    (found,) = _without_time([row], atoms, 50)
    assert set(atoms) == {sine, TIME, clock(Fraction(1))}
    assert sorted(each.payload for each in atoms.values()) == [50, 51, 52]
    assert not found.timed
    problem = problem_at(
        newton_block([found], (0, 1)),
        0.0,
        {atoms[sine].payload: 0.5, atoms[TIME].payload: 3.0, atoms[clock(Fraction(1))].payload: 2.0},
    )
    value = problem.residual(np.array([[30.0, 4.0]]))[0, 0]
    assert value == pytest.approx(30 * 0.5 + 9.0 + 4 * 0.5 + 6.0)
