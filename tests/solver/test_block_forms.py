"""Closed forms and single instants of blocks: systems with known solutions, known slopes, known ends."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import permutations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.expressions import add, call, clock, const, evaluate_op, mul, symbol, walk
from movimentum.planning.blocks.kinds import Assign, Linear, Quadratic
from movimentum.planning.blocks.velocities import BlockRows
from movimentum.records import replace
from movimentum.scene.leaves import Bearing, ContactPlace
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.block import closed_form
from movimentum.solver.block.block_at_instant import OutlinePlace
from movimentum.solver.block.curve_ends import inside_of_ends, is_past_end, open_places_of
from movimentum.solver.block.formulas import UnknownFormulas
from movimentum.solver.block.full_turns import _lattice, keeps_cord_turns, without_full_turns
from movimentum.solver.block.rates import SeriesMoment, _Solver, differentiated
from movimentum.tolerances import PAST_AN_END
from tests.solver.blocks import TIME, less, local_of, newton_block, problem_at, times, total, unknowns
from tests.solver.scenes import motion_of, plan_of, unknown

# --- linear blocks


def exact_determinant(rows: list[list[int]]) -> int:
    """By Leibniz' formula, in whole numbers."""
    result = 0
    for order in permutations(range(len(rows))):
        swaps = sum(order[i] > order[j] for i in range(len(rows)) for j in range(i + 1, len(rows)))
        result += (-1) ** swaps * math.prod(rows[i][order[i]] for i in range(len(rows)))
    return result


def linear_block(count: int, values) -> Linear:
    """A linear block in unknowns 0, 1, … whose matrix and right-hand sides are ``values``."""
    return Linear(
        number=0, unknowns=tuple(range(count)), equations=tuple(range(count)), core=tuple(range(count)),
        inputs=frozenset(), moving=True, system=lambda u, k: tuple(values), entries=(),
    )  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_linear_blocks_are_solved_as_cramer_says(count):
    rng = np.random.default_rng(count)
    matrices = rng.integers(-9, 10, size=(7, count, count))
    right = rng.integers(-9, 10, size=(7, count))
    whole = np.concatenate([matrices.reshape(7, -1), right], axis=1).astype(np.float64)
    columns: list = list(whole.T)
    columns[0], matrices[:, 0, 0] = np.float64(5.0), 5  # one is the same at all instants
    block = linear_block(count, columns)
    found, size = closed_form.linear(block, [None] * count, ()), closed_form.determinant(block, [None] * count, ())
    size = np.broadcast_to(size, 7)
    for f in range(7):
        rows, sides = matrices[f].tolist(), right[f].tolist()
        determinant = exact_determinant(rows)
        assert size[f] == pytest.approx(determinant, abs=1e-9)
        for j in range(count):
            replaced = [[*row[:j], side, *row[j + 1 :]] for row, side in zip(rows, sides, strict=True)]
            if determinant:
                exact = Fraction(exact_determinant(replaced), determinant)
                assert np.broadcast_to(found[j], 7)[f] == pytest.approx(float(exact), rel=1e-11, abs=1e-12)


def test_a_linear_block_that_is_the_same_at_all_instants():
    block = linear_block(2, [np.float64(v) for v in (1, 2, 3, 4, 5, 6)])
    assert [float(v) for v in closed_form.linear(block, [None, None], ())] == pytest.approx([-4.0, 4.5])
    assert float(closed_form.determinant(block, [None, None], ())) == pytest.approx(-2.0)


def test_a_singular_matrix_spoils_no_other_instant():
    two = [np.array([1.0, 2.0]), np.array([1.0, 0.0]), np.array([1.0, 0.0]), np.array([1.0, 4.0]), 6.0, 8.0]
    x, y = closed_form.linear(linear_block(2, two), [None, None], ())
    assert np.isnan([x[0], y[0]]).all()
    assert [x[1], y[1]] == [3.0, 2.0]


def test_eliminated_unknowns_divide_as_arrays_do():
    block = Assign(
        number=0, unknowns=(0, 1), equations=(0, 1), core=(), targets=(0, 1), inputs=frozenset(), moving=True,
        explicit=lambda u, k: (2.0, np.array([3.0, 4.0])),
    )  # fmt: skip
    state: list = [None, None]
    closed_form.fill_explicit(block, state, ())
    with np.errstate(all="ignore"):
        assert state[0] / np.float64(0.0) == np.inf
        assert (1.0 / (state[0] - 2.0)) == np.inf  # of Python's floats this raises
    assert state[1].tolist() == [3.0, 4.0]


