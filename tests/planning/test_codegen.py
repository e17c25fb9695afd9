"""Generated code is written once for a shape, and computes what its expressions say for all numbers."""

import math
import random
from fractions import Fraction

import numpy as np
import pytest

from movimentum.expressions import add, call, clock, const, div, mul, neg, sub, symbol, walk
from movimentum.expressions.operations import evaluate_op
from movimentum.planning.codegen import generate, writing
from movimentum.planning.codegen.generate import Clocks, compiled

NUMBERS = (0.0, 1.0, -1.0, 2.0, -2.0, 3.5, -3.5, 7.25, 1e-200, 1e200, -1e160, 0.1)
"""Among them equal and opposite ones, and ones whose products overflow."""


def planted(seed):
    """Expressions of one form for each ``seed % 40``, with numbers that each seed draws anew."""
    form, draw = random.Random(seed % 40), random.Random(seed)
    pool = [symbol(0), symbol(3), clock(Fraction(1, 3))]
    for _ in range(form.randrange(4, 14)):
        a, b = form.choice(pool), form.choice(pool)
        number = const(draw.choice(NUMBERS))
        made = [mul(number, a), add(a, number), sub(a, b), mul(a, b), div(a, number), neg(a), call("sind", a)]
        pool.append(form.choice(made))
    return [pool[-1], form.choice(pool)]


def value_of(root, values):
    """By the table of operations, one node after the other; None where that tells nothing."""
    memo = {}
    for node in walk(root):
        match node.op:
            case "const":
                memo[node] = node.value
            case "symbol":
                memo[node] = values[node.payload]
            case "clock":
                memo[node] = values["clock"]
            case op:
                args = [memo[arg] for arg in node.args]
                if op == "sind" and not abs(args[0]) < 1e6:
                    return None  # nothing but rounding
                memo[node] = evaluate_op(op, node.payload, args)
    return memo[root]


@pytest.mark.parametrize("part", range(4))
def test_code_computes_what_its_expressions_say(part):
    for seed in range(part, 1200, 4):
        roots = planted(seed)
        u = [1.7, math.nan, math.nan, -0.6]
        with np.errstate(all="ignore"):
            found = compiled(roots, Clocks())(np.array(u), np.array([4.5]))
        for value, root in zip(found, roots, strict=True):
            expected = value_of(root, {0: 1.7, 3: -0.6, "clock": 4.5})
            if expected is None:
                continue
            if math.isfinite(expected) and math.isfinite(value):
                assert value == pytest.approx(expected, rel=1e-9, abs=1e-9)
            else:  # a product that is gathered may overflow earlier, or later
                assert not math.isfinite(expected) or abs(expected) > 1e140 or not abs(value) < 1e140


def test_what_was_written_for_other_numbers_is_what_would_be_written_anew():
    for seed in range(400):
        roots = planted(seed)
        compiled(roots, Clocks())
        parts = generate.Flattening(Clocks())
        results = [parts.value(root) for root in roots]
        u, k = np.array([1.7, 0.0, 0.0, -0.6]), np.array([4.5])
        with np.errstate(all="ignore"):
            reused = parts.function(results)(u, k)
            writing.code_for.cache_clear()
            fresh = parts.function(results)(u, k)
        np.testing.assert_array_equal(reused, fresh)


def test_another_number_of_the_same_shape_writes_nothing():
    x, y = symbol(0), symbol(1)

    def written_for(a, b, places=(0, 1)):
        x, y = map(symbol, places)
        before = writing.code_for.cache_info().misses
        compiled([add(mul(const(a), x), mul(const(b), mul(x, y)))], Clocks())
        return writing.code_for.cache_info().misses - before

    writing.code_for.cache_clear()
    assert written_for(3.0, 5.0) == 1
    assert written_for(7.0, 8.0) == 0
    assert written_for(7.0, 8.0, (4, 9)) == 0
    assert written_for(7.0, -7.0) == 1, "two numbers that are opposite may share a product"
    assert compiled([mul(const(3.0), mul(const(4.0), x))], Clocks())([2.0], ()) == (24.0,)
    with np.errstate(all="ignore"):
        assert compiled([div(y, const(0.0))], Clocks())(np.array([1.0, 2.0]), ())[0] == math.inf
