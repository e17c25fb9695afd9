"""Answers about one instant, as data: against a slider-crank whose answers are known in closed form."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from movimentum.errors import NoSolutionError
from movimentum.records import replace
from movimentum.source import SourceText
from movimentum.workflow.engine import Engine
from movimentum.workflow.inspector import Inspector

TEXT = """Crank : .bar O = [0,0] P = [40,0];
Rod : .bar A = [0,0] B = [100,0];
@0 Crank.O = [0,0];  Crank.angle = 90*.t;
   Rod.A = Crank.P;  Rod.B = [x, 0];  x > 0;
@2
"""


def asked(time: Fraction | int, text: str = TEXT) -> Inspector:
    return Inspector(Engine().revise(SourceText("crank.mov", text)), Fraction(time))


def test_causes_are_those_that_the_value_depends_on_and_no_others() -> None:
    found = asked(1).causes("Crank.P")
    assert [(cause.line, cause.rigid) for cause in found.chain if not cause.rigid] == [(3, False), (3, False)]
    assert {cause.text for cause in found.chain if cause.rigid} <= {"Crank"}
    assert (found.free, found.drawn) == ((), ())
    assert {cause.line for cause in asked(1).causes("x").chain} >= {3, 4}


def test_the_formula_is_the_closed_form() -> None:
    inspector = asked(Fraction(1, 3))
    ((name, formula),) = inspector.formulas("x", 5.0)
    (symbol,) = formula.free_symbols
    for time in (0.2, 0.7, 1.3):
        turn = np.radians(90.0 * time)
        expected = 40.0 * np.cos(turn) + np.sqrt(100.0**2 - (40.0 * np.sin(turn)) ** 2)
        assert float(formula.subs(symbol, time)) == pytest.approx(expected, rel=1e-12)
    assert name == "x"


def test_both_solutions_of_the_rod_are_found_and_drawn() -> None:
    inspector = asked(0, TEXT.replace("x > 0;", ""))
    (part,) = inspector.solutions()
    assert sum(solution.current for solution in part.solutions) == 1
    poses = inspector.poses_of([solution.pose for solution in part.solutions])
    ends = sorted(poses.world(1, (100.0, 0.0))[:, 0].tolist())
    assert ends == pytest.approx([-60.0, 140.0])
    assert poses.frames.tolist() == [0, 1]
    np.testing.assert_allclose(np.hypot(*poses.direction[1].T), 1.0, atol=1e-12)


def test_what_is_free_is_told_with_a_statement_that_stops_it() -> None:
    inspector = asked(0, TEXT.replace("Crank.angle = 90*.t;", ""))
    ((motion, statement),) = inspector.freedom()
    assert set(motion.things) == {0, 1}
    assert statement is not None
    assert asked(0, TEXT.replace("Crank.angle = 90*.t;", f"{statement.rstrip(';')};")).freedom() == []


def test_an_instant_at_a_step_belongs_to_the_piece_that_begins_there() -> None:
    inspector = asked(1, TEXT.replace("@2", "@1 Crank.angle = 90;\n@2"))
    assert inspector.step == 1
    assert inspector.piece[1] == 0.0


def test_an_instant_at_which_a_piece_begins_belongs_to_that_piece() -> None:
    inspector = asked(0, TEXT.replace("[100,0]", "[30,0]"))
    _, second, *_ = inspector.segment_motion.pieces
    assert replace(inspector, time=Fraction(second.begin)).part[0] is second


def test_where_there_is_no_solution_an_error_says_so() -> None:
    inspector = asked(1, TEXT.replace("[100,0]", "[30,0]"))
    with pytest.raises(NoSolutionError, match="no solution at this moment"):
        inspector.solutions()