TRIANGLE = """.config(10);
Crank : .bar A = [0, 0] B = A + [{a}, 0];   Rod : .bar P = [0, 0] Q = P + [{b}, 0];
@0  Crank.A = [0, 0]; Crank.angle = 10 + 30*.t;   Rod.P = Crank.B;   Rod.Q = [x, 0];   {side}  @1
"""


@pytest.mark.parametrize(("a", "b"), [(40, 100), (0.04, 0.1), (4e4, 1e5), (30, 31)])
@pytest.mark.parametrize("sign", [1, -1])
def test_both_roots_of_a_slider_crank(a, b, sign):
    """x = a cos t ± sqrt(b² - a² sin² t): the two branches of one block, and the margin is that root's sign."""
    motion = motion_of(TRIANGLE.format(a=a, b=b, side="x > 0;"))
    (piece,) = motion.segments[0].pieces
    number = unknown(piece.plan, "x")
    block = next(block for block in piece.plan.blocks if isinstance(block, Quadratic))
    instants = piece.instants(np.linspace(0.0, 1.0, 5))
    state, _ = piece.evaluate(instants, piece.upstream(block.number))
    found = []
    for each in (sign, -sign):
        margin = closed_form.set_branch(block, state, instants.clocks, float(each))
        for after in piece.plan.blocks[block.number :]:
            closed_form.fill_explicit(after, state, instants.clocks)
        found.append(state[number])
        assert np.array_equal(closed_form.solve_branch(block, state, instants.clocks, float(-each))[0], margin)
        assert np.array_equal(closed_form.margin(block, state, instants.clocks), margin)
        assert (margin > 0.0).all()
    angle = np.radians(10.0 + 30.0 * instants.tau)
    root = np.sqrt(b * b - np.square(a * np.sin(angle)))
    exact = [a * np.cos(angle) - root, a * np.cos(angle) + root]
    np.testing.assert_allclose(np.sort(found, axis=0), exact, rtol=1e-12)


# --- series in time


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_implicit_derivatives_are_those_of_the_known_curve(size):
    """x = size e^t cos(t), y = size e^t sin(t), found from x² + y² = size² e^2t and y cos = x sin."""
    x, y = unknowns(2)
    degrees = times(180.0 / math.pi, TIME)
    rows = [
        less(total(times(x, x), times(y, y)), times(size * size, call("exp", times(2.0, TIME)))),
        less(times(y, call("cosd", degrees)), times(x, call("sind", degrees))),
    ]
    block = newton_block(rows, (0, 1))
    tau = np.array([0.0, 0.3, 1.1])
    plan = plan_of(TRIANGLE.format(a=1, b=3, side="x > 0;"))
    curves = [lambda t: size * mpmath.exp(t) * mpmath.cos(t), lambda t: size * mpmath.exp(t) * mpmath.sin(t)]
    values: list = [(np.array([float(f(t)) for t in tau]),) for f in curves]
    moment = SeriesMoment(plan, at_offsets(plan.clocks, Fraction(0), tau), values, ahead=True)
    nodes = list(walk(*rows))
    stated = BlockRows(
        unknowns=(0, 1), residuals=tuple(rows), nodes=nodes, slopes=block.slopes, slope_nodes=list(walk(*block.slopes)),
        entries=block.entries,
    )  # fmt: skip
    condition = differentiated(stated, moment, 5)
    assert ((condition > 1e-3) & (condition <= 1.0)).all()
    for curve, series in zip(curves, values, strict=True):
        for f, t in enumerate(tau):
            exact = [float(c) for c in mpmath.taylor(curve, t, 5)]
            np.testing.assert_allclose([c[f] for c in series], exact, rtol=1e-10, atol=1e-10 * size)


@pytest.mark.parametrize("shape", [(3, 3), (5, 3), (1, 1)])
def test_systems_whose_rows_and_unknowns_have_any_size_are_solved(shape):
    rng = np.random.default_rng(shape[0])
    m, n = shape
    base = rng.normal(size=(6, m, n)) + 2.0 * np.eye(m, n)
    rows, columns = 10.0 ** rng.uniform(-6, 6, (6, m)), 10.0 ** rng.uniform(-6, 6, (6, n))
    matrix = base * rows[:, :, None] * columns[:, None, :]
    x = rng.normal(size=(6, n))
    solver = _Solver(matrix)
    found = solver.solve(np.einsum("fmn,fn->fm", matrix, x / columns))
    np.testing.assert_allclose(found * columns, x, rtol=1e-9, atol=1e-10)
    assert (solver.condition > 1e-4).all()
    assert (solver.condition <= 1.0 + 1e-12).all()


