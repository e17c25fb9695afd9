"""Folds, kinks and singular poses of curves that are known: where paths end, go on and begin."""

from __future__ import annotations

import math

import numpy as np
import pytest

from movimentum.expressions import call, substitute
from movimentum.solver.block.block_at_instant import OutlinePlace
from movimentum.solver.continuation.singular_poses import (
    FARTHEST_ALONG,
    STEP_TO_KINK,
    SingularPose,
    _moved_to_next_piece,
    before_kink,
    displacement_between,
    fold_near,
    past_kink,
    path_end,
)
from movimentum.solver.continuation.steps import PathPoint
from movimentum.tolerances import LAST_JUMP_PAST_A_KINK
from tests.solver.blocks import TIME, less, local_of, newton_block, times, total, unknowns

# --- folds


def folding(drive, turn: float):
    """u² = drive and v = u³ in coordinates turned by an angle: u and v as the unknowns' sums."""
    x, y = unknowns(2)
    c, s = math.cos(turn), math.sin(turn)
    u, v = total(times(c, x), times(s, y)), total(times(-s, x), times(c, y))
    return newton_block([less(times(u, u), drive), less(v, times(u, u, u))], (0, 1)), np.array([[c, -s], [s, c]])


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
@pytest.mark.parametrize("size", [1.0, 100.0])
@pytest.mark.parametrize(("drive", "end"), [(less(1.0, TIME), 1.0), (less(4.0, times(TIME, TIME)), 2.0)])
def test_a_fold_is_found_to_the_last_digits(drive, end, turn, size):
    block, matrix = folding(drive, turn)
    local = local_of(block, low=0.0, high=2.5, scale=size)
    for back in (1e-6, 3e-7):
        tau = end - back
        u = math.sqrt((end - tau) * (1.0 if end == 1.0 else end + tau))
        x = matrix @ np.array([u, u**3])
        found = fold_near(local, tau, x, np.full(2, size), 2.5)
        assert found == pytest.approx(end, abs=2e-14)
        assert path_end(local, tau, x, np.full(2, size), 2.5) == pytest.approx(end, abs=2e-14)
    far = matrix @ np.array([math.sqrt(0.01), 0.001])
    assert fold_near(local, end - 0.01 / (1.0 if end == 1.0 else 4.0), far, np.full(2, size), 2.5) is None


def test_a_path_without_a_fold_ends_where_its_formula_does():
    (x,) = unknowns(1)
    local = local_of(newton_block([less(x, call("sqrt", less(1.0, TIME)))], (0,)), low=0.0, high=2.0)
    tau = 1.0 - 1e-7
    with np.errstate(all="ignore"):
        assert fold_near(local, tau, np.array([math.sqrt(1e-7)]), np.ones(1), 2.0) is None
        assert path_end(local, tau, np.array([math.sqrt(1e-7)]), np.ones(1), 2.0) == pytest.approx(1.0, abs=1e-12)


def test_a_rectangle_of_too_few_rows_has_no_fold():
    (x,) = unknowns(1)
    local = local_of(newton_block([less(x, TIME)], (0, 1)))
    assert fold_near(local, 0.0, np.zeros(2), np.ones(2), 1.0) is None
    assert SingularPose.at(local, 0.0, np.zeros(2), np.ones(2)) is None


# --- kinks


@pytest.mark.parametrize("bend", [0.5, -0.8, 0.99])
@pytest.mark.parametrize("total_time", [1.0, 10.0])
def test_a_path_goes_on_beyond_a_kink_on_the_known_curve(bend, total_time):
    """x + bend |x - 1| = t: slopes 1 - bend and 1 + bend, both of one sign."""
    (x,) = unknowns(1)
    local = local_of(
        newton_block([less(total(x, times(bend, call("abs", less(x, 1.0)))), TIME)], (0,)),
        low=0.0,
        high=2.0,
        delta=1e-9,
    )
    tau = 1.0 - 1e-12
    here = PathPoint(tau, np.array([1.0 - 1e-12 / (1 - bend)]), np.array([1.0 / (1 - bend)]), np.zeros(1))
    landing = past_kink(local, here, total_time, np.ones(1), 1.0)
    assert landing is not None
    assert 0.0 < landing.tau - tau <= LAST_JUMP_PAST_A_KINK * total_time
    assert landing.x[0] == pytest.approx(1.0 + (landing.tau - 1.0) / (1 + bend), abs=1e-12)
    assert landing.v[0] == pytest.approx(1.0 / (1 + bend), rel=1e-5)
    assert past_kink(local, here, total_time, np.ones(1), 0.0) is None
    assert past_kink(local, here, total_time, np.ones(1), -1.0) is None


def test_a_path_that_turns_back_at_a_kink_does_not_go_on():
    """x + 2 |x| = 1 - t: both branches end at t = 1."""
    (x,) = unknowns(1)
    row = less(total(x, times(2.0, call("abs", x))), less(1.0, TIME))
    local = local_of(newton_block([row], (0,)), low=0.0, high=2.0, delta=1e-9)
    for slope, side in ((1 / 3, 1.0), (-1.0, -1.0)):
        tau = 1.0 - 1e-12
        here = PathPoint(tau, np.array([slope * 1e-12]), np.array([-slope]), np.zeros(1))
        assert past_kink(local, here, 2.0, np.ones(1), side) is None


