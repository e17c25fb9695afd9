"""Formulas in named steps, evaluated by hand: closed forms of mechanisms, and SymPy's own algebra."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy

from movimentum.equations.program import NoProgram
from movimentum.equations.stage_maker import StageMaker, named_steps, shared_steps, tidied
from movimentum.expressions import symbol
from movimentum.scene.model import AnchorCoordinate, VariableComponent
from tests.solver.scenes import motion_of


def put(steps, **given):
    """The values of all steps."""
    values = {sympy.Symbol(name, real=True): value for name, value in given.items()}
    for name, value in steps:
        values[sympy.Symbol(name, real=True)] = sympy.N(value.subs(values), 30)
    return {str(name): float(value) for name, value in values.items()}


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_steps_of_a_four_bar_are_its_closed_form_on_either_side(side):
    motion = motion_of(
        f"C : .bar O = [0,0] P = [30,0]; R : .bar A = [30,0] B = [90,{side * 60}];"
        f"D : .bar E = [100,0] B = [90,{side * 60}];"
        "@2 C.O = [0,0]; C.angle = 90*.t + 5; R.A = C.P; D.E = [100,0]; D.B = R.B; @4"
    )
    anchors = motion.timeline.scene.things[1].anchors
    number = next(k for k, anchor in enumerate(anchors) if anchor.name == "B")
    wanted = [(f"B{'xy'[axis]}", symbol(AnchorCoordinate(1, number, axis))) for axis in (0, 1)]
    steps = named_steps(motion.segments[0], 0.5, wanted)
    assert [name for name, _ in steps[-2:]] == ["Bx", "By"]
    names = [name for name, _ in steps]
    assert len({name.lower() for name in names}) == len(names)
    for name, value in steps:  # each is needed, and made before
        before = {"t", *names[: names.index(name)]}
        assert {str(each) for each in value.free_symbols} <= before
    a, b = math.hypot(60.0, 60.0), math.hypot(10.0, 60.0)
    for t in (0.0, 0.4, 1.3):
        p = 30.0 * np.array([math.cos(math.radians(90 * t + 5)), math.sin(math.radians(90 * t + 5))])
        e = np.array([100.0, 0.0]) - p
        far = np.hypot(*e)
        along = (far**2 + a**2 - b**2) / (2.0 * far)
        across = side * math.sqrt(a**2 - along**2)
        truth = p + (along * e + across * np.array([-e[1], e[0]])) / far
        found = put(steps, t=t)
        assert (found["Bx"], found["By"]) == pytest.approx(truth, abs=1e-9)


def test_what_has_no_formula_says_so():
    free = motion_of("B : .bar P = [0,0] Q = [30,0]; @0 B.P = [9*.t, 0]; @1")
    with pytest.raises(NoProgram, match="moves freely"):
        named_steps(free.segments[0], 0.0, [("x", symbol(AnchorCoordinate(0, 1, 0)))])
    summed = motion_of("@0 x = .i(.sin(x + .t)); @1")
    with pytest.raises(NoProgram, match="integral"):
        named_steps(summed.segments[0], 0.0, [("x", symbol(VariableComponent("x", None)))])


@pytest.mark.parametrize("seed", range(5))
def test_steps_put_together_again_are_the_formula(seed):
    random = np.random.default_rng(seed)
    t, u = sympy.symbols("t u", real=True)
    part = sympy.sqrt(t**2 + u) * (sympy.sin(t) + int(random.integers(2, 9)))
    value = (part + u) ** 2 / (part - 3) + sympy.cos(part) * sympy.Rational(int(random.integers(1, 9)), 7)
    steps = shared_steps("y", value)
    assert steps[-1][0] == "y"
    assert len(steps) > 1
    here = {}
    for name, each in steps:
        here[sympy.Symbol(name, real=True)] = each.subs(here)
    numbers = {t: 0.7, u: 2.3}
    assert float(here[sympy.Symbol("y", real=True)].subs(numbers)) == pytest.approx(
        float(value.subs(numbers)), rel=1e-12
    )


def test_only_steps_that_are_needed_stay_and_numbers_have_no_name():
    t, a, b, c, d = sympy.symbols("t a b c d", real=True)
    steps = [("a", sympy.Integer(3)), ("b", 5 * t), ("c", sympy.sin(b) + a), ("d", t**2), ("x", c + 1), ("y", t)]
    assert tidied(steps, 2) == [("c", sympy.sin(5 * t) + 3), ("x", c + 1), ("y", t)]
    kept = dict(tidied([*steps[:4], ("x", c + d)], 1))
    assert kept["d"] == t**2
    assert kept["x"] == c + d
    assert a not in kept["c"].free_symbols
    ((_, value),) = tidied([("x", sympy.sqrt(2) * t + sympy.Rational(1, 3))], 1)
    assert value.coeff(t) == pytest.approx(math.sqrt(2.0), rel=1e-14)
    assert value.subs(t, 0) == sympy.Rational(1, 3)


def test_names_are_never_the_same_in_capitals_either():
    maker = StageMaker(None, 0.0, [], {})  # type: ignore[arg-type]
    found = [maker.fresh(name) for name in ("Rod", "rod", "ROD", "Rod", "t")]
    assert found[:4] == ["Rod", "rod_2", "ROD_3", "Rod_4"]
    assert found[4] != "t"
    assert len({name.lower() for name in found}) == 5