@pytest.mark.parametrize("kappa", [1.0, 1e3, 1e6])
def test_condition_numbers_are_of_the_right_size(kappa):
    """Rows (1, c) and (c, 1) are balanced; their singular values are 1 ± c, so the squares' sum tells |A| |A^-1|."""
    c = (kappa - 1.0) / (kappa + 1.0)
    rows = 1e5 * np.array([[1.0, c], [c, 1.0]])
    assert float(_Solver(rows[None]).condition[0]) == pytest.approx(2.0 * kappa / (kappa**2 + 1.0), rel=1e-9)
    assert float(_Solver(np.concatenate([rows, rows])[None]).condition[0]) == pytest.approx(1.0 / kappa, rel=1e-9)


def test_singular_and_infinite_systems_are_told_apart_and_spoil_nothing():
    matrix = np.array([[[1.0, 2.0], [2.0, 4.0]], [[np.inf, 0.0], [0.0, 1.0]], [[0.0, 2.0], [4.0, 0.0]]])
    solver = _Solver(matrix)
    assert solver.condition[0] < 1e-15
    assert np.isnan(solver.condition[1])
    assert solver.condition[2] == pytest.approx(1.0)
    assert solver.solve(np.array([[0.0, 0.0], [0.0, 0.0], [6.0, 8.0]]))[2] == pytest.approx([2.0, 3.0])
    tall = _Solver(np.array([[[1.0, 1.0], [1.0, 1.0], [2.0, 2.0]]]))  # x + y = 1 three times: the shortest solution
    assert tall.solve(np.array([[1.0, 1.0, 2.0]]))[0] == pytest.approx([0.5, 0.5])
    assert tall.condition[0] < 1e-15


def test_a_moment_reads_clocks_that_a_plan_does_not_have():
    plan = plan_of(TRIANGLE.format(a=1, b=3, side="x > 0;"))
    moment = SeriesMoment(plan, at_offsets(plan.clocks, Fraction(0), np.array([0.25, 2.0])), [None], ahead=True)
    for start in (*plan.clocks, Fraction(-3, 2), Fraction(1, 8)):
        first, slope = moment.clock(clock(start))
        assert first.tolist() == [0.25 - float(start), 2.0 - float(start)]
        assert slope == 1.0
    assert moment.of(None) is None


# --- formulas of time


@pytest.mark.parametrize(
    ("statements", "exact"),
    [("x = 3 + 2*.t*.t;", lambda t: 3 + 2 * t * t), ("2*x = 5 - y; y = 3*.t;", lambda t: (5 - 3 * t) / 2),
     ("x = .i(y); y = 4*.t;", lambda t: 2 * t * t + 7),
     ("x = .i(y); y = .i(z); z = 6;", lambda t: 3 * t * t + 7 + 7 * t),
     ("-4*x = y + 1; y = 2*z; z = .sin(90*.t);", lambda t: -(2 * math.sin(math.pi * t / 2) + 1) / 4)],
)  # fmt: skip
def test_unknowns_that_are_formulas_of_time(statements, exact):
    """``x`` as the hand computes it; every integral has come to 7 when the segment begins."""
    plan = plan_of(
        f".config(10); Bar : .bar A = [0, 0] B = A + [9, 0]; @0 Bar.A = [0, 0]; Bar.angle = x; {statements} @2"
    )
    formulas = UnknownFormulas(plan, Fraction(0), lambda n: const(7.0))
    x = unknown(plan, "x")
    found = formulas.of_time(add(mul(const(2.0), symbol(x)), const(1.0)))
    assert found is not None
    for t in (0.0, 0.5, 1.7):
        values: dict = {}
        for node in walk(found):
            values[node] = (
                node.value if node.value is not None else t - float(node.start) if node.op == "clock"
                else evaluate_op(node.op, node.payload, [values[a] for a in node.args])
            )  # fmt: skip
        assert values[found] == pytest.approx(2 * exact(t) + 1, rel=1e-13)


def test_what_is_solved_for_with_others_is_no_formula_of_time():
    plan = plan_of(TRIANGLE.format(a=1, b=3, side="x > 0;"))
    formulas = UnknownFormulas(plan, Fraction(0), lambda n: const(7.0))
    x = unknown(plan, "x")
    assert formulas.of_time(symbol(x)) is None
    assert formulas.of_time(TIME) == TIME


