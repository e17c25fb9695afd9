"""Expressions, polynomials, derivatives, integrals and generated code, against independent evaluation."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf, quad

from movimentum import expressions as ex
from movimentum.expressions.arrays import sincosd
from movimentum.expressions.floats import Floats
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.calculus import affine, closed_form, with_respect_to
from tests.broad import broad

VALUES = {0: 0.7, 1: -1.3, 2: 2.1}
X = [ex.symbol(n) for n in VALUES]


def interpreted(root, values=VALUES, time=0.0):
    """Node by node with `math`."""
    memo = {}
    for node in ex.walk(root):
        if node.op == "const":
            memo[node] = node.payload
        elif node.op == "symbol":
            memo[node] = values[node.payload]
        elif node.op == "clock":
            memo[node] = time - float(node.payload)
        else:
            memo[node] = ex.evaluate_op(node.op, node.payload, [memo[a] for a in node.args])
    return memo[root]


MANY_DIGITS = {
    "add": lambda a, b: a + b,
    "neg": lambda a: -a,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "sind": lambda a: mp.sin(a * mp.pi / 180),
    "cosd": lambda a: mp.cos(a * mp.pi / 180),
    "sqrt": mp.sqrt,
    "atan2d": lambda a, b: mp.atan2(a, b) * 180 / mp.pi,
}


def in_many_digits(root, values):
    """Node by node with mpmath."""
    memo = {}
    for node in ex.walk(root):
        if node.op in ("const", "symbol"):
            memo[node] = mpf(node.payload if node.op == "const" else values[node.payload])
        elif node.op == "pow":
            memo[node] = memo[node.args[0]] ** node.payload
        else:
            memo[node] = MANY_DIGITS[node.op](*(memo[a] for a in node.args))
    return memo[root]


def expressions(depth=4):
    leaf = st.one_of(st.sampled_from(X), st.floats(-3, 3, allow_nan=False).map(ex.const))

    def extend(children):
        pair = st.tuples(children, children)
        return st.one_of(
            pair.map(lambda p: ex.add(*p)),
            pair.map(lambda p: ex.sub(*p)),
            pair.map(lambda p: ex.mul(*p)),
            children.map(ex.neg),
            children.map(lambda a: ex.power(a, 2.0)),
            children.map(lambda a: ex.call("sind", a)),
            children.map(lambda a: ex.call("cosd", a)),
            children.map(lambda a: ex.call("sqrt", ex.add(ex.ONE, ex.mul(a, a)))),
            pair.map(lambda p: ex.call("atan2d", p[0], ex.add(ex.const(4.0), ex.mul(p[1], p[1])))),
            pair.map(lambda p: ex.div(p[0], ex.add(ex.const(2.0), ex.mul(p[1], p[1])))),
        )

    return st.recursive(leaf, extend, max_leaves=2**depth)


@pytest.mark.slow
@settings(max_examples=50)
@given(expressions())
def test_generated_code_computes_what_the_nodes_say(root):
    function = compiled([root], Clocks())
    expected = interpreted(root)
    (scalar,) = function([np.float64(VALUES[n]) for n in range(3)], [])
    (many,) = function([np.full(5, VALUES[n]) for n in range(3)], [])
    assert float(scalar) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert np.broadcast_to(many, 5) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.slow
@settings(max_examples=50)
@given(expressions(), st.sampled_from([0, 1, 2]))
def test_derivatives_agree_with_differences(root, unknown):
    with mp.workdps(80):  # so that a step can be short enough for whatever oscillates
        slope = float(in_many_digits(with_respect_to(root, unknown), VALUES))
        h = mpf(10) ** -30
        high, low = (in_many_digits(root, {**VALUES, unknown: VALUES[unknown] + d}) for d in (h, -h))
        expected = float((high - low) / (2 * h))
    assert slope == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_what_is_affine_is_told_from_what_only_has_a_constant_slope() -> None:
    x, y, z = X
    slope, rest = affine(ex.sub(ex.mul(y, ex.add(x, ex.const(3.0))), ex.div(ex.sub(z, x), y)), 0) or (x, x)
    assert ex.symbols(slope, rest) == {1, 2}
    assert interpreted(slope) == pytest.approx(-1.3 - 1 / 1.3)
    assert interpreted(rest) == pytest.approx(-3 * 1.3 + 2.1 / 1.3)
    assert affine(ex.sub(x, ex.call("floor", x)), 0) is None
    assert affine(ex.sub(ex.mul(ex.const(2.0), x), ex.call("mod", x, ex.const(3.0))), 0) is None
    assert affine(ex.mul(x, x), 0) is None
    assert affine(ex.div(y, x), 0) is None


@pytest.mark.slow
@settings(max_examples=50)
@given(expressions())
def test_polynomials_are_the_same_function(root):
    form = poly.from_expression(root)
    if form is not None:
        again = poly.to_expression(form)
        size = max(1.0, abs(interpreted(root)))
        assert interpreted(again) == pytest.approx(interpreted(root), abs=1e-9 * size)


T0 = ex.clock(Fraction(0))
T1 = ex.clock(Fraction(1, 3))


@broad(
    "integrand",
    [
        ex.const(9.81),
        ex.add(ex.const(2.0), ex.mul(ex.const(3.0), T0)),
        ex.mul(T0, ex.mul(T1, T1)),
        ex.call("sind", ex.mul(ex.const(200.0), T0)),
        ex.mul(ex.const(4.0), ex.call("cosd", ex.add(ex.const(30.0), ex.mul(ex.const(-77.0), T1)))),
        ex.call("exp", ex.mul(ex.const(-0.7), T0)),
        ex.mul(T0, ex.call("sind", ex.mul(ex.const(90.0), T0))),
        ex.mul(ex.mul(T0, T0), ex.call("exp", T1)),
    ],
    every=3,
)
def test_closed_forms_of_integrals(integrand):
    start = Fraction(1, 2)
    form = closed_form(integrand, start)
    assert form is not None
    mp.dps = 30
    for time in (0.5, 1.7, 4.0):
        # 16 digits of the integrand suffice: the quadrature is exact to that
        expected = (
            float(quad(lambda t: interpreted(integrand, time=float(t)), np.linspace(0.5, time, 9).tolist()))
            if time > 0.5
            else 0.0
        )
        assert interpreted(form, time=time) == pytest.approx(expected, rel=1e-11, abs=1e-11)


def test_what_has_no_known_closed_form_says_so():
    assert closed_form(ex.call("sind", ex.mul(T0, T0)), Fraction(0)) is None
    assert closed_form(X[0], Fraction(0)) is None


@pytest.mark.parametrize("turns", [0, 1, -3, 10**6, 10**12])
def test_quadrants_are_exact(turns):
    angle = np.array([0.0, 90.0, 180.0, 270.0]) + 360.0 * turns
    s, c = sincosd(angle)
    assert s.tolist() == [0, 1, 0, -1]
    assert c.tolist() == [1, 0, -1, 0]
    assert [Floats.sind(float(a)) for a in angle] == [0, 1, 0, -1]
    assert [Floats.cosd(float(a)) for a in angle] == [1, 0, -1, 0]


@given(st.floats(-1e7, 1e7))
def test_sines_of_degrees(angle):
    s, c = sincosd(np.float64(angle))
    mp.dps = 40
    exact = mp.mpf(angle) * mp.pi / 180
    assert float(s) == pytest.approx(float(mp.sin(exact)), abs=3e-16)
    assert float(c) == pytest.approx(float(mp.cos(exact)), abs=3e-16)


def test_numbers_fold_and_what_is_not_finite_stays():
    assert ex.add(ex.const(1), ex.const(2)).value == 3
    assert ex.div(ex.ONE, ex.ZERO).value is None
    assert ex.call("sqrt", ex.const(-1.0)).value is None
    assert ex.mul(ex.ZERO, X[0]).value == 0
    assert ex.sub(X[0], X[0]).value == 0
    assert math.isclose(ex.call("exp", ex.ONE).value or 0, math.e)
