"""Every way to evaluate an expression knows every operation, and they agree."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

from movimentum.analysis.interactive.formula import to_sympy
from movimentum.expressions import OPERATIONS, Expr, Operation, const, evaluate_op, rebuild, symbol
from movimentum.expressions.operations import BY_NAME
from movimentum.expressions.tables import Table
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import with_respect_to
from movimentum.scene.lower import OPERATION_OF
from movimentum.solver.arithmetic.double_double import WideArithmetic
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.solver.arithmetic.taylor import Taylor, coefficient
from movimentum.solver.residual_check import ExpressionBatch
from movimentum.syntax.vocabulary import FUNCTIONS, REDUCTIONS, SYNONYMS

# those of outlines are tried in tests/mechanisms/test_contact.py
NUMBERS = tuple(operation for operation in OPERATIONS if not operation.name.startswith("nearest"))
each = pytest.mark.parametrize("operation", NUMBERS, ids=lambda operation: operation.name)
PLACES = ([0.3, 0.7, -1.25, 2.5], [0.6, 0.25, 1.5, -0.5])
"""Arguments at which all are defined, smooth, and on either side of a kink."""
EXPONENT = 1.5


TABLE = Table(np.array([-3.0, -1.0, 0.0, 1.0, 3.0]), np.array([3.0, -1.0, 2.5, 2.0, 0.5]), spelled=("a.csv", "b", ""))


def payload(operation: Operation) -> float | Table | None:
    return {"pow": EXPONENT, "table": TABLE}.get(operation.name)


def node(operation: Operation) -> Expr:
    return Expr(operation.name, tuple(symbol(n) for n in range(operation.arity)), payload(operation))


def values(operation: Operation) -> list[float]:
    found = [evaluate_op(operation.name, payload(operation), place[: operation.arity]) for place in PLACES]
    assert all(map(math.isfinite, found))
    return found


@each
def test_it_takes_as_many_arguments_as_it_says(operation: Operation) -> None:
    for wrong in (operation.arity - 1, operation.arity + 1):
        with pytest.raises(TypeError):
            evaluate_op(operation.name, payload(operation), [0.5] * wrong)


@each
def test_folded_it_is_what_it_is_evaluated(operation: Operation) -> None:
    made = node(operation)
    folded = [rebuild(made, tuple(map(const, place[: operation.arity]))).value for place in PLACES]
    assert folded == values(operation)


@each
def test_all_of_a_shape_at_once(operation: Operation) -> None:
    places = np.array(PLACES).T
    other = Expr(operation.name, tuple(const(PLACES[1][n]) for n in range(operation.arity)), payload(operation))
    together = ExpressionBatch([node(operation), other, node(operation)], Clocks())
    found = np.concatenate([some for _, some in together.values(places, [], len(PLACES))], axis=1)
    expected = values(operation)
    np.testing.assert_allclose(found, [expected, [expected[1]] * len(PLACES), expected], rtol=1e-14)
    assert len(together.shapes) == 2


@each
def test_formulas(operation: Operation) -> None:
    letters = [sympy.Symbol(f"x{n}", real=True) for n in range(operation.arity)]
    formula = to_sympy(node(operation), lambda leaf: letters[leaf.payload])
    found = [float(formula.subs(list(zip(letters, map(Fraction, place), strict=False)))) for place in PLACES]
    np.testing.assert_allclose(found, values(operation), rtol=1e-12)


# --- every row in every column, against mpmath with 60 digits

MP = mpmath.MPContext()
MP.dps = 60


def _of_angles(function: Callable[[object], object]) -> Callable[[object], object]:
    return lambda a: function(a * MP.pi / 180)


def _between_rows(u: Any, row: int) -> Any:
    (x0, x1), (y0, y1) = TABLE.x[row : row + 2], TABLE.y[row : row + 2]
    return y0 + (y1 - y0) * (u - x0) / (x1 - x0)


TRUTH: dict[str, Callable[..., object]] = {
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "neg": lambda a: -a,
    "pow": lambda a: a**EXPONENT,
    "sqrt": MP.sqrt,
    "sind": _of_angles(MP.sin),
    "cosd": _of_angles(MP.cos),
    "tand": _of_angles(MP.tan),
    "asind": lambda a: MP.asin(a) * 180 / MP.pi,
    "acosd": lambda a: MP.acos(a) * 180 / MP.pi,
    "atand": lambda a: MP.atan(a) * 180 / MP.pi,
    "atan2d": lambda a, b: MP.atan2(a, b) * 180 / MP.pi,
    "abs": abs,
    "min": min,
    "max": max,
    "floor": MP.floor,
    "mod": lambda a, b: a - b * MP.floor(a / b),
    "exp": MP.exp,
    "ln": MP.ln,
    "ease": lambda u: 0 if u < 0 else 1 if u > 1 else 3 * u**2 - 2 * u**3,
    "le": lambda e, b, v, w: v if e <= b else w,
    "table": lambda u: _between_rows(u, int(np.searchsorted(TABLE.x, float(u))) - 1),
}
LIMITS = {"asind": (-0.99, 0.99), "acosd": (-0.99, 0.99), "sqrt": (0.01, 9.0), "ln": (0.01, 9.0), "pow": (0.01, 9.0)}


def drawn(operation: Operation, count: int = 12) -> np.ndarray:
    """(arity, count) random arguments at which an operation is defined, and not at a kink or near a pole."""
    low, high = LIMITS.get(operation.name, (-400.0, 400.0) if operation.name in ("sind", "cosd") else (-3.0, 3.0))
    generator = np.random.default_rng(sum(map(ord, operation.name)))
    found: list[np.ndarray] = []
    while len(found) < count:
        some = generator.uniform(low, high, operation.arity)
        steps = [abs(some[-1]), *(abs(x - y) for x, y in pairwise(some)), *abs(some - np.rint(some))]
        quotient = some[0] / some[-1]
        if min(*steps, abs(quotient - round(quotient)) if operation.name == "mod" else 1.0) > 0.01:
            found.append(some)
    return np.array(found).T


def truth(operation: Operation, places: np.ndarray, direction: np.ndarray, order: int) -> np.ndarray:
    """The Taylor coefficient of f(places + t direction) at t = 0."""
    function = TRUTH[operation.name]
    found: list[float] = []
    for place, way in zip(places.T.tolist(), direction.T.tolist(), strict=True):

        def along(t: object, place: list[float] = place, way: list[float] = way) -> object:
            return function(*(MP.mpf(a) + t * b for a, b in zip(place, way, strict=True)))

        found.append(float(MP.taylor(along, 0, order)[order]))
    return np.array(found)


ARITHMETICS = {"floats": None, "numpy": None, "wide": WideArithmetic(), "mpmath": DigitsArithmetic(40)}


@each
@pytest.mark.parametrize("column", ARITHMETICS)
def test_values_are_those_of_mpmath(operation: Operation, column: str) -> None:
    places, arithmetic = drawn(operation), ARITHMETICS[column]
    wanted = [TRUTH[operation.name](*map(MP.mpf, place)) for place in places.T]
    if column == "floats":
        found = [evaluate_op(operation.name, payload(operation), place) for place in places.T.tolist()]
    elif arithmetic is None:
        (found,) = compiled([node(operation)], Clocks())(places, [])
    else:
        found = arithmetic.call(operation.name, payload(operation), [arithmetic.floats(row) for row in places])
        if isinstance(arithmetic, WideArithmetic):
            found = [MP.mpf(float(high)) + MP.mpf(float(low)) for high, low in zip(found.high, found.low, strict=True)]
        within = MP.mpf(10) ** (-27 if column == "wide" else -45)
        assert all(
            abs(MP.mpf(some) - right) <= within * (1 + abs(right)) for some, right in zip(found, wanted, strict=True)
        )
    np.testing.assert_allclose(
        np.array(found, dtype=np.float64), np.array(wanted, dtype=np.float64), rtol=4e-15, atol=1e-15
    )


@each
def test_derivatives_are_those_of_mpmath(operation: Operation) -> None:
    """As formulas, in generated code; and as Taylor series, from the same formulas."""
    places = drawn(operation)
    for n in range(operation.arity):
        direction = np.zeros_like(places)
        direction[n] = 1.0
        (rate,) = compiled([with_respect_to(node(operation), n)], Clocks())(places, [])
        wanted = truth(operation, places, direction, 1)
        np.testing.assert_allclose(np.broadcast_to(rate, wanted.shape), wanted, rtol=1e-12, atol=1e-13)
    direction = np.random.default_rng(5).uniform(-1.0, 1.0, places.shape)
    taylor = Taylor(3)
    series = taylor.call(operation.name, payload(operation), list(zip(places, direction, strict=True)))
    for order in range(4):
        wanted = truth(operation, places, direction, order)
        found = np.broadcast_to(coefficient(series, order), wanted.shape)
        np.testing.assert_allclose(found, wanted, rtol=1e-10, atol=1e-12)


@each
@pytest.mark.parametrize("ahead", [True, False])
def test_series_at_a_kink_are_those_of_the_side_that_time_goes_to(operation: Operation, ahead: bool) -> None:
    """abs, min, max, le and ease where they switch: the derivatives just beside it."""
    places = {"abs": [0.0], "min": [0.5, 0.5], "max": [0.5, 0.5], "ease": [1.0], "le": [0.5, 0.5, 0.3, 0.3]}
    if operation.name not in places:
        return
    place = np.array(places[operation.name])[:, None]
    direction = np.array([0.7, -0.3, 0.2, -0.9])[: operation.arity, None]
    found = Taylor(1, ahead=ahead).call(operation.name, None, list(zip(place, direction, strict=True)))
    beside = place + (1e-6 if ahead else -1e-6) * direction
    wanted = truth(operation, beside, direction, 1)
    np.testing.assert_allclose(np.broadcast_to(coefficient(found, 1), 1), wanted, atol=1e-4)


def test_every_function_of_the_language_that_makes_a_number_is_an_operation() -> None:
    words = {SYNONYMS.get(operation.word, operation.word) for operation in OPERATIONS if operation.word is not None}
    others = {"a", "i", "d", "across", "along", "mesh", "belt", "cord", "on", "where", "gap", "roll", "point",
              "tangent", "curvature", "length", "table"}  # fmt: skip
    assert set(FUNCTIONS) - words == others | (REDUCTIONS - {"min", "max"})
    assert words <= set(FUNCTIONS)
    for word, name in OPERATION_OF.items():
        least, most = FUNCTIONS[word]
        assert BY_NAME[name].arity == (2 if most is None else least)