# --- full turns


@settings(max_examples=40)
@given(st.lists(st.lists(st.integers(-4, 4), min_size=3, max_size=3), min_size=0, max_size=3))
def test_a_lattice_holds_all_whole_turns_that_change_nothing(rows):
    """Of every kernel vector of a whole-number matrix: its basis has that many vectors, and all are in the kernel."""
    changes = 360.0 * np.array(rows, dtype=np.float64).reshape(-1, 3)
    rank = np.linalg.matrix_rank(changes) if len(rows) else 0
    basis = _lattice(changes)
    assert len(basis) == 3 - rank
    if len(basis):
        assert np.linalg.matrix_rank(basis) == len(basis)
        assert np.abs(changes @ basis.T).max(initial=0.0) <= 1e-9
        assert np.array_equal(basis, np.rint(basis))
        assert all(math.gcd(*map(int, vector)) == 1 for vector in basis)  # none is twice another


ANGLES = """.config(10); .let n = 0;
A : .bar P = [0, 0] Q = P + [10, 0];  B : .bar P = [0, 0] Q = P + [10, 0];
@0 A.P = [0, 0]; B.P = [0, 0]; A.angle = 20; B.angle = {b}; @1
"""


@pytest.mark.parametrize("turns", [-7, -1, 0, 1, 3])
def test_an_angle_alone_is_turned_back_to_near_zero(turns):
    """sin a = 1/2, cos a = sqrt(3)/2: of 30 + 360 k the nearest to 0; with an equation for a itself, none other."""
    plan = plan_of(ANGLES.format(b=30))
    carry, number = as_drawn(plan.system.scene), unknown(plan, "A.angle")
    angle = symbol(number)
    loose = newton_block([less(call("sind", angle), 0.5), less(call("cosd", angle), math.sqrt(0.75))], (number,))
    given = np.array([30.0 + 360.0 * turns])
    first, *rest = without_full_turns(plan, problem_at(loose, scale=57.3), [given], carry)
    assert first == pytest.approx([30.0], abs=1e-9)
    assert [other.tolist() for other in rest] == ([given.tolist()] if turns else [])
    tied = newton_block([less(angle, float(given[0]))], (number,))
    assert [x.tolist() for x in without_full_turns(plan, problem_at(tied, scale=57.3), [given], carry)] == [
        given.tolist()
    ]


def test_a_new_angle_is_nearest_to_nothing_a_known_one_to_what_it_was():
    plan = plan_of(ANGLES.format(b=30))
    carry, n = as_drawn(plan.system.scene), unknown(plan, "A.angle")
    block = newton_block([call("sind", less(symbol(n), 180.4)), less(call("cosd", less(symbol(n), 180.4)), 1.0)], (n,))
    assert without_full_turns(plan, problem_at(block, scale=57.3), [np.array([180.4])], carry)[0] == pytest.approx(
        [-179.6]
    )
    turned = (replace(carry.now.things[0], angle=700.0), carry.now.things[1])
    known = replace(carry, now=replace(carry.now, things=turned, known=frozenset({0})))
    assert without_full_turns(plan, problem_at(block, scale=57.3), [np.array([180.4])], known)[0] == pytest.approx(
        [540.4]
    )


@pytest.mark.parametrize(("ratio", "turns"), [(1, (2, 2)), (2, (2, 4)), (1, (2, 3)), (3, (-1, -3))])
def test_angles_that_are_tied_turn_together(ratio, turns):
    """b = ratio a and the direction of a: (0, 0) turns are the nearest; a tie that is broken already stays so."""
    plan = plan_of(ANGLES.format(b=30))
    carry, one, two = as_drawn(plan.system.scene), unknown(plan, "A.angle"), unknown(plan, "B.angle")
    a, b = symbol(one), symbol(two)
    rows = [less(call("sind", a), 0.5), less(call("cosd", a), math.sqrt(0.75)),
            less(b, total(times(ratio, a), 360.0 * (turns[1] - ratio * turns[0])))]  # fmt: skip
    start = np.array([30.0 + 360.0 * turns[0], ratio * 30.0 + 360.0 * turns[1]])
    found = without_full_turns(plan, problem_at(newton_block(rows, (one, two)), scale=57.3), [start], carry)[0]
    kept = turns[1] - ratio * turns[0]
    assert (found[1] - ratio * found[0]) / 360.0 == pytest.approx(kept, abs=1e-9)
    best = min(((30.0 + 360.0 * k) ** 2 + (ratio * 30.0 + 360.0 * (kept + ratio * k)) ** 2, k) for k in range(-9, 10))
    assert found[0] == pytest.approx(30.0 + 360.0 * best[1], abs=1e-9)


