"""Every way to evaluate an expression knows every operation, and they agree."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy

from movimentum.analysis.interactive.formula import to_sympy
from movimentum.expressions import OPERATIONS, Expr, Operation, const, evaluate_op, rebuild, symbol
from movimentum.expressions.operations import BY_NAME
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import with_respect_to
from movimentum.scene.lower import OPERATION_OF
from movimentum.scene.model import VariableComponent
from movimentum.scene.names import expression_name
from movimentum.solver.arithmetic.alike import Alike
from movimentum.solver.arithmetic.double_double import WideArithmetic
from movimentum.solver.arithmetic.evaluation import Arithmetic
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.syntax.words import FUNCTIONS, REDUCTIONS, SYNONYMS
from tests.understand import BAR, constraint_of, scene_of

each = pytest.mark.parametrize("operation", OPERATIONS, ids=lambda operation: operation.name)
PLACES = ([0.3, 0.7, -1.25, 2.5], [0.6, 0.25, 1.5, -0.5])
"""Arguments at which all are defined, smooth, and on either side of a kink."""
EXPONENT = 1.5


def payload(operation: Operation) -> float | None:
    return EXPONENT if operation.name == "pow" else None


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
def test_numpy_code(operation: Operation) -> None:
    places = np.array(PLACES).T
    (found,) = compiled([node(operation)], Clocks())(places, [])
    np.testing.assert_allclose(found, values(operation), rtol=1e-14)


@each
def test_all_of_a_shape_at_once(operation: Operation) -> None:
    places = np.array(PLACES).T
    other = Expr(operation.name, tuple(const(PLACES[1][n]) for n in range(operation.arity)), payload(operation))
    together = Alike([node(operation), other, node(operation)], Clocks())
    found = np.concatenate([some for _, some in together.values(places, [], len(PLACES))], axis=1)
    expected = values(operation)
    np.testing.assert_allclose(found, [expected, [expected[1]] * len(PLACES), expected], rtol=1e-14)
    assert len(together.shapes) == 2


@each
@pytest.mark.parametrize("arithmetic", [WideArithmetic(), DigitsArithmetic(40)], ids=["double-double", "mpmath"])
def test_more_digits(operation: Operation, arithmetic: Arithmetic) -> None:
    arguments = [arithmetic.floats(np.array(column)) for column in zip(*PLACES, strict=True)][: operation.arity]
    found = arithmetic.rounded(arithmetic.call(operation.name, payload(operation), arguments))
    np.testing.assert_allclose(found, values(operation), rtol=1e-14)


@each
def test_formulas(operation: Operation) -> None:
    letters = [sympy.Symbol(f"x{n}", real=True) for n in range(operation.arity)]
    formula = to_sympy(node(operation), lambda leaf: letters[leaf.payload])
    found = [float(formula.subs(list(zip(letters, map(Fraction, place), strict=False)))) for place in PLACES]
    np.testing.assert_allclose(found, values(operation), rtol=1e-12)


@each
def test_derivatives(operation: Operation) -> None:
    made, step = node(operation), 1e-6
    places = np.array(PLACES).T
    value = compiled([made], Clocks())
    for n in range(operation.arity):
        rate = compiled([with_respect_to(made, n)], Clocks())(places, [])[0]
        ahead, behind = places.copy(), places.copy()
        ahead[n] += step
        behind[n] -= step
        slope = (value(ahead, [])[0] - value(behind, [])[0]) / (2 * step)
        np.testing.assert_allclose(np.broadcast_to(rate, 2), slope, rtol=1e-6, atol=1e-8)


@each
def test_a_script_says_it_in_the_words_that_it_is_told_in(operation: Operation) -> None:
    names = [VariableComponent(name, None) for name in ("p", "q", "r", "s")][: operation.arity]
    said = Expr(operation.name, tuple(map(symbol, names)), payload(operation))
    words = expression_name(scene_of(f"{BAR}@2 result = 1;"), said)
    read = constraint_of(scene_of(f"{BAR}@2 result = {words};"), "result").right
    assert read == (said,), words


def test_every_function_of_the_language_that_makes_a_number_is_an_operation() -> None:
    words = {SYNONYMS.get(operation.word, operation.word) for operation in OPERATIONS if operation.word is not None}
    others = {"a", "i", "d", "across", "along", "mesh", "belt"}  # of vectors, of time, of things
    assert set(FUNCTIONS) - words == others | (REDUCTIONS - {"min", "max"})
    assert words <= set(FUNCTIONS)
    for word, name in OPERATION_OF.items():
        least, most = FUNCTIONS[word]
        assert BY_NAME[name].arity == (2 if most is None else least)