def test_a_step_ends_just_before_the_end_of_a_piece():
    (x,) = unknowns(1)
    local = local_of(newton_block([less(x, TIME)], (0,)), places=(OutlinePlace(0, (0.0, 1.0, 3.0), 0.0),))
    here = PathPoint(0.4, np.array([0.4]), np.array([2.0]), np.zeros(1))
    assert before_kink(local, here, 1.0) == pytest.approx(STEP_TO_KINK * 0.3)
    assert before_kink(local, here, 0.25) == 0.125
    assert 0.0 < 1.0 - STEP_TO_KINK < 0.01
    assert before_kink(local_of(newton_block([less(x, TIME)], (0,))), here, 1.0) == 0.5


def test_places_are_handed_over_in_every_combination():
    places = [OutlinePlace(0, (0.0, 1.0, 3.0), 0.0), OutlinePlace(2, (0.0, 2.0), 2.0)]
    x = np.array([0.4, 7.0, 1.0])
    found = _moved_to_next_piece(places, x)
    ways = [len(place.beside(float(x[place.index]))) + 1 for place in places]
    assert len(found) == ways[0] * ways[1] - 1
    assert len({tuple(each) for each in found}) == len(found)
    assert all(each[1] == 7.0 for each in found)
    assert not any(np.array_equal(each, x) for each in found)
    assert x.tolist() == [0.4, 7.0, 1.0]


# --- singular poses

X, Y = unknowns(2)


@pytest.mark.parametrize(
    ("row", "branches"),
    [(less(times(X, X), TIME), lambda t: [-math.sqrt(t), math.sqrt(t)]),
     (less(times(X, X), times(TIME, TIME)), lambda t: [-t, t]),
     (less(times(X, X, X), times(TIME, X)), lambda t: [-math.sqrt(t), 0.0, math.sqrt(t)]),
     (less(times(X, X, X), TIME), lambda t: [t ** (1 / 3)]), (total(times(X, X), TIME), lambda t: [])],
)  # fmt: skip
@pytest.mark.parametrize("tau", [1e-4, 1e-3])
@pytest.mark.parametrize(("size", "begin"), [(1.0, 0.0), (50.0, 0.0), (1.0, 2.5)])
def test_all_paths_from_a_singular_pose_are_found(row, branches, tau, size, begin):
    """A normal form in x, with y = x² + t beside it: turned, so that neither is an unknown of its own."""
    u, v = total(times(0.6, X), times(0.8, Y)), total(times(-0.8, X), times(0.6, Y))
    since = less(TIME, begin)
    bent = substitute(row, lambda node: {X: u, TIME: since}.get(node))
    block = newton_block([bent, less(v, total(times(u, u), since))], (0, 1))
    scale = np.full(2, size)
    pose = SingularPose.at(local_of(block, low=begin, high=begin + 1.0, scale=size), begin, np.zeros(2), scale)
    assert pose is not None
    assert abs(pose.right @ [0.6, 0.8]) == pytest.approx(1.0)
    found, certain = pose.later(begin + tau)
    exact = branches(tau)
    assert certain is (not exact)
    assert sorted(float(0.6 * x[0] + 0.8 * x[1]) for x in found) == pytest.approx(exact, abs=1e-8)
    for x in found:
        assert -0.8 * x[0] + 0.6 * x[1] == pytest.approx((0.6 * x[0] + 0.8 * x[1]) ** 2 + tau, abs=1e-8)
        assert pose.begins(begin + tau, x)


def test_a_path_that_passes_near_a_singular_pose_does_not_begin_there():
    row = times(less(X, 0.1), less(times(X, X), TIME))
    pose = SingularPose.at(local_of(newton_block([row], (0,)), low=0.0, high=1.0), 0.0, np.zeros(1), np.ones(1))
    assert pose is not None
    found, certain = pose.later(1e-4)
    assert not certain
    assert sorted(float(x[0]) for x in found) == pytest.approx([-0.01, 0.01, 0.1], abs=1e-9)
    assert [pose.begins(1e-4, np.array([x])) for x in (-0.01, 0.01, 0.1)] == [True, True, False]
    far = SingularPose.at(
        local_of(newton_block([times(X, X, less(X, 2 * FARTHEST_ALONG))], (0,))), 0.0, np.zeros(1), np.ones(1)
    )
    assert far is not None
    assert all(abs(x[0]) < FARTHEST_ALONG for x in far.later(1e-4)[0])


def test_where_two_ranks_are_lost_nothing_is_said():
    block = newton_block([less(times(X, X), TIME), less(times(Y, Y), TIME)], (0, 1))
    assert SingularPose.at(local_of(block), 0.0, np.zeros(2), np.ones(2)) is None


def test_displacements_are_in_units_of_the_unknowns_sizes():
    local = local_of(newton_block([less(X, TIME), less(Y, TIME)], (0, 1)))
    moved = displacement_between(local, 0.0, np.array([1.0, 2.0]), 1.0, np.array([4.0, 0.0]))
    assert moved.tolist() == [3.0, -2.0]
    local.sizes = np.array([2.0, 10.0])
    assert displacement_between(local, 0.0, np.array([1.0, 2.0]), 1.0, np.array([4.0, 0.0])).tolist() == [1.5, -0.2]