CORD = """.config(10); W : .disc(20) C = [100, 50]; Bob : .bar A = [120, 0] B = A + [0, -9];
@0 W.C = [100, 50]; Bob.A = [120, 0 - 10*.t]; Bob.angle = 0; .cord([40, 90], W, Bob.A) = l; @1
"""


def test_a_cord_goes_round_a_wheel_by_less_than_a_turn_to_begin_with():
    plan = plan_of(CORD)
    carry = as_drawn(plan.system.scene)
    cords = [u.number for u in plan.system.unknowns if isinstance(u.payload, Bearing) and u.payload.of_cord]
    assert cords
    for n in cords:
        drawn = plan.system.unknowns[n].payload.drawn
        block = newton_block([less(symbol(n), drawn)], (n,))
        for turned, same in ((0.0, True), (179.0, True), (-179.0, True), (181.0, False), (-360.0, False)):
            assert keeps_cord_turns(plan, problem_at(block, scale=57.3), np.array([drawn + turned]), carry) is same


# --- one instant of a path


@settings(max_examples=40)
@given(
    st.lists(st.floats(0.1, 3.0), min_size=1, max_size=4), st.floats(-20, 20),
    st.floats(-3, 3).filter(lambda v: abs(v) > 0.01),
    st.booleans(),
)  # fmt: skip
def test_the_time_until_a_place_comes_to_the_end_of_its_piece(widths, place, speed, closed):
    breaks = tuple(np.cumsum([0.5, *widths]).tolist())
    period = breaks[-1] - breaks[0] if closed else 0.0
    on = OutlinePlace(1, breaks, period)
    found = on.until_break(np.array([99.0, place]), np.array([99.0, speed]))
    every = [b + k * period for b in breaks for k in (range(-400, 401) if closed else (0,))]
    times_ = [(b - place) / speed for b in every if (b - place) / speed > 0.0]
    expected = min(times_, default=math.inf)
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9) or found == pytest.approx(
        min((t for t in times_ if t > 1e-9), default=math.inf), rel=1e-6, abs=1e-9
    )
    assert on.until_break(np.array([0.0, place]), np.zeros(2)) == math.inf


def test_places_beside_are_the_middles_of_the_pieces_and_a_little_beyond():
    inner = OutlinePlace(0, (0.0, 1.0, 3.0), 0.0)
    near = 1e-3  # `BESIDE_AN_END` of the outline, or less
    ahead, behind = sorted(inner.beside(0.4), reverse=True)
    assert 1.0 < ahead <= 1.0 + 3.0 * near
    assert -3.0 * near <= behind < 0.0
    found = sorted(inner.beside(1.0))
    assert found[1:3] == pytest.approx([0.5, 2.0])
    assert 3.0 < found[3] <= 3.0 + 3.0 * near
    assert -3.0 * near <= found[0] < 0.0
    ring = OutlinePlace(0, (0.0, 1.0, 3.0), 3.0)
    for turns in (-2, 0, 5):
        found = sorted(each - 3.0 * turns for each in ring.beside(3.0 * turns + 3.0))
        assert found[1:3] == pytest.approx([2.0, 3.5], abs=1e-9)


@pytest.mark.parametrize("t", [0.2, 1.0, 2.5])
def test_velocities_of_a_point_on_a_moving_circle(t):
    """x = t + cos t, y = sin t: x - t = cos t, (x - t)² + y² = 1. The slopes are known; so is the determinant."""
    x, y = unknowns(2)
    away = less(x, TIME)
    rows = [less(away, call("cosd", times(180.0 / math.pi, TIME))), less(total(times(away, away), times(y, y)), 1.0)]
    local = local_of(newton_block(rows, (0, 1)))
    here = np.array([t + math.cos(t), math.sin(t)])
    v, smallest = local.rate(t, here, np.ones(2))
    np.testing.assert_allclose(v, [1.0 - math.sin(t), math.cos(t)], rtol=1e-8, atol=1e-8)
    unit = np.array([[1.0, 0.0], [math.cos(t), math.sin(t)]])
    singular = np.linalg.svd(unit, compute_uv=False)
    assert smallest == pytest.approx(singular[1] / singular[0], rel=1e-9)
    assert local.orientation(t, here, np.ones(2)) == np.sign(math.sin(t))
    mirrored = here * [1.0, -1.0]
    assert local.orientation(t, mirrored, np.ones(2)) == -np.sign(math.sin(t))
    assert local.orientation(t, np.array([t + 1.0, 0.0]), np.ones(2)) == 0.0
    found, good = local.corrected(t, here + np.array([0.01, -0.02]))
    assert good
    np.testing.assert_allclose(found, here, atol=1e-12)
    _, good = local_of(newton_block([total(times(x, x), 1.0), y], (0, 1))).corrected(t, here)
    assert not good


