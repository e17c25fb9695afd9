"""Constants and splines: exact values against SymPy and fractions, polynomials against SciPy and NumPy."""

from __future__ import annotations

import math
import pickle
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline

from movimentum.expressions import ONE, ZERO, Expr, add, call, const, div, mul, neg, power, ratio, sub, symbol
from movimentum.expressions.expr import PI, Occurring, StatedNumber, as_stated, derivative, folded, integral, same
from movimentum.expressions.rational import rational_value, root_of
from movimentum.expressions.splines import banded, horner, quintics, slope_at
from movimentum.expressions.tables import Ends, Table
from tests.planning.exact import valued

# --- splines


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_quintics_are_scipys_from_values_slopes_and_bends(scale):
    random = np.random.default_rng(2)
    x = scale * np.cumsum(random.uniform(0.2, 2.0, 9))
    y, m, q = random.normal(size=9), random.normal(size=9) / scale, random.normal(size=9) / scale**2
    h = np.diff(x)
    coefficients = quintics(h, y, m, q)
    truth = BPoly.from_derivatives(x, np.stack([y, m, 2.0 * q], axis=1))
    for share in (0.0, 0.3, 0.8, 1.0):
        places = x[:-1] + share * h
        assert horner(coefficients, share * h) == pytest.approx(truth(places), abs=1e-9)
    assert slope_at(coefficients, h) == pytest.approx(m[-1:], rel=1e-9)
    # exactly so in fractions, which know no addition of whole numbers but by themselves
    exact = [np.array([Fraction(float(v)) for v in each], dtype=object) for each in (h, y, m, q)]
    pieces = quintics(*exact)
    assert list(horner(pieces, exact[0])) == list(exact[1][1:])
    assert list(slope_at(pieces, exact[0])) == list(exact[2][-1:])


def test_a_tridiagonal_system_is_solved_for_one_right_side_and_for_many():
    random = np.random.default_rng(3)
    matrix = np.diag(random.uniform(3, 5, 8)) + np.diag(random.normal(size=7), 1) + np.diag(random.normal(size=7), -1)
    bands = np.zeros((3, 8))
    bands[0, 1:], bands[1], bands[2, :-1] = np.diag(matrix, 1), np.diag(matrix), np.diag(matrix, -1)
    for right in (random.normal(size=8), random.normal(size=(8, 3))):
        assert banded(bands, right) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-12)


@pytest.mark.parametrize("degree", [0, 1, 4])
def test_horner_is_polyval(degree):
    c = np.random.default_rng(degree).normal(size=degree + 1)
    t = np.linspace(-2.0, 2.0, 7)
    assert np.shape(horner(list(c), t)) == np.shape(t)
    assert horner(list(c), t) == pytest.approx(np.polynomial.polynomial.polyval(t, c), abs=1e-12)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_smooth_tables_are_scipys_splines_and_so_are_their_derivatives(scale):
    random = np.random.default_rng(5)
    x = scale * np.cumsum(random.uniform(0.2, 2.0, 8))
    y = random.normal(size=8)
    places = np.linspace(x[0], x[-1], 57)
    for ends, values, kind in ((Ends.NOTHING, y, "not-a-knot"), (Ends.PERIODIC, np.append(y[:-1], y[0]), "periodic")):
        table, truth = Table(x, values, smooth=True, ends=ends), CubicSpline(x, values, bc_type=kind)
        first = table.derived()
        assert table.at(places) == pytest.approx(truth(places), abs=1e-9)
        assert first is not None
        assert np.asarray(first.at(places[1:-1])) * scale == pytest.approx(truth(places[1:-1], 1) * scale, abs=1e-8)
    straight = Table(x, y)
    assert straight.at(places[1:-1]) == pytest.approx(np.interp(places[1:-1], x, y), abs=1e-12)


# --- exact values of constants

LEAVES = st.one_of(
    st.integers(-6, 6).map(lambda n: (const(float(n)), sympy.Integer(n))),
    st.sampled_from([0.5, 0.1, -0.25, 2.75, 1e-3]).map(lambda v: (const(v), sympy.Rational(repr(v)))),
    st.tuples(st.integers(-9, 9), st.integers(1, 9)).map(lambda p: (ratio(Fraction(*p)), sympy.Rational(*p))),
)


