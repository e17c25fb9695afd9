"""Queries: the value and the rates of any expression, against a motion in closed form."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from movimentum.errors import ScriptError
from movimentum.query import NOT_A_READING
from movimentum.source import SourceText
from movimentum.workflow.engine import Engine, Revision

TEXT = """.let R = 50;
Arm : .bar O = [0,0] P = [R,0];
@0 Arm.O = [0,0];  Arm.angle = 90*.t;  speed = 3*.t;
@2 Arm.angle = 180;
@3
"""
TIMES = [Fraction(1, 10), Fraction(1, 2), Fraction(7, 4)]


def revision(text: str = TEXT) -> Revision:
    return Engine().revise(SourceText("arm.mov", text))


def test_value_velocity_and_acceleration_are_those_of_a_turning_arm() -> None:
    work = revision()
    query = work.query("2*Arm.P", 0)
    turn, rate = np.radians([90.0 * float(time) for time in TIMES]), np.radians(90.0)
    circle = 100.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    tangent = 100.0 * np.stack([-np.sin(turn), np.cos(turn)], axis=1)
    np.testing.assert_allclose(query.values(work.motion.poses_at(TIMES)), circle, atol=1e-10)
    np.testing.assert_allclose(query.rates(work.motion, 1, TIMES), rate * tangent, atol=1e-9)
    np.testing.assert_allclose(query.rates(work.motion, 2, TIMES), -(rate**2) * circle, atol=1e-8)


@pytest.mark.parametrize("text", [".d(Arm.angle)", "2*.d(Arm.P.x) - .d(Arm.P.x)"])
def test_a_derivative_is_solved_for(text: str) -> None:
    work = revision()
    with pytest.raises(ScriptError) as caught:
        work.expressions(text, 0)
    assert caught.value.diagnostics[0].code == NOT_A_READING
    query = work.query(text, 0)
    turn = np.radians([90.0 * float(time) for time in TIMES])
    expected = np.full(3, 90.0) if "angle" in text else -50.0 * np.radians(90.0) * np.sin(turn)
    np.testing.assert_allclose(query.values(work.motion.poses_at(TIMES))[:, 0], expected, atol=1e-8)


def test_the_variable_of_what_is_solved_for_has_a_name_that_the_script_does_not_use() -> None:
    work = revision(".let Shown0 = 1;\nShown1 : .bar A = [0,0] B = [1,0];\n" + TEXT.replace("speed", "Shown2"))
    values = work.query(".d(Arm.angle)", 0).values(work.motion.poses_at(TIMES))
    np.testing.assert_allclose(values[:, 0], 90.0, atol=1e-9)


def test_a_derivative_without_a_clock_has_values_before_the_step_that_asks() -> None:
    work = revision()
    early = work.motion.poses_at([Fraction(1, 2)])
    assert work.query(".d(Arm.angle)", 1).values(early).item() == pytest.approx(90.0)


def test_a_clock_counts_from_the_step_that_is_asked() -> None:
    work = revision()
    at = [Fraction(5, 2)]
    assert work.query(".t", 0).values(work.motion.poses_at(at)).item() == 2.5
    assert work.query(".t", 1).values(work.motion.poses_at(at)).item() == 0.5


def test_a_variable_has_no_value_where_nothing_gives_it_one() -> None:
    work = revision(TEXT.replace("180;", "180;  speed = _;"))
    values = work.query("speed + 1", 0).values(work.motion.poses_at([Fraction(1), Fraction(5, 2)]))[:, 0]
    assert values[0] == pytest.approx(4.0)
    assert np.isnan(values[1])


@pytest.mark.parametrize("text", ["_", "[_, 3]", "1 2", "Arm.P = 3", "Arm.Q", "Arm.P + 1"])
def test_what_is_no_expression_with_a_value_is_refused(text: str) -> None:
    with pytest.raises(ScriptError):
        revision().query(text, 0)


def test_the_same_question_is_understood_once() -> None:
    work = revision()
    assert work.query("Arm.P.x", 0) is work.query("Arm.P.x", 0)