@pytest.mark.parametrize(
    ("tau", "ends"), [(5.0, (4.9, 5.1)), (0.0, (0.0, 0.1)), (10.0, (9.9, 10.0)), (10.05, (9.95, 10.05))]
)
def test_instants_around_stay_on_the_path(tau, ends):
    (x,) = unknowns(1)
    local = local_of(newton_block([less(x, TIME)], (0,)), delta=0.1, low=0.0, high=10.0)
    problem, span = local.problem_around(tau)
    here, later, earlier = problem.clocks[0].tolist()
    assert (here, earlier, later) == pytest.approx((tau, *ends), abs=1e-12)
    assert span == pytest.approx(later - earlier)
    many, spans = local.prepare(np.array([tau, 3.0]))
    assert many.clocks[0].tolist() == pytest.approx([tau, 3.0, later, 3.1, earlier, 2.9])
    again, span = local.problem_around(3.0)
    assert again.clocks[0].tolist() == pytest.approx([3.0, 3.1, 2.9])
    assert span == spans[1]
    assert local.at(3.0).clocks[0].tolist() == [3.0]


def test_no_interval_is_too_short_for_a_difference():
    (x,) = unknowns(1)
    local = local_of(newton_block([less(x, times(3.0, TIME))], (0,)), delta=0.1, low=5.0, high=5.01)
    v, _ = local.rate(5.0, np.array([15.0]), np.ones(1))
    assert v == pytest.approx([3.0])


# --- the ends of open outlines


@settings(max_examples=40)
@given(st.lists(st.floats(-2, 4), min_size=1, max_size=5), st.floats(-3, 3), st.floats(0.5, 9))
def test_how_far_inside_a_place_is(shares, first, length):
    values = first + np.array(shares) * length
    found = inside_of_ends([(1, first, first + length)], [None, values], len(values))
    for value, share in zip(found, shares, strict=True):
        assert value - PAST_AN_END == pytest.approx(min(share, 1.0 - share), abs=1e-12 + 1e-12 * abs(first))
    other = inside_of_ends(
        [(1, first, first + length), (0, 0.0, 1.0)], [np.full(len(values), 0.25), values], len(values)
    )
    assert (other <= 0.25 + PAST_AN_END).all()


TRACK = """.config(10); Way : .curve A = [0, 0] .through([0, 0], [50, 30], [100, 0]) .open;
Pin : .bar A = [0, 0] B = A + [5, 0];
@0 Way.A = [0, 0]; Way.angle = 0; .on(Pin.A, Way) = 0; Pin.A.x = 20 + 30*.t; Pin.angle = 0; @2
"""


def test_only_places_on_open_outlines_have_ends():
    plan = plan_of(TRACK)
    found = {n: (block, ends) for block in plan.blocks for n, *ends in open_places_of(plan, block)}
    places = [u.number for u in plan.system.unknowns if isinstance(u.payload, ContactPlace)]
    assert places
    assert sorted(found) == sorted(places)
    for n, (block, (first, last)) in found.items():
        outline = plan.system.unknowns[n].payload.touch.outline
        assert (first, last) == (outline.first, outline.last)
        for value, beyond in (((first + last) / 2, False), (first, False), (last, False),
                              (last + 0.01 * (last - first), True), (first - 0.01 * (last - first), True)):  # fmt: skip
            state: list = [None] * len(plan.system.unknowns)
            for other in found:
                state[other] = np.array([value, 0.5 * (first + last)])
            assert is_past_end(plan, block, state) is beyond
    closed = plan_of(
        TRACK.replace(
            "Way : .curve A = [0, 0] .through([0, 0], [50, 30], [100, 0]) .open", "Way : .disc(60) A = [0, 0]"
        )
    )
    assert not any(open_places_of(closed, block) for block in closed.blocks)