def _pair(op, a, b):
    (x, u), (y, v) = a, b
    match op:
        case "add":
            return add(x, y), u + v
        case "sub":
            return sub(x, y), u - v
        case "mul":
            return mul(x, y), u * v
        case "div":
            return (div(x, y), u / v) if v else (div(x, ONE), u)
        case "min":
            return call("min", x, y), sympy.Min(u, v)
        case "max":
            return call("max", x, y), sympy.Max(u, v)
        case "abs":
            return call("abs", x), sympy.Abs(u)
        case "neg":
            return neg(x), -u
        case "square":
            return power(x, 2.0), u**2
        case "inverse":
            return (power(y, -1.0), 1 / v) if v else (y, v)
        case "root":
            return call("sqrt", mul(x, x)), sympy.Abs(u)
        case _:
            raise AssertionError(op)


OPERATIONS = ("add", "sub", "mul", "div", "min", "max", "abs", "neg", "square", "inverse", "root")
TREES = st.recursive(
    LEAVES, lambda below: st.builds(_pair, st.sampled_from(OPERATIONS), below, below), max_leaves=8
)  # fmt: skip


@settings(max_examples=60)
@given(TREES)
def test_a_constant_is_the_rational_number_that_sympy_says(pair):
    node, truth = pair
    exact = Fraction(int(truth.p), int(truth.q))
    assert node.value is not None
    assert rational_value(node) in (exact, None)
    assert node.value == pytest.approx(float(exact), rel=1e-12, abs=1e-300)
    if len(str(exact)) < 100:
        assert rational_value(node) == exact
    # what is 0, 1 or -1 exactly has no origin any more, and nothing else loses its own
    if node.value in (0.0, 1.0, -1.0):
        assert (node.origin is None) == (node.value == exact)


def test_sines_are_rational_where_niven_says():
    for turn in range(-390, 391, 15):
        for op, value in (("sind", sympy.sin(sympy.pi * turn / 180)), ("cosd", sympy.cos(sympy.pi * turn / 180))):
            found = rational_value(Expr(op, (const(float(turn)),)))
            assert found == (Fraction(int(value.p), int(value.q)) if value.is_Rational else None)


def test_directions_roots_and_powers_are_exact_or_unknown():
    for x in range(-3, 4):
        for y in range(-3, 4):
            found = rational_value(Expr("atan2d", (const(float(y)), const(float(x)))))
            on_axis = not x or not y or abs(x) == abs(y)
            assert found == (Fraction(round(math.degrees(math.atan2(y, x)))) if on_axis else None)
    assert root_of(Fraction(9, 16)) == Fraction(3, 4)
    assert [root_of(Fraction(v)) for v in (0, 1, 2, -4)] == [0, 1, None, None]
    assert root_of(Fraction(9, 2)) is root_of(Fraction(2, 9)) is None
    powers = {
        (2.0, 3.0): Fraction(8),
        (2.0, -2.0): Fraction(1, 4),
        (4.0, 0.5): None,
        (2.0, 65.0): None,
        (2.0, -65.0): None,
        (0.0, -1.0): None,
        (2.0, 64.0): Fraction(2**64),
    }
    for (base, exponent), truth in powers.items():
        assert rational_value(Expr("pow", (const(base),), exponent)) == truth
    assert rational_value(Expr("div", (ONE, ZERO))) is None
    assert rational_value(PI) is None
    assert rational_value(const(math.inf)) is None
    assert rational_value(symbol("x")) is None
    assert rational_value(folded(math.sqrt(2.0), ("sqrt", (const(2.0),)))) is None
    assert rational_value(const(0.1)) == Fraction(1, 10)


def test_what_takes_too_long_is_not_known():
    long = const(3.0)
    for _ in range(500):
        long = Expr("add", (long, const(1.0)))
    assert rational_value(long) is None
    short = const(3.0)
    for _ in range(150):
        short = Expr("add", (short, const(1.0)))
    assert rational_value(short) == 153
    large = Expr("pow", (const(2.0**53 - 1.0),), 64.0)
    assert rational_value(large) == (2**53 - 1) ** 64
    assert rational_value(Expr("mul", (large, large))) is None


# --- expressions


@settings(max_examples=80)
@given(
    st.recursive(
        st.one_of(st.sampled_from([0, 1, 2]).map(symbol), st.sampled_from([0.0, 1.0, -1.0, 2.0, -0.5, 3.0]).map(const)),
        lambda below: st.one_of(
            st.tuples(st.sampled_from(["add", "sub", "mul"]), below, below), st.tuples(st.just("neg"), below)
        ),
        max_leaves=10,
    )
)
def test_nothing_that_is_simplified_changes_its_value(tree):
    """Against fractions, which the simplifying code never sees."""
    values = {0: Fraction(7, 3), 1: Fraction(-2, 5), 2: Fraction(11)}
    build = {"add": add, "sub": sub, "mul": mul, "neg": neg}
    plain = {"add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b, "neg": lambda a: -a}

    def both(node):
        if isinstance(node, Expr):
            return node, (values[node.payload] if node.op == "symbol" else Fraction(node.value))
        parts = [both(each) for each in node[1:]]
        return build[node[0]](*(p for p, _ in parts)), plain[node[0]](*(v for _, v in parts))

    found, truth = both(tree)
    assert valued(found, values, Fraction) == truth
    again = pickle.loads(pickle.dumps(found))
    assert again == found
    assert hash(again) == hash(found)
    assert same(again, found)
    deepest = 1 + max((arg.depth for arg in found.args), default=0)
    assert found.depth == deepest
    # neutral numbers and double negations are left out
    assert add(found, ZERO) == found
    assert mul(ONE, found) == found
    assert neg(neg(found)) == found
    assert sub(found, found).value == 0.0
    assert mul(found, ZERO).value == 0.0
    assert div(found, ONE) == found


def test_sums_that_cancel_keep_the_digits_of_their_exact_numbers():
    tiny = sub(add(ONE, const(5e-17)), ONE)
    assert tiny.value == 5e-17
    third = div(ONE, const(3.0))
    assert sub(mul(third, const(3.0)), ONE).value == 0.0
    assert mul(third, const(3.0)).origin is None
    # 1 + 5e-17 is 1 in floats, and no neutral number
    near = add(ONE, const(5e-17))
    assert near.value == 1.0
    assert near.origin is not None
    assert mul(near, symbol("x")).op == "mul"
    assert div(symbol("x"), near).op == "div"
    assert sub(add(const(1000.0), third), const(1000.0)).value == 1.0 / 3.0


def test_ratios_are_the_nearest_floats_and_know_what_they_are():
    for value in (Fraction(1, 3), Fraction(-22, 7), Fraction(10**30, 7), Fraction(1, 10**30), Fraction(2**80 + 1)):
        found = ratio(value)
        assert found.value == float(value)
        assert rational_value(found) == value
    assert ratio(Fraction(10**400)).value == math.inf
    assert ratio(Fraction(-(10**400))).value == -math.inf
    assert as_stated(StatedNumber(0.3, ratio(Fraction(3, 10)))) == ratio(Fraction(3, 10))
    assert as_stated(0.25) == const(0.25)
    assert math.copysign(1.0, const(-0.0).value or 0.0) == 1.0


def test_equal_nodes_are_the_same_only_if_their_constants_are():
    x = symbol("x")
    rounded, stated = folded(0.1 + 0.2, ("add", (const(0.1), const(0.2)))), const(0.1 + 0.2)
    one, other = add(x, rounded), add(x, stated)
    assert one == other
    assert not same(one, other)
    assert same(add(x, folded(0.5, ("div", (ONE, const(2.0))))), add(x, const(0.5)))
    assert not same(add(x, ONE), add(x, const(2.0)))
    assert add(x, ONE) != add(x, const(2.0))
    assert Expr("pow", (x,), 2.0) != Expr("pow", (x,), 3.0)
    assert Expr("pow", (x,), 2.0).exponent == 2.0
    with pytest.raises(TypeError):
        _ = x.exponent
    with pytest.raises(TypeError):
        _ = x.start
    deep = other = x
    for _ in range(60):  # in one pass, not in 2^60
        deep, other = Expr("add", (deep, deep)), Expr("add", (other, other))
    assert deep == other
    assert same(deep, other)


def test_what_occurs_below_is_known_and_rates_of_constants_are_nothing():
    t, x = Expr("clock", (), Fraction(0)), symbol("x")
    root = add(mul(x, t), call("sqrt", div(x, t)))
    assert root.timed
    assert not add(x, ONE).timed
    assert root.occurring & Occurring.DIVISION
    assert root.occurring & Occurring.PARTIAL
    assert not root.occurring & (Occurring.PHASE | Occurring.LASTING)
    assert call("cosd", x).occurring == Occurring.PHASE
    assert integral(ZERO, Fraction(0)) == derivative(const(3.0)) == ZERO
    assert integral(x, Fraction(2)).start == 2
    assert integral(x, Fraction(2)).timed
    assert derivative(x).op == "derivative"
